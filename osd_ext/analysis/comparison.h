// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <span>

#include <osdx/features.h>
#include <osdx/progress.h>
#include <osdx/resolved_features.h>
#include <osdx/result.h>
#include <osdx/surface_function.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

/// How far one surface over a base mesh is from another over the same mesh.
struct SurfaceDistance {
    double distance_max = 0;    ///< in both directions
    double distance_rms = 0;    ///< from `from` to `to`, weighted by area
    double normal_deg_max = 0;  ///< between the normals at closest points, in degrees
    double normal_deg_rms = 0;
    std::size_t n_samples = 0;
};

/// Samples each base face that is no hole `rate` times along its edges. From each sample
/// Newton's method starts at the same address and, where osdx has Embree, at the nearest
/// point of a tessellation of the other surface; the nearer end counts, of the second only where
/// its normal is less than 90 degrees off: other sheets of the surface may lie close by.
///
/// Normals are compared on the same side of infinitely sharp creases: for samples of faces
/// that touch one, at the end of a walk from the same address that stops at creases. Points
/// where a surface has no normal are left out.
///
/// Threads: goes wide; the result does not depend on their number.
/// \param unit  lengths are divided by it, finite; by 1 if it is 0
/// \return InvalidOption for another unit
/// \pre rate is even
OSDX_API Result<SurfaceDistance> measure_distance(
    const Topology& base, const ResolvedFeatures& features, const SurfaceFunction& from,
    const SurfaceFunction& to, int rate, double unit, Progress* progress = nullptr);

/// The error of a limit surface by its isolation: the largest distance to the limit surface
/// that is isolated two levels deeper, over `unit`, sampled where the two differ, close to
/// vertices and face centres. Includes what semi-sharp creases lack that are sharper than the
/// isolation level.
/// \pre 1 <= isolation <= LimitSurface::kMaxIsolation - 2
OSDX_API Result<double> isolation_error(const Topology& base, const Features& features,
                                        std::span<const Vec3<double>> positions,
                                        int isolation, double unit);

}  // namespace osdx::inline OSDX_ABI
