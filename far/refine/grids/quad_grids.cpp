// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/grids/quad_grids.h"

#include <algorithm>
#include <cassert>
#include <vector>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
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

/// The halfedge of segment t, counted from the start of the side, of a side of a root.
Index on_side(const QuadGrids& g, Index root, Index side, Index t) {
    const Index last = g.size - 1;
    const Index face = side == 0   ? g.face(root, t, 0)
                       : side == 1 ? g.face(root, last, t)
                       : side == 2 ? g.face(root, last - t, last)
                                   : g.face(root, 0, last - t);
    return 4 * face + side;
}

/// All that is told by halfedge, of the cells of a root.
void link_root(const QuadGrids& g, Index root, Topology& t) {
    const Index s = g.size, first = g.face(root, 0, 0);
    const Index first_row = s * g.roots.n_edges + 2 * s * (s - 1) * root,
                first_column = first_row + s * (s - 1);
    // As if the grid went on beyond the sides of the root.
    for (Index j = 0; j < s; ++j) {
        Index f = first + s * j, h = 4 * f;
        const Index below = first_row + s * (j - 1), above = below + s,
                    left = first_column + (s - 1) * j - 1;
        for (Index i = 0; i < s; ++i, ++f, h += 4) {
            t.face_offsets[f] = h;
            t.twin[h] = h - 4 * s + 2;
            t.twin[h + 1] = h + 4 + 3;
            t.twin[h + 2] = h + 4 * s;
            t.twin[h + 3] = h - 4 + 1;
            t.edge[h] = below + i;
            t.edge[h + 1] = left + i + 1;
            t.edge[h + 2] = above + i;
            t.edge[h + 3] = left + i;
        }
    }
    for (Index side = 0; side < 4; ++side) {
        const Index on_root = 4 * root + side, twin = g.roots.twin[on_root],
                    edge = s * g.roots.edge[on_root];
        for (Index k = 0; k < s; ++k) {
            const Index h = on_side(g, root, side, k);
            t.twin[h] = twin == kInvalidIndex ? kInvalidIndex
                                              : on_side(g, twin / 4, twin % 4, s - 1 - k);
            t.edge[h] = edge + (g.is_first(on_root) ? k : s - 1 - k);
        }
    }
}

/// A halfedge for each vertex inside of a root and on its first edges: the border's, or the
/// lowest.
void link_vertices(const QuadGrids& g, Index root, std::span<Index> out) {
    const Index s = g.size;
    for (Index j = 1; j < s; ++j) {
        const Index v = g.vertex(root, 1, j), h = 4 * g.face(root, 0, j - 1) + 2;
        for (Index i = 0; i + 1 < s; ++i)
            out[v + i] = h + 4 * i;
    }
    for (Index side = 0; side < 4; ++side) {
        const Index on_root = 4 * root + side, twin = g.roots.twin[on_root];
        if (!g.is_first(on_root))
            continue;
        const Index v = g.edge_vertex(on_root, 1);
        for (Index k = 1; k < s; ++k) {
            // The cell before has its next corner there.
            const auto lower = [&](Index of_root, Index of_side, Index at) {
                const Index before = on_side(g, of_root, of_side, at - 1);
                return std::min(on_side(g, of_root, of_side, at),
                                before - of_side + ((of_side + 1) & 3));
            };
            out[v + k - 1] =
                twin == kInvalidIndex
                    ? on_side(g, root, side, k)
                    : std::min(lower(root, side, k), lower(twin / 4, twin % 4, s - k));
        }
    }
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
    detail::for_each_range(g.roots.n_faces(), grain(g.size), [&](Index begin, Index end) {
        std::vector<Index> rows(2 * (g.size + 1));
        Index *below = rows.data(), *above = below + g.size + 1;
        for (Index root = begin; root != end; ++root) {
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
    t.quads_only = true;
    t.vertex.resize(g.n_halfedges());
    face_vertices(g, t.vertex);
    t.face_offsets.resize(g.n_faces() + 1);
    t.face_offsets.back() = g.n_halfedges();
    t.twin.resize(g.n_halfedges());
    t.edge.resize(g.n_halfedges());
    t.vertex_halfedge.resize(g.n_vertices());
    detail::for_each_range(g.roots.n_faces(), grain(s), [&](Index begin, Index end) {
        for (Index root = begin; root != end; ++root) {
            link_root(g, root, t);
            link_vertices(g, root, t.vertex_halfedge);
        }
    });
    detail::for_each_range(
        g.roots.n_vertices(), Index(4096), [&](Index begin, Index end) {
            for (Index v = begin; v != end; ++v) {
                Index lowest = kInvalidIndex;
                g.roots.for_each_outgoing(v, [&](Index h) {
                    lowest = std::min(lowest, on_side(g, h / 4, h % 4, 0));
                });
                const Index first = g.roots.vertex_halfedge[v];
                t.vertex_halfedge[v] = first != kInvalidIndex && g.roots.is_border(first)
                                           ? on_side(g, first / 4, first % 4, 0)
                                           : lowest;
            }
        });
    return t;
}

}  // namespace osdx::inline OSDX_ABI
