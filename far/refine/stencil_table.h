// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cassert>
#include <span>

#include <osdx/buffer.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// Rows of sparse weights: out[r] = sum of weights[k] in[indices[k]] over row r.
///
/// Shapes: offsets n_rows + 1, starting with 0; indices and weights offsets.back().
/// A row sums to one, so that stencils commute with affine maps, or is empty.
struct StencilTable {
    Buffer<std::size_t> offsets{0};
    Buffer<Index> indices;
    Buffer<double> weights;

    bool operator==(const StencilTable&) const = default;

    Index n_rows() const noexcept { return static_cast<Index>(offsets.size() - 1); }

    void add(Index index, double weight) {
        indices.push_back(index);
        weights.push_back(weight);
    }
    void end_row() { offsets.push_back(indices.size()); }

    /// \pre out.size() == n_rows(); every index is below in.size(); no overlap
    template <class V>
    void apply(std::span<const V> in, std::span<V> out) const noexcept {
        assert(out.size() == n_rows());
        using T = typename V::value_type;
        for (Index r = 0; r < n_rows(); ++r) {
            V sum(T(0));
            for (std::size_t k = offsets[r]; k < offsets[r + 1]; ++k)
                sum += T(weights[k]) * in[indices[k]];
            out[r] = sum;
        }
    }

    /// The rows extend an array: row r reads what stands before values[first + r] and writes
    /// there. For values of any number of channels, stored one after the other; those of a channel
    /// do not depend on the others. T: float or double.
    /// \param begin, end  of the rows to be formed; those before are there already
    /// \pre values.size() == (first + n_rows()) n_channels
    template <class T>
    OSDX_API void extend(Index first, int n_channels, std::span<T> values, Index begin,
                         Index end) const noexcept;
    template <class T>
    void extend(Index first, int n_channels, std::span<T> values) const noexcept {
        extend(first, n_channels, values, 0, n_rows());
    }
};

extern template OSDX_API void StencilTable::extend(Index, int, std::span<float>, Index,
                                                   Index) const noexcept;
extern template OSDX_API void StencilTable::extend(Index, int, std::span<double>, Index,
                                                   Index) const noexcept;

/// first, then second: row r of the result is row r of `second` over the inputs of `first`.
/// \param n_inputs  of `first`
OSDX_API StencilTable compose(const StencilTable& second, const StencilTable& first,
                              Index n_inputs);

}  // namespace osdx::inline OSDX_ABI
