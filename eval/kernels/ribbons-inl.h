// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_RIBBONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_RIBBONS_INL_H_
#undef OSDX_EVAL_RIBBONS_INL_H_
#else
#define OSDX_EVAL_RIBBONS_INL_H_
#endif

#include "eval/kernels/lanes-inl.h"
#include "eval/kernels/ribbon_tables.h"

// The parameters and blends of the ribbons of patches of n sides at a point, one ribbon a lane.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

using detail::kLanes;
using detail::RingTables;

using P8 = Pack<kLanes>;

/// Distances to sides k, k+1, ... as jets.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> distances(const RingTables& t, int k, double a, double b) {
    // Exact 0 on the side, and to relative precision near it.
    const V va = number<V>(a), vb = number<V>(b), one = load<V>(t.one.data()),
            a1 = one - va, b1 = one - vb;
    const V low = mul_add(vb, load<V>(t.right.at(k)), b1 * number<V>(t.centre)),
            high = mul_add(b1, load<V>(t.left.at(k)), vb * load<V>(t.corner.at(k)));
    auto l = LaneJet<V, kOrder>::constant(mul_add(va, high, a1 * low));
    if constexpr (kOrder > 0) {
        l.c[1] = load<V>(t.distance_x.at(k));
        l.c[2] = load<V>(t.distance_y.at(k));
    }
    return l;
}

/// From derivatives in (x, y) of the sector to those in (a, b).
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> in_sector(const RingTables& t, V a, V b,
                                        LaneJet<V, kOrder> jet) {
    LaneJet<V, kOrder> r = jet;
    if constexpr (kOrder > 0) {
        const V x_ab = V::of(t.x_ab), x_a = mul_add(b, x_ab, V::of(t.x_a)),
                x_b = mul_add(a, x_ab, V::of(t.x_a)), y_b = V::of(t.y_b);
        const V along = jet.c[1], across = jet.c[2] * y_b;
        r.c[1] = mul_sub(x_a, along, across);
        r.c[2] = mul_add(x_b, along, across);
        if constexpr (kOrder > 1) {
            const V xx = jet.c[3], xy = jet.c[4] * y_b, yy = jet.c[5] * (y_b * y_b);
            r.c[3] = mul_add(x_a, mul_sub(x_a, xx, xy + xy), yy);
            r.c[4] =
                mul_add(x_ab, along, mul_add(x_a * x_b, xx, mul_sub(x_a - x_b, xy, yy)));
            r.c[5] = mul_add(x_b, mul_add(x_b, xx, xy + xy), yy);
        }
    }
    return r;
}

/// W of a ring, in xi and eta: see RingTables::quotient.
template <int kOrder>
HWY_INLINE LaneJet<P8, kOrder> ring_total(const RingTables& t, P8 xi, P8 eta) {
    const P8 z = mul_add(xi, xi, eta * eta), c1 = P8::of(t.total[1]);
    LaneJet<P8, kOrder> total;
    if (t.n <= 5) {
        total.c[0] = mul_add(z, c1, P8::of(t.total[0]));
        if constexpr (kOrder > 0) {
            const P8 slope = P8::of(t.twice_total_1);
            total.c[1] = slope * xi;
            total.c[2] = slope * eta;
        }
        if constexpr (kOrder > 1) {
            total.c[3] = total.c[5] = c1;
            total.c[4] = P8::zero();
        }
        return total;
    }
    const P8 c2 = P8::of(t.total[2]);
    total.c[0] = mul_add(z, mul_add(z, c2, c1), P8::of(t.total[0]));
    if constexpr (kOrder > 0) {
        const P8 slope = mul_add(z + z, c2, c1), xi2 = xi + xi, eta2 = eta + eta;
        total.c[1] = xi2 * slope;
        total.c[2] = eta2 * slope;
        if constexpr (kOrder > 1) {
            total.c[3] = mul_add(xi2 * xi2, c2, slope);
            total.c[4] = (xi2 + xi2) * eta2 * c2;
            total.c[5] = mul_add(eta2 * eta2, c2, slope);
        }
    }
    return total;
}

