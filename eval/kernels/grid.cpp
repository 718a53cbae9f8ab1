// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/grid.h"

#include <hwy/highway.h>

namespace osdx::inline OSDX_ABI::grid {

template <class T>
Kernel<T> kernel(const Table<T>& table, Layout layout) noexcept {
    // Until a target is chosen, Highway's functions look for one with every call.
    hwy::ChosenTarget& chosen = hwy::GetChosenTarget();
    if (!chosen.IsInitialized())
        chosen.Update(hwy::SupportedTargets());
    if (table.product_degree == 0)
        return full_kernel<T>();
    if (table.product_degree < kHighDegree || layout == Layout::Planar)
        return product_kernel<T>();
    return high_kernel<T>();
}
template Kernel<float> kernel(const Table<float>&, Layout) noexcept;
template Kernel<double> kernel(const Table<double>&, Layout) noexcept;

template <class T>
std::size_t scratch_size(const Table<T>& table) noexcept {
    // For other layouts; a vector may reach a little beyond.
    return 3 * padded<T>(table.n_samples()) * table.n_derivatives() + kPanel<T>;
}
template std::size_t scratch_size(const Table<float>&) noexcept;
template std::size_t scratch_size(const Table<double>&) noexcept;

}  // namespace osdx::inline OSDX_ABI::grid
