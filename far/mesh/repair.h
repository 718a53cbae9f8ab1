// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

struct RepairOptions {
    /// Points that are no farther from each other than this times the diagonal of their bounding
    /// box become one; below 0: none do.
    double weld = 1e-6;
    /// Faces, edges, vertices and orientations, too; if not, points alone become one.
    bool faces = true;
};

/// What a repair did. All counts are 0 where there was nothing to do.
struct RepairReport {
    Index n_welded = 0;           ///< vertices that became one with another
    Index n_dropped_faces = 0;    ///< faces with fewer than three vertices that differ
    Index n_shortened_faces = 0;  ///< faces that lost repeated vertices
    Index n_parted_edges = 0;     ///< edges of three and more faces
    Index n_cut_edges = 0;       ///< edges whose two faces no orientation brings together
    Index n_flipped_faces = 0;   ///< faces that run the other way now
    Index n_added_vertices = 0;  ///< copies where fans of faces met in a vertex only
    Index n_dropped_tags = 0;    ///< creases and holes of what is no longer there
    std::vector<Index> vertices;  ///< of each vertex the one of the input
    std::vector<Index> faces;     ///< of each face the one of the input

    bool is_empty() const noexcept {
        return n_welded + n_dropped_faces + n_shortened_faces + n_parted_edges +
                   n_cut_edges + n_flipped_faces + n_added_vertices + n_dropped_tags ==
               0;
    }
};

struct RepairedMesh {
    MeshData mesh;
    RepairReport report;
};

/// A mesh that build_topology() takes, of one that it may refuse.
///
/// In this order: near points become one. Vertices that a face names twice in a row, and edges
/// there and back, are left out of it; faces of fewer than three vertices are dropped. Of three
/// and more faces (up to 100) at an edge those two stay together that bend least, then the next
/// two; what is left over has a border there. Orientations are made to agree over these edges: of
/// a component the majority stays as it is; where none agrees, as on a Moebius strip, the edge is cut.
/// Where several fans of faces meet in a vertex, all but one get a copy of it, as do the places
/// where a face comes by a vertex again.
///
/// Where faces that are left over share both ends of the edge still, around other faces, they are
/// parted from those at the two ends.
///
/// Tags, texture coordinates, channels, names and lines go with their vertices and faces; of
/// vertices that become one the first has its place and its values.
/// In time proportional to the mesh, but for a sort of its edges.
/// \return SizeMismatch or IndexOutOfRange, where a mesh does not hold what it names
OSDX_API Result<RepairedMesh> repair(const MeshData& mesh,
                                     const RepairOptions& options = {});

}  // namespace osdx::inline OSDX_ABI
