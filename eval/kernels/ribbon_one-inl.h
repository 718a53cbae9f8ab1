// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_RIBBON_ONE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_RIBBON_ONE_INL_H_
#undef OSDX_EVAL_RIBBON_ONE_INL_H_
#else
#define OSDX_EVAL_RIBBON_ONE_INL_H_
#endif

#include "eval/kernels/ribbon_weights-inl.h"
#include "eval/kernels/ribbons-inl.h"

// The weights of the control points of EV and EF patches inside, up to one common factor, by
// which sums over them are divided in the end: that they sum to one is nobody's care here.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

// ------------------------------------------------------------------ cubic ribbons

/// Six times cubic B-splines, which are sums of truncated powers: f, f'/3 and f''/6, the factors
/// of 3 being in the derivatives of their variables.
template <int kOrder>
using Cubic = Taylor<P8, kOrder>;

template <int kOrder>
HWY_INLINE Cubic<kOrder> cube(P8 y) {
    Cubic<kOrder> r;
    const P8 y2 = y * y;
    r.c[0] = y2 * y;
    if constexpr (kOrder > 0)
        r.c[1] = y2;
    if constexpr (kOrder > 1)
        r.c[2] = y;
    return r;
}
template <int kOrder>
HWY_INLINE Cubic<kOrder> truncated_cube(P8 y) {
    return cube<kOrder>(max(y, P8::zero()));
}
/// a + factor b
template <int kOrder>
HWY_INLINE Cubic<kOrder> plus(Cubic<kOrder> a, double factor, Cubic<kOrder> b) {
    for (int r = 0; r <= kOrder; ++r)
        a.c[r] = mul_add(P8::of(factor), b.c[r], a.c[r]);
    return a;
}

/// The middle function at u from its middle, |u| <= 1: 4 - 6 u^2 + 3 |u|^3.
template <int kOrder>
HWY_INLINE Cubic<kOrder> middle_cubic(P8 u) {
    const P8 size = abs(u), three = P8::of(3);
    Cubic<kOrder> r;
    r.c[0] = mul_add(u * u, mul_sub(three, size, P8::of(6)), P8::of(4));
    if constexpr (kOrder > 0)
        r.c[1] = u * mul_sub(three, size, P8::of(4));
    if constexpr (kOrder > 1)
        r.c[2] = mul_sub(three, size, P8::of(2));
    return r;
}

/// The first two functions of EV ribbons at the distance y = 0..2 from their end.
template <int kOrder>
HWY_INLINE void ev_functions(P8 y, Cubic<kOrder>* functions) {
    functions[0] = truncated_cube<kOrder>(y - P8::of(1));
    functions[1] = plus(cube<kOrder>(y), -4, functions[0]);
}

/// The function in the middle of rows, with u = y - 1: 4 - 6 u^2 + 3 u^3 from 0 on and before it
/// E_2, extended to y^3 (4 - 12 u + 18 u^2). By the powers of u alone that would not vanish at
/// the end, where far ribbons are, many of them.
template <int kOrder>
HWY_INLINE Cubic<kOrder> extended_cubic(P8 y) {
    const P8 one = P8::of(1), u = y - one, y2 = min(y * y, one), y3 = min(y * y * y, one),
             three = P8::of(3), four = P8::of(4);
    const auto select = [u](P8 middle, P8 extended) OSDX_LAMBDA {
        return if_at_least(u, P8::zero(), middle, extended);
    };
    Cubic<kOrder> r;
    r.c[0] = y3 * mul_add(u,
                          select(u * mul_sub(three, u, P8::of(6)),
                                 mul_sub(P8::of(18), u, P8::of(12))),
                          four);
    if constexpr (kOrder > 0)
        r.c[1] = u * y2 * mul_sub(select(three, P8::of(30)), u, four);
    if constexpr (kOrder > 1)
        r.c[2] = select(mul_sub(three, u, P8::of(2)),
                        y * mul_sub(mul_add(P8::of(60), u, P8::of(24)), u, P8::of(2)));
    return r;
}

/// Functions 0..2 of the splines at the distance y = 0..3 from their end.
template <int kOrder>
HWY_INLINE void ef_functions(P8 y, Cubic<kOrder>* functions) {
    const auto three = cube<kOrder>(y), two = truncated_cube<kOrder>(y - P8::of(1)),
               one = truncated_cube<kOrder>(y - P8::of(2));
    functions[0] = one;
    functions[1] = plus(two, -4, one);
    functions[2] = plus(plus(three, -4, two), 6, one);
}

template <bool kEV>
inline constexpr int kCubicIntervals = kEV ? 2 : 3;

