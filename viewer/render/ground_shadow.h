// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/embree/ray_scene.h>
#include <osdx/types.h>

namespace osdx::render {

/// Soft shadow of the surface on a plane below it, on a grid.
class GroundShadow {
public:
    GroundShadow() = default;
    /// \param points  of the surface, a diagonal of 1 about the origin
    /// \param up  the axis that the plane is normal to
    GroundShadow(const RayScene& scene, std::span<const Vec3<double>> points, int up);

    /// The shadow where a ray meets the plane, 0 to 1.
    double at(const Vec3<double>& eye, const Vec3<double>& direction) const noexcept;

private:
    static constexpr int kSize = 128;

    void blur();

    int up_ = 2;
    Vec3<double> lo_{0}, step_{1};
    std::vector<double> shade_;
};

}  // namespace osdx::render
