// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The templates of eval/bases/patch_basis.h, which includes this file.

#include <cmath>
#include <numbers>

#include "eval/bases/bspline.h"
#include "eval/bases/patch_basis.h"
#include "eval/bases/polygon.h"

namespace osdx {

template <int Order>
Jet<double, Order> PatchBasis::power(const J<Order>& x) const noexcept {
    J<Order> r = x;
    for (int k = 1; k < d_; ++k)
        r = r * x;
    return r;
}

template <int Order>
Jet<double, Order> PatchBasis::blend(const J<Order>& towards,
                                     const J<Order>& from) const noexcept {
    const bool small = from.c[0] <= towards.c[0];
    const J<Order> p = power<Order>(small ? from / towards : towards / from);
    const J<Order> one(1.0);
    return small ? one / (one + p) : p / (one + p);
}

/// The foot of a point on an axis of the n-gon: on the line from the centre to the middle of
/// a side, at t = 0..1.
template <int Order>
class PatchBasis::AxisDomain {
public:
    AxisDomain(const PatchBasis& basis, int side, const J<Order>& t) noexcept
        : basis_(basis), side_(side), t_(t), parameters_(*this, side, basis.n_) {}

    J<Order> distance(int k) const noexcept {
        const auto at = [&](int i) { return basis_.polygon_.vertex_distance(i, k); };
        const double centre = basis_.polygon_.centre_distance();
        const double middle = 0.5 * (at(side_ - 1) + at(side_));
        // Of two terms, so that it is an exact 0 at the end.
        return (J<Order>(1.0) - t_) * centre + t_ * middle;
    }

    J<Order> s(int i) const noexcept { return parameters_.s(i); }
    J<Order> h(int i) const noexcept { return parameters_.h(i); }

private:
    const PatchBasis& basis_;
    int side_;
    J<Order> t_;
    PolygonSideParameters<Order, AxisDomain> parameters_;
};

/// A point of the triangle (1,0), (0,1), (-1,0): barycentric coordinates, as jets. The first
/// and the last vertex are the ends of the border.
template <int Order>
class PatchBasis::Triangle {
public:
    J<Order> first, corner, last;

