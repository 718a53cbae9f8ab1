// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_RIBBON_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_RIBBON_SUMS_INL_H_
#undef OSDX_EVAL_RIBBON_SUMS_INL_H_
#else
#define OSDX_EVAL_RIBBON_SUMS_INL_H_
#endif

#include <algorithm>

#include "eval/kernels/points-inl.h"
#include "eval/kernels/ribbon_weights-inl.h"

// Sums over the control points of EV and EF patches inside.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

/// Control points in lanes x, y, z, 1, so that the sum of the weights is beside the sums of
/// weights times points, and constants come out as such. Where ribbons fill a wide register two
/// points go into one, x x y y z z 1 1, and one load puts the weights of two sectors to them.
/// \tparam kChecked  as of PointReader
template <class T, bool kChecked, int kPoints = P8::kParts == 1 ? 2 : 1>
class PolygonPoints {
public:
    static constexpr int kAtOnce = kPoints;
    using V = Pack<4 * kAtOnce>;
    using Reader = PointReader<V, T, kChecked>;

    HWY_INLINE explicit PolygonPoints(const PointSum<T>& sum) : read_(sum) {}

    HWY_INLINE V operator()(Index a, [[maybe_unused]] Index b) const {
        if constexpr (kAtOnce == 1) {
            return last_from(3, V::of(1), read_(a));
        } else {
            T last_a[V::kLanes], last_b[V::kLanes];
            return last_from(
                6, V::of(1),
                V::load_alternating(read_.at(a, last_a), read_.at(b, last_b)));
        }
    }
    /// Zero in lanes of another point.
    HWY_INLINE V operator()(Index a) const {
        if constexpr (kAtOnce == 1) {
            return (*this)(a, a);
        } else {
            constexpr T kZero[V::kLanes] = {};
            constexpr double kOne[] = {0, 0, 0, 0, 0, 0, 1, 0};
            T last[V::kLanes];
            return last_from(6, V::load(kOne),
                             V::load_alternating(read_.at(a, last), kZero));
        }
    }
    /// The weights in lanes of one or two sectors.
    HWY_INLINE static V weights(const double* w) {
        if constexpr (kAtOnce == 1)
            return V::of(*w);
        else
            return V::load_pairs(w);
    }
    /// The weights of two points of one sector.
    HWY_INLINE static V weights(const double* a, const double* b) {
        return V::alternating(*a, *b);
    }
    template <int kOrder>
    HWY_INLINE static LaneJet<Quad, kOrder> total(LaneJet<V, kOrder> sums) {
        LaneJet<Quad, kOrder> r;
        for (int k = 0; k < r.kSize; ++k) {
            if constexpr (kAtOnce == 1)
                r.c[k] = sums.c[k];
            else
                r.c[k] = sums_of_pairs(sums.c[k]);
        }
        return r;
    }

private:
    Reader read_;
};

template <class Points, int kOrder, class V>
HWY_INLINE LaneJet<V, kOrder> added(LaneJet<V, kOrder> to, const double* w, V point) {
    for (int r = 0; r < to.kSize; ++r)
        to.c[r] = mul_add(Points::weights(w + r * kLanes), point, to.c[r]);
    return to;
}

/// Adds a block of weights times the points of the sectors start, start + 1, .. modulo n.
/// \tparam kInner, kSpoke  points of each sector and spoke; or both are 0
template <class Points, int kInner, int kSpoke, int kOrder, class T, class V>
HWY_INLINE LaneJet<V, kOrder> with_block(LaneJet<V, kOrder> sum, const RingTables& t,
                                         bool is_ev, const Weights& weights,
                                         const PointSum<T>& points, int start) {
    using Jet = LaneJet<V, kOrder>;
    const Points read(points);
    const int n = t.n, n_lanes = t.n_lanes(), d1 = t.degree - 1,
              n_spoke = kInner > 0 ? kSpoke
                        : is_ev    ? d1
                                   : 0,
              n_inner = kInner > 0 ? kInner
                        : is_ev    ? d1 * d1
                                   : t.degree * t.degree;
    const Index *const spokes = points.points + is_ev, *const sectors =
                                                           spokes + n * n_spoke;
    // Two sums, so that additions need not wait for each other.
    Jet even = sum, odd = Jet::zero();
    const auto add_sectors = [&](int m) OSDX_LAMBDA {
        const int first = start + m < n ? start + m : start + m - n,
                  second = first + 1 < n ? first + 1 : 0;
        const double* w = weights.values + m;
        const auto add_points = [&](const Index* of_first, const Index* of_second,
                                    int n_points) OSDX_LAMBDA {
            int k = 0;
            for (; k + 2 <= n_points; k += 2, w += 2 * Jet::kSize * kLanes) {
                even = added<Points>(even, w, read(of_first[k], of_second[k]));
                odd = added<Points>(odd, w + Jet::kSize * kLanes,
                                    read(of_first[k + 1], of_second[k + 1]));
            }
            if (k < n_points) {
                even = added<Points>(even, w, read(of_first[k], of_second[k]));
                w += Jet::kSize * kLanes;
            }
        };
        add_points(sectors + first * n_inner, sectors + second * n_inner, n_inner);
        add_points(spokes + first * n_spoke, spokes + second * n_spoke, n_spoke);
        if (is_ev)
            odd = added<Points>(odd, w, read(points.points[0], points.points[0]));
    };
    int m = 0;
    for (; m + Points::kAtOnce <= n_lanes; m += Points::kAtOnce)
        add_sectors(m);
    if constexpr (Points::kAtOnce == 2) {
        if (m < n_lanes) {
            // Two points of the sector that is left at a time.
            constexpr int kStride = Jet::kSize * kLanes;
            const int sector = start + m < n ? start + m : start + m - n;
            const double* w = weights.values + m;
            const auto point = [&](int k) OSDX_LAMBDA {
                return k < n_inner             ? sectors[sector * n_inner + k]
                       : k < n_inner + n_spoke ? spokes[sector * n_spoke + k - n_inner]
                                               : points.points[0];
            };
            const int n_points = n_inner + n_spoke + is_ev;
            int k = 0;
            for (; k + 2 <= n_points; k += 2, w += 2 * kStride) {
                const V p = read(point(k), point(k + 1));
                for (int r = 0; r < Jet::kSize; ++r)
                    even.c[r] =
                        mul_add(Points::weights(w + r * kLanes, w + kStride + r * kLanes),
                                p, even.c[r]);
            }
            if (k < n_points)  // the weights beside it are finite
                odd = added<Points>(odd, w, read(point(k)));
        }
    }
    return even + odd;
}

