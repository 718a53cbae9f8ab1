// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/buffer.h"

#if __has_include(<sys/mman.h>)
#include <sys/mman.h>
#endif

namespace osdx::detail {
namespace {

constexpr std::size_t kLargePage = std::size_t(2) << 20;
/// Smaller arrays would leave much of their pages empty.
constexpr std::size_t kLarge = 2 * kLargePage;

}  // namespace

void* allocate_buffer(std::size_t bytes) {
    if (bytes < kLarge)
        return ::operator new(bytes);
    void* p = ::operator new(bytes, std::align_val_t(kLargePage));
#ifdef MADV_HUGEPAGE
    // Advice: where the system does not take it, memory is as good as ever. Whole pages only, so
    // that no other allocation's pages are meant.
    (void)madvise(p, bytes & ~(kLargePage - 1), MADV_HUGEPAGE);
#endif
    return p;
}

void free_buffer(void* p, std::size_t bytes) noexcept {
    if (bytes < kLarge)
        ::operator delete(p);
    else
        ::operator delete(p, std::align_val_t(kLargePage));
}

}  // namespace osdx::detail
