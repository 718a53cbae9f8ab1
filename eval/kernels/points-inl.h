// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_POINTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_POINTS_INL_H_
#undef OSDX_EVAL_POINTS_INL_H_
#else
#define OSDX_EVAL_POINTS_INL_H_
#endif

#include "eval/kernels/lanes-inl.h"
#include "eval/kernels/point_kernels.h"

// What the kernels of single points share: how control points are read and jets are written.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

using detail::ChartTurn;
using detail::KernelTables;
using detail::kLanes;
using detail::kManyChannels;
using detail::PointFrame;
using detail::PointJet;
using detail::PointJets;
using detail::PointKernels;
using detail::PointPlaces;
using detail::PointSum;
using detail::RingTables;
using detail::TaylorRows;

using Quad = Pack<4>;
using P8 = Pack<kLanes>;

/// Ribbons in lanes pay where registers are wide enough; elsewhere RibbonBasis goes over the
/// ribbons one by one.
constexpr bool kHasRibbons = P8::kParts <= 2;

/// Reads up to four channels of control points into the first lanes of V, of four lanes or more.
/// In the others there may be anything.
/// \tparam kChecked  whether points may lie at the end of all values, with less behind them than V
///         holds
template <class V, class T, bool kChecked = true>
class PointReader {
public:
    HWY_INLINE explicit PointReader(const PointSum<T>& sum)
        : values_(sum.values),
          n_values_(sum.n_values),
          whole_end_(whole_end(sum)),
          stride_(sum.stride) {}

    HWY_INLINE V operator()(Index point) const {
        T last[V::kLanes];
        return V::load(at(point, last));
    }

    /// Where a point can be read: those at the end of all values are copied to `last`.
    HWY_INLINE const T* at(Index point, [[maybe_unused]] T* last) const {
        const std::size_t at = std::size_t(point) * stride_;
        if constexpr (kChecked) {
            if (HWY_UNLIKELY(at >= whole_end_)) {
                for (std::size_t k = 0; k < V::kLanes; ++k)
                    last[k] = k < 4 && at + k < n_values_ ? values_[at + k] : T(0);
                return last;
            }
        }
        return values_ + at;
    }

    /// Whether none of n points is at the end.
    HWY_INLINE static bool can_read(const PointSum<T>& sum, int n) {
        if (sum.n_values < V::kLanes)
            return false;
        using D = hn::CappedTag<std::uint32_t, 16>;
        const D d;
        auto last = hn::Zero(d);
        for (int i = 0; i < n; i += int(hn::Lanes(d)))
            last = hn::Max(last, hn::MaskedLoad(hn::FirstN(d, n - i), d, sum.points + i));
        const std::size_t end = (sum.n_values - V::kLanes) / sum.stride + 1;
        return hn::AllTrue(d, hn::Lt(last, hn::Set(d, std::uint32_t(end))));
    }

private:
    HWY_INLINE static std::size_t whole_end(const PointSum<T>& sum) {
        return sum.n_values < V::kLanes ? 0 : sum.n_values - (V::kLanes - 1);
    }

    const T* values_;
    std::size_t n_values_, whole_end_, stride_;
};

/// From Taylor coefficients to derivatives.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> derivatives(LaneJet<V, kOrder> jet) {
    if constexpr (kOrder > 1) {
        jet.c[3] = jet.c[3] + jet.c[3];
        jet.c[5] = jet.c[5] + jet.c[5];
    }
    return jet;
}

template <int kOrder>
HWY_INLINE void put(LaneJet<Quad, kOrder> derivatives, PointJet& out) {
    for (int r = 0; r < derivatives.kSize; ++r)
        derivatives.c[r].store(out.value[r]);
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_POINTS_INL_H_
