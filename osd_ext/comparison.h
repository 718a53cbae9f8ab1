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

/// What a walk on the surface does at an infinitely sharp crease. It stops at borders and
/// holes always.
enum class AtCrease : std::uint8_t {
    Cross,
    Stop,  ///< the surface is as if it were cut there
};

/// Walks on the surface from `start` to a local minimum of the distance to `target`:
/// Newton's method within the quarters of the base faces, crossing from one into the next,
/// and along the edges where the walk stops.
/// \param features  of base, by with_border()
/// \param tolerance  length of the last step, in units of the mesh
/// \pre start is not in a hole
ClosestPoint closest_point(const Topology& base, const Features& features,
                           const SurfaceFunction& surface, const Vec3<double>& target,
                           const QuarterPoint& start, double tolerance,
                           AtCrease at_crease = AtCrease::Cross);

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
/// point of a tessellation of the other surface; the nearer end counts.
///
/// Normals are compared on the same side of infinitely sharp creases: for samples of faces
/// that touch one, at the end of a walk from the same address that stops at creases. Points
/// where a surface has no normal are left out.
///
/// Threads: goes wide; the result does not depend on their number.
/// \param features  of base, by with_border()
/// \param unit  lengths are divided by it
/// \pre rate is even
Result<SurfaceDistance> measure_distance(const Topology& base, const Features& features,
                                         const SurfaceFunction& from,
                                         const SurfaceFunction& to, int rate,
                                         double unit);

/// The error of a limit surface by its isolation: the largest distance to the limit surface
/// that is isolated two levels deeper, over `unit`, sampled where the two differ, close to
/// vertices and face centres. Includes what semi-sharp creases lack that are sharper than the
/// isolation level.
/// \pre 1 <= isolation <= LimitSurface::kMaxIsolation - 2
Result<double> isolation_error(const Topology& base, const Features& features,
                               std::span<const Vec3<double>> positions, int isolation,
                               double unit);

/// The limit surface as a SurfaceFunction. \pre both outlive it
SurfaceFunction surface_function(const Topology& base, const LimitSurface& limit);

}  // namespace osdx
