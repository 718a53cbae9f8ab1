// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <osdx/patch_class.h>
#include <osdx/types.h>

#include "eval/bases/polygon.h"

namespace osdx::inline OSDX_ABI::detail {

/// Ribbons, or sides of a polygon, that are worked on at a time.
inline constexpr int kLanes = 8;

/// The polynomials of a uniform B-spline about the middle of their interval, for Horner's
/// scheme on all of them at once: row r has N_j^(r)(1/2) / r!, j = 0..d, and zeros up to a
/// multiple of 4. About the middle no term is larger than the sum by more than a small
/// factor, at any degree.
struct TaylorRows {
    explicit TaylorRows(int degree);

    int stride;
    std::vector<double> rows;
};

/// Values on sides of the n-gon, numbered from the first of the two sides at the corner of
/// the sector that is asked for. Sides from -kBefore to n + kAfter can be read.
class SideTable {
public:
    static constexpr int kBefore = 4, kAfter = 2 * kLanes;

    template <class F>
    SideTable(int n, F&& value) {
        for (int k = -kBefore; k < n + kAfter; ++k)
            values_.push_back(value((k % n + n) % n));
    }
    const double* at(int side) const noexcept { return values_.data() + side + kBefore; }

private:
    std::vector<double> values_;
};

/// What the kernels of n-sided patches read: the geometry of the n-gon.
///
/// Lanes of a register are ribbons: all of them where n <= kLanes (a ring), else kWindow in
/// the middle of the register, so that neighbours are at hand.
///
/// The kernel's variables are (x, y) in the frame of the sector: x runs to its corner.
struct RingTables {
    static constexpr int kWindow = 4, kFirstOfWindow = 2;

    RingTables(const PatchClass& patch_class, const Polygon& polygon);

    bool is_ring() const noexcept { return n <= kLanes; }
    /// Lanes in which a block has weights.
    int n_lanes() const noexcept { return is_ring() ? n : kFirstOfWindow + kWindow + 1; }

    int n, degree, n_points;
    /// Of the splines along a side. The kernels take so many times s and h, and the degree times
    /// their derivatives besides: then cubes and powers of degree d need no factors.
    int n_intervals;
    double centre;  ///< distance from the centre to a side, cos(pi/n)
    double sine;    ///< sin(pi/n)
    /// x = x_a (a + b) + x_ab a b, y = y_b (b - a).
    double x_a, x_ab, y_b;
    SideTable left, corner, right;     ///< distances of the sector's corners to the sides
    SideTable distance_x, distance_y;  ///< derivatives of the distances
    SideTable slope_x, slope_y;        ///< d times them
    SideTable eta_a, eta_b, eta_ab;  ///< eta = eta_a a + eta_b b + eta_ab a b, see below
    /// (l_(i-1) + l_(i+1)) / n_intervals = value + slope l_i
    double sum_value, sum_slope;
    SideTable around_x, around_y;  ///< d times derivatives of that
    double of_degree;              ///< 1 / d
    double power_bend;             ///< (d-1) / (2 d)

    /// Of rings: with xi from the centre away from side i, so that l_i = centre + xi, and eta
    /// along the side,
    ///
    ///     h_i = l_i Q(xi, eta) / W(xi^2 + eta^2),   Q = sum over j != i, i-1 of
    ///                                                 product of l_k over k != i, j, j+1
    ///
    /// by Wachspress' coordinates, whose sum W has the symmetry of the n-gon and a degree
    /// below n. Every l_k is positive, so h is exact to rounding next to its side, too.
    /// quotient[p][r] is that of xi^p eta^(2 r). W is
    /// divided by n_intervals.
    double quotient[kLanes - 2][3] = {}, total[3] = {};
    double twice_quotient_01 = 0, twice_total_1 = 0;

    /// Of windows: of weight j of Wachspress' coordinates, 1 where none of its sides is at
    /// the corner, and the same for j < n, else 0.
    SideTable far_weight;
    std::vector<double> far_weight_once;
    SideTable is_far;          ///< 0 on the two sides at the corner, else 1
    SideTable near_weight[3];  ///< 1 where the weight -1, 0 or 1 is a part of h_i

    /// 1 everywhere. Of what compilers know to be the same in all lanes they compute one and
    /// spread it, which is two operations.
    std::array<double, kLanes> one;
    std::array<double, kLanes> is_ribbon;  ///< 1 in lanes that hold a ribbon of their own
    std::array<double, kLanes> is_slot;    ///< 1 in lanes that may have weights
    std::array<std::int64_t, kLanes> next, previous;
    std::vector<Vec2<double>> sector_turn;  ///< cos and sin of the sectors' directions

    std::vector<double> extended;  ///< (1-u)^d times this polynomial is E_(d-1)

private:
    double weight_if_far(int j) const noexcept { return j > 1 && j < n - 1 ? 1.0 : 0.0; }
    SideTable near_table(int weight) const;
    void build_polynomials();
};

}  // namespace osdx::inline OSDX_ABI::detail
