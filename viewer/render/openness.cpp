// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/openness.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "far/parallel.h"

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

double radical_inverse(std::uint32_t i) noexcept {
    double result = 0, digit = 0.5;
    for (; i != 0; i >>= 1, digit /= 2)
        result += digit * (i & 1);
    return result;
}

}  // namespace

double openness(const RayScene& scene, const Vec& p, const Vec& n, int n_rays,
                double reach, std::size_t seed) {
    const Vec helper = std::abs(n.z) < 0.9 ? Vec(0, 0, 1) : Vec(1, 0, 0);
    const Vec s = glm::normalize(glm::cross(helper, n)), t = glm::cross(n, s);
    // Rotated so that points with neighbouring seeds complement each other: multiples of
    // powers of the plastic number's inverse (Roberts' R2 sequence).
    const Vec2<double> shift(glm::fract(0.7548776662466927 * double(seed)),
                             glm::fract(0.5698402909980532 * double(seed)));
    // Off the surface by more than the facets are off it.
    const Vec origin = p + 5e-4 * n;
    int n_free = 0;
    for (int i = 0; i < n_rays; ++i) {
        const double r2 = (i + shift.x) / n_rays;
        const double turns = radical_inverse(i) + shift.y;
        const double angle = 2 * std::numbers::pi * turns;
        const Vec d = std::sqrt(r2) * (std::cos(angle) * s + std::sin(angle) * t) +
                      std::sqrt(1 - r2) * n;
        n_free += !scene.intersect({origin, d, 0, reach});
    }
    return double(n_free) / n_rays;
}

std::vector<double> all_openness(
    const RayScene& scene, const Tessellation& t,
    const std::function<bool(const Vec&, const Vec&)>& is_inside) {
    const std::size_t n = t.normals.size();
    std::vector<Index> point(n);
    for (std::size_t c = 0; c < t.facet_normals.size(); ++c)
        point[t.facet_normals[c]] = t.facet_points[c];
    const int n_rays = static_cast<int>(std::clamp(2.5e6 / double(n), 4.0, 32.0));
    std::vector<double> open(n);
    detail::for_each_range(n, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec& p = t.positions[point[i]];
            const Vec normal = is_inside(p, t.normals[i]) ? -t.normals[i] : t.normals[i];
            open[i] = normal == Vec(0) ? 1 : openness(scene, p, normal, n_rays, 0.35, i);
        }
    });
    // Few rays are noisy; forty passes average over some hundred points, and blur the
    // shadows by about six.
    std::vector<double> sum(n), weight(n);
    for (int pass = 0; pass < 40; ++pass) {
        for (std::size_t i = 0; i < n; ++i) {
            sum[i] = 2 * open[i];
            weight[i] = 2;
        }
        const Index* corner = t.facet_normals.data();
        for (const Index size : t.facet_sizes) {
            for (Index i = 0; i < size; ++i) {
                const Index a = corner[i], b = corner[(i + 1) % size];
                sum[a] += open[b];
                sum[b] += open[a];
                ++weight[a];
                ++weight[b];
            }
            corner += size;
        }
        for (std::size_t i = 0; i < n; ++i)
            open[i] = sum[i] / weight[i];
    }
    return open;
}

}  // namespace osdx::render
