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

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Registers go by value everywhere: what has an address costs compilers dear, those that
// instrument every access above all.

/// kN doubles in as many registers as that takes, so that kernels are the same everywhere.
template <int kN, bool kFits = (hn::MaxLanes(hn::CappedTag<double, kN>()) == kN)>
struct Pack;

/// In one register.
template <int kN>
struct Pack<kN, true> {
    using D = hn::CappedTag<double, kN>;
    static constexpr int kParts = 1, kLanes = kN;
    hn::Vec<D> v;

    HWY_INLINE static Pack of(double x) { return {hn::Set(D(), x)}; }
    HWY_INLINE static Pack zero() { return {hn::Zero(D())}; }
    HWY_INLINE static Pack load(const double* from) { return {hn::LoadU(D(), from)}; }
    HWY_INLINE static Pack load(const float* from) {
        return {hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), from))};
    }
    /// from[0] from[1] from[0] from[1] ..
    HWY_INLINE static Pack load_pairs(const double* from) {
        return {hn::LoadDup128(D(), from)};
    }
    /// a b a b ..
    HWY_INLINE static Pack alternating(double a, double b) {
        return {hn::OddEven(hn::Set(D(), b), hn::Set(D(), a))};
    }
    /// a[0] b[0] a[1] b[1] .., of kN values each that can be read.
    template <class T>
    HWY_INLINE static Pack load_alternating(const T* a, const T* b) {
#if HWY_TARGET <= HWY_AVX3
        if constexpr (kN == 8 && sizeof(T) == 4) {
            const hn::Rebind<T, D> d;
            const auto order = _mm256_setr_epi32(0, 8, 1, 9, 2, 10, 3, 11);
            return {hn::PromoteTo(D(),
                                  hn::Vec<decltype(d)>{_mm256_permutex2var_ps(
                                      hn::LoadU(d, a).raw, order, hn::LoadU(d, b).raw)})};
        } else if constexpr (kN == 8) {
            const auto order = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
            return {hn::Vec<D> {
                _mm512_permutex2var_pd(hn::LoadU(D(), a).raw, order,
                                       hn::LoadU(D(), b).raw)
            }};
        }
#endif
        T both[kN];
        for (int i = 0; i < kN; ++i)
            both[i] = (i % 2 == 0 ? a : b)[i / 2];
        return load(both);
    }
    HWY_INLINE void store(double* to) const {
        hn::StoreU(v, D(), to);
    }

    friend HWY_INLINE Pack operator+(Pack a, Pack b) {
        return {hn::Add(a.v, b.v)};
    }
    friend HWY_INLINE Pack operator-(Pack a, Pack b) {
        return {hn::Sub(a.v, b.v)};
    }
    friend HWY_INLINE Pack operator*(Pack a, Pack b) {
        return {hn::Mul(a.v, b.v)};
    }
    friend HWY_INLINE Pack operator/(Pack a, Pack b) {
        return {hn::Div(a.v, b.v)};
    }
    friend HWY_INLINE Pack operator-(Pack a) {
        return {hn::Neg(a.v)};
    }
    /// a b + c
    friend HWY_INLINE Pack mul_add(Pack a, Pack b, Pack c) {
        return {hn::MulAdd(a.v, b.v, c.v)};
    }
    /// a b - c
    friend HWY_INLINE Pack mul_sub(Pack a, Pack b, Pack c) {
        return {hn::MulSub(a.v, b.v, c.v)};
    }
    /// c - a b
    friend HWY_INLINE Pack neg_mul_add(Pack a, Pack b, Pack c) {
        return {hn::NegMulAdd(a.v, b.v, c.v)};
    }
    /// 1 / a to an ulp or two.
    /// \pre a is neither 0 nor denormal, else it may be anything
    friend HWY_INLINE Pack inverse(Pack a) {
#if HWY_TARGET <= HWY_AVX3
        // By Newton's method from 14 bits: a division of wide registers takes as long as many
        // products, and there is but one at a time.
        if constexpr (kN == 8) {
            const auto one = hn::Set(D(), 1.0);
            hn::Vec<D> x{_mm512_rcp14_pd(a.v.raw)};
            x = hn::MulAdd(x, hn::NegMulAdd(a.v, x, one), x);
            return {hn::MulAdd(x, hn::NegMulAdd(a.v, x, one), x)};
        }
#endif
        return of(1) / a;
    }
    friend HWY_INLINE Pack floor(Pack a) {
        return {hn::Floor(a.v)};
    }
    friend HWY_INLINE Pack abs(Pack a) {
        return {hn::Abs(a.v)};
    }
    friend HWY_INLINE Pack min(Pack a, Pack b) {
        return {hn::Min(a.v, b.v)};
    }
    friend HWY_INLINE Pack max(Pack a, Pack b) {
        return {hn::Max(a.v, b.v)};
    }
    /// x >= least ? yes : no
    friend HWY_INLINE Pack if_at_least(Pack x, Pack least, Pack yes, Pack no) {
        return {hn::IfThenElse(hn::Ge(x.v, least.v), yes.v, no.v)};
    }
    friend HWY_INLINE double sum_of_lanes(Pack a) {
        return hn::GetLane(hn::SumOfLanes(D(), a.v));
    }
    /// Lane i of the result is lane index[i].
    friend HWY_INLINE Pack permute(Pack a, const std::int64_t* index) {
        return {hn::TableLookupLanes(a.v, hn::SetTableIndices(D(), index))};
    }
};

