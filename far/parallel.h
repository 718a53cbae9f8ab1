// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <osdx/buffer.h>
#include <osdx/progress.h>
#include <osdx/result.h>
#include <osdx/types.h>

/// The one door to threads: loops on all of the caller's. Chunks are of a fixed size, so that
/// what is made chunk by chunk does not depend on the number of threads.
///
/// For the sources of this project: no public header includes this.
namespace osdx::inline OSDX_ABI::detail {

/// What the work of this thread tells of itself; null where nobody asks.
OSDX_API Progress*& current_progress() noexcept;

/// Thrown where work is cancelled, caught by cancellable().
struct Cancelled {};

/// While it lives, the work of this thread is that of a Progress.
class ProgressScope {
public:
    explicit ProgressScope(Progress* progress) noexcept
        : before_(std::exchange(current_progress(), progress)) {}
    ~ProgressScope() { current_progress() = before_; }
    ProgressScope(const ProgressScope&) = delete;
    ProgressScope& operator=(const ProgressScope&) = delete;

private:
    Progress* before_;
};

/// Of the thread that begins a loop, for those that take part in it.
class Carried {
public:
    Carried() noexcept : progress_(current_progress()) {}
    /// Throws Cancelled.
    ProgressScope enter() const {
        if (progress_ && progress_->is_cancelled())
            throw Cancelled();
        return ProgressScope(progress_);
    }

private:
    Progress* progress_;
};

/// Calls f, which returns a Result: what is not done when it is cancelled is left.
template <class F>
auto cancellable(Progress* progress, F&& f) -> decltype(f()) {
    if (!progress)
        return f();
    const auto refused = [] {
        return fail(ErrorCode::Cancelled, "the work was cancelled");
    };
    try {
        progress->set("starting", 0, 0);
        const ProgressScope scope(progress);
        auto result = f();
        if (progress->is_cancelled())
            return refused();
        progress->set("done", 1, 1);
        return result;
    } catch (const Cancelled&) {
        return refused();
    }
}

/// What comes now, and which part of the whole it is. Throws Cancelled.
inline void at_stage(const char* stage, double begin, double end) {
    if (Progress* const progress = current_progress()) {
        if (progress->is_cancelled())
            throw Cancelled();
        progress->set(stage, begin, end);
    }
}

/// How much of the stage is done. Throws Cancelled.
inline void part_done(double done) {
    if (Progress* const progress = current_progress()) {
        if (progress->is_cancelled())
            throw Cancelled();
        progress->advance(done);
    }
}

/// Tells how much of a stage is done as its parts are.
class Steps {
public:
    explicit Steps(std::size_t n) noexcept : n_(n), progress_(current_progress()) {}
    void add(std::size_t n_done) noexcept {
        if (progress_) {
            const auto before = done_.fetch_add(n_done, std::memory_order_relaxed);
            progress_->advance(double(before + n_done) / double(n_));
        }
    }

private:
    std::size_t n_;
    Progress* progress_;
    std::atomic<std::size_t> done_ = 0;
};

/// Enough for the price of a task, for work of some nanoseconds an element.
inline constexpr std::size_t kChunk = 2048;
/// The same for work of some ten nanoseconds an element, so that small meshes are shared too.
inline constexpr std::size_t kSmallChunk = 256;

/// How many may work at the same time: for the size of pieces, never for results.
std::size_t n_threads() noexcept;

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
    const Carried carried;
    tbb::parallel_for(std::size_t(0), n_chunks(n, size), [&](std::size_t chunk) {
        const auto work = carried.enter();
        run(chunk);
    });
}

/// Calls f(begin, end) for parts of [0, n), cut as threads are free, down to `grain`.
template <class Number, class F>
void for_each_range(Number n, std::size_t grain, F&& f) {
    const Carried carried;
    tbb::parallel_for(tbb::blocked_range<Number>(0, n, grain), [&](const auto& range) {
        const auto work = carried.enter();
        f(range.begin(), range.end());
    });
}

