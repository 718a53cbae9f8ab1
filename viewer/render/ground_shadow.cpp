// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/ground_shadow.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "far/parallel.h"
#include "viewer/render/openness.h"

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

}  // namespace

GroundShadow::GroundShadow(const RayScene& scene, std::span<const Vec> points, int up)
    : up_(up) {
    lo_ = Vec(INFINITY);
    Vec hi(-INFINITY);
    for (const Vec& p : points) {
        lo_ = glm::min(lo_, p);
        hi = glm::max(hi, p);
    }
    // Half a diagonal further the shadow has faded.
    const double height = lo_[up] - 1e-3;
    lo_ -= Vec(0.5);
    lo_[up] = height;
    step_ = (hi + Vec(0.5) - lo_) / double(kSize - 1);
    shade_.resize(kSize * kSize);
    Vec normal(0);
    normal[up] = 1;
    detail::for_each_task(kSize, [&](int j) {
        for (int i = 0; i < kSize; ++i) {
            Vec p = lo_;
            p[(up + 1) % 3] += i * step_[(up + 1) % 3];
            p[(up + 2) % 3] += j * step_[(up + 2) % 3];
            shade_[j * kSize + i] = 1 - openness(scene, p, normal, 48, 1.0,
                                                 static_cast<std::size_t>(j * kSize + i));
        }
    });
    for (int pass = 0; pass < 4; ++pass)
        blur();
}

double GroundShadow::at(const Vec& eye, const Vec& direction) const noexcept {
    if (shade_.empty() || direction[up_] >= 0 || eye[up_] <= lo_[up_])
        return 0;
    const Vec p = eye + (lo_[up_] - eye[up_]) / direction[up_] * direction;
    const double x = (p[(up_ + 1) % 3] - lo_[(up_ + 1) % 3]) / step_[(up_ + 1) % 3],
                 y = (p[(up_ + 2) % 3] - lo_[(up_ + 2) % 3]) / step_[(up_ + 2) % 3];
    if (!(x >= 0 && y >= 0 && x < kSize - 1 && y < kSize - 1))
        return 0;
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const double* s = &shade_[j * kSize + i];
    const double fx = x - i, fy = y - j;
    const double value =
        std::lerp(std::lerp(s[0], s[1], fx), std::lerp(s[kSize], s[kSize + 1], fx), fy);
    // Ends with the grid, and without a line at the horizon.
    const auto fade = [](double f) {
        return std::min({1.0, f / 16, (kSize - 1 - f) / 16});
    };
    const double steep = -direction[up_] / glm::length(direction);
    return value * fade(x) * fade(y) * std::min(1.0, 6 * steep);
}

void GroundShadow::blur() {
    std::vector<double> next(shade_);
    for (int j = 1; j + 1 < kSize; ++j) {
        for (int i = 1; i + 1 < kSize; ++i) {
            const double* s = &shade_[j * kSize + i];
            next[j * kSize + i] =
                (4 * s[0] + 2 * (s[-1] + s[1] + s[-kSize] + s[kSize]) + s[-kSize - 1] +
                 s[-kSize + 1] + s[kSize - 1] + s[kSize + 1]) /
                16;
        }
    }
    shade_ = std::move(next);
}

}  // namespace osdx::render
