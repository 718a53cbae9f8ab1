// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/polygon.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osdx::inline OSDX_ABI {

Polygon::Polygon(int n) : n_(n), centre_distance_(std::cos(std::numbers::pi / n)) {
    const double angle = std::numbers::pi / n;
    for (int k = 0; k < n; ++k) {
        // cos(pi/n) - cos((2k+1) pi/n), as a product: no cancellation, exact 0 on the side.
        const double d = k == 0 || k == n - 1
                             ? 0.0
                             : 2 * std::sin(k * angle) * std::sin((k + 1) * angle);
        vertex_distance_.push_back(d);
        normals_.emplace_back(std::cos((2 * k - 1) * angle),
                              std::sin((2 * k - 1) * angle));
    }
}

Vec2<double> Polygon::sector_point(const DomainPoint& p) const noexcept {
    const double angle = std::numbers::pi / n_;
    const auto at = [&](double turns, double radius) {
        return Vec2<double>(radius * std::cos(turns * angle),
                            radius * std::sin(turns * angle));
    };
    const double c = centre_distance_;
    const Vec2<double> left = at(2 * p.sector - 1, c), corner = at(2 * p.sector, 1),
                       right = at(2 * p.sector + 1, c);
    return p.a * (1 - p.b) * left + p.a * p.b * corner + (1 - p.a) * p.b * right;
}

int Polygon::sector_of(const Vec2<double>& xy) const noexcept {
    const double angle = std::numbers::pi / n_;
    const int sector =
        static_cast<int>(std::lround(std::atan2(xy.y, xy.x) / (2 * angle)));
    return (sector % n_ + n_) % n_;
}

DomainPoint Polygon::sector_place(int sector, const Vec2<double>& xy) const noexcept {
    // Along the corner's direction: p = (a + b) c^2 + a b (1 - 2 c^2), c = cos(pi/n); across:
    // q = (b - a) c sin(pi/n). With t = a + b this is a quadratic equation for t.
    const double angle = std::numbers::pi / n_;
    const double cs = std::cos(2 * sector * angle), sn = std::sin(2 * sector * angle);
    const double p = xy.x * cs + xy.y * sn, q = xy.y * cs - xy.x * sn;
    const double c = std::cos(angle), c2 = c * c;
    const double difference = q / (c * std::sin(angle));
    const double k2 = (1 - 2 * c2) / 4;
    const double k0 = k2 * difference * difference + p;
    const double root = std::sqrt(std::max(0.0, c2 * c2 + 4 * k2 * k0));
    const double t = 2 * k0 / (c2 + root);
    return {sector, std::clamp((t - difference) / 2, 0.0, 1.0),
            std::clamp((t + difference) / 2, 0.0, 1.0)};
}

}  // namespace osdx::inline OSDX_ABI
