// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <utility>
#include <vector>

#include "far/types.h"

/// Loops on all threads. Ranges are cut into chunks of a fixed size, so that what is made chunk
/// by chunk does not depend on the number of threads.
///
/// For the sources of this project: no public header includes this.
namespace osdx::detail {

/// Enough for the price of a task, for work of some nanoseconds an element.
inline constexpr std::size_t kChunk = 2048;

inline std::size_t n_chunks(std::size_t n, std::size_t size = kChunk) noexcept {
    return (n + size - 1) / size;
}

/// Calls f(chunk, begin, end) for the chunks of [0, n).
template <class F>
void for_each_chunk(std::size_t n, std::size_t size, F&& f) {
    const auto run = [&](std::size_t chunk) {
        f(chunk, chunk * size, std::min(n, (chunk + 1) * size));
    };
    if (n <= size) {
        if (n > 0)
            run(0);
        return;
    }
    tbb::parallel_for(std::size_t(0), n_chunks(n, size), run);
}

/// Calls f(i) for i in [0, n).
template <class F>
void for_each_index(std::size_t n, F&& f, std::size_t size = kChunk) {
    for_each_chunk(n, size, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            f(static_cast<Index>(i));
    });
}

/// The lowest i in [0, n) of which `is` holds; kInvalidIndex if there is none.
template <class Is>
Index first_index(std::size_t n, Is&& is, std::size_t size = kChunk) {
    std::atomic<Index> first = kInvalidIndex;
    for_each_chunk(n, size, [&](std::size_t, std::size_t begin, std::size_t end) {
        if (begin >= first.load(std::memory_order_relaxed))
            return;
        for (std::size_t i = begin; i < end; ++i) {
            if (!is(static_cast<Index>(i)))
                continue;
            Index known = first.load(std::memory_order_relaxed);
            while (i < known && !first.compare_exchange_weak(known, static_cast<Index>(i),
                                                             std::memory_order_relaxed)) {
            }
            return;
        }
    });
    return first;
}

/// Numbers what is counted chunk by chunk: count(begin, end) says how many a chunk holds, then
/// allocate(sum) hears how many there are in all, and write(first, begin, end) gets the number
/// of the first one of a chunk.
template <class Count, class Allocate, class Write>
void for_each_numbered(std::size_t n, std::size_t size, Count&& count,
                       Allocate&& allocate, Write&& write) {
    std::vector<std::size_t> first(n_chunks(n, size));
    for_each_chunk(n, size, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
        first[chunk] = count(begin, end);
    });
    std::size_t sum = 0;
    for (std::size_t& f : first)
        sum += std::exchange(f, sum);
    allocate(sum);
    for_each_chunk(n, size, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
        write(first[chunk], begin, end);
    });
}

/// Sets a flag that several threads may set.
inline void set_flag(std::uint8_t& flag) noexcept {
    std::atomic_ref(flag).store(1, std::memory_order_relaxed);
}

}  // namespace osdx::detail