/// In two halves.
template <int kN>
struct Pack<kN, false> {
    using Half = Pack<kN / 2>;
    static constexpr int kParts = 2 * Half::kParts, kLanes = kN;
    Half lo, hi;

    HWY_INLINE static Pack of(double x) { return {Half::of(x), Half::of(x)}; }
    HWY_INLINE static Pack zero() { return {Half::zero(), Half::zero()}; }
    template <class T>
    HWY_INLINE static Pack load(const T* from) {
        return {Half::load(from), Half::load(from + kN / 2)};
    }
    HWY_INLINE void store(double* to) const {
        lo.store(to);
        hi.store(to + kN / 2);
    }

    friend HWY_INLINE Pack operator+(Pack a, Pack b) {
        return {a.lo + b.lo, a.hi + b.hi};
    }
    friend HWY_INLINE Pack operator-(Pack a, Pack b) {
        return {a.lo - b.lo, a.hi - b.hi};
    }
    friend HWY_INLINE Pack operator*(Pack a, Pack b) {
        return {a.lo * b.lo, a.hi * b.hi};
    }
    friend HWY_INLINE Pack operator/(Pack a, Pack b) {
        return {a.lo / b.lo, a.hi / b.hi};
    }
    friend HWY_INLINE Pack operator-(Pack a) { return {-a.lo, -a.hi}; }
    friend HWY_INLINE Pack mul_add(Pack a, Pack b, Pack c) {
        return {mul_add(a.lo, b.lo, c.lo), mul_add(a.hi, b.hi, c.hi)};
    }
    friend HWY_INLINE Pack mul_sub(Pack a, Pack b, Pack c) {
        return {mul_sub(a.lo, b.lo, c.lo), mul_sub(a.hi, b.hi, c.hi)};
    }
    friend HWY_INLINE Pack neg_mul_add(Pack a, Pack b, Pack c) {
        return {neg_mul_add(a.lo, b.lo, c.lo), neg_mul_add(a.hi, b.hi, c.hi)};
    }
    friend HWY_INLINE Pack inverse(Pack a) { return {inverse(a.lo), inverse(a.hi)}; }
    friend HWY_INLINE Pack floor(Pack a) { return {floor(a.lo), floor(a.hi)}; }
    friend HWY_INLINE Pack abs(Pack a) { return {abs(a.lo), abs(a.hi)}; }
    friend HWY_INLINE Pack min(Pack a, Pack b) {
        return {min(a.lo, b.lo), min(a.hi, b.hi)};
    }
    friend HWY_INLINE Pack max(Pack a, Pack b) {
        return {max(a.lo, b.lo), max(a.hi, b.hi)};
    }
    friend HWY_INLINE Pack if_at_least(Pack x, Pack least, Pack yes, Pack no) {
        return {if_at_least(x.lo, least.lo, yes.lo, no.lo),
                if_at_least(x.hi, least.hi, yes.hi, no.hi)};
    }
    friend HWY_INLINE double sum_of_lanes(Pack a) { return sum_of_lanes(a.lo + a.hi); }
    friend HWY_INLINE Pack permute(Pack a, const std::int64_t* index) {
        alignas(64) double from[kN], to[kN];
        a.store(from);
        for (int i = 0; i < kN; ++i)
            to[i] = from[index[i]];
        return load(to);
    }
};

/// The lanes of `last` from `first` on, before them those of a.
template <int kN>
HWY_INLINE Pack<kN> last_from(int first, Pack<kN> last, Pack<kN> a) {
    if constexpr (Pack<kN>::kParts == 1)
        return {hn::IfThenElse(hn::FirstN(typename Pack<kN>::D(), first), a.v, last.v)};
    else
        return {last_from(first, last.lo, a.lo),
                last_from(first - kN / 2, last.hi, a.hi)};
}

