// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/footprint.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

}  // namespace

std::array<RayStep, 2> ray_steps(const Camera& camera, int samples,
                                 const Hit& hit) noexcept {
    const Vec &d = hit.direction, &n = hit.normal;
    const double cosine = std::min(glm::dot(d, n), -1e-3);
    // d is (direction of Camera) / length, whose part along -back is 1.
    const double step = -camera.pixel / samples * glm::dot(d, camera.back);
    std::array<RayStep, 2> result;
    for (int axis = 0; axis < 2; ++axis) {
        const Vec side = axis == 0 ? camera.right : -camera.up;
        const Vec dd = step * (side - glm::dot(d, side) * d);
        result[axis] = {dd, hit.t * (dd - glm::dot(dd, n) / cosine * d)};
    }
    return result;
}

Vec2<double> in_uv(const SurfaceJet<double>& jet, const Vec& dp) noexcept {
    const Vec &u = jet.du, &v = jet.dv;
    const double E = glm::dot(u, u), F = glm::dot(u, v), G = glm::dot(v, v);
    const double pu = glm::dot(dp, u), pv = glm::dot(dp, v), det = E * G - F * F;
    if (!(det > 0))
        return {0, 0};
    return {(G * pu - F * pv) / det, (E * pv - F * pu) / det};
}

std::array<Vec, 2> mirrored_steps(const Camera& camera, int samples,
                                  const Hit& hit) noexcept {
    const Vec &d = hit.direction, &n = hit.normal;
    const Vec &u = hit.jet.du, &v = hit.jet.dv;
    const double E = glm::dot(u, u), F = glm::dot(u, v), G = glm::dot(v, v);
    const double L = glm::dot(n, hit.jet.duu), M = glm::dot(n, hit.jet.duv),
                 N = glm::dot(n, hit.jet.dvv), det = E * G - F * F;
    const std::array<RayStep, 2> steps = ray_steps(camera, samples, hit);
    std::array<Vec, 2> result;
    for (int axis = 0; axis < 2; ++axis) {
        const auto& [dd, dp] = steps[axis];
        Vec dn(0);
        if (hit.regular && det > 0) {
            const Vec2<double> uv = in_uv(hit.jet, dp);
            const double nu = -(L * uv.x + M * uv.y), nv = -(M * uv.x + N * uv.y);
            dn = (G * nu - F * nv) / det * u + (E * nv - F * nu) / det * v;
        }
        result[axis] =
            dd - 2.0 * (glm::dot(d, n) * dn + (glm::dot(dd, n) + glm::dot(d, dn)) * n);
    }
    return result;
}

double square_wave(double at, double width) noexcept {
    const auto integral = [](double s) {
        const double whole = std::floor(s);
        return 0.5 * whole + std::min(s - whole, 0.5);
    };
    width = std::min(width, 1e6);
    return (integral(at + 0.5 * width) - integral(at - 0.5 * width)) / width;
}

}  // namespace osdx::render
