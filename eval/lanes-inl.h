// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_LANES_INL_H_
#undef OSDX_EVAL_LANES_INL_H_
#else
#define OSDX_EVAL_LANES_INL_H_
#endif

#include <cstdint>
#include <utility>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace osdx::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Lambdas do not take the instruction set from their surroundings.
#undef OSDX_LAMBDA
#define OSDX_LAMBDA HWY_ATTR __attribute__((always_inline))

template <class F, int... kI>
HWY_INLINE void repeat_each(F&& f, std::integer_sequence<int, kI...>) {
    (f(std::integral_constant<int, kI>()), ...);
}
/// f(0) .. f(n - 1); unrolled, so that arrays become registers, where n = kN is known.
template <int kN, class F>
HWY_INLINE void repeat(int n, F&& f) {
    if constexpr (kN >= 0) {
        repeat_each(f, std::make_integer_sequence<int, kN>());
    } else {
        for (int i = 0; i < n; ++i)
            f(i);
    }
}

/// kN numbers in as many registers as that takes, so that kernels are the same everywhere.
template <class T, int kN>
struct Pack {
    using D = hn::CappedTag<T, kN>;
#define OSDX_EACH(expression)                                                      \
    Pack r{Uninitialised()};                                                       \
    repeat<kParts>(kParts, [&](auto i) OSDX_LAMBDA { r.part[i] = (expression); }); \
    return r
    static constexpr int kPart = static_cast<int>(hn::MaxLanes(D()));
    static constexpr int kParts = kN / kPart;
    hn::Vec<D> part[kParts];

    struct Uninitialised {};
    HWY_INLINE explicit Pack(Uninitialised) {}
    HWY_INLINE Pack() : Pack(T(0)) {}
    HWY_INLINE explicit Pack(T x) {
        repeat<kParts>(kParts, [&](auto i) OSDX_LAMBDA { part[i] = hn::Set(D(), x); });
    }
    HWY_INLINE static Pack load(const T* from) {
        OSDX_EACH(hn::LoadU(D(), from + i * kPart));
    }
    /// Of floats.
    HWY_INLINE static Pack load(const float* from) requires(sizeof(T) == sizeof(double)) {
        OSDX_EACH(
            hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), from + i * kPart)));
    }
    HWY_INLINE void store(T* to) const {
        repeat<kParts>(kParts, [&](auto i) OSDX_LAMBDA {
            hn::StoreU(part[i], D(), to + i * kPart);
        });
    }

    friend HWY_INLINE Pack operator+(const Pack& a, const Pack& b) {
        OSDX_EACH(hn::Add(a.part[i], b.part[i]));
    }
    friend HWY_INLINE Pack operator-(const Pack& a, const Pack& b) {
        OSDX_EACH(hn::Sub(a.part[i], b.part[i]));
    }
    friend HWY_INLINE Pack operator*(const Pack& a, const Pack& b) {
        OSDX_EACH(hn::Mul(a.part[i], b.part[i]));
    }
    friend HWY_INLINE Pack operator/(const Pack& a, const Pack& b) {
        OSDX_EACH(hn::Div(a.part[i], b.part[i]));
    }
    friend HWY_INLINE Pack operator-(const Pack& a) {
        OSDX_EACH(hn::Neg(a.part[i]));
    }
    /// a b + c
    friend HWY_INLINE Pack mul_add(const Pack& a, const Pack& b, const Pack& c) {
        OSDX_EACH(hn::MulAdd(a.part[i], b.part[i], c.part[i]));
    }
    /// c - a b
    friend HWY_INLINE Pack neg_mul_add(const Pack& a, const Pack& b, const Pack& c) {
        OSDX_EACH(hn::NegMulAdd(a.part[i], b.part[i], c.part[i]));
    }
    friend HWY_INLINE Pack floor(const Pack& a) {
        OSDX_EACH(hn::Floor(a.part[i]));
    }
    friend HWY_INLINE Pack clamp(const Pack& a, const Pack& lo, const Pack& hi) {
        OSDX_EACH(hn::Min(hn::Max(a.part[i], lo.part[i]), hi.part[i]));
    }
    /// x >= least ? yes : no
    friend HWY_INLINE Pack if_at_least(const Pack& x, const Pack& least, const Pack& yes,
                                       const Pack& no) {
        OSDX_EACH(
            hn::IfThenElse(hn::Ge(x.part[i], least.part[i]), yes.part[i], no.part[i]));
    }
