// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/value_map.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "far/parallel.h"
#include "viewer/render/color.h"

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

}  // namespace

ValueMap::ValueMap(const PictureInput& input, const PictureOptions& options,
                   const Scene& scene)
    : input_(input), o_(options) {
    if (is_for(o_.shade))
        range_ = o_.range ? *o_.range : choose_range(scene);
}

double ValueMap::value(const Hit& hit) const {
    if (is_distance())
        return input_.distance(input_.surface(hit.at), hit.at);
    const Curvature<double> k = curvature(hit.jet);
    return o_.shade == Shade::Mean ? k.mean : k.gauss;
}

Vec ValueMap::color(double v) const noexcept {
    if (!std::isfinite(v))
        return to_linear(Vec(150));
    return is_distance() ? sequential_color(v / range_)
                         : diverging_color(0.5 + 0.5 * v / range_);
}

/// Rounded up to two digits, the second even: the legend tells it and its half.
double ValueMap::choose_range(const Scene& scene) const {
    // Some 40000 points of the picture are enough for a percentile.
    const double area = double(o_.width) * o_.height;
    const int step = std::max(1, static_cast<int>(std::sqrt(area / 40000)));
    const int n_rows = (o_.height + step - 1) / step;
    std::vector<std::vector<double>> rows(n_rows);
    detail::for_each_task(n_rows, [&](int row) {
        for (int x = 0; x < o_.width; x += step) {
            if (const auto hit = scene.find(x + 0.5, row * step + 0.5)) {
                const double v = std::abs(value(*hit));
                if (std::isfinite(v))
                    rows[row].push_back(v);
            }
        }
    });
    std::vector<double> values;
    for (const auto& row : rows)
        values.insert(values.end(), row.begin(), row.end());
    if (values.empty())
        return 1;
    const double part = is_distance() ? 1 : 0.95;
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>(part * double(values.size() - 1));
    std::ranges::nth_element(values, at);
    // Below this the curvature of a plane is rounding, and so is a distance.
    const double least = is_distance() ? 1e-15 : 1e-6;
    const double range = std::max(*at, least);
    const double unit = std::pow(10, std::floor(std::log10(range)) - 1) * 2;
    return unit * std::ceil(range / unit * (1 - 1e-9));
}

}  // namespace osdx::render
