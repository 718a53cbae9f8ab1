// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_RIBBON_POINTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_RIBBON_POINTS_INL_H_
#undef OSDX_EVAL_RIBBON_POINTS_INL_H_
#else
#define OSDX_EVAL_RIBBON_POINTS_INL_H_
#endif

#include <array>

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/points-inl.h"
#include "eval/kernels/ribbon_one-inl.h"

// The weights of the control points of rings at several points of the domain, one a lane: the
// ribbons come one after the other. Variables are (x, y) of the n-gon, whatever the sectors.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

/// Where the places are: (x, y), and the distances to all sides.
struct RingPlaces {
    P8 a, b, cos, sin;  // of the sector's direction
    P8 x, y;
    alignas(64) double distances[kLanes][kLanes];

    HWY_INLINE RingPlaces(const RingTables& t, const PointPlaces& at)
        : a(P8::load(at.a)), b(P8::load(at.b)) {
        alignas(64) double turns[2][kLanes];
        for (int i = 0; i < kLanes; ++i) {
            turns[0][i] = t.sector_turn[at.sector[i]].x;
            turns[1][i] = t.sector_turn[at.sector[i]].y;
        }
        cos = P8::load(turns[0]);
        sin = P8::load(turns[1]);
        const P8 along = mul_add(P8::of(t.x_a), a + b, P8::of(t.x_ab) * (a * b)),
                 across = P8::of(t.y_b) * (b - a);
        x = mul_sub(cos, along, sin * across);
        y = mul_add(sin, along, cos * across);
        const P8 centre = P8::of(t.centre);
        for (int k = 0; k < t.n; ++k) {
            const P8 l_x = P8::of(*t.distance_x.at(k)), l_y = P8::of(*t.distance_y.at(k));
            mul_add(l_x, x, mul_add(l_y, y, centre)).store(distances[k]);
        }
        // Exact 0 on the sides at the corner of the sector, and to relative precision near them.
        const P8 one = P8::of(1), half = P8::of(*t.right.at(0));
        alignas(64) double at_corner[2][kLanes];
        ((one - a) * mul_add(b, half, (one - b) * centre)).store(at_corner[0]);
        ((one - b) * mul_add(a, half, (one - a) * centre)).store(at_corner[1]);
        for (int i = 0; i < kLanes; ++i) {
            distances[at.sector[i]][i] = at_corner[0][i];
            distances[t.next[at.sector[i]]][i] = at_corner[1][i];
        }
    }

    /// From derivatives in (x, y) to those in (a, b).
    template <int kOrder>
    HWY_INLINE LaneJet<P8, kOrder> in_sector(const RingTables& t,
                                             LaneJet<P8, kOrder> jet) const {
        return HWY_NAMESPACE::in_sector(t, a, b, turned(cos, sin, jet));
    }
};

/// Calls take(point, weight) for all control points, up to one common factor.
/// \tparam kDegree  0 for any
template <int kDegree, bool kEV, int kOrder, class Take>
HWY_INLINE void ring_point_weights(const RingTables& t, const RingPlaces& places,
                                   Take&& take) {
    using J = LaneJet<P8, kOrder>;
    const int n = t.n, d = kDegree > 0 ? kDegree : t.degree, m = d - 1;
    constexpr int kMost = kDegree > 0 ? kDegree : kMaxDegree;
    P8 l[kLanes];
    J powers[kLanes], h[kLanes], alpha[kLanes], beta[kLanes];
    {
        const P8 of_total = inverse(ring_total<0>(t, places.x, places.y).c[0]);
        for (int i = 0; i < n; ++i) {
            const P8 l_x = P8::of(*t.distance_x.at(i)), l_y = P8::of(*t.distance_y.at(i));
            l[i] = P8::load(places.distances[i]);
            const P8 xi = l[i] - P8::of(t.centre),
                     eta = mul_sub(places.x, l_y, places.y * l_x);
            h[i] = RingH<kOrder>::of(t, l[i], xi, eta, ring_total<kOrder>(t, xi, eta),
                                     of_total, l_x, l_y, P8::of(*t.slope_x.at(i)),
                                     P8::of(*t.slope_y.at(i)));
            powers[i] = power(t, h[i]);
        }
    }
    for (int i = 0; i < n; ++i) {
        const auto next = t.next[i];
        set_blends(powers[i], powers[next], alpha[next], beta[i]);
    }

    struct Ribbon {
        J rows[kMost], columns[2 * kMost];
    };
    Ribbon ribbons[kLanes];
    for (int i = 0; i < n; ++i) {
        J *const rows = ribbons[i].rows, *const columns = ribbons[i].columns;
        J before, around;
        before.c[0] = l[t.previous[i]];
        around.c[0] = mul_add(P8::of(t.sum_slope), l[i], P8::of(t.sum_value));
        if constexpr (kOrder > 0) {
            before.c[1] = P8::of(*t.slope_x.at(i - 1));
            before.c[2] = P8::of(*t.slope_y.at(i - 1));
            around.c[1] = P8::of(*t.around_x.at(i));
            around.c[2] = P8::of(*t.around_y.at(i));
        }
        const J s = along_side(t, before, around);
        if constexpr (kDegree == 3) {
            cubic_rows<kEV>(h[i], rows);
            const auto inner = cubic_inner<kOrder>(s);
            J half[3];
            cubic_half<kEV>(P8::of(kCubicIntervals<kEV>) - s.c[0],
                            BlendedInner<P8, kOrder>::of_mirrored(inner, alpha[i]), half);
            for (int k = 0; k < 3 - kEV; ++k)
                columns[m - kEV - k] = half[k];
            cubic_half<kEV>(s.c[0], BlendedInner<P8, kOrder>::of(inner, beta[i]),
                            columns + d);
            if constexpr (kEV)
                columns[m] = BlendedInner<P8, kOrder>::of(inner, alpha[i] * beta[i])
                                 .compose(middle_cubic<kOrder>(s.c[0] - P8::of(1)));
        } else {
            spline_rows<kOrder>(t, kEV, h[i], rows);
            spline_columns<kOrder>(t, kEV, s, alpha[i], beta[i], columns);
        }
    }

    // As in spline_weights().
    int spoke = kEV, inner = spoke + (kEV ? n * m : 0);
    J vertex = J::zero();
    for (int i = 0; i < n; ++i) {
        const Ribbon &own = ribbons[i], &next = ribbons[t.next[i]],
                     &previous = ribbons[t.previous[i]];
        for (int a = kEV; a < d; ++a) {
            for (int b = kEV; b < d; ++b)
                take(inner++, mul_add(own.columns[d - kEV + b], own.rows[m - a],
                                      next.columns[m - a] * next.rows[m - b]));
        }
        if constexpr (kEV) {
            for (int b = 1; b < d; ++b)
                take(spoke++,
                     mul_add(own.columns[m], own.rows[m - b],
                             mul_add(next.columns[m - b], next.rows[m],
                                     previous.columns[m + b] * previous.rows[m])));
            vertex = mul_add(own.columns[m], own.rows[m], vertex);
        }
    }
    if constexpr (kEV)
        take(0, vertex);
}

