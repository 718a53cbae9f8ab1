// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The templates of eval/bases/ribbon.h, which includes this file.

#include <algorithm>
#include <array>

#include "eval/bases/bspline.h"
#include "eval/bases/ribbon.h"

namespace osdx::inline OSDX_ABI {

/// A point of the triangle (1,0), (0,1), (-1,0): barycentric coordinates, as jets. The first
/// and the last vertex are the ends of the border.
template <int Order, class T>
class RibbonBasis::Triangle {
    using J = Jet<T, Order>;

public:
    J first, corner, last;

    Triangle(const RibbonBorder::Place<Order, T>& p, Chart chart) noexcept {
        // The quad (middle of the border, first, corner, last).
        const J one(1.0);
        corner = p.a * p.b;
        const J middle = 0.5 * (one - p.a) * (one - p.b);
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
    Triangle(const J& first_, const J& last_) noexcept
        : first(first_), corner(), last(last_) {}

private:
    static J linear(T value, double dx, double dy) noexcept {
        J j(value);
        j.c[1] = dx;
        j.c[2] = dy;
        return j;
    }
};

template <class T>
void RibbonBasis::row_basis(int interval, T u, int order,
                            std::span<T> out) const noexcept {
    bspline_basis<T>(d_, u, order, out);
    if (class_.kind != PatchKind::EV || interval < border_.n_intervals() - 1)
        return;
    // Row d-1 on the last interval: de Casteljau for the Taylor coefficients of a Bezier
    // polynomial of degree 2d-1, C(2d-1, r) times the r-th differences.
    T* taylor = out.data() + (order + 1);
    const int degree = 2 * d_ - 1;
    double binomial = 1;
    for (int r = 0; r <= order; ++r) {
        std::array<T, 2 * kMaxDegree> c;
        std::ranges::copy(extended_, c.begin());
        for (int m = 0; m < r && m <= degree; ++m) {
            for (int i = 0; i < degree - m; ++i)
                c[i] = c[i + 1] - c[i];
        }
        for (int m = degree - r; m > 0; --m) {
            for (int i = 0; i < m; ++i)
                c[i] = (1 - u) * c[i] + u * c[i + 1];
        }
        taylor[r] = r <= degree ? binomial * c[0] : T(0.0);
        binomial *= double(degree - r) / (r + 1);
    }
}

template <int Order, class T, class Sink>
void RibbonBasis::ribbon_weights(int ribbon, const Jet<T, Order>& s,
                                 const Jet<T, Order>& h, const Jet<T, Order>& alpha,
                                 const Jet<T, Order>& beta, Jet<T, Order>& f,
                                 Sink&& sink) const noexcept {
    constexpr int kStride = Order + 1;
    const int n_intervals = border_.n_intervals();
    const auto interval = [&](const T& x) {
        return std::clamp(static_cast<int>(representative(x)), 0, n_intervals - 1);
    };
    const Jet<T, Order> sbar = double(n_intervals) * s, hbar = double(n_intervals) * h;
    const int column0 = interval(sbar.c[0]), row0 = interval(hbar.c[0]);
    const JetPowers<T, Order> s_powers(sbar), h_powers(hbar);

    std::array<T, (kMaxDegree + 1) * kStride> taylor;
    const std::span<T> basis(taylor.data(), static_cast<std::size_t>(d_ + 1) * kStride);
    row_basis<T>(row0, hbar.c[0] - row0, Order, basis);
    std::array<Jet<T, Order>, kMaxDegree> rows;
    for (int k = row0; k < d_; ++k)
        rows[k] = h_powers.compose(taylor.data() + (k - row0) * kStride);

    bspline_basis<T>(d_, sbar.c[0] - column0, Order, basis);
    const int middle = class_.kind == PatchKind::EV ? d_ - 1 : columns_;
    for (int m = 0; m <= d_; ++m) {
        const int j = column0 + m;
        Jet<T, Order> column = s_powers.compose(taylor.data() + m * kStride);
        if (j < d_)
            column = column * alpha;
        if (j >= d_ || j == middle)
            column = column * beta;
        const Index first = static_cast<Index>((ribbon * columns_ + j) * d_);
        for (int k = row0; k < d_; ++k) {
            const Jet<T, Order> w = column * rows[k];
            f += w;
            sink(first + static_cast<Index>(k), w);
        }
    }
}

template <class Sink>
auto RibbonBasis::expanded(int net, Sink& sink) const noexcept {
    const Index* const offsets = term_offsets_.data() + net * n_ * columns_ * d_;
    return [&, offsets](Index i, const auto& w) {
        if (!class_.is_open()) {
            sink(terms_[offsets[i]].point, w);
            return;
        }
        for (Index t = offsets[i]; t < offsets[i + 1]; ++t)
            sink(terms_[t].point, terms_[t].weight * w);
    };
}

template <int Order, class T, class D, class Sink>
Jet<T, Order> RibbonBasis::polygon_weights(const D& domain, Sink&& sink) const noexcept {
    using J = Jet<T, Order>;
    J f;
    J h_before = domain.h(n_ - 1), h = domain.h(0);
    for (int i = 0; i < n_; ++i) {
        const J h_after = domain.h(cyclic(i + 1));
        ribbon_weights<Order, T>(i, domain.s(i), h, blend(h_before, h, d_),
                                 blend(h_after, h, d_), f, sink);
        h_before = h;
        h = h_after;
    }
    return f;
}

template <int Order, class T, class Sink>
Jet<T, Order> RibbonBasis::triangle_weights(const Triangle<Order, T>& at,
                                            Sink&& sink) const noexcept {
    using J = Jet<T, Order>;
    // Half ribbons: s and h run over halves, and one blend serves all columns. Ribbon 0 has
    // its side from the first vertex to the corner, ribbon 1 from there to the last.
    const J one(1.0);
    const J beta = blend(at.first, at.last, d_);
    J f;
    const auto add = [&](int ribbon, const J& to_other, const J& to_own,
                         const J& weight) {
        const J span = at.corner + to_own;
        if (representative(span.c[0]) == 0)
            return;  // at the far end of the border, where the weight vanishes
        const J half = 0.5 * at.corner / span;
        ribbon_weights<Order, T>(ribbon, ribbon == 0 ? J(0.5) + half : J(0.5) - half,
                                 0.5 * to_other, one, one, f,
                                 [&](Index i, const J& w) { sink(i, w * weight); });
    };
    add(0, at.last, at.first, beta);
    J f0 = f * beta;
    f = J();
    const J alpha = one - beta;
    add(1, at.first, at.last, alpha);
    return f0 + f * alpha;
}

template <int Order, class T, class Sink>
void RibbonBasis::curve_weights(int part, const Jet<T, Order>& scale,
                                const Jet<T, Order>& tau, Sink&& sink) const noexcept {
    const Index* offsets =
        term_offsets_.data() + (1 + n_parts_) * n_ * columns_ * d_ + part * columns_;
    border_.curve(tau, [&](int j, const Jet<T, Order>& w) {
        const Jet<T, Order> c = w * scale;
        for (Index t = offsets[j]; t < offsets[j + 1]; ++t)
            sink(terms_[t].point, terms_[t].weight * c);
    });
}

template <int Order, class T, class Sink>
Jet<T, Order> RibbonBasis::single_sector_weights(const DomainPointOf<T>& p, Chart chart,
                                                 Sink&& sink) const noexcept {
    using J = Jet<T, Order>;
    const J one(1.0);
    const Triangle<Order, T> at(border_.place<Order, T>(p), chart);
    if (is_at_corner(p)) {
        J f;
        ribbon_weights<Order, T>(1, J(0.5) - 0.5 * at.corner / (at.corner + at.last),
                                 0.5 * at.first, one, one, f, expanded(0, sink));
        return f;
    }
    // Points have contributions from many ribbon points, which are mirror images: added up first.
    constexpr int kMostPoints = kMaxDegree * (kMaxDegree + 2) + 1;
    std::array<J, kMostPoints> own;  // zeros
    const auto add = [&](Index i, const J& w) { own[i] += w; };
    const J f = triangle_weights(at, expanded(0, add));
    const J border = at.first + at.last, scale = f * power(border, d_) * border;
    const auto correct = [&](int part, const J& sign, const J& first, const J& last) {
        std::array<J, kMostPoints> at_foot;  // zeros
        const auto add_foot = [&](Index i, const J& w) { at_foot[i] += w; };
        const J f_foot = triangle_weights(Triangle<Order, T>(first, last),
                                          expanded(1 + part, add_foot));
        curve_weights<Order, T>(part, scale * sign,
                                border_.parameter(0.5 * last, 0.5 * first), add);
        const J minus = -1.0 * scale * sign / f_foot;
        for (Index i = 0; i < static_cast<Index>(class_.n_points()); ++i)
            own[i] += minus * at_foot[i];
    };
    const J first = at.first / border, last = at.last / border;
    if (!border_.is_pinned()) {
        correct(0, one, first, last);
    } else {
        const J x = first - last;
        const bool beyond = representative(x.c[0]) < 0;
        correct(0, beyond ? J(-1.0) : one, beyond ? last : first, beyond ? first : last);
        const J rho = border_.even_place(x, at.corner, 0);
        correct(1, one, 0.5 * (one + rho), 0.5 * (one - rho));
    }
    for (Index i = 0; i < static_cast<Index>(class_.n_points()); ++i)
        sink(i, own[i]);
    return f;
}

template <int Order, class T, class Sink>
Jet<T, Order> RibbonBasis::for_each_weight(const DomainPointOf<T>& p, Chart chart,
                                           Sink&& sink) const noexcept {
    using J = Jet<T, Order>;
    if (class_.is_single())
        return single_sector_weights<Order, T>(p, chart, sink);
    const auto at = border_.place<Order, T>(p);
    const PolygonPoint<Order, T> domain(border_.polygon(), p.sector, at.a, at.b, chart,
                                        !class_.is_open());
    const auto own = expanded(0, sink);
    if (is_at_corner(p)) {
        const int i = cyclic(p.sector + 1);  // starts at the corner
        const J one(1.0);
        J f;
        ribbon_weights<Order, T>(i, domain.s(i), domain.h(i), one, one, f, own);
        return f;
    }
    const J f = polygon_weights<Order, T>(domain, own);
    if (class_.border == PatchBorder::Spike) {
        const J b = border_.spike_weight(domain, f);
        sink(static_cast<Index>(class_.kind == PatchKind::EV ? 0 : class_.ef_centre()),
             b);
        for (Index i = 0; i < centre_weights_.size(); ++i)
            sink(i, -centre_weights_[i] * b);
    }
    border_.for_each_part<Order, T>(
        domain, p.sector, [&](int part, const J& b, const auto& foot, const J& tau) {
            const J scale = f * b;
            curve_weights<Order, T>(part, scale, tau, sink);
            const J minus =
                -1.0 * scale / polygon_weights<Order, T>(foot, [](Index, const J&) {});
            const auto subtract = [&](Index i, const J& w) { sink(i, minus * w); };
            polygon_weights<Order, T>(foot, expanded(1 + part, subtract));
        });
    return f;
}

}  // namespace osdx::inline OSDX_ABI
