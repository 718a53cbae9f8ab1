// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <limits>
#include <new>
#include <utility>
#include <vector>

namespace osdx {
namespace detail {

/// From some megabytes on in pages of that size where the system has them: the first touch of a
/// large array costs more than what is written to it, and a large page a third of small ones.
/// \param bytes  > 0
/// \throws std::bad_alloc
void* allocate_buffer(std::size_t bytes);
/// \param bytes  as it was allocated
void free_buffer(void* p, std::size_t bytes) noexcept;

/// Leaves numbers without a value as they are, so that no thread writes zeros to what all of
/// them fill.
template <class T>
struct BufferAllocator {
    using value_type = T;

    BufferAllocator() noexcept = default;
    template <class U>
    BufferAllocator(const BufferAllocator<U>&) noexcept {}

    T* allocate(std::size_t n) {
        if (n > std::numeric_limits<std::size_t>::max() / sizeof(T))
            throw std::bad_array_new_length();
        return static_cast<T*>(allocate_buffer(n * sizeof(T)));
    }
    void deallocate(T* p, std::size_t n) noexcept { free_buffer(p, n * sizeof(T)); }

    template <class U>
    void construct(U* p) noexcept {
        ::new (static_cast<void*>(p)) U;
    }
    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
    }
    template <class U>
    bool operator==(const BufferAllocator<U>&) const noexcept {
        return true;
    }
};

}  // namespace detail

/// An array that may be large: what Buffer<T>(n) and resize(n) add has no value until it is
/// written to, and memory comes in large pages where the system has them. T is a number or a
/// structure of numbers.
template <class T>
using Buffer = std::vector<T, detail::BufferAllocator<T>>;

}  // namespace osdx
