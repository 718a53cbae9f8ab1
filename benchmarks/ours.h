// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <vector>

#include "benchmarks/meshes.h"
#include "benchmarks/samples.h"
#include "osd_ext/surface.h"

namespace osdx::bench {

/// A surface with its points in float, and the bytes that it holds.
struct FloatSurface {
    Surface surface;
    std::vector<Vec3<float>> points;
    double bytes = 0;
};

/// The options of all surfaces that are measured.
inline SurfaceOptions surface_options(int degree,
                                      PatchFamily family = PatchFamily::Multisided) {
    return {.degree = degree,
            .family = family,
            .ignore_tags = true,
            .boundary = BoundaryRule::EdgeOnly};
}

/// \throw std::runtime_error with the reason why the mesh is refused
FloatSurface make_surface(const BenchMesh& mesh, const SurfaceOptions& options);

/// Faces whose whole grid lies in patches that the predicate takes.
std::vector<Index> faces_where(const Surface& surface,
                               const std::function<bool(Index patch)>& takes);

/// One B-spline patch of the base mesh lies over each of them: there the surface of degree 3
/// is the limit of Catmull and Clark, whoever evaluates it.
std::vector<Index> regular_faces(const Surface& surface);

/// The grid on faces.
SampleWay our_grid(const FloatSurface& surface, std::span<const Place> places);
/// Points one by one, where patch and place in it are known.
SampleWay our_points(const FloatSurface& surface, std::span<const Place> places);

}  // namespace osdx::bench
