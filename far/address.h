// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "far/types.h"

namespace osdx {

/// A point of the surface, whatever patches lie underneath: a face of the base mesh and
/// its (u, v).
///
/// Quads: corners (0,0), (1,0), (1,1), (0,1). Other polygons of N sides: the sub-face at
/// corner i fills [0,.5]^2 of the tile (i mod D, i div D), D = 2 for N = 3, 3 for N = 5..9,
/// else 1 + floor(sqrt(N-1)); corner i is at the tile's integer corner, u runs towards
/// corner i + 1, and the face centre is the (.5,.5) of any tile. This is the
/// parameterisation QUAD_SUBFACES of OpenSubdiv's Bfr.
struct Address {
    Index face = 0;
    double u = 0, v = 0;
};

}  // namespace osdx
