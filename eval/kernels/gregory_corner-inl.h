// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_GREGORY_POINTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_GREGORY_POINTS_INL_H_
#undef OSDX_EVAL_GREGORY_POINTS_INL_H_
#else
#define OSDX_EVAL_GREGORY_POINTS_INL_H_
#endif

#include "eval/bases/gregory.h"
#include "eval/kernels/lanes-inl.h"

// Gregory patches of four sides: see GregoryBasis. All four corners are alike, each in variables
// of its own: x runs from the corner to the next one, y to the one before.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

/// The product of a function of x and one of y.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> tensor(Taylor<V, kOrder> x, Taylor<V, kOrder> y) {
    LaneJet<V, kOrder> r;
    r.c[0] = x.c[0] * y.c[0];
    if constexpr (kOrder > 0) {
        r.c[1] = x.c[1] * y.c[0];
        r.c[2] = x.c[0] * y.c[1];
    }
    if constexpr (kOrder > 1) {
        r.c[3] = x.c[2] * y.c[0];
        r.c[4] = x.c[1] * y.c[1];
        r.c[5] = x.c[0] * y.c[2];
    }
    return r;
}

/// Polynomials of one variable that vanish at 1, as GregoryBasis' weights are made of them.
template <class V, int kOrder>
struct GregoryPolynomials {
    Taylor<V, kOrder> corner;  ///< (1-x)^3
    Taylor<V, kOrder> edge;    ///< 3 x (1-x)^2
    Taylor<V, kOrder> face;    ///< 3 (1-x)^2

    HWY_INLINE explicit GregoryPolynomials(V x) {
        const V three = number<V>(3), y = number<V>(1) - x, y3 = three * y;
        face.c[0] = y3 * y;
        corner.c[0] = y * y * y;
        edge.c[0] = x * face.c[0];
        if constexpr (kOrder > 0) {
            corner.c[1] = -face.c[0];
            edge.c[1] = y3 * neg_mul_add(three, x, number<V>(1));
            face.c[1] = number<V>(-2) * y3;
        }
        if constexpr (kOrder > 1) {
            corner.c[2] = y3;
            edge.c[2] = mul_sub(number<V>(9), x, number<V>(6));
            face.c[2] = three;
        }
    }
};

/// The weights of a corner's points, in the order of GregoryBasis::Point.
template <class V, int kOrder>
struct GregoryCorner {
    LaneJet<V, kOrder> weights[GregoryBasis::kPerCorner];

    HWY_INLINE GregoryCorner(V x, V y) {
        const GregoryPolynomials<V, kOrder> of_x(x), of_y(y);
        weights[GregoryBasis::P] = tensor(of_x.corner, of_y.corner);
        weights[GregoryBasis::EPlus] = tensor(of_x.edge, of_y.corner);
        weights[GregoryBasis::EMinus] = tensor(of_x.corner, of_y.edge);
        // x^2 y / (x + y) and x y^2 / (x + y) by x and y over their sum, which at the corner are
        // those of the bisector.
        const V sum = x + y, least = number<V>(1e-100), half = number<V>(0.5),
                of_sum = inverse(max(sum, least)),
                p = if_at_least(sum, least, x * of_sum, half),
                q = if_at_least(sum, least, y * of_sum, half);
        const auto face = tensor(of_x.face, of_y.face);
        weights[GregoryBasis::FPlus] = blended(sum, p, q) * face;
        weights[GregoryBasis::FMinus] = exchanged(blended(sum, q, p)) * face;
    }

private:
    /// x^2 y / (x + y), where x = sum p and y = sum q.
    static HWY_INLINE LaneJet<V, kOrder> blended(V sum, V p, V q) {
        const V pp = p * p;
        LaneJet<V, kOrder> r;
        r.c[0] = sum * sum * (pp * q);
        if constexpr (kOrder > 0) {
            r.c[1] = sum * (p * q) * (number<V>(2) - p);
            r.c[2] = sum * (pp * p);
        }
        if constexpr (kOrder > 1) {
            r.c[3] = q * q * q;
            r.c[4] = pp * mul_sub(number<V>(-2), p, number<V>(-3));
            r.c[5] = -(pp * p);
        }
        return r;
    }
    /// With x for y and y for x.
    static HWY_INLINE LaneJet<V, kOrder> exchanged(LaneJet<V, kOrder> f) {
        LaneJet<V, kOrder> r = f;
        if constexpr (kOrder > 0) {
            r.c[1] = f.c[2];
            r.c[2] = f.c[1];
        }
        if constexpr (kOrder > 1) {
            r.c[3] = f.c[5];
            r.c[5] = f.c[3];
        }
        return r;
    }
};

/// The sum of what is given in the variables of each corner, in those of the first one.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> sum_of_corners(const LaneJet<V, kOrder>* corners) {
    const auto &a = corners[0].c, &b = corners[1].c, &c = corners[2].c, &d = corners[3].c;
    LaneJet<V, kOrder> r;
    r.c[0] = (a[0] + b[0]) + (c[0] + d[0]);
    if constexpr (kOrder > 0) {
        r.c[1] = (a[1] - b[2]) - (c[1] - d[2]);
        r.c[2] = (a[2] + b[1]) - (c[2] + d[1]);
    }
    if constexpr (kOrder > 1) {
        r.c[3] = (a[3] + b[5]) + (c[3] + d[5]);
        r.c[4] = (a[4] - b[4]) + (c[4] - d[4]);
        r.c[5] = (a[5] + b[3]) + (c[5] + d[3]);
    }
    return r;
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_GREGORY_POINTS_INL_H_