/// The sides' parameters in a ring.
template <int kOrder>
class RingH {
    using J = LaneJet<P8, kOrder>;

public:
    /// n_intervals h, its derivatives times the degree.
    /// \param l, l_x, l_y  the distance to the side and its derivatives
    /// \param slope_x, slope_y  the degree times them
    /// \param of_total  1 / W
    static HWY_INLINE J of(const RingTables& t, P8 l, P8 xi, P8 eta, J total, P8 of_total,
                           [[maybe_unused]] P8 l_x, [[maybe_unused]] P8 l_y,
                           [[maybe_unused]] P8 slope_x, [[maybe_unused]] P8 slope_y) {
        // Q times l = centre + xi, over W, then from (xi, eta) to (x, y).
        const J q = t.n <= 5 ? quadratic(t, xi, eta) : polynomial(t, xi, eta);
        J g, r;
        g.c[0] = l * q.c[0];
        if constexpr (kOrder > 0) {
            g.c[1] = mul_add(l, q.c[1], q.c[0]);
            g.c[2] = l * q.c[2];
        }
        if constexpr (kOrder > 1) {
            g.c[3] = mul_add(l, q.c[3], q.c[1]);
            g.c[4] = mul_add(l, q.c[4], q.c[2]);
            g.c[5] = l * q.c[5];
        }
        const J h = quotient(g, total, of_total);
        r.c[0] = h.c[0];
        if constexpr (kOrder > 0) {
            r.c[1] = mul_add(slope_x, h.c[1], slope_y * h.c[2]);
            r.c[2] = mul_sub(slope_y, h.c[1], slope_x * h.c[2]);
        }
        if constexpr (kOrder > 1) {
            const P8 xx = slope_x * l_x, xy = slope_x * l_y, yy = slope_y * l_y;
            r.c[3] = mul_add(xx, h.c[3], mul_add(xy, h.c[4], yy * h.c[5]));
            r.c[4] = mul_add(xy + xy, h.c[3] - h.c[5], (yy - xx) * h.c[4]);
            r.c[5] = mul_add(yy, h.c[3], neg_mul_add(xy, h.c[4], xx * h.c[5]));
        }
        return r;
    }

private:
    /// Q where n <= 5.
    static HWY_INLINE J quadratic(const RingTables& t, P8 xi, P8 eta) {
        const auto coefficient = [&](int p, int r)
                                     OSDX_LAMBDA { return P8::of(t.quotient[p][r]); };
        J q = J::zero();
        const P8 q2 = coefficient(2, 0) * xi, slope = q2 + coefficient(1, 0);
        q.c[0] =
            mul_add(slope, xi, mul_add(eta * eta, coefficient(0, 1), coefficient(0, 0)));
        if constexpr (kOrder > 0) {
            q.c[1] = q2 + slope;
            q.c[2] = eta * P8::of(t.twice_quotient_01);
        }
        if constexpr (kOrder > 1) {
            q.c[3] = coefficient(2, 0);
            q.c[5] = coefficient(0, 1);
        }
        return q;
    }

    static HWY_INLINE J polynomial(const RingTables& t, P8 xi, P8 eta) {
        const P8 e = eta * eta;
        J q = J::zero();
        for (int p = t.n - 3; p >= 0; --p) {  // Horner's scheme in xi
            if constexpr (kOrder > 1) {
                q.c[3] = mul_add(q.c[3], xi, q.c[1]);
                q.c[4] = mul_add(q.c[4], xi, q.c[2]);
                q.c[5] = q.c[5] * xi;
            }
            if constexpr (kOrder > 0) {
                q.c[1] = mul_add(q.c[1], xi, q.c[0]);
                q.c[2] = q.c[2] * xi;
            }
            q.c[0] = mul_add(q.c[0], xi, P8::of(t.quotient[p][0]));
            if (p + 2 <= t.n - 3) {
                const P8 c1 = P8::of(t.quotient[p][1]), c2 = P8::of(t.quotient[p][2]),
                         slope = mul_add(c2 + c2, e, c1);
                q.c[0] = mul_add(mul_add(c2, e, c1), e, q.c[0]);
                if constexpr (kOrder > 0)
                    q.c[2] = mul_add(eta + eta, slope, q.c[2]);
                if constexpr (kOrder > 1)
                    q.c[5] = q.c[5] + mul_add(P8::of(4) * c2, e, slope);
            }
        }
        return q;
    }
};