    Triangle(const Place<Order>& p, Chart chart) noexcept {
        // The quad (middle of the border, first, corner, last).
        const J<Order> one(1.0);
        corner = p.a * p.b;
        const J<Order> middle = 0.5 * (one - p.a) * (one - p.b);
        first = middle + p.a * (one - p.b);
        last = middle + (one - p.a) * p.b;
        if constexpr (Order > 0) {
            if (chart == Chart::Native) {
                first = linear(first.c[0], 0.5, -0.5);
                corner = linear(corner.c[0], 0, 1);
                last = linear(last.c[0], -0.5, -0.5);
            }
        }
    }
    /// The foot on the border.
    Triangle(const J<Order>& first_, const J<Order>& last_) noexcept
        : first(first_), corner(), last(last_) {}

private:
    static J<Order> linear(double value, double dx, double dy) noexcept {
        J<Order> j(value);
        j.c[1] = dx;
        j.c[2] = dy;
        return j;
    }
};

template <int Order>
Jet<double, Order> PatchBasis::border_parameter(const J<Order>& h_i,
                                                const J<Order>& h_o) const noexcept {
    const J<Order> one(1.0), sum = h_i + h_o, m = h_i / sum;
    const double near = 1.0 / d_;
    const J<Order> w_i = blend<Order>(near * h_o, h_i),
                   w_o = blend<Order>(near * h_i, h_o);
    return double(intervals_) * (m + (sum - one) * (w_i * m - w_o * (one - m)));
}

template <int Order>
Jet<double, Order> PatchBasis::axis_parameter(const J<Order>& t) const noexcept {
    const J<Order> one(1.0);
    if (class_.is_single())
        return border_parameter<Order>(0.25 * (one - t), 0.25 * (one + t));
    const AxisDomain<Order> at(*this, 0, t);
    return border_parameter<Order>(at.h(0), at.h(n_ / 2));
}

template <int Order>
Jet<double, Order> PatchBasis::axis_place(const J<Order>& a) const noexcept {
    // tau falls from L/2 to 0 as t rises: Newton's method, kept inside the last bracket.
    const double goal = 0.5 * intervals_ * (1 - a.c[0]);
    double lo = 0, hi = 1, t = a.c[0], slope = -1;
    constexpr int kMaxSteps = 100;
    for (int step = 0; step < kMaxSteps; ++step) {
        Jet<double, 1> x(t);
        x.c[1] = 1;
        const Jet<double, 1> tau = axis_parameter<1>(x);
        slope = tau.c[1];
        const double error = tau.c[0] - goal;
        (error > 0 ? lo : hi) = t;
        double next = t - error / slope;
        if (!(next > lo && next < hi))
            next = error == 0 ? t : 0.5 * (lo + hi);
        const bool done = std::abs(next - t) < 1e-16 || t == 0 || t == 1;
        if (a.c[0] <= 0 || a.c[0] >= 1 || done)
            break;
        t = next;
    }
    // Each step makes one more order right.
    J<Order> result(t);
    for (int order = 0; order < Order; ++order) {
        J<Order> error =
            axis_parameter<Order>(result) + (0.5 * intervals_) * (a - J<Order>(1.0));
        error.c[0] = 0;
        result -= error * (1 / slope);
    }
    return result;
}

template <int Order>
PatchBasis::Place<Order> PatchBasis::place(const DomainPoint& p) const noexcept {
    Place<Order> at{J<Order>(p.a), J<Order>(p.b)};
    if constexpr (Order > 0) {
        at.a.c[1] = 1;
        at.b.c[2] = 1;
    }
    if (!class_.is_open())
        return at;
    const J<Order> one(1.0), a = at.a, b = at.b;
    if (p.sector == 0)
        at.a = a + (one - b) * (axis_place<Order>(a) - a);
    if (p.sector == class_.n_sectors - 1)
        at.b = b + (one - a) * (axis_place<Order>(b) - b);
    return at;
}

template <int Order, class Sink>
Jet<double, Order> PatchBasis::regular_weights(double s, double t,
                                               Sink&& sink) const noexcept {
    constexpr int kStride = Order + 1;
    std::array<double, (kMaxDegree + 1) * kStride> along_s, along_t;
    const auto size = static_cast<std::size_t>((d_ + 1) * kStride);
    bspline_basis<double>(d_, s, Order, std::span(along_s).first(size));
    bspline_basis<double>(d_, t, Order, std::span(along_t).first(size));
    Index point = 0;
    for (int k = 0; k <= d_; ++k) {
        for (int j = 0; j <= d_; ++j, ++point) {
            Jet<double, Order> w;
            for (int m = 0; m <= Order; ++m) {
                for (int y = 0; y <= m; ++y)
                    w.c[w.index(m - y, y)] =
                        along_s[j * kStride + m - y] * along_t[k * kStride + y];
            }
            sink(point, w);
        }
    }
    return Jet<double, Order>(1.0);
}

template <int Order, class Sink>
void PatchBasis::ribbon_weights(int ribbon, const Jet<double, Order>& s,
                                const Jet<double, Order>& h,
                                const Jet<double, Order>& alpha,
                                const Jet<double, Order>& beta, Jet<double, Order>& f,
                                Sink&& sink) const noexcept {
    constexpr int kStride = Order + 1;
    const auto interval = [&](double x) {
        return std::clamp(static_cast<int>(x), 0, intervals_ - 1);
    };
    const Jet<double, Order> sbar = double(intervals_) * s, hbar = double(intervals_) * h;
    const int column0 = interval(sbar.c[0]), row0 = interval(hbar.c[0]);
    const JetPowers<double, Order> s_powers(sbar), h_powers(hbar);

    std::array<double, (kMaxDegree + 1) * kStride> taylor;
    const std::span<double> basis(taylor.data(),
                                  static_cast<std::size_t>(d_ + 1) * kStride);
    row_basis(row0, hbar.c[0] - row0, Order, basis);
    std::array<Jet<double, Order>, kMaxDegree> rows;
    for (int k = row0; k < d_; ++k)
        rows[k] = h_powers.compose(taylor.data() + (k - row0) * kStride);

    bspline_basis<double>(d_, sbar.c[0] - column0, Order, basis);
    const int middle = class_.kind == PatchKind::EV ? d_ - 1 : columns_;
    for (int m = 0; m <= d_; ++m) {
        const int j = column0 + m;
        Jet<double, Order> column = s_powers.compose(taylor.data() + m * kStride);
        if (j < d_)
            column = column * alpha;
        if (j >= d_ || j == middle)
            column = column * beta;
        const Index* offsets = term_offsets_.data() + (ribbon * columns_ + j) * d_;
        for (int k = row0; k < d_; ++k) {
            const Jet<double, Order> w = column * rows[k];
            f += w;
            if (!class_.is_open()) {
                sink(terms_[offsets[k]].point, w);
                continue;
            }
            for (Index t = offsets[k]; t < offsets[k + 1]; ++t)
                sink(terms_[t].point, terms_[t].weight * w);
        }
    }
}

template <int Order, class D, class Sink>
Jet<double, Order> PatchBasis::polygon_weights(const D& domain,
                                               Sink&& sink) const noexcept {
    J<Order> f;
    J<Order> h_before = domain.h(n_ - 1), h = domain.h(0);
    for (int i = 0; i < n_; ++i) {
        const J<Order> h_after = domain.h(cyclic(i + 1));
        ribbon_weights<Order>(i, domain.s(i), h, blend<Order>(h_before, h),
                              blend<Order>(h_after, h), f, sink);
        h_before = h;
        h = h_after;
    }
    return f;
}

template <int Order, class Sink>
Jet<double, Order> PatchBasis::triangle_weights(const Triangle<Order>& at,
                                                Sink&& sink) const noexcept {
    // Half ribbons: s and h run over halves, and one blend serves all columns. Ribbon 0 has
    // its side from the first vertex to the corner, ribbon 1 from there to the last.
    const J<Order> one(1.0);
    const J<Order> beta = blend<Order>(at.first, at.last);
    J<Order> f;
    const auto add = [&](int ribbon, const J<Order>& far, const J<Order>& near,
                         const J<Order>& weight) {
        const J<Order> span = at.corner + near;
        if (span.c[0] == 0)
            return;  // at the far end of the border, where the weight vanishes
        const J<Order> half = 0.5 * at.corner / span;
        ribbon_weights<Order>(
            ribbon, ribbon == 0 ? J<Order>(0.5) + half : J<Order>(0.5) - half, 0.5 * far,
            one, one, f, [&](Index i, const J<Order>& w) { sink(i, w * weight); });
    };
    add(0, at.last, at.first, beta);
    J<Order> f0 = f * beta;
    f = J<Order>();
    const J<Order> alpha = one - beta;
    add(1, at.first, at.last, alpha);
    return f0 + f * alpha;
}

template <int Order, class Sink>
void PatchBasis::axis_curve(const J<Order>& tau, Sink&& sink) const noexcept {
    constexpr int kStride = Order + 1;
    const int interval = std::clamp(static_cast<int>(tau.c[0]), 0, intervals_ - 1);
    std::array<double, (kMaxDegree + 1) * kStride> taylor;
    bspline_basis<double>(
        d_, tau.c[0] - interval, Order,
        std::span(taylor).first(static_cast<std::size_t>(d_ + 1) * kStride));
    const JetPowers<double, Order> powers(tau);
    for (int m = 0; m <= d_; ++m)
        sink(interval + m, powers.compose(taylor.data() + m * kStride));
}

template <int Order, class Weights, class Sink>
void PatchBasis::correct(int axis, const J<Order>& scale, const J<Order>& h_i,
                         const J<Order>& h_o, Weights&& weights,
                         Sink&& sink) const noexcept {
    const Index* offsets = term_offsets_.data() + n_ * columns_ * d_ + axis * columns_;
    axis_curve<Order>(border_parameter<Order>(h_i, h_o), [&](int j, const J<Order>& w) {
        const J<Order> c = w * scale;
        for (Index t = offsets[j]; t < offsets[j + 1]; ++t)
            sink(terms_[t].point, terms_[t].weight * c);
    });
    const J<Order> f = weights([](Index, const J<Order>&) {});
    const J<Order> minus = -1.0 * scale / f;
    weights([&](Index i, const J<Order>& v) { sink(i, minus * v); });
}

template <int Order, class D>
PatchBasis::AxisFoot<Order> PatchBasis::axis_foot(const D& domain,
                                                  int axis) const noexcept {
    const int k = class_.n_sectors, i = axis * k, o = cyclic(i + n_ / 2);
    const J<Order> one(1.0);
    const double inverse = 1 / polygon_.centre_distance();
    AxisFoot<Order> foot{i, one - domain.distance(i) * inverse, one};
    if (foot.t.c[0] < 0) {
        foot.side = o;
        foot.t = domain.distance(o) * -inverse + one;
    }
    // Twice the distance from the axis, by two sides that are mirror images in it.
    const int m = n_ / 4;
    const J<Order> y = (domain.distance(axis == 0 ? n_ - m : i + m) -
                        domain.distance(axis == 0 ? m : i - m)) *
                       (1 / std::sin(2 * std::numbers::pi * m / n_));
    const bool pinned = class_.border == PatchBorder::Pinned;
    for (int side = axis == 0 ? 1 : 0; side <= (pinned && axis == 0 ? k : k - 1); ++side)
        foot.weight = foot.weight * blend<Order>(domain.distance(side), y);
    return foot;
}

template <int Order, class Sink>
Jet<double, Order> PatchBasis::for_each_weight(const DomainPoint& p, Chart chart,
                                               Sink&& sink) const noexcept {
    if (gregory_)
        return gregory_->for_each_weight<Order>(p, chart, sink);
    if (class_.kind == PatchKind::Regular)
        return regular_weights<Order>(p.a, p.b, sink);

    // Below this distance the second derivatives of the blends, which grow like the
    // distance to the power -2, drown in rounding, and the ribbons differ by its square.
    const bool at_corner = 2 - p.a - p.b < kCorner;
    const J<Order> one(1.0);
    J<Order> f;

    const Place<Order> at_place = place<Order>(p);
    if (class_.is_single()) {
        const Triangle<Order> at(at_place, chart);
        if (at_corner) {
            ribbon_weights<Order>(1,
                                  J<Order>(0.5) - 0.5 * at.corner / (at.corner + at.last),
                                  0.5 * at.first, one, one, f, sink);
            return f;
        }
        f = triangle_weights<Order>(at, sink);
        const J<Order> border = at.first + at.last;
        const Triangle<Order> foot(at.first / border, at.last / border);
        correct<Order>(
            0, f * power<Order>(border) * border, 0.5 * foot.last, 0.5 * foot.first,
            [&](auto&& s) { return triangle_weights<Order>(foot, s); }, sink);
        return f;
    }

    const PolygonPoint<Order> domain(polygon_, p.sector, at_place.a, at_place.b, chart,
                                     !class_.is_open());
    if (at_corner) {
        const int i = cyclic(p.sector + 1);  // starts at the corner
        ribbon_weights<Order>(i, domain.s(i), domain.h(i), one, one, f, sink);
        return f;
    }
    f = polygon_weights<Order>(domain, sink);
    if (class_.border == PatchBorder::Spike) {
        J<Order> b = f;
        for (int k = 0; k < n_; ++k)
            b = b * power<Order>(domain.distance(k) * (1 / polygon_.centre_distance()));
        sink(static_cast<Index>(class_.kind == PatchKind::EV ? 0 : class_.ef_centre()),
             b);
        for (Index i = 0; i < centre_weights_.size(); ++i)
            sink(i, -centre_weights_[i] * b);
    }
    if (!class_.is_open())
        return f;
    const bool pinned = class_.border == PatchBorder::Pinned;
    for (int axis = 0; axis <= int(pinned); ++axis) {
        const AxisFoot<Order> at = axis_foot<Order>(domain, axis);
        if (!at.has_weight())
            continue;
        const int i = axis * class_.n_sectors;
        const AxisDomain<Order> foot(*this, at.side, at.t);
        correct<Order>(
            axis, f * at.weight, foot.h(i), foot.h(cyclic(i + n_ / 2)),
            [&](auto&& s) { return polygon_weights<Order>(foot, s); }, sink);
    }
    return f;
}

}  // namespace osdx