/// A parameter of a ribbon, to put it into them.
template <int kOrder>
HWY_INLINE Inner<P8, kOrder> cubic_inner(LaneJet<P8, kOrder> x) {
    return Inner<P8, kOrder>::of(x, 1, 1.0 / 3);
}

/// Rows 0..2 of a ribbon.
template <bool kEV, int kOrder>
HWY_INLINE void cubic_rows(LaneJet<P8, kOrder> h, LaneJet<P8, kOrder>* rows) {
    const P8 y = P8::of(kCubicIntervals<kEV>) - h.c[0];
    Cubic<kOrder> f[3];
    if constexpr (kEV) {
        ev_functions<kOrder>(y, f);
        f[2] = extended_cubic<kOrder>(y);
    } else {
        ef_functions<kOrder>(y, f);
    }
    const auto inner = cubic_inner<kOrder>(h);
    for (int k = 0; k < 3; ++k)
        rows[k] = inner.compose_mirrored(f[k]);
}

/// The columns of one half of a ribbon, from the middle outwards, for EV without the middle one.
/// \param y  from the other end
template <bool kEV, int kOrder>
HWY_INLINE void cubic_half(P8 y, BlendedInner<P8, kOrder> inner,
                           LaneJet<P8, kOrder>* columns) {
    constexpr int kColumns = kEV ? 2 : 3;
    Cubic<kOrder> f[3];
    if constexpr (kEV)
        ev_functions<kOrder>(y, f);
    else
        ef_functions<kOrder>(y, f);
    for (int k = 0; k < kColumns; ++k)
        columns[k] = inner.compose(f[kColumns - 1 - k]);
}

/// For corner i, where ribbon i ends and the next one starts, what lies on either side: rows,
/// and the columns from the middle outwards (for EV without the middle one), blended.
template <bool kEV, int kOrder>
struct CornerBasis {
    static constexpr int kColumns = kEV ? 2 : 3;
    LaneJet<P8, kOrder> columns[kColumns], next_columns[kColumns], rows[3], next_rows[3];
    LaneJet<P8, kOrder> middle;  // of ribbon i, of EV

    HWY_INLINE CornerBasis(const RingTables& t, const Ribbons<kOrder>& ribbons) {
        using J = LaneJet<P8, kOrder>;
        const std::int64_t *next = t.next.data(), *previous = t.previous.data();
        cubic_rows<kEV>(ribbons.h, rows);
        for (int k = 0; k < 3; ++k)
            next_rows[k] = permute(rows[k], next);
        // The first half of a ribbon is the mirror image of the second.
        const J next_s = permute(ribbons.s, next);
        const auto inner = cubic_inner<kOrder>(ribbons.s),
                   next_inner = cubic_inner<kOrder>(next_s);
        cubic_half<kEV>(ribbons.s.c[0], BlendedInner<P8, kOrder>::of(inner, ribbons.beta),
                        columns);
        cubic_half<kEV>(
            P8::of(kCubicIntervals<kEV>) - next_s.c[0],
            BlendedInner<P8, kOrder>::of_mirrored(next_inner, ribbons.next_alpha),
            next_columns);
        if constexpr (kEV) {
            const J alpha = permute(ribbons.next_alpha, previous);
            middle = BlendedInner<P8, kOrder>::of(inner, alpha * ribbons.beta)
                         .compose(middle_cubic<kOrder>(ribbons.s.c[0] - P8::of(1)));
        }
    }
};

template <bool kEV, int kOrder>
HWY_INLINE void cubic_weights(const RingTables& t, const Ribbons<kOrder>& ribbons,
                              Weights& weights) {
    using J = LaneJet<P8, kOrder>;
    const CornerBasis<kEV, kOrder> at(t, ribbons);
    constexpr int kSide = kEV ? 2 : 3, kLast = kSide - 1;
    // The point a steps from side i and b from side i+1 lies in ribbons i and i+1. Rows count
    // from the sides.
    for (int a = 0; a < kSide; ++a) {
        for (int b = 0; b < kSide; ++b)
            weights.put(a * kSide + b,
                        mul_add(at.columns[b], at.rows[kLast - a],
                                at.next_columns[a] * at.next_rows[kLast - b]));
    }
    if constexpr (kEV) {
        // Points of a spoke lie in three; the vertex in all of them.
        for (int b = 0; b < 2; ++b) {
            const J two =
                mul_add(at.middle, at.rows[1 - b], at.next_columns[b] * at.next_rows[2]);
            weights.put(4 + b,
                        two + permute(at.columns[b] * at.rows[2], t.previous.data()));
        }
        weights.put(6, at.middle * at.rows[2]);
    }
}

