// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "far/buffer.h"
#include "far/mesh.h"
#include "far/types.h"

namespace osdx {

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
    Index find_valence(Index n_faces, Index from = 0) const noexcept;
    static constexpr std::uint8_t stored_valence(Index n_faces) noexcept {
        return static_cast<std::uint8_t>(n_faces < kManyFaces ? n_faces : kManyFaces);
    }

private:
    static constexpr Index kManyFaces = 255;
};

/// What Topology::quads_only may be.
bool has_only_quads(const Topology& topology);

/// Checks the arrays and links them, with their numbering of vertices and faces: nothing is
/// dropped, doubled or renumbered. A vertex that no face uses is kept. Meshes may be open;
/// tags are left to build_features(). In linear time, on all threads.
/// \return every ErrorCode from EmptyMesh to NonManifoldVertex, with the element and its line;
///         those of check_uvs, with the face.
Result<Topology> build_topology(const MeshData& data);

/// Flattens a mesh that build_mesh made: the same as from its arrays.
Topology build_topology(const Mesh& mesh);

/// The halfedges at the border, in ascending order.
std::vector<Index> border_halfedges(const Topology& topology);

/// The faces of a topology with given positions, as arrays. A face's first vertex is that of
/// its first halfedge.
/// \pre positions.size() == topology.n_vertices()
MeshData to_mesh_data(const Topology& topology, std::vector<Vec3<double>> positions);

/// Linear subdivision: every face becomes one quad per corner.
///
/// Vertices: those of the mesh, then one per edge, then one per face. Face h of the result
/// is the quad at halfedge h of the input: corner h, middle of the edge that leaves it, face
/// centre, middle of the edge that enters it. Its edges: the halves of edge e are 2 e, at the
/// start of its first halfedge, and 2 e + 1; then one for each halfedge, from the middle of
/// its edge to the face centre.
Topology split(const Topology& topology);

/// The dual mesh: its vertex f is face f of the input, its faces are the vertices inside, in
/// their order; a border vertex has no face, so that the border recedes by half a face.
///
/// \param halfedge_map  when not null: for each halfedge h of the input, the halfedge of
///        the dual that starts at dual vertex face(h) inside the dual face vertex(h);
///        kInvalidIndex at border vertices.
Topology dual(const Topology& topology, std::vector<Index>* halfedge_map = nullptr);

/// A part of a mesh, and where its elements come from.
struct Submesh {
    Topology topology;
    Buffer<Index> vertices, halfedges, edges, faces;  ///< of the whole mesh
};

/// The faces that are kept, with their vertices, all in ascending order.
/// \pre keep.size() == topology.n_faces()
Submesh submesh(const Topology& topology, const Flags& keep);

/// The faces and, `rings` times over, those that share a vertex with them.
/// \pre faces.size() == topology.n_faces()
Flags grown(const Topology& topology, Flags faces, int rings = 1);

/// The mesh cut along edges: what was a vertex with several fans of faces between such edges
/// becomes one vertex a fan. Faces and halfedges keep their numbers, and so do the vertices
/// of the first fans; those of the others, and the second sides of edges, come after all.
/// \param vertices  where each vertex comes from
Topology cut(const Topology& topology, const std::vector<bool>& edges,
             std::vector<Index>& vertices);

/// The mesh with a strip of quads around its border.
///
/// Face n_faces + i is the quad outside of border halfedge borders[i].
/// Where `corner` says so of a vertex between two of them, one more quad fills the corner of
/// the strip there; these come last, in the order of the halfedges that leave the vertices.
/// Halfedges of the mesh keep their numbers.
Topology with_border_strip(const Topology& topology, const std::vector<Index>& borders,
                           const std::vector<bool>& corner);

}  // namespace osdx
