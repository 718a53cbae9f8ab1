// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/ribbon_sums_float.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/ribbon_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

void set_ribbon_sums_float(PointKernels& kernels) {
    if constexpr (kHasRibbons)
        kernels.float_sum = {&polygon_sum<0, float>, &polygon_sum<1, float>,
                             &polygon_sum<2, float>};
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI {

HWY_EXPORT(set_ribbon_sums_float);

namespace detail {

void set_ribbon_sums_float_kernels(PointKernels& kernels) {
    HWY_DYNAMIC_DISPATCH(set_ribbon_sums_float)(kernels);
}

}  // namespace detail

}  // namespace osdx::inline OSDX_ABI
#endif  // HWY_ONCE
