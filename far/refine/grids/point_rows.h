// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

#include <osdx/types.h>

#include "far/parallel.h"

/// Rows of points of C channels, one after the other: what refinement on grids is made of.
namespace osdx::inline OSDX_ABI::detail {

/// Calls f(begin, end) for parts of 0 .. n, each of `work` points an item.
template <class F>
void for_ranges(std::size_t n, std::size_t work, F&& f) {
    constexpr std::size_t kPointsInTask = 1 << 14;
    const std::size_t grain =
        kPointsInTask / std::clamp(work, std::size_t(1), kPointsInTask);
    for_each_range(n, grain, f);
}

/// out = (a + b)/2
template <class T>
void mean_row(const T* __restrict a, const T* __restrict b, T* __restrict out,
              std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = T(0.5) * (a[i] + b[i]);
}

/// out = (3 a + b)/4
template <class T>
void nearer_row(const T* __restrict a, const T* __restrict b, T* __restrict out,
                std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = T(0.75) * a[i] + T(0.25) * b[i];
}

/// out = b_weight b + side_weight (a + c)
template <class T>
void three_rows(T side_weight, const T* __restrict a, T b_weight, const T* __restrict b,
                const T* __restrict c, T* __restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = b_weight * b[i] + side_weight * (a[i] + c[i]);
}

/// A row of points whose ends may lie elsewhere than what is between them.
template <class T>
struct EndedRow {
    const T *first, *inside, *last;
};

/// Of n > 0 points inside a row: b_weight b + side_weight (a + c), a and c those beside b.
/// No copy of the row comes before: loads that overlap stores under way would wait for them.
template <int C, class T>
void three_along(T side_weight, T b_weight, const EndedRow<T>& row, std::size_t n,
                 T* out) {
    const T* in = row.inside;
    if (n == 1)
        return three_rows(side_weight, row.first, b_weight, in, row.last, out, C);
    const std::size_t end = C * (n - 1);
    three_rows(side_weight, row.first, b_weight, in, in + C, out, C);
    three_rows(side_weight, in, b_weight, in + C, in + 2 * C, out + C, end - C);
    three_rows(side_weight, in + end - C, b_weight, in + end, row.last, out + end, C);
}

/// Points that lie a constant step apart.
template <class T>
struct Strided {
    const T* first;
    std::ptrdiff_t step;
    const T* operator[](Index i) const { return first + std::ptrdiff_t(i) * step; }
    Strided reversed(Index n) const {
        return {first + (std::ptrdiff_t(n) - 1) * step, -step};
    }
};

/// Of constant size, so that it is a few moves and no call.
template <int C, class T>
void copy_point(const T* from, T* to) {
    std::memcpy(to, from, C * sizeof(T));
}

/// What interleave() reads and does not keep behind its inputs.
template <int C>
inline constexpr std::size_t kRowSlack = C == 3 ? 1 : 0;

/// Points of a and b in turns. \param n  values of each of them
/// \pre a and b have kRowSlack more
template <int C, class T>
void interleave(const T* __restrict a, const T* __restrict b, std::size_t n,
                T* __restrict out) {
    // Whole vectors: what is too much is written over by the next point.
    constexpr std::size_t kBytes = (C + kRowSlack<C>)*sizeof(T);
    std::size_t i = 0;
    for (; i + C < n; i += C, out += 2 * C) {
        std::memcpy(out, a + i, kBytes);
        std::memcpy(out + C, b + i, kBytes);
    }
    if (i < n) {
        std::memcpy(out, a + i, kBytes);
        copy_point<C>(b + i, out + C);
    }
}

}  // namespace osdx::inline OSDX_ABI::detail
