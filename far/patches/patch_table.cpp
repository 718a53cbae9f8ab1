// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cassert>

#include <osdx/patch_table.h>
#include <osdx/patch_table_view.h>

#include "far/mesh/quadrant.h"
#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {

using View = PatchTableView;

Index PatchTable::whole_patch(Index face) const noexcept {
    if (base_.face_size(face) != 4 || degree_ % 2 == 0)
        return kInvalidIndex;
    const Index* root = nodes_.data() + base_.face_offsets[face];
    const Index patch = root[0] & View::kPatchMask;
    for (Index k = 0; k < 4; ++k) {
        if (root[k] !=
            (View::kLeafBit | View::kSquareBit | k << View::kCornerShift | patch))
            return kInvalidIndex;
    }
    return patches_[patch].level() == 0 ? patch : kInvalidIndex;
}

PatchPoint PatchTable::locate(const QuarterPoint& point,
                              Vec2<double> towards) const noexcept {
    assert(nodes_[point.quarter] != kInvalidIndex);  // has_surface()
    Vec2<double> p(point.x, point.y);
    Index node = nodes_[point.quarter];
    int turns = quarter_turns(base_, point.quarter);
    double scale = 2;
    while (!(node & View::kLeafBit)) {
        const detail::Quadrant q(p, towards);
        p = q.point(p);
        towards = q.direction(towards);
        node = nodes_[node + q.corner()];
        turns -= q.corner();
        scale *= 2;
    }
    const PatchLeaf at = view().leaf(node);
    const int extent = class_of(at.patch).extent();
    p = Vec2<double>(at.x, at.y) + double(at.size) * turn(p, at.turns);
    return {at.patch,
            at.sector,
            p.x / extent,
            p.y / extent,
            (turns + at.turns) & 3,
            scale * at.size / extent};
}

template <class T>
void PatchTable::refresh_channels(int n_channels, std::span<T> values) const {
    for (std::size_t g = 0; g + 1 < row_groups_.size(); ++g) {
        const Index first = row_groups_[g];
        detail::for_each_chunk(row_groups_[g + 1] - first, detail::kChunk,
                               [&](std::size_t, std::size_t begin, std::size_t end) {
                                   refined_points_.extend(
                                       n_base_points_, n_channels, values,
                                       first + static_cast<Index>(begin),
                                       first + static_cast<Index>(end));
                               });
    }
}
template void PatchTable::refresh_channels(int, std::span<float>) const;
template void PatchTable::refresh_channels(int, std::span<double>) const;

PatchPoint PatchTable::locate(const Address& address) const noexcept {
    return locate(to_quarter(base_, address));
}

std::vector<Cell> PatchTable::cells() const {
    std::vector<Cell> cells;
    for (Index quarter = 0; quarter < base_.n_halfedges(); ++quarter)
        add_cells(quarter, cells);
    return cells;
}

void PatchTable::add_cells(Index quarter, std::vector<Cell>& cells) const {
    if (!has_surface(base_.face(quarter)))
        return;
    const auto add = [&](auto&& self, Index node, Vec2<double> origin,
                         Vec2<double> x_axis) -> void {
        if (node & View::kLeafBit) {
            const PatchLeaf at = view().leaf(node);
            cells.push_back({quarter,
                             at.patch,
                             origin,
                             x_axis,
                             at.sector,
                             {at.x, at.y},
                             at.size,
                             at.turns});
            return;
        }
        const Vec2<double> y_axis = turn(x_axis, 1);
        for (int k = 0; k < 4; ++k) {
            const auto c = square_corner<double>(k);
            self(self, nodes_[node + k], origin + c.x * x_axis + c.y * y_axis,
                 0.5 * turn(x_axis, k));
        }
    };
    add(add, nodes_[quarter], {0, 0}, {1, 0});
}

PatchTableView PatchTable::view() const noexcept {
    return {degree_,
            n_base_points_,
            classes_,
            patches_,
            points_,
            nodes_,
            leaves_,
            refined_points_.offsets,
            refined_points_.indices,
            refined_points_.weights,
            row_groups_};
}

}  // namespace osdx::inline OSDX_ABI
