// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_GRID_LAYOUT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_GRID_LAYOUT_INL_H_
#undef OSDX_EVAL_GRID_LAYOUT_INL_H_
#else
#define OSDX_EVAL_GRID_LAYOUT_INL_H_
#endif

#include "eval/kernels/grid_store-inl.h"

// Any kind of table into any layout.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {
namespace {

/// Into any layout, by Any::run<interleaved>() into the two that it knows.
template <class Any, class T>
void evaluate(const Table<T>& table, const Batch<T>& batch, const Target<T>& target,
              T* scratch) {
    if (target.layout == Layout::Interleaved)
        return Any::template run<true>(table, batch, target);
    if (target.layout == Layout::Planar)
        return Any::template run<false>(table, batch, target);
    // By way of scratch memory.
    const std::size_t size = 3 * padded<T>(table.n_samples());
    Target<T> packed;
    for (int r = 0; r < table.n_derivatives(); ++r) {
        packed.data[r] = scratch + size * r;
        packed.row_stride[r] = 3 * table.nx;
        packed.sample_stride[r] = 3;
        packed.channel_stride[r] = 1;
    }
    constexpr Index kFirst = 0;
    for (std::size_t b = 0; b < batch.n; ++b) {
        Any::template run<true>(
            table, {1, batch.points, batch.last_point, batch.indices + b, &kFirst},
            packed);
        for (int r = 0; r < table.n_derivatives(); ++r) {
            const T* from = packed.data[r];
            const std::ptrdiff_t stride = target.sample_stride[r];
            for (int j = 0; j < table.ny; ++j) {
                T* to = target.data[r] + batch.first_samples[b] * stride +
                        j * target.row_stride[r];
                for (int i = 0; i < table.nx; ++i, from += 3, to += stride) {
                    for (int c = 0; c < 3; ++c)
                        to[c * target.channel_stride[r]] = from[c];
                }
            }
        }
    }
}

}  // namespace
}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_GRID_LAYOUT_INL_H_
