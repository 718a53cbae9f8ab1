// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <span>

#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// A mesh of quads, the roots, each of them parted into size x size cells: what uniform
/// refinement makes of a mesh. All connectivity follows by formula from that of the roots.
///
/// Point (i, j) of a root, 0 <= i, j <= size: its corners 0, 1, 2, 3 are (0, 0), (size, 0),
/// (size, size), (0, size). Cell (i, j), 0 <= i, j < size, has the corners (i, j), (i + 1, j),
/// (i + 1, j + 1), (i, j + 1), in this order.
///
/// Numbers, with s = size and V, E, F roots:
///   vertices  v, the vertices of the roots, v < V;
///             V + (s-1) e + t-1, inside root edge e, t = 1 .. s-1 from the start of its
///             lower halfedge;
///             V + (s-1) E + (s-1)^2 f + (s-1) (j-1) + i-1, inside root f, 0 < i, j < s
///   faces     s^2 f + s j + i, cell (i, j) of root f
///   halfedges 4 face + k, from corner k of the cell
///   edges     s e + t, between t and t + 1 on root edge e;
///             s E + 2 s (s-1) f + s (j-1) + i, from (i, j) to (i + 1, j), 0 < j < s;
///             s E + 2 s (s-1) f + s (s-1) + (s-1) j + i-1, from (i, j) to (i, j + 1), 0 < i < s
/// While size is 1 the roots may be any polygons.
/// This is a view: the roots are kept elsewhere.
struct QuadGrids {
    const Topology& roots;
    Index size = 1;

    Index n_inner() const noexcept { return size - 1; }  ///< vertices inside a root edge
    Index first_edge_vertex() const noexcept { return roots.n_vertices(); }
    Index first_face_vertex() const noexcept {
        return first_edge_vertex() + n_inner() * roots.n_edges;
    }
    Index n_vertices() const noexcept {
        return first_face_vertex() + n_inner() * n_inner() * roots.n_faces();
    }
    Index n_faces() const noexcept { return size * size * roots.n_faces(); }
    Index n_halfedges() const noexcept { return size * size * roots.n_halfedges(); }
    Index n_edges() const noexcept {
        return size * roots.n_edges + 2 * size * n_inner() * roots.n_faces();
    }

    /// Whether a root edge is numbered from the start of this halfedge on.
    bool is_first(Index root_halfedge) const noexcept {
        return root_halfedge < roots.twin[root_halfedge];
    }
    /// The point on a root edge t steps from the start of a halfedge, 0 <= t <= size.
    Index edge_vertex(Index root_halfedge, Index t) const noexcept {
        if (t == 0)
            return roots.vertex[root_halfedge];
        if (t == size)
            return roots.to_vertex(root_halfedge);
        return first_edge_vertex() + n_inner() * roots.edge[root_halfedge] +
               (is_first(root_halfedge) ? t : size - t) - 1;
    }
    /// \pre the root is a quad
    Index vertex(Index root, Index i, Index j) const noexcept {
        const Index h = roots.face_offsets[root];
        if (j == 0)
            return edge_vertex(h, i);
        if (i == size)
            return edge_vertex(h + 1, j);
        if (j == size)
            return edge_vertex(h + 2, size - i);
        if (i == 0)
            return edge_vertex(h + 3, size - j);
        return first_face_vertex() + n_inner() * (n_inner() * root + j - 1) + i - 1;
    }
    Index face(Index root, Index i, Index j) const noexcept {
        return size * (size * root + j) + i;
    }
    Index root_of_face(Index face) const noexcept { return face / (size * size); }

    /// The number of a halfedge that split() gives to it when the roots are split log2(size)
    /// times.
    /// \pre the roots are quads; size is a power of two
    Index from_split(Index halfedge) const noexcept;
};

/// The vertices of all faces, in order: Topology::vertex of the same mesh. This runs at the
/// speed of memory, on all threads of the caller's arena.
/// \pre out.size() == grids.n_halfedges()
void face_vertices(const QuadGrids& grids, std::span<Index> out);

/// The same mesh as flat arrays, with the same numbers.
Topology to_topology(const QuadGrids& grids);

}  // namespace osdx::inline OSDX_ABI
