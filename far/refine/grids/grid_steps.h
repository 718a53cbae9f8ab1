// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "far/refine/grids/grid_rules.h"
#include "far/refine/grids/quad_grids.h"

/// The passes of OddGrids over points of C channels, one after the other.
namespace osdx::inline OSDX_ABI::detail {

/// Linear subdivision and the first smoothing: from the points of grids to those of twice the
/// size. The grids of size 1 may be any polygons.
template <class T, int C>
void refine_grids(const QuadGrids& grids, const GridRules& rules, const T* in, T* out);

/// A further smoothing. \pre the roots are quads
template <class T, int C>
void smooth_grids(const QuadGrids& grids, const GridRules& rules, const T* in, T* out);

}  // namespace osdx::inline OSDX_ABI::detail