/// Calls f(i) for i in [0, n), of which each may be a task.
template <class Number, class F>
void for_each_task(Number n, F&& f) {
    const Carried carried;
    tbb::parallel_for(Number(0), n, [&](Number i) {
        const auto work = carried.enter();
        f(i);
    });
}

/// Calls both.
template <class F, class G>
void in_parallel(F&& f, G&& g) {
    const Carried carried;
    tbb::parallel_invoke(
        [&] {
            const auto work = carried.enter();
            f();
        },
        [&] {
            const auto work = carried.enter();
            g();
        });
}

/// add(begin, end, sum) for parts of [0, n), merged in an order that does not depend on the
/// number of threads, by a.merge(b).
template <class Sum, class Number, class Add>
Sum sum_over(Number n, std::size_t grain, Add&& add) {
    const Carried carried;
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<Number>(0, n, grain), Sum{},
        [&](const auto& range, Sum sum) {
            const auto work = carried.enter();
            add(range.begin(), range.end(), sum);
            return sum;
        },
        [](Sum a, const Sum& b) {
            a.merge(b);
            return a;
        });
}

/// One T for each thread that asks for its local() one.
template <class T>
using PerThread = tbb::enumerable_thread_specific<T>;

/// Calls f(i) for i in [0, n).
template <class F>
void for_each_index(std::size_t n, F&& f, std::size_t size = kChunk) {
    for_each_chunk(n, size, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            f(static_cast<Index>(i));
    });
}

/// Makes a number, which several threads may lower, no higher than another one.
inline void lower(std::atomic<Index>& number, Index to) noexcept {
    Index known = number.load(std::memory_order_relaxed);
    while (to < known &&
           !number.compare_exchange_weak(known, to, std::memory_order_relaxed)) {
    }
}

/// The lowest i in [0, n) of which `is` holds; kInvalidIndex if there is none.
template <class Is>
Index first_index(std::size_t n, Is&& is, std::size_t size = kChunk) {
    std::atomic<Index> first = kInvalidIndex;
    for_each_chunk(n, size, [&](std::size_t, std::size_t begin, std::size_t end) {
        if (begin >= first.load(std::memory_order_relaxed))
            return;
        for (std::size_t i = begin; i < end; ++i) {
            if (is(static_cast<Index>(i)))
                return lower(first, static_cast<Index>(i));
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

/// An array of one value.
template <class T>
Buffer<T> filled(std::size_t n, T value) {
    Buffer<T> array(n);
    for_each_chunk(n, 8 * kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
        std::fill(array.begin() + begin, array.begin() + end, value);
    });
    return array;
}

/// The elements whose flags are set, in ascending order.
/// \param numbers  when not null: where each element stands there, or kInvalidIndex
inline Buffer<Index> flagged(const Flags& flags, Buffer<Index>* numbers = nullptr) {
    Buffer<Index> which;
    if (numbers)
        numbers->resize(flags.size());
    for_each_numbered(
        flags.size(), 2 * kChunk,
        [&](std::size_t begin, std::size_t end) {
            return std::accumulate(flags.begin() + begin, flags.begin() + end,
                                   std::size_t(0));
        },
        [&](std::size_t n) { which.resize(n); },
        [&](std::size_t next, std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                if (numbers)
                    (*numbers)[i] = flags[i] ? static_cast<Index>(next) : kInvalidIndex;
                if (flags[i])
                    which[next++] = static_cast<Index>(i);
            }
        });
    return which;
}

/// Sets a flag that several threads may set.
inline void set_flag(std::uint8_t& flag) noexcept {
    std::atomic_ref(flag).store(1, std::memory_order_relaxed);
}

/// Makes a number, which several threads may raise, no lower than another one.
inline void raise(Index& number, Index to) noexcept {
    const std::atomic_ref<Index> atom(number);
    Index known = atom.load(std::memory_order_relaxed);
    while (known < to &&
           !atom.compare_exchange_weak(known, to, std::memory_order_relaxed)) {
    }
}

}  // namespace osdx::inline OSDX_ABI::detail