/// The sums over points of kChannels channels, that stay in registers.
/// \param net  `stride` values of each point
template <int kChannels, class J>
HWY_INLINE void sum_channels(const J* weights, int n_points, const double* net,
                             int stride, J* out) {
    J sums[kChannels];
    for (int c = 0; c < kChannels; ++c)
        sums[c] = J::zero();
    for (int i = 0; i < n_points; ++i, net += stride) {
        for (int c = 0; c < kChannels; ++c) {
            const P8 x = P8::of(net[c]);
            for (int r = 0; r < J::kSize; ++r)
                sums[c].c[r] = mul_add(weights[i].c[r], x, sums[c].c[r]);
        }
    }
    for (int c = 0; c < kChannels; ++c)
        out[c] = sums[c];
}

/// The sums over all control points at some places at once.
/// \tparam kChannels  0 for any number
template <int kDegree, bool kEV, int kOrder, int kChannels>
void ring_points(const KernelTables& tables, const double* net, int n_channels,
                 const PointPlaces& at, Chart chart, PointJets& out) {
    const RingTables& t = *tables.ring;
    using J = LaneJet<P8, kOrder>;
    const RingPlaces places(t, at);
    constexpr int kMost = kChannels > 0 ? kChannels : kManyChannels;
    const int n = kChannels > 0 ? kChannels : n_channels;
    J one = J::zero(), sums[kMost];
    for (int c = 0; c < n; ++c)
        sums[c] = one;
    if constexpr (kDegree == 3 && kChannels == 0) {
        // Sums of few channels stay in registers: over all weights, which are few.
        J weights[kLanes * kDegree * kDegree];
        int n_points = 0;
        ring_point_weights<kDegree, kEV, kOrder>(t, places,
                                                 [&](int point, J w) OSDX_LAMBDA {
                                                     one = one + w;
                                                     weights[point] = w;
                                                     ++n_points;
                                                 });
        constexpr int kTogether = kOrder > 1 ? 1 : 2;
        int c = 0;
        for (; c + kTogether <= n; c += kTogether)
            sum_channels<kTogether>(weights, n_points, net + c, n, sums + c);
        for (; c < n; ++c)
            sum_channels<1>(weights, n_points, net + c, n, sums + c);
    } else {
        ring_point_weights<kDegree, kEV, kOrder>(
            t, places, [&](int point, J w) OSDX_LAMBDA {
                const double* p = net + n * point;
                one = one + w;
                for (int c = 0; c < n; ++c) {
                    const P8 x = P8::of(p[c]);
                    for (int r = 0; r < J::kSize; ++r)
                        sums[c].c[r] = mul_add(w.c[r], x, sums[c].c[r]);
                }
            });
    }
    const P8 of_one = inverse(one.c[0]), cos = P8::load(at.cos), sin = P8::load(at.sin);
    for (int c = 0; c < n; ++c) {
        J jet = derivatives(quotient(sums[c], one, of_one));
        if (chart == Chart::BaseUV)
            jet = places.in_sector(t, jet);
        jet = turned(cos, sin, jet);
        for (int r = 0; r < jet.kSize; ++r)
            jet.c[r].store(out.value[r][c]);
    }
}

/// Those for a class of rings, by the order of the derivatives.
template <int kDegree, bool kEV, int kChannels>
std::array<PointKernels::Many, 3> ring_kernels_of() {
    return {&ring_points<kDegree, kEV, 0, kChannels>,
            &ring_points<kDegree, kEV, 1, kChannels>,
            &ring_points<kDegree, kEV, 2, kChannels>};
}
template <int kChannels>
std::array<PointKernels::Many, 3> ring_kernels(const KernelTables& tables) {
    if constexpr (kHasRibbons) {
        if (tables.ring->is_ring()) {
            const bool is_ev = tables.kind == PatchKind::EV;
            if (tables.degree == 3)
                return is_ev ? ring_kernels_of<3, true, kChannels>()
                             : ring_kernels_of<3, false, kChannels>();
            return is_ev ? ring_kernels_of<0, true, kChannels>()
                         : ring_kernels_of<0, false, kChannels>();
        }
    }
    return {};
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_RIBBON_POINTS_INL_H_
