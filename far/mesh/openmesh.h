// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/Traits.hh>

#include <osdx/build_topology.h>
#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

struct MeshTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
};

/// The input mesh as OpenMesh holds it: polygons of any size with double positions. Later
/// stages work on the flat arrays of osdx/topology.h.
using Mesh = OpenMesh::PolyMesh_ArrayKernelT<MeshTraits>;

/// Gives the arrays to OpenMesh, vertex i to vertex i and face i to face i, as far as
/// build_topology() of osdx/build_topology.h takes them.
/// \return what build_topology() returns
OSDX_API Result<Mesh> build_mesh(const MeshData& data);

/// Flattens a mesh that build_mesh made: the same as from its arrays.
OSDX_API Topology build_topology(const Mesh& mesh);

/// The arrays of any OpenMesh polygon mesh, with its numbering.
/// \pre no element is marked as deleted (call garbage_collection() first)
template <class Traits>
MeshData to_mesh_data(const OpenMesh::PolyMesh_ArrayKernelT<Traits>& mesh) {
    MeshData data;
    data.positions.reserve(mesh.n_vertices());
    for (const auto v : mesh.all_vertices()) {
        const auto p = mesh.point(v);
        data.positions.emplace_back(p[0], p[1], p[2]);
    }
    data.face_sizes.reserve(mesh.n_faces());
    for (const auto f : mesh.all_faces()) {
        data.face_sizes.push_back(mesh.valence(f));
        for (const auto v : f.vertices_ccw())
            data.face_vertices.push_back(static_cast<Index>(v.idx()));
    }
    return data;
}

}  // namespace osdx::inline OSDX_ABI
