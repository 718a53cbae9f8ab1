// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/grid.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/grid_product_float.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/grid_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {

void product_float(const Table<float>& table, const Batch<float>& batch,
                   const Target<float>& target, float* scratch) {
    evaluate<Any>(table, batch, target, scratch);
}

}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI::grid {

HWY_EXPORT(product_float);

template <>
Kernel<float> product_kernel() noexcept {
    return HWY_DYNAMIC_DISPATCH(product_float);
}

}  // namespace osdx::inline OSDX_ABI::grid
#endif  // HWY_ONCE
