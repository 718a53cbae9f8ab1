// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include "far/parallel.h"
#include "far/stencil_table.h"

/// Stencil tables whose rows are made on all threads. For the sources of this project.
namespace osdx::detail {

inline constexpr std::size_t kRowChunk = 512;

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

}  // namespace osdx::detail
