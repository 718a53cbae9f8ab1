// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include <osdx/patch_class.h>
#include <osdx/place.h>
#include <osdx/types.h>

#include "eval/bases/bspline.h"
#include "eval/bases/jet.h"
#include "eval/bases/polygon.h"

namespace osdx::inline OSDX_ABI {

/// x^d
template <class J>
J power(const J& x, int d) noexcept {
    J r = x;
    for (int k = 1; k < d; ++k)
        r = r * x;
    return r;
}

/// towards^d / (towards^d + from^d): the smaller one over the larger avoids underflow.
template <class J>
J blend(const J& towards, const J& from, int d) noexcept {
    const bool small = representative(from.c[0]) <= representative(towards.c[0]);
    const J p = power(small ? from / towards : towards / from, d);
    const J one(1.0);
    return small ? one / (one + p) : p / (one + p);
}

/// The foot of a point on an axis of the n-gon: on the line from the centre to the middle of
/// a side, at t = 0..1.
template <int Order, class T>
class AxisPoint {
    using J = Jet<T, Order>;

public:
    using Scalar = T;

    AxisPoint(const Polygon& polygon, int side, const J& t) noexcept
        : polygon_(polygon), side_(side), t_(t), parameters_(*this, side, polygon.n()) {}
    AxisPoint(const AxisPoint&) = delete;
    AxisPoint& operator=(const AxisPoint&) = delete;

    J distance(int k) const noexcept {
        const auto at = [&](int i) { return polygon_.vertex_distance(i, k); };
        const double centre = polygon_.centre_distance();
        const double middle = 0.5 * (at(side_ - 1) + at(side_));
        // Of two terms, so that it is an exact 0 at the end.
        return (J(1.0) - t_) * centre + t_ * middle;
    }

    J s(int i) const noexcept { return parameters_.s(i); }
    J h(int i) const noexcept { return parameters_.h(i); }
    int side() const noexcept { return side_; }
    const J& t() const noexcept { return t_; }

private:
    const Polygon& polygon_;
    int side_;
    J t_;
    PolygonSideParameters<Order, AxisPoint> parameters_;
};

/// The formula of EV and EF patches at borders, sharp edges and spikes, for whatever S may be:
/// weights of control points, or sums over them.
///
/// On the axis, the straight line through the centre of the n-gon that is the border, S depends
/// on border points only. It is corrected to the uniform B-spline curve C of these:
///
///     S'(p) = S(p) + b(p) (C(tau(q)) - S(q)),   b = product of l_k^d / (l_k^d + (2 y)^d)
///
/// over the sides of the part that the axis does not meet, y the distance of p from the axis and
/// q its foot there, at x = -1..1 from side n/2 to side 0, i and o the sides that the axis meets
/// at its ends, L = d-1 for EV and d for EF, and
///
///     tau = L (m + (h_i + h_o - 1) (w_i m - w_o (1 - m))),   m = h_i / (h_i + h_o),
///     w_i = (h_o/d)^d / ((h_o/d)^d + h_i^d),   w_o = (h_i/d)^d / ((h_i/d)^d + h_o^d),
///
/// which is L h_i but for order d at side i, L (1 - h_o) at side o, and rises everywhere. (A
/// plain blend of these two goes back and forth from n = 10 on at d = 3, n = 6 at d = 5.)
/// That changes no derivative below d on any side.
///
/// Where two curves end at the centre V, C_e is the curve of side e continued by 2 V - P, and
/// with D_e = C_e - S, the latter at x and -x,
///
///     S'(p) = S(p) + b(p) (sgn(x) (D_0 - D_n/2)(|x|) + (D_0 + D_n/2)(rho)) / 2,
///     rho^2 = x^2 + eps^2 y^2 (1 - x^2)
///
/// in units of the centre's distance to a side: part 0 and part 1 (MirroredNet). The odd part is
/// as smooth as a straight border; the even part has the corner's kink at the centre alone, where
/// the surface is a cone, with a regular chart for all openings up to 330 degrees.
///
/// A spike is S(p) + b(p) (V - S(0)), with b the product of (l_k(p) / l_k(0))^d over all sides.
///
/// In the sectors beside a border (a, b) is moved along it, so that tau is linear in (a, b): on
/// both sides of a crease, whatever patches lie there, and on borders modelled apart, equal
/// addresses are equal points. Source: own.
/// Threads: const members may run at the same time; no allocation.
class RibbonBorder {
public:
    explicit RibbonBorder(const PatchClass& patch_class)
        : class_(patch_class),
          polygon_(patch_class.n_polygon()),
          n_(patch_class.n_polygon()),
          d_(patch_class.degree),
          intervals_(patch_class.kind == PatchKind::EV ? d_ - 1 : d_) {}

