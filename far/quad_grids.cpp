// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/quad_grids.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <numeric>
#include <vector>

namespace osdx {
namespace {

/// The roots that one task takes, so that it has some thousands of cells.
std::size_t grain(Index size) {
    return std::max<std::size_t>(1, (std::size_t(1) << 14) / (std::size_t(size) * size));
}

/// Row j of the points of a root.
void fill_row(const QuadGrids& g, Index root, Index j, Index* row) {
    row[0] = g.vertex(root, 0, j);
    row[g.size] = g.vertex(root, g.size, j);
    if (g.size == 1)
        return;
    const Index first = g.vertex(root, 1, j);
    const Index step =
        g.size == 2 ? 0 : g.vertex(root, 2, j) - first;  // 1 or, wrapped, -1
    for (Index i = 1; i < g.size; ++i)
        row[i] = first + (i - 1) * step;
}

/// A cell (i, j) of a root and one of its sides.
struct CellSide {
    Index i, j, side;
};

/// Segment t, counted from the start of the side, of a side of a root.
CellSide segment(Index size, Index side, Index t) {
    const Index last = size - 1;
    switch (side) {
        case 0:
            return {t, 0, 0};
        case 1:
            return {last, t, 1};
        case 2:
            return {last - t, last, 2};
        default:
            return {0, last - t, 3};
    }
}

/// The cell beside another inside of a root. \return false where the root ends
bool step_across(Index size, CellSide& c) {
    switch (c.side) {
        case 0:
            if (c.j == 0)
                return false;
            --c.j;
            break;
        case 1:
            if (c.i + 1 == size)
                return false;
            ++c.i;
            break;
        case 2:
            if (c.j + 1 == size)
                return false;
            ++c.j;
            break;
        default:
            if (c.i == 0)
                return false;
            --c.i;
    }
    c.side ^= 2;
    return true;
}

}  // namespace

Index QuadGrids::from_split(Index halfedge) const noexcept {
    // Quad k of a split has its corner 0 at corner k and runs on from there: cells that turn.
    Index k = halfedge & 3, face = halfedge >> 2, n_digits = 0;
    for (Index s = size; s > 1; s >>= 1)
        ++n_digits;
    const Index root = face >> (2 * n_digits);
    Index i = 0, j = 0, turns = 0, half = size;
    for (Index d = n_digits; d-- > 0;) {
        half >>= 1;
        turns = (turns + (face >> (2 * d))) & 3;
        i += half * (turns == 1 || turns == 2);
        j += half * (turns >= 2);
    }
    return 4 * this->face(root, i, j) + ((k + turns) & 3);
}

void face_vertices(const QuadGrids& g, std::span<Index> out) {
    assert(out.size() == g.n_halfedges());
    if (g.size == 1) {
        std::ranges::copy(g.roots.vertex, out.begin());
        return;
    }
    const tbb::blocked_range<Index> roots(0, g.roots.n_faces(), grain(g.size));
    tbb::parallel_for(roots, [&](const tbb::blocked_range<Index>& range) {
        std::vector<Index> rows(2 * (g.size + 1));
        Index *below = rows.data(), *above = below + g.size + 1;
        for (Index root = range.begin(); root != range.end(); ++root) {
            fill_row(g, root, 0, below);
            Index* cell = out.data() + std::size_t(4) * g.face(root, 0, 0);
            for (Index j = 0; j < g.size; ++j) {
                fill_row(g, root, j + 1, above);
                for (Index i = 0; i < g.size; ++i) {
                    cell[4 * i] = below[i];
                    cell[4 * i + 1] = below[i + 1];
                    cell[4 * i + 2] = above[i + 1];
                    cell[4 * i + 3] = above[i];
                }
                cell += std::size_t(4) * g.size;
                std::swap(below, above);
            }
        }
    });
}

Topology to_topology(const QuadGrids& g) {
    const Index s = g.size;
    if (s == 1)
        return g.roots;
    Topology t;
    t.n_edges = g.n_edges();
    t.vertex.resize(g.n_halfedges());
    face_vertices(g, t.vertex);
    t.face_offsets.resize(g.n_faces() + 1);
    for (Index f = 0; f <= g.n_faces(); ++f)
        t.face_offsets[f] = 4 * f;
    t.twin.resize(g.n_halfedges());
    t.edge.resize(g.n_halfedges());
    t.face.resize(g.n_halfedges());
    t.vertex_halfedge.assign(g.n_vertices(), kInvalidIndex);
    const auto halfedge = [&](Index root, const CellSide& c) {
        return 4 * g.face(root, c.i, c.j) + c.side;
    };
    for (Index root = 0; root < g.roots.n_faces(); ++root) {
        const Index first_row = s * g.roots.n_edges + 2 * s * (s - 1) * root;
        const Index first_column = first_row + s * (s - 1);
        for (Index j = 0; j < s; ++j) {
            for (Index i = 0; i < s; ++i) {
                for (Index side = 0; side < 4; ++side) {
                    const Index h = halfedge(root, {i, j, side});
                    t.face[h] = g.face(root, i, j);
                    CellSide beside = {i, j, side};
                    if (!step_across(s, beside))
                        continue;
                    t.twin[h] = halfedge(root, beside);
                    t.edge[h] = side % 2 == 0
                                    ? first_row + s * (j + (side == 2) - 1) + i
                                    : first_column + (s - 1) * j + i + (side == 1) - 1;
                }
            }
        }
        for (Index side = 0; side < 4; ++side) {
            const Index on_root = 4 * root + side, twin = g.roots.twin[on_root];
            for (Index k = 0; k < s; ++k) {
                const Index h = halfedge(root, segment(s, side, k));
                t.twin[h] = twin == kInvalidIndex
                                ? kInvalidIndex
                                : halfedge(twin / 4, segment(s, twin % 4, s - 1 - k));
                t.edge[h] =
                    s * g.roots.edge[on_root] + (g.is_first(on_root) ? k : s - 1 - k);
            }
        }
    }
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        Index& out = t.vertex_halfedge[t.vertex[h]];
        if (out == kInvalidIndex || t.is_border(h))
            out = h;
    }
    return t;
}

}  // namespace osdx
