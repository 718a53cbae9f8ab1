// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

/// 28 degrees across the smaller side: little distortion, and still depth.
const double kTanHalfView = std::tan(14 * std::numbers::pi / 180);

}  // namespace

Camera make_camera(std::span<const Vec> points, const PictureOptions& o,
                   const Margins& margins) {
    const int z = static_cast<int>(o.up);
    Vec x_axis(0), y_axis(0), z_axis(0);
    z_axis[z] = x_axis[(z + 1) % 3] = y_axis[(z + 2) % 3] = 1;
    const double azimuth = o.azimuth_deg * std::numbers::pi / 180,
                 elevation = o.elevation_deg * std::numbers::pi / 180;
    const Vec away = std::cos(azimuth) * x_axis + std::sin(azimuth) * y_axis;

    Camera c{};
    c.right = -std::sin(azimuth) * x_axis + std::cos(azimuth) * y_axis;
    c.back = std::cos(elevation) * away + std::sin(elevation) * z_axis;
    c.up = glm::cross(c.back, c.right);
    c.width = o.width;
    c.height = o.height;
    c.pixel = 2 * kTanHalfView / std::min(o.width, o.height);

    // A point (x, y, z) in these axes is left of the right border if
    // x - eye.x <= tan_right (eye.z - z), and so on: the largest x + tan_right z decides.
    const double tans[4] = {c.pixel * (0.5 * o.width - margins.right),
                            c.pixel * (0.5 * o.width - margins.left),
                            c.pixel * (0.5 * o.height - margins.top),
                            c.pixel * (0.5 * o.height - margins.bottom)};
    double most[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    double nearest = -INFINITY;
    for (const Vec& p : points) {
        const double px = glm::dot(p, c.right), py = glm::dot(p, c.up),
                     pz = glm::dot(p, c.back);
        most[0] = std::max(most[0], px + tans[0] * pz);
        most[1] = std::max(most[1], -px + tans[1] * pz);
        most[2] = std::max(most[2], py + tans[2] * pz);
        most[3] = std::max(most[3], -py + tans[3] * pz);
        nearest = std::max(nearest, pz);
    }
    // Never inside: 0.05 of the diagonal keeps off even a flat sheet seen from its edge.
    const double ez =
        std::max({(most[0] + most[1]) / (tans[0] + tans[1]),
                  (most[2] + most[3]) / (tans[2] + tans[3]), nearest + 0.05});
    // The middle of what the borders leave free.
    const double ex = 0.5 * (most[0] - tans[0] * ez + tans[1] * ez - most[1]);
    const double ey = 0.5 * (most[2] - tans[2] * ez + tans[3] * ez - most[3]);
    c.eye = ex * c.right + ey * c.up + ez * c.back;
    return c;
}

}  // namespace osdx::render
