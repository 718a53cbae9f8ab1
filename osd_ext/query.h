// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include <osdx/address.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/surface_jet.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

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
/// \param features  of base
/// \param tolerance  length of the last step, in units of the mesh
/// \pre start is not in a hole
OSDX_API ClosestPoint closest_point(const Topology& base,
                                    const ResolvedFeatures& features,
                                    const SurfaceFunction& surface,
                                    const Vec3<double>& target, const QuarterPoint& start,
                                    double tolerance,
                                    AtCrease at_crease = AtCrease::Cross);

/// Where a ray meets a surface.
struct RayPoint {
    QuarterPoint at;
    SurfaceJet<double> jet;
    double t = 0;         ///< along the ray
    double distance = 0;  ///< of the point from the ray
};

/// From a point near it to where a ray meets the surface: Newton's method in (u, v) within the
/// face of `start`. It ends within the tolerance, after so many steps, or before a step that
/// leads away from the ray; `distance` tells which.
/// \param direction  unit
/// \param tolerance  distance from the ray, in units of the mesh
/// \pre start.face is no hole
OSDX_API RayPoint intersect_ray(const Topology& base, const SurfaceFunction& surface,
                                const Vec3<double>& origin, const Vec3<double>& direction,
                                const Address& start, double tolerance,
                                int max_steps = 10);

}  // namespace osdx::inline OSDX_ABI
