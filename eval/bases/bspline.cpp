// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/bspline.h"

namespace osdx::inline OSDX_ABI {

template void bspline_basis<float>(int, float, int, std::span<float>) noexcept;
template void bspline_basis<double>(int, double, int, std::span<double>) noexcept;

}  // namespace osdx::inline OSDX_ABI
