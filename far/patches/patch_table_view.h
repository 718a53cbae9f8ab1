// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// All of a patch table in flat arrays, for those who evaluate it elsewhere: on a GPU, in another
/// language. As stable as the interface's version.
///
/// Points: points 0 .. n_base_points are the vertices; the others follow from them by the rows of
/// sparse weights, row r is point n_base_points + r. Rows of a group, row_groups[g] ..
/// row_groups[g + 1], read only points before the group: a pass for each group makes them all.
///
/// Patches: patch i has the class classes[patches[i].patch_class()], which decides its basis, and
/// classes[..].n_points() control points, points[patches[i].first_point ..], in the order that
/// PatchClass tells.
///
/// From (face, u, v) to a patch: to_quarter() gives a quarter and (x, y) in it; nodes[quarter] is
/// the root of its quadtree. A node
///   - that is kInvalidIndex: there is no surface;
///   - with neither of the two highest bits: it is the index of its first child of four in
///     `nodes`. Child k is the one at corner k of the square, counter-clockwise from (0, 0): 1 for
///     x > 1/2, y <= 1/2, and so on. In it (x, y) becomes 2 ((x, y) - corner k) turned back by
///     k quarter turns;
///   - with the highest bit alone: the leaf leaves[node without that bit];
///   - with both bits: a leaf of a square patch, whose number are the lowest 28 bits. At levels
///     above 0 the leaf is {patch, 0, 0, 0, 2, 0}. At level 0 bits 28 and 29 are k, the corner of
///     the face: {patch, 0, 2 corner k, 1, k} for odd degrees, {patch, 0, (1, 1), 1, k} for even.
/// In the leaf, (a, b) = ((leaf.x, leaf.y) + leaf.size (x, y) turned by leaf.turns) / extent() of
/// the class: the chart of the sector, for n-sided patches the bilinear coordinates of its quad.
struct PatchTableView {
    int degree = 3;
    Index n_base_points = 0;
    std::span<const PatchClass> classes;
    std::span<const PatchRecord> patches;
    std::span<const Index> points;  ///< control points of all patches
    std::span<const Index>
        nodes;  ///< of quadtrees; the roots first, one for each quarter
    std::span<const PatchLeaf> leaves;

    std::span<const std::size_t> row_offsets;  ///< n_rows + 1
    std::span<const Index> row_points;
    std::span<const double> row_weights;
    std::span<const Index> row_groups;

    static constexpr Index kLeafBit = Index(1) << 31, kSquareBit = Index(1) << 30;
    static constexpr int kCornerShift = 28;  ///< where k is, of square patches
    static constexpr Index kPatchMask = (Index(1) << kCornerShift) - 1;

    /// \pre node & kLeafBit, not kInvalidIndex
    PatchLeaf leaf(Index node) const noexcept {
        if (!(node & kSquareBit))
            return leaves[node & ~kLeafBit];
        const Index patch = node & kPatchMask;
        if (patches[patch].level() > 0)
            return {patch, 0, 0, 0, 2, 0};
        // Even degrees: a quarter of the patch of its vertex, else a quarter of its face.
        const int k = static_cast<int>(node >> kCornerShift & 3);
        const auto p = degree % 2 == 0 ? Vec2<int>(1, 1) : 2 * square_corner<int>(k);
        return {patch,
                0,
                static_cast<std::int8_t>(p.x),
                static_cast<std::int8_t>(p.y),
                1,
                static_cast<std::uint8_t>(k)};
    }
};

}  // namespace osdx::inline OSDX_ABI
