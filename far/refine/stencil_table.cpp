// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>

#include <osdx/stencil_table.h>

#include "far/parallel.h"
#include "far/refine/stencil_rows.h"

namespace osdx::inline OSDX_ABI {

StencilTable detail::joined(std::span<StencilTable> tables) {
    if (tables.size() == 1)
        return std::move(tables[0]);
    struct Place {
        std::size_t row = 0, entry = 0;
    };
    std::vector<Place> places(tables.size() + 1);
    for (std::size_t i = 0; i < tables.size(); ++i) {
        places[i + 1] = {places[i].row + tables[i].n_rows(),
                         places[i].entry + tables[i].indices.size()};
    }
    StencilTable all;
    all.offsets.resize(places.back().row + 1);
    all.indices.resize(places.back().entry);
    all.weights.resize(places.back().entry);
    for_each_chunk(tables.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
        const auto [row, entry] = places[i];
        for (Index r = 1; r <= tables[i].n_rows(); ++r)
            all.offsets[row + r] = entry + tables[i].offsets[r];
        std::copy(tables[i].indices.begin(), tables[i].indices.end(),
                  all.indices.data() + entry);
        std::copy(tables[i].weights.begin(), tables[i].weights.end(),
                  all.weights.data() + entry);
        tables[i] = {};
    });
    return all;
}

namespace detail {
namespace {

std::size_t hash_of(const StencilTable& table, Index row) noexcept {
    // Multiply and fold: FNV-1a with words for bytes (Fowler, Noll and Vo).
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto add = [&](std::uint64_t word) {
        hash = (hash ^ word) * 0x100000001b3u;
        hash ^= hash >> 32;
    };
    for (std::size_t k = table.offsets[row]; k < table.offsets[row + 1]; ++k) {
        add(table.indices[k]);
        add(std::bit_cast<std::uint64_t>(table.weights[k]));
    }
    return hash;
}

bool equal_rows(const StencilTable& a, Index row_a, const StencilTable& b,
                Index row_b) noexcept {
    const std::size_t begin_a = a.offsets[row_a], n = a.offsets[row_a + 1] - begin_a,
                      begin_b = b.offsets[row_b];
    return b.offsets[row_b + 1] - begin_b == n &&
           std::equal(a.indices.data() + begin_a, a.indices.data() + begin_a + n,
                      b.indices.data() + begin_b) &&
           std::equal(a.weights.data() + begin_a, a.weights.data() + begin_a + n,
                      b.weights.data() + begin_b);
}

}  // namespace

std::size_t DistinctRows::slot_of(std::size_t hash) const noexcept {
    return hash & (slots_.size() - 1);
}

void DistinctRows::grow() {
    const std::size_t n = rows_.n_rows() - first_;
    slots_.assign(std::bit_ceil(std::max<std::size_t>(64, 4 * n)), kInvalidIndex);
    for (Index r = first_; r < rows_.n_rows(); ++r) {
        std::size_t slot = slot_of(hashes_[r]);
        while (slots_[slot] != kInvalidIndex)
            slot = slot_of(slot + 1);
        slots_[slot] = r;
    }
}

Index DistinctRows::find_or_add(const StencilTable& table, Index row) {
    if (2 * std::size_t(rows_.n_rows() - first_) >= slots_.size())
        grow();
    const std::size_t hash = hash_of(table, row);
    std::size_t slot = slot_of(hash);
    for (; slots_[slot] != kInvalidIndex; slot = slot_of(slot + 1)) {
        const Index r = slots_[slot];
        if (hashes_[r] == hash && equal_rows(rows_, r, table, row))
            return r;
    }
    slots_[slot] = rows_.n_rows();
    hashes_.push_back(hash);
    for (std::size_t k = table.offsets[row]; k < table.offsets[row + 1]; ++k)
        rows_.add(table.indices[k], table.weights[k]);
    rows_.end_row();
    return slots_[slot];
}

}  // namespace detail

namespace {

/// Channels that are summed at a time.
constexpr int kMostChannels = 8;

/// Rows of N channels, or with a stride N of more: by four at a time, the last four of N where
/// they do not go into it.
template <int N, class T>
void extend_by(const StencilTable& t, Index first, int stride, T* values, Index begin,
               Index end) noexcept {
    constexpr int kFour = N < 4 ? N : 4, kLast = N - kFour;
    for (Index r = begin; r < end; ++r) {
        T sum[kFour] = {}, last[kFour] = {};
        for (std::size_t k = t.offsets[r]; k < t.offsets[r + 1]; ++k) {
            const T* in = values + std::size_t(t.indices[k]) * stride;
            const T w = T(t.weights[k]);
            for (int c = 0; c < kFour; ++c)
                sum[c] += w * in[c];
            if constexpr (kLast > 0) {
                for (int c = 0; c < kFour; ++c)
                    last[c] += w * in[kLast + c];
            }
        }
        T* const out = values + std::size_t(first + r) * stride;
        std::copy_n(sum, kFour, out);
        if constexpr (kLast > 0)
            std::copy_n(last, kFour, out + kLast);
    }
}

/// Calls f with std::integral_constant<int, n>. \pre 1 <= n <= N
template <int N, class F>
void with_channels(int n, F&& f) {
    if constexpr (N > 1) {
        if (n < N)
            return with_channels<N - 1>(n, f);
    }
    f(std::integral_constant<int, N>());
}

}  // namespace

template <class T>
void StencilTable::extend(Index first, int n_channels, std::span<T> values, Index begin,
                          Index end) const noexcept {
    assert(values.size() == std::size_t(first + n_rows()) * n_channels);
    if (n_channels == 0)
        return;
    if (n_channels <= kMostChannels) {
        with_channels<kMostChannels>(n_channels, [&](auto n) {
            extend_by<n>(*this, first, n, values.data(), begin, end);
        });
        return;
    }
    // Row by row, so that a row's weights are read once.
    for (Index r = begin; r < end; ++r) {
        for (int c = 0; c < n_channels; c += kMostChannels)
            with_channels<kMostChannels>(
                std::min(kMostChannels, n_channels - c), [&](auto n) {
                    extend_by<n>(*this, first, n_channels, values.data() + c, r, r + 1);
                });
    }
}
template void StencilTable::extend(Index, int, std::span<float>, Index,
                                   Index) const noexcept;
template void StencilTable::extend(Index, int, std::span<double>, Index,
                                   Index) const noexcept;

StencilTable compose(const StencilTable& second, const StencilTable& first,
                     Index n_inputs) {
    detail::PerThread<detail::DenseRow> of_thread;
    return detail::make_row_chunks(
        second.n_rows(), [&](Index begin, Index end, StencilTable& result) {
            detail::DenseRow& row = of_thread.local();
            row.fit(n_inputs);
            for (Index r = begin; r < end; ++r) {
                for (std::size_t k = second.offsets[r]; k < second.offsets[r + 1]; ++k) {
                    const Index s = second.indices[k];
                    for (std::size_t m = first.offsets[s]; m < first.offsets[s + 1]; ++m)
                        row.add(first.indices[m], second.weights[k] * first.weights[m]);
                }
                row.take([&](Index i, double w) { result.add(i, w); });
                result.end_row();
            }
        });
}

}  // namespace osdx::inline OSDX_ABI