    const PatchClass& patch_class() const noexcept { return class_; }
    const Polygon& polygon() const noexcept { return polygon_; }
    int n_intervals() const noexcept { return intervals_; }  ///< of a ribbon both ways: L

    bool is_pinned() const noexcept { return class_.border == PatchBorder::Pinned; }

    /// (a, b) of a sector's quad, as jets in the (a, b) that was asked for.
    template <int Order, class T>
    struct Place {
        Jet<T, Order> a, b;
    };
    template <int Order, class T>
    Place<Order, T> place(const DomainPointOf<T>& p) const noexcept;

    template <class J>
    J parameter(const J& h_i, const J& h_o) const noexcept;  ///< tau

    /// Calls f(part, b, q, tau) for the parts that a point of the n-gon is moved by, with the sign
    /// of the part in b.
    /// \tparam D  with distance(k): the point
    template <int Order, class T, class D, class F>
    void for_each_part(const D& domain, int sector, F&& f) const noexcept;

    /// rho, for x and y in units of the centre's distance to a side. At the centre, where it has
    /// no derivatives, it takes those along the middle of the sector, and no second ones.
    template <class J>
    J even_place(const J& x, const J& y, int sector) const noexcept;

    /// `start` times the b of a spike.
    template <class D, class J>
    J spike_weight(const D& domain, const J& start) const noexcept {
        J b = start;
        for (int k = 0; k < n_; ++k)
            b = b * power(domain.distance(k) * (1 / polygon_.centre_distance()), d_);
        return b;
    }

    /// Calls sink(j, w) with the weights of the points of an axis' curve at tau.
    template <int Order, class T, class Sink>
    void curve(const Jet<T, Order>& tau, Sink&& sink) const noexcept;

private:
    int cyclic(int i) const noexcept { return polygon_.cyclic(i); }

    /// tau at t on an axis: 0 at t = 1, the side, and L/2 at t = 0, the centre.
    template <int Order, class T>
    Jet<T, Order> axis_parameter(const Jet<T, Order>& t) const noexcept;
    /// The t at which tau is L/2 (1 - a).
    template <int Order, class T>
    Jet<T, Order> axis_place(const Jet<T, Order>& a) const noexcept;

    /// b
    template <class J, class D>
    J weight(const D& domain, const J& y) const noexcept;

