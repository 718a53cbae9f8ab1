// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <vector>

#include <osdx/mesh_data.h>
#include <osdx/openmesh_arrays.h>
#include <osdx/result.h>

namespace osdx::inline OSDX_ABI {

namespace detail {

/// Gives every corner its texture coordinate; those of one vertex that are equal become one.
class CornerTexcoords {
public:
    explicit CornerTexcoords(MeshData& data)
        : data_(data), first_(data.positions.size(), kInvalidIndex) {}

    void add(Index vertex, const Vec2<double>& uv) {
        Index* at = &first_[vertex];
        while (*at != kInvalidIndex && data_.uvs[*at] != uv)
            at = &next_[*at];
        if (*at == kInvalidIndex) {
            *at = static_cast<Index>(data_.uvs.size());
            data_.face_uvs.push_back(*at);
            data_.uvs.push_back(uv);
            next_.push_back(kInvalidIndex);
        } else {
            data_.face_uvs.push_back(*at);
        }
    }

private:
    MeshData& data_;
    std::vector<Index> first_, next_;  // of the texture coordinates of each vertex
};

template <class V>
Vec2<double> to_uv(const V& uv) {
    return {uv[0], uv[1]};
}

}  // namespace detail

/// The mesh as MeshData, for what takes no views: subdivide(), TextureSurface. Features are
/// tags. Texture coordinates are texcoords2D of halfedges, or of vertices where there are only
/// those; a seam is where the values differ.
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
    detail::CornerTexcoords texcoords(data);
    std::size_t corner = 0;
    for (Index f = 0; f < arrays.faces.size(); ++f) {
        auto h = mesh.halfedge_handle(arrays.face_handle(f));
        for (Index i = 0; i < arrays.face_sizes[f]; ++i, ++corner) {
            const auto v = mesh.to_vertex_handle(h);
            texcoords.add(
                arrays.face_vertices[corner],
                detail::to_uv(of_halfedges ? mesh.texcoord2D(h) : mesh.texcoord2D(v)));
            h = mesh.next_halfedge_handle(h);
        }
    }
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