#undef OSDX_EACH

    friend HWY_INLINE T sum_of_lanes(const Pack& a) {
        auto v = a.part[0];
        for (int i = 1; i < kParts; ++i)
            v = hn::Add(v, a.part[i]);
        return hn::GetLane(hn::SumOfLanes(D(), v));
    }
};

/// The sums of the lanes of a and of b.
template <class P>
HWY_INLINE void sum_lanes_of_two(const P& a, const P& b, double* sum) {
    if constexpr (P::kPart >= 4) {
        const typename P::D d;
        auto x = a.part[0], y = b.part[0];
        for (int i = 1; i < P::kParts; ++i) {
            x = Add(x, a.part[i]);
            y = Add(y, b.part[i]);
        }
        // Pairs of lanes a b a b ...
        const auto pairs = Add(InterleaveLower(d, x, y), InterleaveUpper(d, x, y));
        const hn::Half<typename P::D> half;
        const auto halves = Add(LowerHalf(half, pairs), UpperHalf(half, pairs));
        if constexpr (P::kPart == 8) {
            const hn::Half<hn::Half<typename P::D>> quarter;
            StoreU(Add(LowerHalf(quarter, halves), UpperHalf(quarter, halves)), quarter,
                   sum);
        } else {
            StoreU(halves, half, sum);
        }
    } else {
        sum[0] = sum_of_lanes(a);
        sum[1] = sum_of_lanes(b);
    }
}

HWY_INLINE double mul_add(double a, double b, double c) {
    return a * b + c;
}
HWY_INLINE double neg_mul_add(double a, double b, double c) {
    return c - a * b;
}
template <class V>
HWY_INLINE V load(const double* from) {
    return V::load(from);
}
template <>
HWY_INLINE double load<double>(const double* from) {
    return *from;
}

/// Lane i of the result is lane index[i].
HWY_INLINE Pack<double, 8> permute(const Pack<double, 8>& a, const std::int64_t* index) {
    using P = Pack<double, 8>;
    if constexpr (P::kParts == 1) {
        P r;
        r.part[0] = hn::TableLookupLanes(a.part[0], hn::SetTableIndices(P::D(), index));
        return r;
    } else {
        alignas(64) double from[8], to[8];
        a.store(from);
        for (int i = 0; i < 8; ++i)
            to[i] = from[index[i]];
        return P::load(to);
    }
}

/// What Jet is (eval/jet.h), in registers and for orders up to 2: a Taylor polynomial with
/// the coefficients f, f_x, f_y, f_xx/2, f_xy, f_yy/2.
template <class V, int kOrder>
struct LaneJet {
    static constexpr int kSize = (kOrder + 1) * (kOrder + 2) / 2;
    V c[kSize];

    HWY_INLINE LaneJet() : c{} {}
    HWY_INLINE explicit LaneJet(const V& value) : c{} { c[0] = value; }
    /// The same in all lanes.
    HWY_INLINE static LaneJet same(const LaneJet<double, kOrder>& x) {
        LaneJet r;
        repeat<kSize>(kSize, [&](auto k) OSDX_LAMBDA { r.c[k] = V(x.c[k]); });
        return r;
    }