    PatchClass class_;
    Polygon polygon_;
    int n_, d_, intervals_;
};

template <class J>
J RibbonBorder::parameter(const J& h_i, const J& h_o) const noexcept {
    const J one(1.0), sum = h_i + h_o, m = h_i / sum;
    const double step = 1.0 / d_;
    const J w_i = blend(step * h_o, h_i, d_), w_o = blend(step * h_i, h_o, d_);
    return double(intervals_) * (m + (sum - one) * (w_i * m - w_o * (one - m)));
}

template <int Order, class T>
Jet<T, Order> RibbonBorder::axis_parameter(const Jet<T, Order>& t) const noexcept {
    const Jet<T, Order> one(1.0);
    if (class_.is_single())
        return parameter(0.25 * (one - t), 0.25 * (one + t));
    const AxisPoint<Order, T> at(polygon_, 0, t);
    return parameter(at.h(0), at.h(n_ / 2));
}

template <int Order, class T>
Jet<T, Order> RibbonBorder::axis_place(const Jet<T, Order>& a) const noexcept {
    // tau falls from L/2 to 0 as t rises: Newton's method, kept inside the last bracket.
    const T goal = 0.5 * intervals_ * (1 - a.c[0]);
    const double a0 = representative(a.c[0]);
    const auto tau_at = [&](T t) {
        Jet<T, 1> x(t);
        x.c[1] = 1;
        return axis_parameter(x);
    };
    T lo = 0, hi = 1, t = a.c[0];
    constexpr int kMaxSteps = 100;
    for (int step = 0; step < kMaxSteps && a0 > 0 && a0 < 1; ++step) {
        const Jet<T, 1> tau = tau_at(t);
        const T error = tau.c[0] - goal;
        (representative(error) > 0 ? lo : hi) = t;
        T next = t - error / tau.c[1];
        const bool inside =
            representative(next - lo) > 0 && representative(hi - next) > 0;
        if (!inside)
            next = representative(error) == 0 ? t : 0.5 * (lo + hi);
        const double size = std::abs(representative(next - t)), at = representative(t);
        if (at == 0 || at == 1)
            break;
        t = next;
        // A step of Newton's squares the error, times some power of n.
        if (size < (inside ? 1e-8 / (n_ * n_) : 1e-16))
            break;
    }
    Jet<T, Order> result(t);
    if constexpr (Order > 0) {
        // Each step makes one more order right.
        const T inverse = 1 / tau_at(t).c[1];
        for (int order = 0; order < Order; ++order) {
            Jet<T, Order> error = (0.5 * intervals_) * a;
            if (order > 0)
                error += axis_parameter(result);
            error.c[0] = 0;
            result -= error * inverse;
        }
    }
    return result;
}

template <int Order, class T>
RibbonBorder::Place<Order, T> RibbonBorder::place(
    const DomainPointOf<T>& p) const noexcept {
    using J = Jet<T, Order>;
    Place<Order, T> at{J(p.a), J(p.b)};
    if constexpr (Order > 0) {
        at.a.c[1] = 1;
        at.b.c[2] = 1;
    }
    if (!class_.is_open())
        return at;
    const J one(1.0), a = at.a, b = at.b;
    if (p.sector == 0)
        at.a = a + (one - b) * (axis_place(a) - a);
    if (p.sector == class_.n_sectors - 1)
        at.b = b + (one - a) * (axis_place(b) - b);
    return at;
}

template <int Order, class T, class Sink>
void RibbonBorder::curve(const Jet<T, Order>& tau, Sink&& sink) const noexcept {
    constexpr int kStride = Order + 1;
    // Two curves are read up to the centre, where they are given by their own piece.
    const int last = is_pinned() ? (intervals_ - 1) / 2 : intervals_ - 1;
    const int interval = std::clamp(static_cast<int>(representative(tau.c[0])), 0, last);
    std::array<T, (kMaxDegree + 1) * kStride> taylor;
    bspline_basis<T>(d_, tau.c[0] - interval, Order,
                     std::span(taylor).first(static_cast<std::size_t>(d_ + 1) * kStride));
    const JetPowers<T, Order> powers(tau);
    for (int m = 0; m <= d_; ++m)
        sink(interval + m, powers.compose(taylor.data() + m * kStride));
}

template <class J>
J RibbonBorder::even_place(const J& x, const J& y, int sector) const noexcept {
    // Measured: larger ones fold random nets at re-entrant corners, smaller ones are further from
    // the Catmull-Clark limit.
    const double eps = class_.is_single() ? 0.3 : class_.n_sectors == 2 ? 0.7 : 0.5;
    const J square = x * x + (eps * eps) * (y * y) * (J(1.0) - x * x);
    if (representative(square.c[0]) > 1e-16)
        return sqrt(square);
    const double angle = (sector + 0.5) * std::numbers::pi / class_.n_sectors,
                 along = std::cos(angle), across = eps * std::sin(angle),
                 length = std::hypot(along, across);
    J rho = (along / length) * x + (eps * across / length) * y;
    using std::sqrt;
    rho.c[0] = sqrt(square.c[0]);
    return rho;
}

template <class J, class D>
J RibbonBorder::weight(const D& domain, const J& y) const noexcept {
    J b(1.0);
    for (int side = 1; side < class_.n_sectors; ++side)
        b = b * blend(domain.distance(side), y, d_);
    return b;
}

template <int Order, class T, class D, class F>
void RibbonBorder::for_each_part(const D& domain, int sector, F&& f) const noexcept {
    using J = Jet<T, Order>;
    if (!class_.is_open())
        return;
    const double inverse = 1 / polygon_.centre_distance();
    // Twice the distance from the axis, by two sides that are mirror images in it.
    const int m = n_ / 4;
    const J y = (domain.distance(n_ - m) - domain.distance(m)) *
                (1 / std::sin(2 * std::numbers::pi * m / n_));
    const J b = weight(domain, y);
    if (std::ranges::all_of(b.c, [](const auto& x) { return representative(x) == 0; }))
        return;
    int side = 0;
    J x = J(1.0) - domain.distance(0) * inverse;
    if (representative(x.c[0]) < 0) {
        side = n_ / 2;
        x = domain.distance(side) * -inverse + J(1.0);
    }
    const auto take = [&](int part, const J& scale, int at_side, const J& t) {
        const AxisPoint<Order, T> point(polygon_, at_side, t);
        f(part, scale, point, parameter(point.h(0), point.h(n_ / 2)));
    };
    if (!is_pinned())
        return take(0, b, side, x);
    take(0, side == 0 ? b : b * T(-1), 0, x);
    take(1, b, 0,
         even_place(x, (0.5 * inverse) * y,
                    side == 0 ? sector : class_.n_sectors - 1 - sector));
}

}  // namespace osdx::inline OSDX_ABI
