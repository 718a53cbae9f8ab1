// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/point_kernels.h"

#include <algorithm>

#include "eval/bases/gregory.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/point_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/gregory_corner-inl.h"
#include "eval/kernels/lanes-inl.h"
#include "eval/kernels/ribbon_many-inl.h"
#include "eval/kernels/ribbon_one-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::HWY_NAMESPACE {

using detail::ChartTurn;
using detail::PointFrame;
using detail::PointJet;
using detail::PointJets;
using detail::PointPlaces;
using detail::PointSum;
using detail::TaylorRows;

using Quad = Pack<4>;

/// Ribbons in lanes pay where registers are wide enough; elsewhere PatchBasis goes over the
/// ribbons one by one.
constexpr bool kHasPolygons = P8::kParts <= 2;

// ------------------------------------------------------------------ sums over points

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

// ------------------------------------------------------------------ regular patches

/// The basis at u: derivative r of function j over r! in out[r][j].
template <int kDegree, int kOrder>
HWY_INLINE void uniform_basis(const TaylorRows& taylor, int degree, double u,
                              double (*out)[16]) {
    const int d = kDegree > 0 ? kDegree : degree;
    const int stride = kDegree > 0 ? (kDegree + 4) / 4 * 4 : taylor.stride;
    const Quad v = Quad::of(u - 0.5);
    for (int j = 0; j < stride; j += 4) {
        const double* row = taylor.rows.data() + d * stride + j;
        Quad c0 = Quad::load(row), c1 = Quad::zero(), c2 = Quad::zero();
        for (int r = d - 1; r >= 0; --r) {
            row -= stride;
            if constexpr (kOrder > 1)
                c2 = mul_add(c2, v, c1);
            if constexpr (kOrder > 0)
                c1 = mul_add(c1, v, c0);
            c0 = mul_add(c0, v, Quad::load(row));
        }
        c0.store(out[0] + j);
        if constexpr (kOrder > 0)
            c1.store(out[1] + j);
        if constexpr (kOrder > 1)
            c2.store(out[2] + j);
    }
}

template <int kDegree, int kOrder, class T>
void regular(const TaylorRows& taylor, int degree, double s, double t, ChartTurn turn,
             const PointSum<T>& sum, PointJet& out) {
    const int d = kDegree > 0 ? kDegree : degree;
    alignas(64) double along_s[kOrder + 1][16], along_t[kOrder + 1][16];
    uniform_basis<kDegree, kOrder>(taylor, degree, s, along_s);
    uniform_basis<kDegree, kOrder>(taylor, degree, t, along_t);
    auto jet = LaneJet<Quad, kOrder>::zero();
    const PointReader<Quad, T> read(sum);
    const Index* point = sum.points;
    for (int k = 0; k <= d; ++k) {
        Quad row[kOrder + 1];
        for (int r = 0; r <= kOrder; ++r)
            row[r] = Quad::zero();
        for (int j = 0; j <= d; ++j) {
            const Quad p = read(*point++);
            for (int r = 0; r <= kOrder; ++r)
                row[r] = mul_add(Quad::of(along_s[r][j]), p, row[r]);
        }
        for (int m = 0, c = 0; m <= kOrder; ++m) {
            for (int y = 0; y <= m; ++y, ++c)
                jet.c[c] = mul_add(Quad::of(along_t[y][k]), row[m - y], jet.c[c]);
        }
    }
    put(turned(Quad::of(turn.cos), Quad::of(turn.sin), derivatives(jet)), out);
}

template <class T>
void regular_of_any(const TaylorRows& taylor, int degree, double s, double t, int order,
                    ChartTurn turn, const PointSum<T>& sum, PointJet& out) {
    if (degree == 3) {
        switch (order) {
            case 0:
                return regular<3, 0, T>(taylor, degree, s, t, turn, sum, out);
            case 1:
                return regular<3, 1>(taylor, degree, s, t, turn, sum, out);
            default:
                return regular<3, 2>(taylor, degree, s, t, turn, sum, out);
        }
    }
    switch (order) {
        case 0:
            return regular<0, 0>(taylor, degree, s, t, turn, sum, out);
        case 1:
            return regular<0, 1>(taylor, degree, s, t, turn, sum, out);
        default:
            return regular<0, 2>(taylor, degree, s, t, turn, sum, out);
    }
}

