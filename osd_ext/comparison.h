// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "osd_ext/limit_surface.h"
#include "osd_ext/tessellation.h"

namespace osdx {

/// The point of a surface that is nearest to a target.
struct ClosestPoint {
    QuarterPoint at;
    SurfaceJet<double> jet;
    double distance = 0;
};

/// Walks on the surface from `start` to a local minimum of the distance to `target`:
/// Newton's method within the quarters of the base faces, crossing from one into the next.
/// \param tolerance  length of the last step, in units of the mesh
ClosestPoint closest_point(const Topology& base, const SurfaceFunction& surface,
                           const Vec3<double>& target, const QuarterPoint& start,
                           double tolerance);

/// How far one surface over a base mesh is from another over the same mesh.
struct SurfaceDistance {
    double distance_max = 0;    ///< in both directions
    double distance_rms = 0;    ///< from `from` to `to`, weighted by area
    double normal_deg_max = 0;  ///< between the normals at closest points, in degrees
    double normal_deg_rms = 0;
    std::size_t n_samples = 0;
};

/// Samples each base face `rate` times along its edges. From each sample Newton's method
/// starts at the same address and, where osdx has Embree, at the nearest point of a
/// tessellation of the other surface; the nearer end counts.
/// Threads: goes wide; the result does not depend on their number.
/// \param unit  lengths are divided by it
/// \pre rate is even
Result<SurfaceDistance> measure_distance(const Topology& base,
                                         const SurfaceFunction& from,
                                         const SurfaceFunction& to, int rate,
                                         double unit);

/// The error of a limit surface by its isolation: the largest distance to the limit surface
/// that is isolated two levels deeper, over `unit`, sampled where the two differ, close to
/// vertices and face centres.
/// \pre 1 <= isolation <= LimitSurface::kMaxIsolation - 2
Result<double> isolation_error(const Topology& base, const Features& features,
                               std::span<const Vec3<double>> positions, int isolation,
                               double unit);

/// The limit surface as a SurfaceFunction.
/// \pre both outlive it
SurfaceFunction surface_function(const Topology& base, const LimitSurface& limit);

}  // namespace osdx