    friend HWY_INLINE LaneJet operator+(const LaneJet& a, const LaneJet& b) {
        LaneJet r;
        repeat<kSize>(kSize, [&](auto k) OSDX_LAMBDA { r.c[k] = a.c[k] + b.c[k]; });
        return r;
    }
    friend HWY_INLINE LaneJet operator-(const LaneJet& a, const LaneJet& b) {
        LaneJet r;
        repeat<kSize>(kSize, [&](auto k) OSDX_LAMBDA { r.c[k] = a.c[k] - b.c[k]; });
        return r;
    }
    friend HWY_INLINE LaneJet operator*(const LaneJet& a, const V& s) {
        LaneJet r;
        repeat<kSize>(kSize, [&](auto k) OSDX_LAMBDA { r.c[k] = a.c[k] * s; });
        return r;
    }
    friend HWY_INLINE LaneJet operator*(const LaneJet& a, const LaneJet& b) {
        LaneJet r;
        r.c[0] = a.c[0] * b.c[0];
        if constexpr (kOrder > 0) {
            r.c[1] = mul_add(a.c[1], b.c[0], a.c[0] * b.c[1]);
            r.c[2] = mul_add(a.c[2], b.c[0], a.c[0] * b.c[2]);
        }
        if constexpr (kOrder > 1) {
            r.c[3] = mul_add(a.c[3], b.c[0], mul_add(a.c[1], b.c[1], a.c[0] * b.c[3]));
            r.c[4] = mul_add(
                a.c[4], b.c[0],
                mul_add(a.c[2], b.c[1], mul_add(a.c[1], b.c[2], a.c[0] * b.c[4])));
            r.c[5] = mul_add(a.c[5], b.c[0], mul_add(a.c[2], b.c[2], a.c[0] * b.c[5]));
        }
        return r;
    }
    /// a b + sum
    friend HWY_INLINE LaneJet mul_add(const LaneJet& a, const LaneJet& b,
                                      const LaneJet& sum) {
        LaneJet r;
        r.c[0] = mul_add(a.c[0], b.c[0], sum.c[0]);
        if constexpr (kOrder > 0) {
            r.c[1] = mul_add(a.c[1], b.c[0], mul_add(a.c[0], b.c[1], sum.c[1]));
            r.c[2] = mul_add(a.c[2], b.c[0], mul_add(a.c[0], b.c[2], sum.c[2]));
        }
        if constexpr (kOrder > 1) {
            r.c[3] = mul_add(a.c[3], b.c[0],
                             mul_add(a.c[1], b.c[1], mul_add(a.c[0], b.c[3], sum.c[3])));
            r.c[4] = mul_add(
                a.c[4], b.c[0],
                mul_add(a.c[2], b.c[1],
                        mul_add(a.c[1], b.c[2], mul_add(a.c[0], b.c[4], sum.c[4]))));
            r.c[5] = mul_add(a.c[5], b.c[0],
                             mul_add(a.c[2], b.c[2], mul_add(a.c[0], b.c[5], sum.c[5])));
        }
        return r;
    }
    /// a / b, given 1 over the value of b.
    friend HWY_INLINE LaneJet quotient(const LaneJet& a, const LaneJet& b,
                                       const V& inverse) {
        LaneJet r;
        r.c[0] = a.c[0] * inverse;
        if constexpr (kOrder > 0) {
            r.c[1] = neg_mul_add(b.c[1], r.c[0], a.c[1]) * inverse;
            r.c[2] = neg_mul_add(b.c[2], r.c[0], a.c[2]) * inverse;
        }
        if constexpr (kOrder > 1) {
            r.c[3] = neg_mul_add(b.c[3], r.c[0], neg_mul_add(b.c[1], r.c[1], a.c[3])) *
                     inverse;
            r.c[4] = neg_mul_add(b.c[4], r.c[0],
                                 neg_mul_add(b.c[2], r.c[1],
                                             neg_mul_add(b.c[1], r.c[2], a.c[4]))) *
                     inverse;
            r.c[5] = neg_mul_add(b.c[5], r.c[0], neg_mul_add(b.c[2], r.c[2], a.c[5])) *
                     inverse;
        }
        return r;
    }
    friend HWY_INLINE LaneJet operator/(const LaneJet& a, const LaneJet& b) {
        return quotient(a, b, V(1.0) / b.c[0]);
    }
};

/// f(x), where taylor[r] = f^(r)/r! at the value of x, and `squares` holds the products of
/// the derivatives of x that second derivatives need.
template <class V, int kOrder>
struct Inner {
    LaneJet<V, kOrder> x;
    V square[3];

    HWY_INLINE explicit Inner(const LaneJet<V, kOrder>& jet) : x(jet) {
        if constexpr (kOrder > 1) {
            square[0] = x.c[1] * x.c[1];
            square[1] = V(2.0) * x.c[1] * x.c[2];
            square[2] = x.c[2] * x.c[2];
        }
    }
    HWY_INLINE LaneJet<V, kOrder> compose(const V* taylor) const {
        LaneJet<V, kOrder> r;
        r.c[0] = taylor[0];
        if constexpr (kOrder > 0) {
            r.c[1] = taylor[1] * x.c[1];
            r.c[2] = taylor[1] * x.c[2];
        }
        if constexpr (kOrder > 1) {
            repeat<3>(3, [&](auto k) OSDX_LAMBDA {
                r.c[3 + k] = mul_add(taylor[2], square[k], taylor[1] * x.c[3 + k]);
            });
        }
        return r;
    }
};

}  // namespace osdx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_LANES_INL_H_