/// The basis at kLanes places at once.
template <int kDegree, int kOrder>
HWY_INLINE void uniform_bases(const TaylorRows& taylor, int degree, P8 u,
                              P8 (*out)[kMaxDegree + 1]) {
    const int d = kDegree > 0 ? kDegree : degree;
    const P8 v = u - P8::of(0.5);
    for (int j = 0; j <= d; ++j) {
        const double* row = taylor.rows.data() + d * taylor.stride + j;
        P8 c0 = P8::of(*row), c1 = P8::zero(), c2 = P8::zero();
        for (int r = d - 1; r >= 0; --r) {
            row -= taylor.stride;
            if constexpr (kOrder > 1)
                c2 = mul_add(c2, v, c1);
            if constexpr (kOrder > 0)
                c1 = mul_add(c1, v, c0);
            c0 = mul_add(c0, v, P8::of(*row));
        }
        out[0][j] = c0;
        if constexpr (kOrder > 0)
            out[1][j] = c1;
        if constexpr (kOrder > 1)
            out[2][j] = c2 + c2;
    }
}

template <int kDegree, int kOrder>
void regular_points(const TaylorRows& taylor, int degree, const double* net,
                    const PointPlaces& at, PointJets& out) {
    const int d = kDegree > 0 ? kDegree : degree;
    P8 along_s[kOrder + 1][kMaxDegree + 1], along_t[kOrder + 1][kMaxDegree + 1];
    uniform_bases<kDegree, kOrder>(taylor, degree, P8::load(at.a), along_s);
    uniform_bases<kDegree, kOrder>(taylor, degree, P8::load(at.b), along_t);
    const P8 cos = P8::load(at.cos), sin = P8::load(at.sin);
    for (int c = 0; c < 3; ++c, ++net) {
        auto jet = LaneJet<P8, kOrder>::zero();
        const double* p = net;
        for (int k = 0; k <= d; ++k) {
            P8 row[kOrder + 1];
            for (int r = 0; r <= kOrder; ++r)
                row[r] = P8::zero();
            for (int j = 0; j <= d; ++j, p += 3) {
                for (int r = 0; r <= kOrder; ++r)
                    row[r] = mul_add(along_s[r][j], P8::of(*p), row[r]);
            }
            for (int m = 0, r = 0; m <= kOrder; ++m) {
                for (int y = 0; y <= m; ++y, ++r)
                    jet.c[r] = mul_add(along_t[y][k], row[m - y], jet.c[r]);
            }
        }
        jet = turned(cos, sin, jet);
        for (int r = 0; r < jet.kSize; ++r)
            jet.c[r].store(out.value[r][c]);
    }
}

template <int kDegree>
void regular_points_of_order(const TaylorRows& taylor, int degree, const double* net,
                             const PointPlaces& at, int order, PointJets& out) {
    switch (order) {
        case 0:
            return regular_points<kDegree, 0>(taylor, degree, net, at, out);
        case 1:
            return regular_points<kDegree, 1>(taylor, degree, net, at, out);
        default:
            return regular_points<kDegree, 2>(taylor, degree, net, at, out);
    }
}

void regular_points_of_any(const TaylorRows& taylor, int degree, const double* net,
                           const PointPlaces& at, int order, PointJets& out) {
    if (degree == 3)
        return regular_points_of_order<3>(taylor, degree, net, at, order, out);
    regular_points_of_order<0>(taylor, degree, net, at, order, out);
}

// ------------------------------------------------------------------ Gregory patches

