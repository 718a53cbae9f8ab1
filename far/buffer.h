// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <new>
#include <utility>
#include <vector>

#include <osdx/version.h>

namespace osdx::inline OSDX_ABI {
namespace detail {

/// Leaves numbers without a value as they are, so that no thread writes zeros to what all of
/// them fill.
template <class T>
struct BufferAllocator : std::allocator<T> {
    template <class U>
    struct rebind {
        using other = BufferAllocator<U>;
    };
    template <class U>
    void construct(U* p) noexcept {
        ::new (static_cast<void*>(p)) U;
    }
    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
    }
};

}  // namespace detail

/// An array that may be large: what Buffer<T>(n) and resize(n) add has no value until it is
/// written to. T is a number or a structure of numbers.
///
/// Of large arrays the first touch of their pages costs more than what is written to them.
/// Where memory is plenty the C library takes large pages for it (glibc.malloc.hugetlb=1 in
/// GLIBC_TUNABLES), at a third of the price; in virtual machines that give free memory back they
/// may cost several times as much instead, so that this is left to the user.
template <class T>
using Buffer = std::vector<T, detail::BufferAllocator<T>>;

}  // namespace osdx::inline OSDX_ABI
