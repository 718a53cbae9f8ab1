// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/ribbon_channels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/points-inl.h"
#include "eval/kernels/ribbon_many-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

template <int kDegree, bool kEV>
void set_ring_points(PointKernels& kernels) {
    kernels.many_of_any = {&ring_points<kDegree, kEV, 0, 0>,
                           &ring_points<kDegree, kEV, 1, 0>,
                           &ring_points<kDegree, kEV, 2, 0>};
}

void set_ribbon_channels(const KernelTables& tables, PointKernels& kernels) {
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

HWY_EXPORT(set_ribbon_channels);

namespace detail {

void set_ribbon_channels_kernels(const KernelTables& tables, PointKernels& kernels) {
    HWY_DYNAMIC_DISPATCH(set_ribbon_channels)(tables, kernels);
}

}  // namespace detail
}  // namespace osdx::inline OSDX_ABI
#endif  // HWY_ONCE
