// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/point_kernels.h"

#include "eval/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/point_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/gregory_points-inl.h"
#include "eval/lanes-inl.h"
#include "eval/ribbon_points-inl.h"
#include "eval/ribbon_weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::HWY_NAMESPACE {

using detail::ChartMap;
using detail::ChartTurn;
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
template <class V, class T>
class PointReader {
public:
    HWY_INLINE explicit PointReader(const PointSum<T>& sum)
        : values_(sum.values),
          n_values_(sum.n_values),
          whole_end_(sum.n_values < V::kLanes ? 0 : sum.n_values - (V::kLanes - 1)),
          stride_(sum.stride) {}

    HWY_INLINE V operator()(Index point) const {
        const std::size_t at = std::size_t(point) * stride_;
        if (HWY_LIKELY(at < whole_end_))
            return V::load(values_ + at);
        T last[V::kLanes] = {};
        for (std::size_t k = at; k < n_values_ && k < at + 4; ++k)
            last[k - at] = values_[k];
        return V::load(last);
    }

private:
    const T* values_;
    std::size_t n_values_, whole_end_, stride_;
};

/// From Taylor coefficients in the kernel's variables to those in the ones that are asked for.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> mapped(const ChartMap& m, LaneJet<V, kOrder> jet) {
    LaneJet<V, kOrder> r;
    r.c[0] = jet.c[0];
    if constexpr (kOrder > 0) {
        const V x = jet.c[1], y = jet.c[2];
        r.c[1] = mul_add(number<V>(m.x_u), x, number<V>(m.y_u) * y);
        r.c[2] = mul_add(number<V>(m.x_v), x, number<V>(m.y_v) * y);
        if constexpr (kOrder > 1) {
            const auto second = [&](double xx, double xy, double yy) OSDX_LAMBDA {
                return mul_add(
                    number<V>(xx), jet.c[3],
                    mul_add(number<V>(xy), jet.c[4], number<V>(yy) * jet.c[5]));
            };
            r.c[3] = second(m.x_u * m.x_u, m.x_u * m.y_u, m.y_u * m.y_u);
            r.c[4] = mul_add(number<V>(m.x_uv), x,
                             second(2 * m.x_u * m.x_v, m.x_u * m.y_v + m.y_u * m.x_v,
                                    2 * m.y_u * m.y_v));
            r.c[5] = second(m.x_v * m.x_v, m.x_v * m.y_v, m.y_v * m.y_v);
        }
    }
    return r;
}