/// h where there are more sides, from Wachspress' weights of the corners, over the product
/// P = l_0 l_1 / product of all l: 1 for corner 0, l_0/l_2 and l_1/l_-1 beside it, and
/// P/(l_j l_(j+1)) for the others, which are far.
template <int kOrder>
class WindowH {
    using J = LaneJet<P8, kOrder>;
    using S = LaneJet<double, kOrder>;

public:
    HWY_INLINE WindowH(const RingTables& t, double a, double b) : t_(t) {
        S rest = S::zero();
        for (int j = 0; j < t.n; j += kLanes) {
            const J w = far_weight(j, t.far_weight_once.data() + j,
                                   distances<P8, kOrder>(t, j, a, b),
                                   distances<P8, kOrder>(t, j + 1, a, b));
            for (int k = 0; k < S::kSize; ++k)
                rest.c[k] += sum_of_lanes(w.c[k]);
        }
        const S l0 = distances<double, kOrder>(t, 0, a, b),
                l1 = distances<double, kOrder>(t, 1, a, b);
        const S before = l1 / distances<double, kOrder>(t, -1, a, b),
                after = l0 / distances<double, kOrder>(t, 2, a, b);
        S product = l0 * l1;
        S sum = mul_add(product, rest, before + after);
        sum.c[0] += 1;
        const S inverse = S::constant(1) / sum;
        product = product * inverse;
        near_[0] = J::same(before * inverse);
        near_[1] = J::same(inverse);
        near_[2] = J::same(after * inverse);
        rest_ = J::same(rest * product);
        product_ = J::same(product);
    }

    /// The sum of all weights but i and i-1, over the sum of all, for the sides from `first`
    /// on but that in lane 0. Next to the sides at the corner, where h vanishes, every term
    /// is positive.
    HWY_INLINE J h(int first, J l, J l_next) const {
        const J w = far_weight(first, t_.far_weight.at(first), l, l_next);
        J sum = rest_ - product_ * (w + permute(w, t_.previous.data()));
        for (int i = 0; i < 3; ++i) {
            const P8 part = P8::load(t_.near_weight[i].at(first));
            for (int k = 0; k < J::kSize; ++k)
                sum.c[k] = mul_add(part, near_[i].c[k], sum.c[k]);
        }
        return sum;
    }

private:
    /// 1/(l_j l_(j+1)) for the corners that are far, else 0.
    HWY_INLINE J far_weight(int j, const double* is_far, J l, J l_next) const {
        return J::constant(P8::load(is_far)) / (masked(l, j) * masked(l_next, j + 1));
    }
    /// 1 for the sides at the corner, which no far weight has.
    HWY_INLINE J masked(J l, int side) const {
        const P8 part = P8::load(t_.is_far.at(side));
        J r = l * part;
        r.c[0] = r.c[0] + (P8::of(1) - part);
        return r;
    }

    const RingTables& t_;
    J near_[3], rest_, product_;
};

/// Of ribbons i, one a lane: s_i and h_i times n_intervals, and d times their derivatives; and
/// the blends at corner i, where ribbon i ends and the next one starts: beta_i and
/// alpha_(i+1) = 1 - beta_i, zero where that is no ribbon.
template <int kOrder>
struct Ribbons {
    LaneJet<P8, kOrder> s, h, beta, next_alpha;
    HWY_INLINE Ribbons() {}  // an implicit one is not compiled for the instruction set
};

/// h^d
/// \param h  d times its derivatives with it
template <int kOrder>
HWY_INLINE LaneJet<P8, kOrder> power(const RingTables& t, LaneJet<P8, kOrder> h) {
    P8 two = t.degree == 2 ? P8::of(1) : h.c[0];  // h^(d-2)
    for (int k = 3; k < t.degree; ++k)
        two = two * h.c[0];
    const P8 one = two * h.c[0];
    Taylor<P8, kOrder> taylor;
    taylor.c[0] = one * h.c[0];
    if constexpr (kOrder > 0)
        taylor.c[1] = one;
    if constexpr (kOrder > 1)
        taylor.c[2] = two * P8::of(t.power_bend);
    return Inner<P8, kOrder>::of(h).compose(taylor);
}

/// alpha_(i+1) and beta_i, from h^d of sides i and i+1.
template <int kOrder>
HWY_INLINE void set_blends(LaneJet<P8, kOrder> own, LaneJet<P8, kOrder> other,
                           LaneJet<P8, kOrder>& next_alpha, LaneJet<P8, kOrder>& beta) {
    const auto sum = own + other;
    const P8 of_sum = inverse(sum.c[0]);
    next_alpha = quotient(own, sum, of_sum);
    beta.c[0] = other.c[0] * of_sum;
    for (int k = 1; k < sum.kSize; ++k)
        beta.c[k] = -next_alpha.c[k];
}

