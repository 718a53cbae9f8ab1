// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/topology.h>
#include <osdx/types.h>

/// Topologies that are made of others.
namespace osdx::inline OSDX_ABI {

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

}  // namespace osdx::inline OSDX_ABI
