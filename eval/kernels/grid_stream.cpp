// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cstddef>
#include <cstdint>

#include "eval/kernels/grid.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/grid_stream.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include <hwy/cache_control.h>

#include "eval/kernels/grid_store-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {
namespace {

template <class T>
void stream(const T* from, std::size_t n, T* to) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    std::size_t i = 0;
    for (; i < n && reinterpret_cast<std::uintptr_t>(to + i) % (N * sizeof(T)) != 0; ++i)
        to[i] = from[i];
    for (; i + N <= n; i += N)
        hn::Stream(hn::LoadU(d, from + i), d, to + i);
    for (; i < n; ++i)
        to[i] = from[i];
    hwy::FlushStream();
}

}  // namespace

void stream_float(const float* from, std::size_t n, float* to) {
    stream(from, n, to);
}
void stream_double(const double* from, std::size_t n, double* to) {
    stream(from, n, to);
}

}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI::grid {

HWY_EXPORT(stream_float);
HWY_EXPORT(stream_double);

template <>
void stream(const float* from, std::size_t n, float* to) noexcept {
    HWY_DYNAMIC_DISPATCH(stream_float)(from, n, to);
}
template <>
void stream(const double* from, std::size_t n, double* to) noexcept {
    HWY_DYNAMIC_DISPATCH(stream_double)(from, n, to);
}

}  // namespace osdx::inline OSDX_ABI::grid
#endif  // HWY_ONCE
