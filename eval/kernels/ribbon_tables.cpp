// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/ribbon_tables.h"

#include <cmath>
#include <numbers>
#include <span>

#include "eval/bases/bspline.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

/// E_(d-1) continues N_(d-1) at d-2 with all derivatives below d and ends with a zero of
/// order d: the Taylor coefficients of N_(d-1)(d-2+u) / (1-u)^d below degree d.
std::vector<double> extended_polynomial(int d) {
    std::vector<double> taylor(static_cast<std::size_t>(d + 1) * d), a(d);
    bspline_basis<double>(d, 0.0, d - 1, std::span(taylor));
    const double* of = taylor.data() + d;  // the function 1 of the interval
    for (int r = 0; r < d; ++r) {
        double binomial = 1;  // of (1-u)^-d: C(d-1+k, k)
        for (int k = 0; k <= r; ++k) {
            a[r] += binomial * of[r - k];
            binomial *= double(d + k) / (k + 1);
        }
    }
    return a;
}

}  // namespace

TaylorRows::TaylorRows(int degree) : stride((degree + 4) / 4 * 4) {
    const int n = degree + 1;
    std::vector<double> taylor(static_cast<std::size_t>(n) * n);
    bspline_basis<double>(degree, 0.5, degree, std::span(taylor));
    rows.resize(static_cast<std::size_t>(n) * stride);
    for (int r = 0; r < n; ++r) {
        for (int j = 0; j < n; ++j)
            rows[r * stride + j] = taylor[j * n + r];
    }
}

RingTables::RingTables(const PatchClass& patch_class, const Polygon& polygon)
    : n(polygon.n()),
      degree(patch_class.degree),
      n_points(patch_class.n_points()),
      n_intervals(degree - (patch_class.kind == PatchKind::EV)),
      centre(polygon.centre_distance()),
      sine(std::sin(std::numbers::pi / n)),
      x_a(centre * centre),
      x_ab(1 - 2 * x_a),
      y_b(centre * sine),
      left(n,
           [&](int k) {
               return 0.5 *
                      (polygon.vertex_distance(-1, k) + polygon.vertex_distance(0, k));
           }),
      corner(n, [&](int k) { return polygon.vertex_distance(0, k); }),
      right(n,
            [&](int k) {
                return 0.5 *
                       (polygon.vertex_distance(0, k) + polygon.vertex_distance(1, k));
            }),
      distance_x(n, [&](int k) { return -polygon.normal(k).x; }),
      distance_y(n, [&](int k) { return -polygon.normal(k).y; }),
      slope_x(n, [&](int k) { return -degree * polygon.normal(k).x; }),
      slope_y(n, [&](int k) { return -degree * polygon.normal(k).y; }),
      eta_a(n,
            [&](int k) {
                return -(x_a * polygon.normal(k).y + y_b * polygon.normal(k).x);
            }),
      eta_b(n,
            [&](int k) { return y_b * polygon.normal(k).x - x_a * polygon.normal(k).y; }),
      eta_ab(n, [&](int k) { return -x_ab * polygon.normal(k).y; }),
      sum_value(4 * centre * sine * sine / n_intervals),
      sum_slope(2 * std::cos(2 * std::numbers::pi / n) / n_intervals),
      around_x(n, [&](int k) { return -degree * sum_slope * polygon.normal(k).x; }),
      around_y(n, [&](int k) { return -degree * sum_slope * polygon.normal(k).y; }),
      of_degree(1.0 / degree),
      power_bend(0.5 * (degree - 1) / degree),
      far_weight(n, [&](int j) { return weight_if_far(j); }),
      is_far(n, [](int k) { return k > 1 ? 1.0 : 0.0; }),
      near_weight{near_table(-1), near_table(0), near_table(1)} {
    one.fill(1);
    for (int m = 0; m < kLanes; ++m) {
        const int period = is_ring() ? n : kLanes;
        next[m] = (m + 1) % period;
        previous[m] = (m + period - 1) % period;
        is_slot[m] = m < n_lanes();
        is_ribbon[m] =
            is_ring() ? m < n : m >= kFirstOfWindow && m < kFirstOfWindow + kWindow;
    }
    for (int i = 0; i < n; ++i) {
        const double angle = 2 * std::numbers::pi * i / n;
        sector_turn.emplace_back(std::cos(angle), std::sin(angle));
    }
    for (int j = 0; j < n + kLanes; ++j)
        far_weight_once.push_back(j < n ? weight_if_far(j) : 0.0);
    if (is_ring())
        build_polynomials();
    if (patch_class.kind == PatchKind::EV)
        extended = extended_polynomial(degree);
}

SideTable RingTables::near_table(int weight) const {
    const int of = (weight + n) % n;
    return SideTable(n,
                     [&](int i) { return of != i && of != (i + n - 1) % n ? 1.0 : 0.0; });
}

void RingTables::build_polynomials() {
    // Polynomials in xi and eta of side 0, by their powers.
    using Polynomial = std::array<std::array<double, kLanes>, kLanes>;
    const auto product = [&](auto&& leave_out) {
        Polynomial r{};
        r[0][0] = 1;
        for (int k = 0; k < n; ++k) {
            if (leave_out(k))
                continue;
            const double angle = 2 * std::numbers::pi * k / n, x = std::cos(angle),
                         y = -std::sin(angle);
            for (int p = n - 1; p >= 0; --p) {  // times l_k = centre + x xi + y eta
                for (int q = n - 1; q >= 0; --q)
                    r[p][q] = centre * r[p][q] + (p > 0 ? x * r[p - 1][q] : 0.0) +
                              (q > 0 ? y * r[p][q - 1] : 0.0);
            }
        }
        return r;
    };
    for (int j = 0; j < n; ++j) {
        const int next_j = (j + 1) % n;
        const Polynomial w = product([&](int k) { return k == j || k == next_j; });
        for (int r = 0; 2 * r <= n - 3; ++r)
            total[r] += w[2 * r][0] / n_intervals;
        if (j == 0 || j == n - 1)
            continue;
        const Polynomial q =
            product([&](int k) { return k == 0 || k == j || k == next_j; });
        for (int p = 0; p <= n - 3; ++p) {
            for (int r = 0; p + 2 * r <= n - 3; ++r)
                quotient[p][r] += q[p][2 * r];
        }
    }
    twice_quotient_01 = 2 * quotient[0][1];
    twice_total_1 = 2 * total[1];
}

}  // namespace osdx::inline OSDX_ABI::detail
