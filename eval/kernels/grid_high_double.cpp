// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/grid.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/grid_high_double.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/grid_high-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {

void high_double(const Table<double>& table, const Batch<double>& batch,
                 const Target<double>& target, double* scratch) {
    evaluate<Any>(table, batch, target, scratch);
}

}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI::grid {

HWY_EXPORT(high_double);

template <>
Kernel<double> high_kernel() noexcept {
    return HWY_DYNAMIC_DISPATCH(high_double);
}

}  // namespace osdx::inline OSDX_ABI::grid
#endif  // HWY_ONCE
