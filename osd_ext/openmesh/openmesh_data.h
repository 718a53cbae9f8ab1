// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <utility>

#include <osdx/mesh_data.h>
#include <osdx/openmesh_arrays.h>
#include <osdx/openmesh_channels.h>
#include <osdx/result.h>

namespace osdx::inline OSDX_ABI {

/// The mesh as MeshData, for what takes no views: subdivide(). Features are
/// tags. Texture coordinates are texcoords2D of halfedges, or of vertices where there are only
/// those; a seam is where the values differ. What else halfedges have goes into
/// MeshData::face_varying by halfedge_channels().
/// \pre arrays are those of the mesh
template <OpenMeshMesh M>
MeshData to_mesh_data(const M& mesh, const OpenMeshArrays& arrays) {
    MeshData data;
    data.positions.reserve(arrays.vertices.size());
    for (Index v = 0; v < arrays.vertices.size(); ++v) {
        const auto& p = mesh.point(arrays.vertex_handle(v));
        data.positions.emplace_back(p[0], p[1], p[2]);
    }
    data.face_sizes = arrays.face_sizes;
    data.face_vertices = arrays.face_vertices;
    data.tags = arrays.tags();
    const bool of_halfedges = mesh.has_halfedge_texcoords2D();
    if (!of_halfedges && !mesh.has_vertex_texcoords2D())
        return data;
    FaceVaryingChannels texcoords = detail::corner_channels(
        mesh, arrays, [&](auto h, auto v) -> const typename M::TexCoord2D& {
            return of_halfedges ? mesh.texcoord2D(h) : mesh.texcoord2D(v);
        });
    for (Index i = 0; i < texcoords.n_values(); ++i)
        data.uvs.emplace_back(texcoords.view()[i][0], texcoords.view()[i][1]);
    data.face_uvs = std::move(texcoords.corner_values);
    return data;
}

/// \return what read_openmesh() returns
template <OpenMeshMesh M>
Result<MeshData> to_mesh_data(const M& mesh, const OpenMeshOptions& options = {}) {
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh, options);
    if (!arrays)
        return arrays.error();
    return to_mesh_data(mesh, *arrays);
}

}  // namespace osdx::inline OSDX_ABI
