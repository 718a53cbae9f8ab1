// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cassert>
#include <span>
#include <vector>

#include "far/types.h"

namespace osdx {

/// Rows of sparse weights: out[r] = sum of weights[k] in[indices[k]] over row r.
///
/// Shapes: offsets n_rows + 1, starting with 0; indices and weights offsets.back().
/// A row sums to one, so that stencils commute with affine maps, or is empty.
struct StencilTable {
    std::vector<std::size_t> offsets{0};
    std::vector<Index> indices;
    std::vector<double> weights;

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

    /// The same for values of any number of channels, stored one point after the other.
    /// \pre out.size() == n_rows() n_channels; no overlap
    template <class T>
    void apply_channels(std::span<const T> in, int n_channels,
                        std::span<T> out) const noexcept {
        assert(out.size() == std::size_t(n_rows()) * n_channels);
        std::ranges::fill(out, T(0));
        for (Index r = 0; r < n_rows(); ++r) {
            T* o = out.data() + std::size_t(r) * n_channels;
            for (std::size_t k = offsets[r]; k < offsets[r + 1]; ++k) {
                const T* i = in.data() + std::size_t(indices[k]) * n_channels;
                for (int c = 0; c < n_channels; ++c)
                    o[c] += T(weights[k]) * i[c];
            }
        }
    }
};

/// first, then second: row r of the result is row r of `second` over the inputs of
/// `first`; rows whose flag in `wanted` is false stay empty (all are made when it is
/// empty).
/// \param n_inputs  of `first`
StencilTable compose(const StencilTable& second, const StencilTable& first,
                     Index n_inputs, const std::vector<bool>& wanted = {});

}  // namespace osdx