/// n_intervals s_i, its derivatives times d.
/// \param before  l_(i-1), its derivatives times d; second ones vanish
/// \param around  (l_(i-1) + l_(i+1)) / n_intervals, likewise
template <int kOrder>
HWY_INLINE LaneJet<P8, kOrder> along_side(const RingTables& t, LaneJet<P8, kOrder> before,
                                          LaneJet<P8, kOrder> around) {
    LaneJet<P8, kOrder> s;
    const P8 of_around = inverse(around.c[0]);
    s.c[0] = before.c[0] * of_around;
    if constexpr (kOrder > 0) {
        s.c[1] = neg_mul_add(around.c[1], s.c[0], before.c[1]) * of_around;
        s.c[2] = neg_mul_add(around.c[2], s.c[0], before.c[2]) * of_around;
        if constexpr (kOrder > 1) {
            const P8 scale = of_around * P8::of(-t.of_degree);
            s.c[3] = around.c[1] * s.c[1] * scale;
            s.c[4] = mul_add(around.c[1], s.c[2], around.c[2] * s.c[1]) * scale;
            s.c[5] = around.c[2] * s.c[2] * scale;
        }
    }
    return s;
}

/// What follows from l and from h.
/// \param l, first  distances, to side first + m in lane m
template <int kOrder>
HWY_INLINE void set_lanes(const RingTables& t, int first, P8 l, Ribbons<kOrder>& r) {
    using J = LaneJet<P8, kOrder>;
    // First what all else has to wait for.
    const J own = power(t, r.h);
    set_blends(own, permute(own, t.next.data()), r.next_alpha, r.beta);
    J before, around;
    before.c[0] = permute(l, t.previous.data());
    around.c[0] = mul_add(P8::of(t.sum_slope), l, P8::of(t.sum_value));
    if constexpr (kOrder > 0) {
        before.c[1] = P8::load(t.slope_x.at(first - 1));
        before.c[2] = P8::load(t.slope_y.at(first - 1));
        around.c[1] = P8::load(t.around_x.at(first));
        around.c[2] = P8::load(t.around_y.at(first));
    }
    r.s = along_side(t, before, around);
}

/// Zero in lanes where the mask is.
template <int kOrder>
HWY_INLINE LaneJet<P8, kOrder> where(P8 mask, LaneJet<P8, kOrder> x) {
    for (int k = 0; k < x.kSize; ++k)
        x.c[k] = if_at_least(mask, P8::of(1), x.c[k], P8::zero());
    return x;
}

/// Of a ring, ribbon m in lane m.
template <int kOrder>
HWY_INLINE Ribbons<kOrder> ring_ribbons(const RingTables& t, const DomainPoint& p) {
    Ribbons<kOrder> r;
    const int first = t.n - p.sector;
    const P8 l = distances<P8, 0>(t, first, p.a, p.b).c[0], a = P8::of(p.a),
             b = P8::of(p.b), xi = l - P8::of(t.centre),
             eta = mul_add(
                 mul_add(b, P8::load(t.eta_ab.at(first)), P8::load(t.eta_a.at(first))), a,
                 b * P8::load(t.eta_b.at(first)));
    const auto total = ring_total<kOrder>(t, xi, eta);
    const P8 of_total = P8::of(1 / first_lane(total.c[0]));
    const auto load = [&](const detail::SideTable& table)
                          OSDX_LAMBDA { return P8::load(table.at(first)); };
    r.h = RingH<kOrder>::of(t, l, xi, eta, total, of_total, load(t.distance_x),
                            load(t.distance_y), load(t.slope_x), load(t.slope_y));
    set_lanes<kOrder>(t, first, l, r);
    return r;
}

/// Of a window, from the sector of the point on: ribbon first + m in lane m.
template <int kOrder>
HWY_INLINE Ribbons<kOrder> window_ribbons(const RingTables& t, const DomainPoint& p,
                                          const WindowH<kOrder>& h, int first) {
    Ribbons<kOrder> r;
    const auto l = distances<P8, kOrder>(t, first, p.a, p.b);
    r.h = h.h(first, l, distances<P8, kOrder>(t, first + 1, p.a, p.b)) *
          P8::of(t.n_intervals);
    for (int k = 1; k < r.h.kSize; ++k)
        r.h.c[k] = r.h.c[k] * P8::of(t.degree);
    set_lanes<kOrder>(t, first, l.c[0], r);
    alignas(64) double is_ribbon[kLanes];
    for (int m = 0; m < kLanes; ++m)
        is_ribbon[m] = first + m < t.n ? t.is_ribbon[m] : 0.0;
    // Whatever the other lanes hold, infinities included.
    const P8 mask = P8::load(is_ribbon);
    r.s = where(mask, r.s);
    r.beta = where(mask, r.beta);
    r.next_alpha = where(permute(mask, t.next.data()), r.next_alpha);
    return r;
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_RIBBONS_INL_H_
