// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>

#include <osdx/build_patch_table.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI::detail {

/// How much refinement may leave open, so that it ends where it does not help.
///
/// A cell stays open where its control net, which reaches (d + 1)/2 edges, meets something
/// irregular or semi-sharp, or where it lies within d/2 edges of what waits until others are
/// further off: less than d + 1 edges from it either way. Irregular points do not become more,
/// and all of their corners are among those that the first level leaves open: (d + 1)^2 cells
/// for each of these. A semi-sharp edge becomes 2^l of them on level l, with d + 1 cells on both
/// sides, until its sharpness is used up. Where nothing becomes regular there are four times as
/// many cells with each level, which is soon more.
///
/// Sharpness and isolation are at an end on levels that are known beforehand. From there on
/// distances double with each level, from half an edge to d + 1 and more.
struct IsolationBound {
    int last_level;  ///< leaves nothing open
    std::size_t cells_of_corner, cells_of_edge;
    /// Of faces to refine around what is open, beyond those that its nets reach. They change
    /// no patch and no point.
    int more_rings = 0;

    explicit IsolationBound(const PatchTableOptions& options);

    /// \param n_corners  of the cells that the first level leaves open
    /// \param n_semi_sharp  edges of the base mesh, as long as any of them is on this level
    double most_cells(int level, std::size_t n_corners, std::size_t n_semi_sharp) const;
};

/// With a bound of one's own.
Result<PatchTable> build_patch_table(Topology base, Features features,
                                     const PatchTableOptions& options,
                                     const IsolationBound& bound);

}  // namespace osdx::inline OSDX_ABI::detail
