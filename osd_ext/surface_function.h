// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>

#include <osdx/address.h>
#include <osdx/surface_jet.h>

namespace osdx::inline OSDX_ABI {

class Surface;

/// A surface over the faces of a base mesh, with derivatives in (u, v). Called from several
/// threads at the same time.
using SurfaceFunction = std::function<SurfaceJet<double>(const QuarterPoint&)>;

/// A surface as a function. Chart::Native gives normals and curvature also where (u, v) is
/// singular, at smooth border vertices of one face.
/// \pre the surface outlives it, unmoved
OSDX_API SurfaceFunction surface_function(const Surface& surface,
                                          Chart chart = Chart::BaseUV);

}  // namespace osdx::inline OSDX_ABI
