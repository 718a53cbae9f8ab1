// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <functional>
#include <queue>

#include <osdx/dependents.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {
namespace {

void sort_out(std::vector<Index>& list) {
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
}

void append(std::vector<Index>& list, std::span<const Index> more) {
    list.insert(list.end(), more.begin(), more.end());
}

}  // namespace

template <class Each>
Dependents::Lists Dependents::Lists::collect(Index n_lists, Each&& each) {
    Lists lists;
    lists.offsets.assign(std::size_t(n_lists) + 1, 0);
    each([&](Index list, Index) { ++lists.offsets[list + 1]; });
    for (Index i = 0; i < n_lists; ++i)
        lists.offsets[i + 1] += lists.offsets[i];
    lists.items.resize(lists.offsets.back());
    std::vector<std::size_t> next(lists.offsets.begin(), lists.offsets.end() - 1);
    each([&](Index list, Index item) { lists.items[next[list]++] = item; });
    return lists;
}

Dependents::Dependents(const PatchTable& table) {
    const StencilTable& rows = table.refined_points();
    readers_ = Lists::collect(table.n_points(), [&](auto&& add) {
        for (Index r = 0; r < rows.n_rows(); ++r) {
            for (std::size_t k = rows.offsets[r]; k < rows.offsets[r + 1]; ++k)
                add(rows.indices[k], table.n_base_points() + r);
        }
    });
    patches_ = Lists::collect(table.n_points(), [&](auto&& add) {
        for (Index p = 0; p < table.n_patches(); ++p) {
            for (const Index point : table.patch(p).points)
                add(point, p);
        }
    });
    faces_ = Lists::collect(table.n_patches(), [&](auto&& add) {
        // The cells of a patch in a face stand together, for the most part.
        Index last_patch = kInvalidIndex, last_face = kInvalidIndex;
        std::vector<Cell> cells;
        for (Index quarter = 0; quarter < table.base().n_halfedges(); ++quarter) {
            const Index face = table.base().face(quarter);
            cells.clear();
            table.add_cells(quarter, cells);
            for (const Cell& cell : cells) {
                if (cell.patch == last_patch && face == last_face)
                    continue;
                add(cell.patch, face);
                last_patch = cell.patch;
                last_face = face;
            }
        }
    });
}

Change Dependents::of(std::span<const Index> vertices) const {
    Change change;
    const auto note = [&](Index point) { append(change.patches, patches_[point]); };
    // In ascending order, so that each point comes after those that its row reads.
    std::priority_queue<Index, std::vector<Index>, std::greater<>> open;
    const auto open_readers = [&](Index point) {
        for (const Index reader : readers_[point])
            open.push(reader);
    };
    for (const Index v : vertices) {
        note(v);
        open_readers(v);
    }
    while (!open.empty()) {
        const Index point = open.top();
        while (!open.empty() && open.top() == point)
            open.pop();
        change.points.push_back(point);
        note(point);
        open_readers(point);
    }
    sort_out(change.patches);
    for (const Index p : change.patches)
        append(change.faces, faces_[p]);
    sort_out(change.faces);
    return change;
}

}  // namespace osdx::inline OSDX_ABI
