// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include <osdx/displace.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

Vec3<double> unit_or_zero(const Vec3<double>& v) {
    // By the largest first: squares might underflow, of a tiny model's facets.
    const double size = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    return size > 0 ? glm::normalize(v / size) : Vec3<double>(0);
}

/// Of each point the sum of its normals.
std::vector<Vec3<double>> sums_of_normals(const Tessellation& t) {
    std::vector<Vec3<double>> sums(t.normals.begin(),
                                   t.normals.begin() + t.positions.size());
    std::vector<Index> points(t.normals.size() - t.positions.size());
    for (std::size_t c = 0; c < t.facet_normals.size(); ++c) {
        if (t.facet_normals[c] >= t.positions.size())
            points[t.facet_normals[c] - t.positions.size()] = t.facet_points[c];
    }
    for (std::size_t i = 0; i < points.size(); ++i)
        sums[points[i]] += t.normals[t.positions.size() + i];
    return sums;
}

}  // namespace

void displace(Tessellation& t, const HeightFunction& height, DisplacedNormals normals) {
    const std::vector<Vec3<double>> directions = sums_of_normals(t);
    detail::for_each_index(
        t.positions.size(),
        [&](Index p) {
            const Vec3<double> normal = unit_or_zero(directions[p]);
            if (normal != Vec3<double>(0))
                t.positions[p] += height(t.addresses[p], t.positions[p], normal) * normal;
        },
        detail::kSmallChunk);
    if (normals == DisplacedNormals::FromFacets)
        set_facet_normals(t);
}

void set_facet_normals(Tessellation& t) {
    std::ranges::fill(t.normals, Vec3<double>(0));
    std::size_t first = 0;
    for (const Index n : t.facet_sizes) {
        const auto at = [&](Index corner) {
            return t.positions[t.facet_points[first + corner]];
        };
        // Twice the area: of a quad by its diagonals.
        const Vec3<double> area = glm::cross(at(2) - at(0), at(n - 1) - at(1));
        for (Index c = 0; c < n; ++c)
            t.normals[t.facet_normals[first + c]] += area;
        first += n;
    }
    for (Vec3<double>& normal : t.normals)
        normal = unit_or_zero(normal);
}

}  // namespace osdx::inline OSDX_ABI
