// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/buffer.h"

#include <cstdint>
#include <cstdlib>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace osdx::detail {
namespace {

/// Advises the system to use large pages for what of them lies in the array; it may decline.
void advise_large_pages([[maybe_unused]] void* array,
                        [[maybe_unused]] std::size_t n_bytes) noexcept {
#ifdef MADV_HUGEPAGE
    constexpr std::size_t kPage = std::size_t(1) << 21;
    if (n_bytes < 2 * kPage)
        return;
    const auto address = reinterpret_cast<std::uintptr_t>(array);
    const std::size_t before = (kPage - address % kPage) % kPage,
                      size = (n_bytes - before) / kPage * kPage;
    madvise(static_cast<char*>(array) + before, size, MADV_HUGEPAGE);
#endif
}

}  // namespace

void* allocate_array(std::size_t n_bytes) {
    void* const array = std::malloc(n_bytes > 0 ? n_bytes : 1);
    if (!array)
        throw std::bad_alloc();
    advise_large_pages(array, n_bytes);
    return array;
}

void free_array(void* array) noexcept {
    std::free(array);
}

}  // namespace osdx::detail
