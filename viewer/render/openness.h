// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <osdx/embree/ray_scene.h>
#include <osdx/tessellation.h>
#include <osdx/types.h>

namespace osdx::render {

/// How much light of an even sky arrives at a point: the part of `n_rays` rays about the
/// normal that meets nothing within `reach`.
/// \param seed  points with neighbouring ones take rays that complement each other
double openness(const RayScene& scene, const Vec3<double>& p, const Vec3<double>& n,
                int n_rays, double reach, std::size_t seed);

/// The openness at all normals of a tessellation, smoothed along its edges.
/// \param is_inside  whether the normal at a point leads away from where it is seen
std::vector<double> all_openness(
    const RayScene& scene, const Tessellation& tessellation,
    const std::function<bool(const Vec3<double>& point, const Vec3<double>& normal)>&
        is_inside);

}  // namespace osdx::render
