// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

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

void set_ribbon_many(const KernelTables& tables, PointKernels& kernels) {
    kernels.many = ring_kernels<3>(tables);
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