// ------------------------------------------------------------------ ribbons of any degree

/// Derivatives at u of the uniform B-splines of degree d over one interval, over r!: those
/// of function j in out[j].
template <int kOrder>
HWY_INLINE void uniform_basis(int d, P8 u, Taylor<P8, kOrder>* out) {
    // Values by the recurrence of bspline_basis(), derivatives by differences.
    const P8 u1 = P8::of(1) - u, half = P8::of(0.5);
    P8 b[kMaxDegree + 1];
    b[0] = u1;
    b[1] = u;
    for (int k = 1; k <= d; ++k) {  // b is the basis of degree k
        if (k > 1) {
            const P8 inverse = P8::of(1.0 / k);
            b[k] = u * inverse * b[k - 1];
            for (int j = k - 1; j > 0; --j) {
                const P8 left = mul_add(u, inverse, P8::of(double(k - j) / k)),
                         right = mul_add(u1, inverse, P8::of(double(j) / k));
                b[j] = mul_add(left, b[j - 1], right * b[j]);
            }
            b[0] = u1 * inverse * b[0];
        }
        if constexpr (kOrder > 0) {
            if (k == d - 1) {
                out[0].c[1] = -b[0];
                for (int j = 1; j < d; ++j)
                    out[j].c[1] = b[j - 1] - b[j];
                out[d].c[1] = b[d - 1];
            }
        }
        if constexpr (kOrder > 1) {
            if (k == d - 2) {
                for (int j = 0; j <= d; ++j) {
                    P8 sum = P8::zero();
                    if (j < d - 1)
                        sum = half * b[j];
                    if (j >= 1 && j < d)
                        sum = sum - b[j - 1];
                    if (j >= 2)
                        sum = mul_add(half, b[j - 2], sum);
                    out[j].c[2] = sum;
                }
            }
        }
    }
    for (int j = 0; j <= d; ++j)
        out[j].c[0] = b[j];
    if constexpr (kOrder > 1) {
        if (d == 2) {
            out[0].c[2] = out[2].c[2] = half;
            out[1].c[2] = P8::of(-1);
        }
    }
}

/// The same of E_(d-1) in its last interval.
template <int kOrder>
HWY_INLINE Taylor<P8, kOrder> extended_function(const RingTables& t, P8 u) {
    const int d = t.degree;
    P8 c0 = P8::of(t.extended[d - 1]), c1 = P8::zero(), c2 = P8::zero();
    for (int i = d - 2; i >= 0; --i) {
        if constexpr (kOrder > 1)
            c2 = mul_add(c2, u, c1);
        if constexpr (kOrder > 0)
            c1 = mul_add(c1, u, c0);
        c0 = mul_add(c0, u, P8::of(t.extended[i]));
    }
    const P8 v = P8::of(1) - u;
    P8 v2 = P8::of(1);  // v^(d-2)
    for (int k = 2; k < d; ++k)
        v2 = v2 * v;
    const P8 v1 = v2 * v, v0 = v1 * v, slope = P8::of(-d) * v1;
    Taylor<P8, kOrder> out;
    out.c[0] = c0 * v0;
    if constexpr (kOrder > 0)
        out.c[1] = mul_add(c1, v0, c0 * slope);
    if constexpr (kOrder > 1)
        out.c[2] =
            mul_add(c2, v0, mul_add(c1, slope, P8::of(0.5 * d * (d - 1)) * v2 * c0));
    return out;
}

/// Moves n functions to the columns that they stand for: by the interval in each lane.
template <int kOrder>
HWY_INLINE void shift(Taylor<P8, kOrder>* functions, int n, int last_interval,
                      P8 interval) {
    for (int by = 8; by > 0; by /= 2) {
        if (by > last_interval)
            continue;
        const P8 least = P8::of(by);
        for (int j = n - 1; j >= 0; --j) {
            for (int r = 0; r <= kOrder; ++r) {
                const P8 moved = j >= by ? functions[j - by].c[r] : P8::zero();
                functions[j].c[r] =
                    if_at_least(interval, least, moved, functions[j].c[r]);
            }
        }
        interval = if_at_least(interval, least, interval - least, interval);
    }
}

/// A parameter of a ribbon, to put it into functions with their own derivatives.
template <int kOrder>
HWY_INLINE Inner<P8, kOrder> spline_inner(const RingTables& t, LaneJet<P8, kOrder> x) {
    return Inner<P8, kOrder>::of(x, t.of_degree, t.of_degree * t.of_degree);
}

