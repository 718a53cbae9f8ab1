// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

/// Checks the arrays and links them, with their numbering of vertices and faces: nothing is
/// dropped, doubled or renumbered. A vertex that no face uses is kept. Meshes may be open;
/// tags are left to build_features(). In linear time, on all threads.
/// \return every ErrorCode from EmptyMesh to NonManifoldVertex, with the element and its line
OSDX_API Result<Topology> build_topology(const MeshView& mesh);
/// The same, and looks at positions, texture coordinates, channels and names of faces.
/// \return besides, what check_uvs(), check_channels(), check_face_names() and
///         check_face_varying() return, with the face, vertex or value
OSDX_API Result<Topology> build_topology(const MeshData& data);

/// The faces of a topology with given positions, as arrays. A face's first vertex is that of
/// its first halfedge.
/// \pre positions.size() == topology.n_vertices()
OSDX_API MeshData to_mesh_data(const Topology& topology,
                               std::vector<Vec3<double>> positions);

}  // namespace osdx::inline OSDX_ABI