template <int kOrder, class T>
void gregory(double a, double b, ChartTurn turn, const PointSum<T>& sum, PointJet& out) {
    using J = LaneJet<Quad, kOrder>;
    constexpr int kCorners = 4, kPoints = GregoryBasis::kPerCorner;
    // A corner in each lane.
    alignas(32) const double along[kCorners + 1] = {a, b, 1 - a, 1 - b, a};
    const GregoryCorner<Quad, kOrder> corner(Quad::load(along), Quad::load(along + 1));
    alignas(32) double weights[kPoints][J::kSize][kCorners];
    for (int k = 0; k < kPoints; ++k) {
        for (int r = 0; r < J::kSize; ++r)
            corner.weights[k].c[r].store(weights[k][r]);
    }
    const PointReader<Quad, T> read(sum);
    const Index* point = sum.points;
    J sums[kCorners];
    for (int i = 0; i < kCorners; ++i) {
        sums[i] = J::zero();
        for (int k = 0; k < kPoints; ++k) {
            const Quad p = read(*point++);
            for (int r = 0; r < J::kSize; ++r)
                sums[i].c[r] = mul_add(Quad::of(weights[k][r][i]), p, sums[i].c[r]);
        }
    }
    put(turned(Quad::of(turn.cos), Quad::of(turn.sin),
               derivatives(sum_of_corners<Quad, kOrder>(sums))),
        out);
}

template <class T>
void gregory_of_order(double a, double b, int order, ChartTurn turn,
                      const PointSum<T>& sum, PointJet& out) {
    switch (order) {
        case 0:
            return gregory<0>(a, b, turn, sum, out);
        case 1:
            return gregory<1>(a, b, turn, sum, out);
        default:
            return gregory<2>(a, b, turn, sum, out);
    }
}

/// At some places at once.
template <int kOrder>
void gregory_points(const double* net, const PointPlaces& at, PointJets& out) {
    using J = LaneJet<P8, kOrder>;
    constexpr int kCorners = 4, kPoints = GregoryBasis::kPerCorner;
    const P8 a = P8::load(at.a), b = P8::load(at.b), one = P8::of(1);
    const P8 along[kCorners + 1] = {a, b, one - a, one - b, a};
    J sums[3][kCorners];
    for (int i = 0; i < kCorners; ++i) {
        const GregoryCorner<P8, kOrder> corner(along[i], along[i + 1]);
        for (int c = 0; c < 3; ++c) {
            sums[c][i] = J::zero();
            for (int k = 0; k < kPoints; ++k) {
                const P8 p = P8::of(net[3 * (i * kPoints + k) + c]);
                for (int r = 0; r < J::kSize; ++r)
                    sums[c][i].c[r] = mul_add(corner.weights[k].c[r], p, sums[c][i].c[r]);
            }
        }
    }
    const P8 cos = P8::load(at.cos), sin = P8::load(at.sin);
    for (int c = 0; c < 3; ++c) {
        const J jet = turned(cos, sin, derivatives(sum_of_corners<P8, kOrder>(sums[c])));
        for (int r = 0; r < jet.kSize; ++r)
            jet.c[r].store(out.value[r][c]);
    }
}

void gregory_points_of_order(const double* net, const PointPlaces& at, int order,
                             PointJets& out) {
    switch (order) {
        case 0:
            return gregory_points<0>(net, at, out);
        case 1:
            return gregory_points<1>(net, at, out);
        default:
            return gregory_points<2>(net, at, out);
    }
}

// ------------------------------------------------------------------ patches of n sides

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

/// From derivatives in (x, y) of the sector to those in other variables, turned.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> in_frame(const RingTables& t, const DomainPoint& p,
                                       PointFrame frame, ChartTurn turn,
                                       LaneJet<V, kOrder> jet) {
    if (frame == PointFrame::BaseUV) {
        jet = in_sector(t, V::of(p.a), V::of(p.b), jet);
    } else if (frame == PointFrame::Native) {
        const auto at = t.sector_turn[p.sector];
        jet = turned(V::of(at.x), V::of(-at.y), jet);
    }
    return turned(V::of(turn.cos), V::of(turn.sin), jet);
}

