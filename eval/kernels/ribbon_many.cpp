// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/ribbon_many.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/points-inl.h"
#include "eval/kernels/ribbon_many-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

/// At some places at once.
template <int kDegree, bool kEV, int kOrder>
void ring_points(const KernelTables& tables, const double* net, const PointPlaces& at,
                 Chart chart, PointJets& out) {
    const RingTables& t = *tables.ring;
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
void set_ring_points(PointKernels& kernels) {
    kernels.many = {&ring_points<kDegree, kEV, 0>, &ring_points<kDegree, kEV, 1>,
                    &ring_points<kDegree, kEV, 2>};
}

void set_ribbon_many(const KernelTables& tables, PointKernels& kernels) {
    if constexpr (kHasRibbons) {
        if (!tables.ring->is_ring())
            return;
        const bool is_ev = tables.kind == PatchKind::EV;
        if (tables.degree == 3)
            is_ev ? set_ring_points<3, true>(kernels)
                  : set_ring_points<3, false>(kernels);
        else
            is_ev ? set_ring_points<0, true>(kernels)
                  : set_ring_points<0, false>(kernels);
    }
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI {

HWY_EXPORT(set_ribbon_many);

namespace detail {

void set_ribbon_many_kernels(const KernelTables& tables, PointKernels& kernels) {
    HWY_DYNAMIC_DISPATCH(set_ribbon_many)(tables, kernels);
}

}  // namespace detail
}  // namespace osdx::inline OSDX_ABI
#endif  // HWY_ONCE