/// Rows 0..d-1 of a ribbon.
template <int kOrder>
HWY_INLINE void spline_rows(const RingTables& t, bool ev, LaneJet<P8, kOrder> x,
                            LaneJet<P8, kOrder>* rows) {
    const int d = t.degree, n_intervals = d - ev;
    const P8 last = P8::of(n_intervals - 1);
    const P8 interval = min(max(floor(x.c[0]), P8::zero()), last);
    const P8 u = x.c[0] - interval;
    Taylor<P8, kOrder> functions[kMaxDegree + 1];
    uniform_basis<kOrder>(d, u, functions);
    if (ev) {
        const auto extended = extended_function<kOrder>(t, u);
        for (int r = 0; r <= kOrder; ++r)
            functions[1].c[r] =
                if_at_least(interval, last, extended.c[r], functions[1].c[r]);
    }
    shift<kOrder>(functions, d, n_intervals - 1, interval);
    const auto inner = spline_inner<kOrder>(t, x);
    for (int k = 0; k < d; ++k)
        rows[k] = inner.compose(functions[k]);
}

/// All columns of a ribbon, blended.
template <int kOrder>
HWY_INLINE void spline_columns(const RingTables& t, bool ev, LaneJet<P8, kOrder> x,
                               LaneJet<P8, kOrder> alpha, LaneJet<P8, kOrder> beta,
                               LaneJet<P8, kOrder>* columns) {
    const int d = t.degree, n_columns = 2 * d - ev, n_intervals = d - ev;
    const P8 interval = min(max(floor(x.c[0]), P8::zero()), P8::of(n_intervals - 1));
    Taylor<P8, kOrder> functions[2 * kMaxDegree];
    uniform_basis<kOrder>(d, x.c[0] - interval, functions);
    for (int j = d + 1; j < n_columns; ++j) {
        for (int r = 0; r <= kOrder; ++r)
            functions[j].c[r] = P8::zero();
    }
    shift<kOrder>(functions, n_columns, n_intervals - 1, interval);
    const auto inner = spline_inner<kOrder>(t, x);
    const auto first_half = BlendedInner<P8, kOrder>::of(inner, alpha),
               second_half = BlendedInner<P8, kOrder>::of(inner, beta);
    for (int j = 0; j < n_columns; ++j)
        columns[j] = (j < d ? first_half : second_half).compose(functions[j]);
    if (ev)
        columns[d - 1] = columns[d - 1] * beta;
}

template <int kOrder>
HWY_INLINE void spline_weights(const RingTables& t, bool ev,
                               const Ribbons<kOrder>& ribbons, Weights& weights) {
    using J = LaneJet<P8, kOrder>;
    const std::int64_t *next = t.next.data(), *previous = t.previous.data();
    const int d = t.degree, m = d - 1;
    J columns[2 * kMaxDegree], rows[kMaxDegree], next_columns[kMaxDegree],
        next_rows[kMaxDegree];
    spline_rows<kOrder>(t, ev, ribbons.h, rows);
    spline_columns<kOrder>(t, ev, ribbons.s, permute(ribbons.next_alpha, previous),
                           ribbons.beta, columns);
    for (int k = 0; k < d; ++k) {
        next_rows[k] = permute(rows[k], next);
        next_columns[k] = permute(columns[k], next);
    }

    int k = 0;
    // The point a steps from side i and b from side i+1 lies in ribbons i and i+1.
    for (int a = ev; a < d; ++a) {
        for (int b = ev; b < d; ++b)
            weights.put(k++, mul_add(columns[d - ev + b], rows[m - a],
                                     next_columns[m - a] * next_rows[m - b]));
    }
    if (ev) {
        // Points of a spoke lie in three; the vertex in all of them.
        for (int b = 1; b < d; ++b) {
            const J two =
                mul_add(columns[m], rows[m - b], next_columns[m - b] * next_rows[m]);
            weights.put(k++, two + permute(columns[m + b] * rows[m], previous));
        }
        weights.put(k, columns[m] * rows[m]);
    }
}

template <int kOrder>
HWY_INLINE void block_weights(const RingTables& t, PatchKind kind,
                              const Ribbons<kOrder>& ribbons, Weights& weights) {
    const bool is_ev = kind == PatchKind::EV;
    if (t.degree != 3)
        spline_weights<kOrder>(t, is_ev, ribbons, weights);
    else if (is_ev)
        cubic_weights<true, kOrder>(t, ribbons, weights);
    else
        cubic_weights<false, kOrder>(t, ribbons, weights);
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_RIBBON_ONE_INL_H_