/// From Taylor coefficients to derivatives.
template <class V, int kOrder>
HWY_INLINE void put(LaneJet<V, kOrder> jet, PointJet& out) {
    if constexpr (kOrder > 1) {
        jet.c[3] = jet.c[3] + jet.c[3];
        jet.c[5] = jet.c[5] + jet.c[5];
    }
    for (int r = 0; r < jet.kSize; ++r)
        first_four(jet.c[r]).store(out.value[r]);
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
    const double c = turn.cos, s_ = turn.sin;
    put(mapped<Quad, kOrder>({c, s_, -s_, c, 0}, jet), out);
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

/// From derivatives in (s, t) to those in variables that are turned against them.
template <int kOrder>
HWY_INLINE LaneJet<P8, kOrder> turned(P8 cos, P8 sin, LaneJet<P8, kOrder> jet) {
    LaneJet<P8, kOrder> r = jet;
    if constexpr (kOrder > 0) {
        r.c[1] = mul_add(cos, jet.c[1], sin * jet.c[2]);
        r.c[2] = mul_sub(cos, jet.c[2], sin * jet.c[1]);
    }
    if constexpr (kOrder > 1) {
        const P8 cc = cos * cos, ss = sin * sin, cs = cos * sin,
                 twice = (cs + cs) * jet.c[4];
        r.c[3] = mul_add(cc, jet.c[3], mul_add(ss, jet.c[5], twice));
        r.c[4] = mul_add(cc - ss, jet.c[4], cs * (jet.c[5] - jet.c[3]));
        r.c[5] = mul_add(ss, jet.c[3], mul_sub(cc, jet.c[5], twice));
    }
    return r;
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
        jet = turned<kOrder>(cos, sin, jet);
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
    const double c = turn.cos, s = turn.sin;
    put(mapped<Quad, kOrder>({c, s, -s, c, 0}, sum_of_corners<Quad, kOrder>(sums)), out);
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
                    sums[c][i].c[r] =
                        mul_add(corner.weights[k].c[r], p, sums[c][i].c[r]);
            }
        }
    }
    const P8 cos = P8::load(at.cos), sin = P8::load(at.sin);
    for (int c = 0; c < 3; ++c) {
        J jet = sum_of_corners<P8, kOrder>(sums[c]);
        if constexpr (kOrder > 1) {
            jet.c[3] = jet.c[3] + jet.c[3];
            jet.c[5] = jet.c[5] + jet.c[5];
        }
        jet = turned<kOrder>(cos, sin, jet);
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

/// Where ribbons fill a wide register a sum takes one, too, half of it in vain: while there are
/// wide ones on their way, narrow ones have but one port to go through.
using Wide = Pack<P8::kParts == 1 ? kLanes : 4>;

/// The sums of weights times points, and of the weights alone, so that constants come out as
/// such.
template <int kOrder>
struct PolygonSums {
    LaneJet<Wide, kOrder> points;
    LaneJet<double, kOrder> one;
};

template <int kOrder, class T>
HWY_INLINE LaneJet<Wide, kOrder> added(LaneJet<Wide, kOrder> to, const double* w, int k,
                                       PointReader<Wide, T> read, Index point) {
    const Wide p = read(point);
    for (int r = 0; r < to.kSize; ++r)
        to.c[r] = mul_add(Wide::of(w[(k * to.kSize + r) * kLanes]), p, to.c[r]);
    return to;
}

/// Adds a block of weights times the points of the sectors start, start + 1, .. modulo n.
/// \tparam kInner, kSpoke  points of each sector and spoke; or both are 0
template <int kInner, int kSpoke, int kOrder, class T>
HWY_INLINE PolygonSums<kOrder> with_block(PolygonSums<kOrder> sums, const RingTables& t,
                                          bool is_ev, const Weights& weights,
                                          const PointSum<T>& sum, int start) {
    using Jet = LaneJet<Wide, kOrder>;
    const PointReader<Wide, T> read(sum);
    const int n = t.n, n_lanes = t.n_lanes(), d1 = t.degree - 1,
              n_spoke = kInner > 0 ? kSpoke
                        : is_ev    ? d1
                                   : 0,
              n_inner = kInner > 0 ? kInner
                        : is_ev    ? d1 * d1
                                   : t.degree * t.degree;
    const double* w = weights.values;
    const Index *const spokes = sum.points + is_ev, *const sectors = spokes + n * n_spoke;
    const Index *spoke = spokes + start * n_spoke, *inner = sectors + start * n_inner;
    // Several sums, so that additions need not wait for each other.
    Jet s0 = sums.points, s1 = Jet::zero(), s2 = s1, s3 = s1;
    for (int m = 0, to_wrap = n - start; m < n_lanes; ++m, ++w) {
        int k = 0;
        for (; k + 4 <= n_inner; k += 4, inner += 4) {
            s0 = added(s0, w, k, read, inner[0]);
            s1 = added(s1, w, k + 1, read, inner[1]);
            s2 = added(s2, w, k + 2, read, inner[2]);
            s3 = added(s3, w, k + 3, read, inner[3]);
        }
        for (; k < n_inner; ++k)
            s0 = added(s0, w, k, read, *inner++);
        for (; k + 2 <= n_inner + n_spoke; k += 2, spoke += 2) {
            s0 = added(s0, w, k, read, spoke[0]);
            s1 = added(s1, w, k + 1, read, spoke[1]);
        }
        for (; k < n_inner + n_spoke; ++k)
            s1 = added(s1, w, k, read, *spoke++);
        if (--to_wrap == 0) {
            spoke = spokes;
            inner = sectors;
        }
    }
    sums.points = (s0 + s1) + (s2 + s3);
    if (is_ev) {
        const Wide vertex = read(sum.points[0]);
        for (int r = 0; r < Jet::kSize; ++r)
            sums.points.c[r] =
                mul_add(Wide::of(weights.sum_and_vertex[r][1]), vertex, sums.points.c[r]);
    }
    for (int r = 0; r < Jet::kSize; ++r)
        sums.one.c[r] += weights.sum_and_vertex[r][0];
    return sums;
}

/// The same for any degree, faster for cubic ones.
template <int kOrder, class T>
HWY_INLINE PolygonSums<kOrder> with_any_block(PolygonSums<kOrder> sums,
                                              const RingTables& t, bool is_ev,
                                              const Weights& weights,
                                              const PointSum<T>& sum, int start) {
    if (t.degree != 3)
        return with_block<0, 0>(sums, t, is_ev, weights, sum, start);
    if (is_ev)
        return with_block<4, 2>(sums, t, true, weights, sum, start);
    return with_block<9, 0>(sums, t, false, weights, sum, start);
}

/// Windows of weights on their way to sums.
template <int kOrder, class T>
struct WindowSink {
    const RingTables& tables;
    bool is_ev;
    const PointSum<T>& sum;
    PolygonSums<kOrder> sums;

    static void take(const WeightSink& sink, const Weights& weights, int start) {
        auto& self = *static_cast<WindowSink*>(sink.state);
        self.sums =
            with_any_block(self.sums, self.tables, self.is_ev, weights, self.sum, start);
    }
};

template <int kOrder, class T>
void polygon_sum(const RingTables& t, PatchKind kind, const DomainPoint& p,
                 const ChartMap& map, const PointSum<T>& sum, PointJet& out) {
    using Jet = LaneJet<Wide, kOrder>;
    using S = LaneJet<double, kOrder>;
    const bool is_ev = kind == PatchKind::EV;
    PolygonSums<kOrder> sums{Jet::zero(), S::zero()};
    if (t.is_ring()) {
        Weights weights;
        ring_weights<kOrder>(t, kind, p, weights);
        sums = with_any_block(sums, t, is_ev, weights, sum, 0);
    } else {
        WindowSink<kOrder, T> sink{t, is_ev, sum, sums};
        window_weights<kOrder>(t, kind, p, {&sink.take, &sink});
        sums = sink.sums;
    }
    const Wide of_one = Wide::of(1 / sums.one.c[0]);
    const S f = mapped<double, kOrder>(map, sums.one);
    put(quotient(mapped<Wide, kOrder>(map, sums.points), Jet::same(f), of_one), out);
}

template <class T>
void polygon_sum_of_order(const RingTables& t, PatchKind kind, const DomainPoint& p,
                          int order, const ChartMap& map, const PointSum<T>& sum,
                          PointJet& out) {
    switch (order) {
        case 0:
            return polygon_sum<0>(t, kind, p, map, sum, out);
        case 1:
            return polygon_sum<1>(t, kind, p, map, sum, out);
        default:
            return polygon_sum<2>(t, kind, p, map, sum, out);
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
        J jet = quotient(sums[c], one, of_one);
        if constexpr (kOrder > 1) {
            jet.c[3] = jet.c[3] + jet.c[3];
            jet.c[5] = jet.c[5] + jet.c[5];
        }
        if (chart == Chart::BaseUV)
            jet = places.in_sector(t, jet);
        jet = turned<kOrder>(cos, sin, jet);
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
    kernels.ring_points = nullptr;
    if constexpr (kHasPolygons) {
        kernels.polygon = &polygon_sum_of_order<T>;
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
