// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include <osdx/buffer.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// Connectivity of a polygon mesh, closed or with borders, in flat arrays.
///
/// A halfedge is a corner of a face with the edge that leaves it: the halfedges of face f
/// are face_offsets[f] .. face_offsets[f + 1], counter-clockwise. Nothing lies outside of the
/// border: an edge there has one halfedge. All functions are O(1), valence() if it is known.
///
/// Shapes: face_offsets n_faces + 1; vertex, twin, edge n_halfedges; faces n_halfedges or none;
/// vertex_halfedge n_vertices; valences n_vertices or none.
struct Topology {
    Buffer<Index> face_offsets{0};
    Buffer<Index> vertex;  ///< where the halfedge starts
    Buffer<Index> twin;    ///< on the other side of the edge; kInvalidIndex at a border
    Buffer<Index> edge;    ///< shared with the twin
    Buffer<Index> faces;   ///< what face() is; empty if quads_only
    /// One that starts here, the border's at a border vertex; kInvalidIndex if unused.
    Buffer<Index> vertex_halfedge;
    /// What valence() is, by stored_valence(); empty where nobody has counted.
    Buffer<std::uint8_t> valences;
    Index n_edges = 0;
    /// All faces are quads: then halfedge h is corner h modulo 4 of face h / 4, and walks about
    /// vertices read `twin` alone, which is what large meshes wait for. May be false for quads.
    bool quads_only = false;

    bool operator==(const Topology&) const = default;

    /// A copy whose vertices are to be linked otherwise: without what has been counted.
    Topology to_relink() const {
        Topology t = *this;
        t.valences = {};
        return t;
    }

    Index n_vertices() const noexcept {
        return static_cast<Index>(vertex_halfedge.size());
    }
    Index n_faces() const noexcept { return static_cast<Index>(face_offsets.size() - 1); }
    Index n_halfedges() const noexcept { return static_cast<Index>(vertex.size()); }
    Index face_size(Index f) const noexcept {
        return face_offsets[f + 1] - face_offsets[f];
    }
    /// On the left of the halfedge.
    Index face(Index h) const noexcept { return quads_only ? h / 4 : faces[h]; }

    Index next(Index h) const noexcept {
        if (quads_only)
            return (h & ~Index(3)) | ((h + 1) & 3);
        const Index f = faces[h];
        return h + 1 == face_offsets[f + 1] ? face_offsets[f] : h + 1;
    }
    Index prev(Index h) const noexcept {
        if (quads_only)
            return (h & ~Index(3)) | ((h + 3) & 3);
        const Index f = faces[h];
        return h == face_offsets[f] ? face_offsets[f + 1] - 1 : h - 1;
    }
    bool is_border(Index h) const noexcept { return twin[h] == kInvalidIndex; }
    /// The next halfedge counter-clockwise about the vertex where h starts; kInvalidIndex
    /// beyond the last face at a border.
    Index ccw(Index h) const noexcept { return twin[prev(h)]; }
    Index to_vertex(Index h) const noexcept { return vertex[next(h)]; }

    /// Calls f(halfedge) for the halfedges that start at v, counter-clockwise.
    template <class F>
    void for_each_outgoing(Index v, F&& f) const {
        const Index first = vertex_halfedge[v];
        if (first == kInvalidIndex)
            return;
        Index h = first;
        do {
            f(h);
            h = ccw(h);
        } while (h != first && h != kInvalidIndex);
    }

    /// Calls f(edge, other vertex) for the edges at v, counter-clockwise.
    template <class F>
    void for_each_edge(Index v, F&& f) const {
        Index last = kInvalidIndex;
        for_each_outgoing(v, [&](Index h) {
            f(edge[h], to_vertex(h));
            last = prev(h);
        });
        if (last != kInvalidIndex && is_border(last))
            f(edge[last], vertex[last]);
    }

    /// The number of faces at v.
    Index valence(Index v) const noexcept {
        if (!valences.empty() && valences[v] < kManyFaces)
            return valences[v];
        Index n = 0;
        for_each_outgoing(v, [&](Index) { ++n; });
        return n;
    }
    /// The first vertex from `from` on that has so many faces, 0 to 254; kInvalidIndex if none.
    OSDX_API Index find_valence(Index n_faces, Index from = 0) const noexcept;
    static constexpr std::uint8_t stored_valence(Index n_faces) noexcept {
        return static_cast<std::uint8_t>(n_faces < kManyFaces ? n_faces : kManyFaces);
    }

private:
    static constexpr Index kManyFaces = 255;
};

/// What Topology::quads_only may be.
OSDX_API bool has_only_quads(const Topology& topology);

/// The halfedges at the border, in ascending order.
OSDX_API std::vector<Index> border_halfedges(const Topology& topology);

}  // namespace osdx::inline OSDX_ABI
