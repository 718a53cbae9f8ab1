// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <osdx/analysis/continuity.h>
#include <osdx/evaluator.h>
#include <osdx/mesh_data.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

namespace osdx::test {

/// The uniform B-spline of degree d with knots at whole or half numbers and its centre at 0.
inline double centred_bspline(int d, double x) {
    if (d == 0)
        return x >= -0.5 && x < 0.5 ? 1 : 0;
    const double half = 0.5 * (d + 1);
    if (std::abs(x) >= half)
        return 0;
    return ((half + x) * centred_bspline(d - 1, x + 0.5) +
            (half - x) * centred_bspline(d - 1, x - 0.5)) /
           d;
}

/// The control polygons of borders and infinitely sharp creases, straight from the base mesh.
class BorderCurves {
public:
    explicit BorderCurves(const Surface& surface)
        : base_(surface.base()),
          features_(surface.features()),
          points_(surface.points().first(surface.base().n_vertices())),
          degree_(surface.patches().degree()) {}

    bool is_border(Index h) const {
        return features_.edge(base_.edge[h]) >= kInfinitelySharp;
    }

    /// The point of the B-spline curve over the edge of a halfedge; nothing where semi-sharp
    /// features or the end of a crease give it another rule nearby.
    std::optional<Vec3<double>> point(Index h, double t) const {
        Chain chain;
        const Index from = base_.vertex[h], to = base_.to_vertex(h);
        if (!walk(to, from, chain.before, chain.is_pinned_before) ||
            !walk(from, to, chain.after, chain.is_pinned_after))
            return {};
        Vec3<double> p(0);
        for (int j = -degree_; j <= degree_ + 1; ++j)
            p += centred_bspline(degree_, t - j) * chain.point(j);
        return p;
    }

private:
    /// Points of a curve: before[0] is number 0, after[0] number 1. Where it is pinned it goes
    /// on by point reflection.
    struct Chain {
        std::vector<Vec3<double>> before, after;
        bool is_pinned_before = false, is_pinned_after = false;

        Vec3<double> point(int j) const {
            const int lo = 1 - static_cast<int>(before.size()),
                      hi = static_cast<int>(after.size());
            if (j < lo)
                return 2.0 * before.back() - point(2 * lo - j);
            if (j > hi)
                return 2.0 * after.back() - point(2 * hi - j);
            return j <= 0 ? before[-j] : after[j - 1];
        }
    };

    /// The points from v on, away from u, as many as a curve of the degree needs.
    bool walk(Index u, Index v, std::vector<Vec3<double>>& points,
              bool& is_pinned) const {
        points = {points_[v]};
        while (true) {
            int n_sharp = 0;
            bool semi_sharp = is_semi_sharp(features_.vertex(v));
            Index onwards = kInvalidIndex;
            base_.for_each_edge(v, [&](Index e, Index to) {
                const double s = features_.edge(e);
                semi_sharp |= is_semi_sharp(s);
                n_sharp += s >= kInfinitelySharp;
                if (s >= kInfinitelySharp && to != u)
                    onwards = to;
            });
            if (semi_sharp || n_sharp == 1)
                return false;
            if (n_sharp > 2 || features_.vertex(v) >= kInfinitelySharp) {
                is_pinned = true;
                return true;
            }
            if (onwards == kInvalidIndex)
                return false;  // two edges join the same vertices
            if (static_cast<int>(points.size()) > degree_)
                return true;
            u = std::exchange(v, onwards);
            points.push_back(points_[v]);
        }
    }

    const Topology& base_;
    const Features& features_;
    std::span<const Vec3<double>> points_;
    int degree_;
};

/// The largest distance of the surface at borders and infinitely sharp edges, on each side of
/// them, from their curves at the same address, over the bounding-box diagonal.
struct BorderError {
    double max = 0;
    std::size_t n_samples = 0;
};

inline BorderError border_error(const Surface& surface, int rate = 7) {
    const Topology& base = surface.base();
    const BorderCurves curves(surface);
    const double diagonal = bounding_diagonal(surface.points().first(base.n_vertices()));
    BorderError error;
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        if (!curves.is_border(h) || !surface.patches().has_surface(base.face(h)))
            continue;
        for (int i = 0; i <= rate; ++i) {
            const double t = double(i) / rate;
            const auto expected = curves.point(h, t);
            if (!expected)
                break;
            const auto at = edge_point(base, h, t);
            const double distance = glm::length(
                surface.evaluator().evaluate<double, 0>(surface.points(), at).p -
                *expected);
            if (!(distance <= error.max * diagonal))
                error.max = distance / diagonal;
            ++error.n_samples;
        }
    }
    return error;
}

}  // namespace osdx::test