template <int kOrder, class T>
void polygon_sum(const RingTables& t, PatchKind kind, const DomainPoint& p,
                 PointFrame frame, ChartTurn turn, const PointSum<T>& points,
                 PointJet& out) {
    using Points = PolygonPoints<T, false>;
    using Jet = LaneJet<typename Points::V, kOrder>;
    const bool is_ev = kind == PatchKind::EV;
    Jet sum = Jet::zero();
    if (t.is_ring()) {
        if (HWY_UNLIKELY(!Points::Reader::can_read(points, t.n_points)))
            return with_copy(points, t.n_points, [&](const PointSum<T>& copy) {
                polygon_sum<kOrder>(t, kind, p, frame, turn, copy, out);
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

template <class T>
void polygon_sum_of_order(const RingTables& t, PatchKind kind, const DomainPoint& p,
                          int order, PointFrame frame, ChartTurn turn,
                          const PointSum<T>& sum, PointJet& out) {
    switch (order) {
        case 0:
            return polygon_sum<0>(t, kind, p, frame, turn, sum, out);
        case 1:
            return polygon_sum<1>(t, kind, p, frame, turn, sum, out);
        default:
            return polygon_sum<2>(t, kind, p, frame, turn, sum, out);
    }
}

/// The weights of all points of a ring.
template <int kOrder>
void all_ring_weights(const RingTables& t, PatchKind kind, const DomainPoint& p,
                      PointFrame frame, ChartTurn turn, double* out) {
    using J = LaneJet<P8, kOrder>;
    Weights weights;
    ring_weights<kOrder>(t, kind, p, weights);
    const bool is_ev = kind == PatchKind::EV;
    const int d1 = t.degree - 1, n_spoke = is_ev ? d1 : 0,
              n_inner = is_ev ? d1 * d1 : t.degree * t.degree,
              first_inner = is_ev + t.n * n_spoke;
    double ordered[J::kSize][detail::kMostManyPoints + kLanes];
    LaneJet<double, kOrder> sum;
    for (int r = 0; r < J::kSize; ++r) {
        double* const to = ordered[r];
        to[0] = 0;
        for (int m = 0; m < t.n; ++m) {
            const double* from = weights.values + r * kLanes + m;
            const auto next = [&] {
                const double w = *from;
                from += J::kSize * kLanes;
                return w;
            };
            for (int k = 0; k < n_inner; ++k)
                to[first_inner + m * n_inner + k] = next();
            for (int k = 0; k < n_spoke; ++k)
                to[1 + m * n_spoke + k] = next();
            if (is_ev)
                to[0] += next();
        }
        std::fill_n(to + t.n_points, kLanes, 0.0);
        P8 lanes = P8::zero();
        for (int i = 0; i < t.n_points; i += kLanes)
            lanes = lanes + P8::load(to + i);
        sum.c[r] = sum_of_lanes(lanes);
    }
    const P8 of_sum = P8::of(1 / sum.c[0]);
    for (int i = 0; i < t.n_points; i += kLanes) {
        J w;
        for (int r = 0; r < J::kSize; ++r)
            w.c[r] = P8::load(ordered[r] + i);
        w = in_frame(t, p, frame, turn, derivatives(quotient(w, J::same(sum), of_sum)));
        for (int r = 0; r < J::kSize; ++r) {
            double lanes[kLanes];
            w.c[r].store(lanes);
            std::copy_n(lanes, std::min(kLanes, t.n_points - i),
                        out + r * t.n_points + i);
        }
    }
}

void all_ring_weights_of_order(const RingTables& t, PatchKind kind, const DomainPoint& p,
                               int order, PointFrame frame, ChartTurn turn, double* out) {
    switch (order) {
        case 0:
            return all_ring_weights<0>(t, kind, p, frame, turn, out);
        case 1:
            return all_ring_weights<1>(t, kind, p, frame, turn, out);
        default:
            return all_ring_weights<2>(t, kind, p, frame, turn, out);
    }
}

/// At some places at once.
template <int kDegree, bool kEV, int kOrder>
void ring_points(const RingTables& t, const double* net, const PointPlaces& at,
                 Chart chart, PointJets& out) {
    using J = LaneJet<P8, kOrder>;
    const RingPlaces places(t, at);
    J one = J::zero(), sums[3] = {one, one, one};
    ring_point_weights<kDegree, kEV, kOrder>(t, places, [&](int point, J w) OSDX_LAMBDA {
        const double* p = net + 3 * point;
        one = one + w;
        for (int c = 0; c < 3; ++c) {
            const P8 x = P8::of(p[c]);
            for (int r = 0; r < J::kSize; ++r)
                sums[c].c[r] = mul_add(w.c[r], x, sums[c].c[r]);
        }
    });
    const P8 of_one = inverse(one.c[0]), cos = P8::load(at.cos), sin = P8::load(at.sin);
    for (int c = 0; c < 3; ++c) {
        J jet = derivatives(quotient(sums[c], one, of_one));
        if (chart == Chart::BaseUV)
            jet = places.in_sector(t, jet);
        jet = turned(cos, sin, jet);
        for (int r = 0; r < jet.kSize; ++r)
            jet.c[r].store(out.value[r][c]);
    }
}

template <int kDegree, bool kEV>
void ring_points_of_order(const RingTables& t, const double* net, const PointPlaces& at,
                          Chart chart, int order, PointJets& out) {
    switch (order) {
        case 0:
            return ring_points<kDegree, kEV, 0>(t, net, at, chart, out);
        case 1:
            return ring_points<kDegree, kEV, 1>(t, net, at, chart, out);
        default:
            return ring_points<kDegree, kEV, 2>(t, net, at, chart, out);
    }
}

void ring_points_of_any(const RingTables& t, PatchKind kind, const double* net,
                        const PointPlaces& at, Chart chart, int order, PointJets& out) {
    const bool is_ev = kind == PatchKind::EV;
    if (t.degree == 3)
        return (is_ev ? ring_points_of_order<3, true>
                      : ring_points_of_order<3, false>)(t, net, at, chart, order, out);
    (is_ev ? ring_points_of_order<0, true>
           : ring_points_of_order<0, false>)(t, net, at, chart, order, out);
}

template <class T>
void set_kernels(detail::PointKernels<T>& kernels) {
    kernels.regular = &regular_of_any<T>;
    kernels.regular_points = &regular_points_of_any;
    kernels.gregory = &gregory_of_order<T>;
    kernels.gregory_points = &gregory_points_of_order;
    kernels.polygon = nullptr;
    kernels.ring_weights = nullptr;
    kernels.ring_points = nullptr;
    if constexpr (kHasPolygons) {
        kernels.polygon = &polygon_sum_of_order<T>;
        kernels.ring_weights = &all_ring_weights_of_order;
        kernels.ring_points = &ring_points_of_any;
    }
}
void set_float_kernels(detail::PointKernels<float>& kernels) {
    set_kernels(kernels);
}
void set_double_kernels(detail::PointKernels<double>& kernels) {
    set_kernels(kernels);
}

}  // namespace osdx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx {

HWY_EXPORT(set_float_kernels);
HWY_EXPORT(set_double_kernels);

namespace detail {

template <>
PointKernels<float>::PointKernels() {
    HWY_DYNAMIC_DISPATCH(set_float_kernels)(*this);
}
template <>
PointKernels<double>::PointKernels() {
    HWY_DYNAMIC_DISPATCH(set_double_kernels)(*this);
}

}  // namespace detail
}  // namespace osdx
#endif  // HWY_ONCE
