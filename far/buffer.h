// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace osdx::detail {

/// Memory for an array, of large pages where it is large and the system has them: fewer of them
/// are to be found and cleared, which is a fifth of the time in which a large table is built.
/// \throw std::bad_alloc
void* allocate_array(std::size_t n_bytes);
void free_array(void* array) noexcept;

/// Leaves numbers without a value as they are: for arrays that all threads fill, so that not
/// one of them writes zeros first.
template <class T>
struct UninitialisedAllocator : std::allocator<T> {
    template <class U>
    struct rebind {
        using other = UninitialisedAllocator<U>;
    };
    T* allocate(std::size_t n) { return static_cast<T*>(allocate_array(n * sizeof(T))); }
    void deallocate(T* array, std::size_t) noexcept { free_array(array); }
    template <class U>
    void construct(U* p) noexcept {
        ::new (static_cast<void*>(p)) U;
    }
    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
    }
};

/// An array; resize() adds elements without a value.
template <class T>
using Buffer = std::vector<T, UninitialisedAllocator<T>>;

}  // namespace osdx::detail
