// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/ribbon_ring.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/ribbon_one-inl.h"
#include "eval/kernels/ribbon_weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

template <int kOrder>
HWY_NOINLINE void ring_weights(const RingTables& t, PatchKind kind, const DomainPoint& p,
                               Weights& weights) {
    block_weights<kOrder>(t, kind, ring_ribbons<kOrder>(t, p), weights);
}

// Where registers are wide enough for kernels of ribbons.
#if HWY_MAX_BYTES >= 32
template void ring_weights<0>(const RingTables&, PatchKind, const DomainPoint&, Weights&);
template void ring_weights<1>(const RingTables&, PatchKind, const DomainPoint&, Weights&);
template void ring_weights<2>(const RingTables&, PatchKind, const DomainPoint&, Weights&);
#endif

/// The weights of all points of a ring.
template <int kOrder>
void all_ring_weights(const KernelTables& tables, const DomainPoint& p, PointFrame frame,
                      ChartTurn turn, double* out) {
    const RingTables& t = *tables.ring;
    const PatchKind kind = tables.kind;
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

void set_ribbon_weights(const KernelTables& tables, PointKernels& kernels) {
    if constexpr (kHasRibbons) {
        if (tables.ring->is_ring())
            kernels.weights = {&all_ring_weights<0>, &all_ring_weights<1>,
                               &all_ring_weights<2>};
    }
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI {

HWY_EXPORT(set_ribbon_weights);

namespace detail {

void set_ribbon_weights_kernels(const KernelTables& tables, PointKernels& kernels) {
    HWY_DYNAMIC_DISPATCH(set_ribbon_weights)(tables, kernels);
}

}  // namespace detail

}  // namespace osdx::inline OSDX_ABI
#endif  // HWY_ONCE
