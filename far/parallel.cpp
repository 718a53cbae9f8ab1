// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/parallel.h"

#include <cassert>

#include <tbb/task_arena.h>

#include <osdx/threads.h>

namespace osdx::inline OSDX_ABI {
namespace detail {

Progress*& current_progress() noexcept {
    thread_local Progress* current = nullptr;
    return current;
}

}  // namespace detail

std::size_t detail::n_threads() noexcept {
    return static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
}

void with_threads(int n_threads, const std::function<void()>& f) {
    assert(n_threads >= 1);
    tbb::task_arena arena(n_threads);
    const detail::Carried carried;
    arena.execute([&] {
        const auto work = carried.enter();
        f();
    });
}

}  // namespace osdx::inline OSDX_ABI