/// The same for any degree, faster for cubic ones.
template <class Points, int kOrder, class T, class V>
HWY_INLINE LaneJet<V, kOrder> with_any_block(LaneJet<V, kOrder> sum, const RingTables& t,
                                             bool is_ev, const Weights& weights,
                                             const PointSum<T>& points, int start) {
    if (t.degree != 3)
        return with_block<Points, 0, 0>(sum, t, is_ev, weights, points, start);
    if (is_ev)
        return with_block<Points, 4, 2>(sum, t, true, weights, points, start);
    return with_block<Points, 9, 0>(sum, t, false, weights, points, start);
}

/// Windows of weights on their way to sums.
template <int kOrder, class T>
struct WindowSink {
    using Points = PolygonPoints<T, true>;
    const RingTables& tables;
    bool is_ev;
    const PointSum<T>& points;
    LaneJet<typename Points::V, kOrder> sum;

    static void take(const WeightSink& sink, const Weights& weights, int start) {
        auto& self = *static_cast<WindowSink*>(sink.state);
        self.sum = with_any_block<Points>(self.sum, self.tables, self.is_ev, weights,
                                          self.points, start);
    }
};

/// Calls take(points) with a copy of the points of a ring that can be read at the end, too.
template <class T, class Take>
HWY_NOINLINE void with_copy(const PointSum<T>& sum, int n, Take&& take) {
    T values[detail::kSumChannels * detail::kMostManyPoints + kLanes];
    Index points[detail::kMostManyPoints];
    T* to = values;
    for (int i = 0; i < n; ++i) {
        const std::size_t at = std::size_t(sum.points[i]) * sum.stride;
        for (std::size_t k = at; k < at + detail::kSumChannels; ++k)
            *to++ = k < sum.n_values ? sum.values[k] : T(0);
        points[i] = Index(i);
    }
    std::fill_n(to, kLanes, T(0));
    to += kLanes;
    take(PointSum<T>{values, std::size_t(to - values), detail::kSumChannels, points});
}

template <int kOrder, class T>
void polygon_sum(const KernelTables& tables, const DomainPoint& p, PointFrame frame,
                 ChartTurn turn, const PointSum<T>& points, PointJet& out) {
    const RingTables& t = *tables.ring;
    const PatchKind kind = tables.kind;
    using Points = PolygonPoints<T, false>;
    using Jet = LaneJet<typename Points::V, kOrder>;
    const bool is_ev = kind == PatchKind::EV;
    Jet sum = Jet::zero();
    if (t.is_ring()) {
        if (HWY_UNLIKELY(!Points::Reader::can_read(points, t.n_points)))
            return with_copy(points, t.n_points, [&](const PointSum<T>& copy) {
                polygon_sum<kOrder>(tables, p, frame, turn, copy, out);
            });
        Weights weights;
        ring_weights<kOrder>(t, kind, p, weights);
        sum = with_any_block<Points>(sum, t, is_ev, weights, points, 0);
    } else {
        WindowSink<kOrder, T> sink{t, is_ev, points, sum};
        window_weights<kOrder>(t, kind, p, {&sink.take, &sink});
        sum = sink.sum;
    }
    const auto total = Points::template total<kOrder>(sum);
    constexpr std::int64_t kLast[] = {3, 3, 3, 3};
    const auto one = permute(total, kLast);
    const auto jet = derivatives(quotient(total, one, Quad::of(1) / one.c[0]));
    put(in_frame(t, p, frame, turn, jet), out);
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_RIBBON_SUMS_INL_H_
