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
    // Gustavson (1978): one dense accumulator, cleared by the list of touched entries.
    struct Sums {
        explicit Sums(Index n) : sum(n, 0.0), touched(n, false) {}
        std::vector<double> sum;
        std::vector<std::uint8_t> touched;
        std::vector<Index> row;
    };
    tbb::enumerable_thread_specific<Sums> of_thread(n_inputs);
    return detail::make_row_chunks(second.n_rows(), [&](Index begin, Index end,
                                                        StencilTable& result) {
        auto& [sum, touched, row] = of_thread.local();
        for (Index r = begin; r < end; ++r) {
            row.clear();
            for (std::size_t k = second.offsets[r]; k < second.offsets[r + 1]; ++k) {
                const Index s = second.indices[k];
                for (std::size_t m = first.offsets[s]; m < first.offsets[s + 1]; ++m) {
                    const Index i = first.indices[m];
                    if (!touched[i]) {
                        touched[i] = true;
                        row.push_back(i);
                    }
                    sum[i] += second.weights[k] * first.weights[m];
                }
            }
            std::ranges::sort(row);
            for (const Index i : row) {
                if (sum[i] != 0.0)
                    result.add(i, sum[i]);
                sum[i] = 0.0;
                touched[i] = false;
            }
            result.end_row();
        }
    });
}

}  // namespace osdx
