// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>

#include <osdx/version.h>

namespace osdx::inline OSDX_ABI::detail {

/// Asks in time for what is read or written next and may lie anywhere.
template <class T>
void prefetch(const T* begin, std::size_t n = 1) noexcept {
#if defined(__GNUC__)
    __builtin_prefetch(begin);
    __builtin_prefetch(reinterpret_cast<const char*>(begin + n) - 1);
#endif
}

}  // namespace osdx::inline OSDX_ABI::detail
