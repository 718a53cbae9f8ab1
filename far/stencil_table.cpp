// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/stencil_table.h"

#include <tbb/enumerable_thread_specific.h>

#include "far/stencil_rows.h"

namespace osdx {

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

StencilTable compose(const StencilTable& second, const StencilTable& first,
                     Index n_inputs) {
    tbb::enumerable_thread_specific<detail::DenseRow> of_thread;
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

}  // namespace osdx
