// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

class PatchTable;

/// What a move of some base vertices changes; all in ascending order, each once.
struct Change {
    std::vector<Index> points;   ///< from PatchTable::n_base_points() on
    std::vector<Index> patches;  ///< with one of the vertices or points as control point
    std::vector<Index> faces;    ///< of the base, where these patches lie
};

/// The ways from base vertices over refined points to patches and base faces: the lists of
/// PatchTable read backwards. Of connectivity only, so that they hold for all positions.
///
/// Memory: 4 bytes for each weight, each control point of each patch and each cell; made in
/// linear time.
/// Threads: const members may run at the same time.
class OSDX_API Dependents {
public:
    /// \pre the table outlives this
    explicit Dependents(const PatchTable& table);

    /// In time proportional to the lists that are read, but for a logarithm.
    /// \pre every vertex is below n_base_points()
    Change of(std::span<const Index> vertices) const;

private:
    /// Lists of indices, one after the other.
    struct Lists {
        std::vector<std::size_t> offsets;
        std::vector<Index> items;
        std::span<const Index> operator[](Index i) const noexcept {
            return std::span(items).subspan(offsets[i], offsets[i + 1] - offsets[i]);
        }
        /// \param each  calls its argument with each (list, item)
        template <class Each>
        static Lists collect(Index n_lists, Each&& each);
    };

    Lists readers_;  // by point: the points whose rows read it
    Lists patches_;  // by point
    Lists faces_;    // by patch
};

}  // namespace osdx::inline OSDX_ABI