/// a_0 + a_1, a_2 + a_3 .. of eight in one register.
template <int kN>
HWY_INLINE Pack<kN / 2> sums_of_pairs(Pack<kN> a) {
    constexpr std::int64_t kEven[] = {0, 2, 4, 6, 0, 2, 4, 6};
    // Not all targets have these functions.
    return {LowerHalf(permute(a + Pack<kN>{Shuffle01(a.v)}, kEven).v)};
}

HWY_INLINE double mul_add(double a, double b, double c) {
    return a * b + c;
}
HWY_INLINE double neg_mul_add(double a, double b, double c) {
    return c - a * b;
}
/// -a b
template <int kN>
HWY_INLINE Pack<kN> neg_mul(Pack<kN> a, Pack<kN> b) {
    return neg_mul_add(a, b, Pack<kN>::zero());
}

template <int kN>
HWY_INLINE double first_lane(Pack<kN> a) {
    if constexpr (Pack<kN>::kParts == 1)
        return hn::GetLane(a.v);
    else
        return first_lane(a.lo);
}

/// One number as V: that, or in all lanes.
template <class V>
HWY_INLINE V number(double x) {
    return V::of(x);
}
template <>
HWY_INLINE double number<double>(double x) {
    return x;
}
template <class V>
HWY_INLINE V load(const double* from) {
    return V::load(from);
}
template <>
HWY_INLINE double load<double>(const double* from) {
    return *from;
}

/// What Jet is (eval/bases/jet.h), in registers and for orders up to 2: a Taylor polynomial with
/// the coefficients f, f_x, f_y, f_xx/2, f_xy, f_yy/2.
template <class V, int kOrder>
struct LaneJet {
    static constexpr int kSize = (kOrder + 1) * (kOrder + 2) / 2;
    V c[kSize];

    HWY_INLINE static LaneJet constant(V value) {
        LaneJet r;
        for (int k = 1; k < kSize; ++k)
            r.c[k] = number<V>(0);
        r.c[0] = value;
        return r;
    }
    HWY_INLINE static LaneJet zero() { return constant(number<V>(0)); }
    /// The same in all lanes.
    HWY_INLINE static LaneJet same(LaneJet<double, kOrder> x) {
        LaneJet r;
        for (int k = 0; k < kSize; ++k)
            r.c[k] = number<V>(x.c[k]);
        return r;
    }

