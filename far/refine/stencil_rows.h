// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include <osdx/stencil_table.h>

#include "far/parallel.h"

/// Stencil tables whose rows are made on all threads. For the sources of this project.
namespace osdx::inline OSDX_ABI::detail {

/// Rows without their repetitions, numbered in the order in which they come.
class DistinctRows {
public:
    const StencilTable& rows() const noexcept { return rows_; }
    /// The number of a row of another table, of the same entries in the same order.
    Index find_or_add(const StencilTable& table, Index row);
    /// Rows to come are compared to none of those before.
    void forget() noexcept {
        first_ = rows_.n_rows();
        slots_.clear();
    }

private:
    std::size_t slot_of(std::size_t hash) const noexcept;
    void grow();

    StencilTable rows_;
    Index first_ = 0;
    std::vector<std::size_t> hashes_;  // of all rows
    // A table of some power of two, less than half of it full; where a slot is taken, the next
    // free one: kInvalidIndex.
    std::vector<Index> slots_;
};

inline constexpr std::size_t kRowChunk = 256;

/// A row whose inputs come again and again.
///
/// Gustavson (1978): one dense accumulator, cleared by the list of touched entries.
class DenseRow {
public:
    void fit(Index n_inputs) {
        if (sum_.size() < n_inputs) {
            sum_.resize(n_inputs);
            touched_.resize(n_inputs);
        }
    }
    /// \pre fit() for more inputs than this one
    void add(Index input, double weight) {
        if (!touched_[input]) {
            touched_[input] = true;
            inputs_.push_back(input);
        }
        sum_[input] += weight;
    }
    /// Hands f(input, weight) the entries in ascending order, and is empty again.
    template <class F>
    void take(F&& f) {
        std::ranges::sort(inputs_);
        for (const Index i : inputs_) {
            if (sum_[i] != 0.0)
                f(i, sum_[i]);
            sum_[i] = 0.0;
            touched_[i] = false;
        }
        inputs_.clear();
    }

private:
    std::vector<double> sum_;
    Flags touched_;
    std::vector<Index> inputs_;
};

/// The rows of some tables, one table after the other.
StencilTable joined(std::span<StencilTable> tables);

/// make(begin, end, table) appends the rows of a chunk.
template <class Make>
StencilTable make_row_chunks(Index n_rows, Make&& make) {
    std::vector<StencilTable> tables(n_chunks(n_rows, kRowChunk));
    for_each_chunk(
        n_rows, kRowChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
            tables[chunk].offsets.reserve(end - begin + 1);
            make(static_cast<Index>(begin), static_cast<Index>(end), tables[chunk]);
        });
    return joined(tables);
}

/// make(row, table) adds the entries of a row.
template <class Make>
StencilTable make_rows(Index n_rows, Make&& make) {
    return make_row_chunks(n_rows, [&](Index begin, Index end, StencilTable& table) {
        for (Index r = begin; r < end; ++r) {
            make(r, table);
            table.end_row();
        }
    });
}

}  // namespace osdx::inline OSDX_ABI::detail
