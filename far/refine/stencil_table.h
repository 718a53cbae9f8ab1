// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
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
    /// there. For values of any number of channels, stored one after the other.
    /// \param begin, end  of the rows to be formed; those before are there already
    /// \pre values.size() == (first + n_rows()) n_channels
    template <class T>
    void extend(Index first, int n_channels, std::span<T> values, Index begin,
                Index end) const noexcept {
        assert(values.size() == std::size_t(first + n_rows()) * n_channels);
        if (n_channels == 3)
            extend_fixed<3>(first, values.data(), begin, end);
        else if (n_channels == 2)
            extend_fixed<2>(first, values.data(), begin, end);
        else
            extend_any(first, n_channels, values.data(), begin, end);
    }
    template <class T>
    void extend(Index first, int n_channels, std::span<T> values) const noexcept {
        extend(first, n_channels, values, 0, n_rows());
    }

private:
    template <int N, class T>
    void extend_fixed(Index first, T* values, Index begin, Index end) const noexcept {
        for (Index r = begin; r < end; ++r) {
            T sum[N] = {};
            for (std::size_t k = offsets[r]; k < offsets[r + 1]; ++k) {
                const T* in = values + std::size_t(indices[k]) * N;
                const T w = T(weights[k]);
                for (int c = 0; c < N; ++c)
                    sum[c] += w * in[c];
            }
            std::copy_n(sum, N, values + std::size_t(first + r) * N);
        }
    }
    template <class T>
    void extend_any(Index first, int n_channels, T* values, Index begin,
                    Index end) const noexcept {
        for (Index r = begin; r < end; ++r) {
            T* out = values + std::size_t(first + r) * n_channels;
            std::fill_n(out, n_channels, T(0));
            for (std::size_t k = offsets[r]; k < offsets[r + 1]; ++k) {
                const T* in = values + std::size_t(indices[k]) * n_channels;
                for (int c = 0; c < n_channels; ++c)
                    out[c] += T(weights[k]) * in[c];
            }
        }
    }
};

/// first, then second: row r of the result is row r of `second` over the inputs of `first`.
/// \param n_inputs  of `first`
OSDX_API StencilTable compose(const StencilTable& second, const StencilTable& first,
                              Index n_inputs);

}  // namespace osdx::inline OSDX_ABI