    friend HWY_INLINE LaneJet operator+(LaneJet a, LaneJet b) {
        for (int k = 0; k < kSize; ++k)
            a.c[k] = a.c[k] + b.c[k];
        return a;
    }
    friend HWY_INLINE LaneJet operator-(LaneJet a, LaneJet b) {
        for (int k = 0; k < kSize; ++k)
            a.c[k] = a.c[k] - b.c[k];
        return a;
    }
    friend HWY_INLINE LaneJet operator*(LaneJet a, V s) {
        for (int k = 0; k < kSize; ++k)
            a.c[k] = a.c[k] * s;
        return a;
    }
    friend HWY_INLINE LaneJet operator*(LaneJet a, LaneJet b) {
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
    friend HWY_INLINE LaneJet mul_add(LaneJet a, LaneJet b, LaneJet sum) {
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
    friend HWY_INLINE LaneJet quotient(LaneJet a, LaneJet b, V inverse) {
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
    friend HWY_INLINE LaneJet operator/(LaneJet a, LaneJet b) {
        return quotient(a, b, number<V>(1) / b.c[0]);
    }
    friend HWY_INLINE LaneJet permute(LaneJet x, const std::int64_t* index) {
        for (int k = 0; k < kSize; ++k)
            x.c[k] = permute(x.c[k], index);
        return x;
    }
};

#define OSDX_TURN HWY_INLINE
#include "eval/turn-inl.h"
#undef OSDX_TURN

/// Derivatives in variables that are turned against others.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> turned(V cos, V sin, LaneJet<V, kOrder> jet) {
    turn_derivatives<kOrder, V>(cos, sin, jet.c);
    return jet;
}

/// Taylor coefficients of a function of one variable.
template <class V, int kOrder>
struct Taylor {
    V c[kOrder + 1];
};

/// A jet to put into functions of one variable.
template <class V, int kOrder>
struct Inner {
    V c[LaneJet<V, kOrder>::kSize];  // of them c[0] is not used
    V square[3];                     // what second derivatives need

    /// Of the variable x. What is given for f' and f''/2 are these over `first` and `second`.
    HWY_INLINE static Inner of(LaneJet<V, kOrder> x, double first = 1,
                               double second = 1) {
        Inner r;
        if constexpr (kOrder > 0) {
            for (int k = 1; k < LaneJet<V, kOrder>::kSize; ++k)
                r.c[k] = number<V>(first) * x.c[k];
        }
        if constexpr (kOrder > 1) {
            const V along_x = number<V>(second) * x.c[1],
                    along_y = number<V>(second) * x.c[2];
            r.square[0] = along_x * x.c[1];
            r.square[1] = number<V>(2) * along_x * x.c[2];
            r.square[2] = along_y * x.c[2];
        }
        return r;
    }
    HWY_INLINE LaneJet<V, kOrder> compose(Taylor<V, kOrder> f) const {
        LaneJet<V, kOrder> r;
        r.c[0] = f.c[0];
        if constexpr (kOrder > 0) {
            r.c[1] = f.c[1] * c[1];
            r.c[2] = f.c[1] * c[2];
        }
        if constexpr (kOrder > 1) {
            for (int k = 0; k < 3; ++k)
                r.c[3 + k] = mul_add(f.c[2], square[k], f.c[1] * c[3 + k]);
        }
        return r;
    }
    /// Of f(constant - x).
    HWY_INLINE LaneJet<V, kOrder> compose_mirrored(Taylor<V, kOrder> f) const {
        LaneJet<V, kOrder> r;
        r.c[0] = f.c[0];
        if constexpr (kOrder > 0) {
            r.c[1] = neg_mul(f.c[1], c[1]);
            r.c[2] = neg_mul(f.c[1], c[2]);
        }
        if constexpr (kOrder > 1) {
            for (int k = 0; k < 3; ++k)
                r.c[3 + k] = neg_mul_add(f.c[1], c[3 + k], f.c[2] * square[k]);
        }
        return r;
    }
};

/// The same for f(x) times a factor: its products with the derivatives of x serve all f.
template <class V, int kOrder>
struct BlendedInner {
    LaneJet<V, kOrder> factor;
    LaneJet<V, kOrder> first;  // factor (x - value of x)
    V second[3];               // factor (x - value of x)^2

    HWY_INLINE static BlendedInner of(Inner<V, kOrder> x, LaneJet<V, kOrder> factor) {
        BlendedInner r;
        r.factor = factor;
        const auto& f = factor.c;
        if constexpr (kOrder > 0) {
            r.first.c[1] = x.c[1] * f[0];
            r.first.c[2] = x.c[2] * f[0];
        }
        if constexpr (kOrder > 1) {
            r.first.c[3] = mul_add(x.c[3], f[0], x.c[1] * f[1]);
            r.first.c[4] = mul_add(x.c[4], f[0], mul_add(x.c[2], f[1], x.c[1] * f[2]));
            r.first.c[5] = mul_add(x.c[5], f[0], x.c[2] * f[2]);
            for (int k = 0; k < 3; ++k)
                r.second[k] = x.square[k] * f[0];
        }
        return r;
    }
    /// Of constant - x.
    HWY_INLINE static BlendedInner of_mirrored(Inner<V, kOrder> x,
                                               LaneJet<V, kOrder> factor) {
        BlendedInner r;
        r.factor = factor;
        const auto& f = factor.c;
        if constexpr (kOrder > 0) {
            r.first.c[1] = neg_mul(x.c[1], f[0]);
            r.first.c[2] = neg_mul(x.c[2], f[0]);
        }
        if constexpr (kOrder > 1) {
            r.first.c[3] = neg_mul_add(x.c[3], f[0], neg_mul(x.c[1], f[1]));
            r.first.c[4] = neg_mul_add(x.c[4], f[0],
                                       neg_mul_add(x.c[2], f[1], neg_mul(x.c[1], f[2])));
            r.first.c[5] = neg_mul_add(x.c[5], f[0], neg_mul(x.c[2], f[2]));
            for (int k = 0; k < 3; ++k)
                r.second[k] = x.square[k] * f[0];
        }
        return r;
    }
    HWY_INLINE LaneJet<V, kOrder> compose(Taylor<V, kOrder> f) const {
        LaneJet<V, kOrder> r;
        r.c[0] = f.c[0] * factor.c[0];
        if constexpr (kOrder > 0) {
            r.c[1] = mul_add(f.c[1], first.c[1], f.c[0] * factor.c[1]);
            r.c[2] = mul_add(f.c[1], first.c[2], f.c[0] * factor.c[2]);
        }
        if constexpr (kOrder > 1) {
            for (int k = 3; k < 6; ++k)
                r.c[k] = mul_add(f.c[2], second[k - 3],
                                 mul_add(f.c[1], first.c[k], f.c[0] * factor.c[k]));
        }
        return r;
    }
};

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_LANES_INL_H_
