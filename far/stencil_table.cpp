// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/stencil_table.h"

namespace osdx {

StencilTable compose(const StencilTable& second, const StencilTable& first,
                     Index n_inputs) {
    // Gustavson (1978): one dense accumulator, cleared by the list of touched entries.
    StencilTable result;
    result.offsets.reserve(second.offsets.size());
    std::vector<double> sum(n_inputs, 0.0);
    std::vector<bool> touched(n_inputs, false);
    std::vector<Index> row;
    for (Index r = 0; r < second.n_rows(); ++r) {
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
    return result;
}

}  // namespace osdx
