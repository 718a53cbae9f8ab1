// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <osdx/types.h>

/// Uniform B-spline curves once more, by plain loops over one row of points.
namespace osdx::test {

/// The control polygon of a curve from t = 0 at the first point to the number of edges. An open
/// one is continued beyond its ends by point reflection, a closed one (the first point is
/// not repeated) goes round.
struct Polygon {
    std::vector<Vec3<double>> points;
    bool is_closed = false;

    int n_edges() const { return static_cast<int>(points.size()) - (is_closed ? 0 : 1); }

    Vec3<double> operator[](int i) const {
        const int n = static_cast<int>(points.size());
        if (is_closed)
            return points[(i % n + n) % n];
        if (i < 0)
            return 2.0 * points[0] - (*this)[-i];
        if (i >= n)
            return 2.0 * points[n - 1] - (*this)[2 * (n - 1) - i];
        return points[i];
    }
};

/// M_d(x), support [0, d + 1], by the recurrence of Cox and de Boor.
inline double cardinal_bspline(int d, double x) {
    if (d == 0)
        return x >= 0 && x < 1 ? 1 : 0;
    return (x * cardinal_bspline(d - 1, x) +
            (d + 1 - x) * cardinal_bspline(d - 1, x - 1)) /
           d;
}

/// The curve of degree d at t: point i has the B-spline that is centred at i.
inline Vec3<double> curve_point(const Polygon& polygon, int d, double t) {
    Vec3<double> sum(0);
    const int first = static_cast<int>(std::floor(t - 0.5 * (d + 1)));
    for (int i = first; i <= first + d + 2; ++i) {
        const double w = cardinal_bspline(d, t - i + 0.5 * (d + 1));
        if (w != 0)
            sum += w * polygon[i];
    }
    return sum;
}

/// The control points of the same curve after some steps of refinement, those with t in
/// [0, n_edges()], of closed curves in [0, n_edges()). Odd degrees have points at multiples of
/// 2^-levels, even degrees midway between these.
/// Source: Lane and Riesenfeld (1980): the mask is C(d + 1, k) / 2^d.
inline std::vector<Vec3<double>> refined_polygon(const Polygon& polygon, int d,
                                                 int levels) {
    std::vector<double> mask = {1.0};  // Pascal's triangle, scaled
    for (int i = 0; i <= d; ++i) {
        mask.push_back(0.0);
        for (std::size_t k = mask.size() - 1; k > 0; --k)
            mask[k] += mask[k - 1];
    }
    for (double& m : mask)
        m = std::ldexp(m, -d);

    // Points whose numbers begin with `first`; point i is at (i + offset) spacing.
    const int pad = d + 2;
    int first = -pad;
    std::vector<Vec3<double>> row;
    for (int i = first; i <= polygon.n_edges() + pad; ++i)
        row.push_back(polygon[i]);
    double spacing = 1, offset = 0;
    for (int l = 0; l < levels; ++l) {
        // Entry k of the mask lies k - (d + 1)/2 fine points from the point; halves round up.
        const int n = static_cast<int>(row.size());
        const int fine_first = 2 * first - (d + 1) / 2;
        std::vector<Vec3<double>> fine(2 * row.size() + mask.size(), Vec3<double>(0));
        for (int i = 0; i < n; ++i) {
            for (int k = 0; k <= d + 1; ++k)
                fine[2 * i + k] += mask[k] * row[i];
        }
        // The first and the last ones lack contributions.
        const int margin = d + 1;
        row.assign(fine.begin() + margin, fine.end() - margin - 2);
        first = fine_first + margin;
        // Even degrees: children 2i and 2i + 1 lie a quarter before and after point i.
        offset = 2 * offset - (d % 2 == 0 ? 0.5 : 0.0);
        spacing *= 0.5;
    }
    std::vector<Vec3<double>> result;
    for (std::size_t i = 0; i < row.size(); ++i) {
        const double t = (first + static_cast<double>(i) + offset) * spacing;
        if (t >= 0 &&
            (polygon.is_closed ? t < polygon.n_edges() : t <= polygon.n_edges()))
            result.push_back(row[i]);
    }
    return result;
}

}  // namespace osdx::test
