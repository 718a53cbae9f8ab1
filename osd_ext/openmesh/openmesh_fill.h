// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <vector>

#include <osdx/mesh_data.h>
#include <osdx/openmesh_arrays.h>
#include <osdx/openmesh_channels.h>
#include <osdx/result.h>
#include <osdx/tessellation.h>

namespace osdx::inline OSDX_ABI {

namespace detail {

/// The faces that a mesh is to get.
struct FilledFaces {
    std::vector<Index> sizes;
    /// Places in the arrays of corners that the faces are made from.
    std::vector<Index> corners;
};

/// Gives the mesh vertices, faces and features, but no points; or leaves it as it was.
OSDX_API Result<FilledFaces> fill_connectivity(OpenMesh::PolyConnectivity& mesh,
                                               const MeshData& data, bool triangles,
                                               const OpenMeshOptions& options);
OSDX_API Result<FilledFaces> fill_connectivity(OpenMesh::PolyConnectivity& mesh,
                                               const Tessellation& tessellation,
                                               bool triangles);

template <class To, class From>
To convert(const From& from, int n) {
    To to;
    for (int i = 0; i < n; ++i)
        to[i] = static_cast<typename OpenMesh::vector_traits<To>::value_type>(from[i]);
    return to;
}

template <OpenMeshMesh M, class Points>
void fill_points(M& mesh, const Points& points) {
    for (std::size_t v = 0; v < points.size(); ++v) {
        mesh.set_point(OpenMesh::VertexHandle(static_cast<int>(v)),
                       convert<typename M::Point>(points[v], 3));
    }
}

/// Calls f(halfedge that ends at the corner, vertex, corner) for the corners of all faces.
template <OpenMeshMesh M, class F>
void for_each_corner(const M& mesh, const FilledFaces& faces, F&& f) {
    std::size_t i = 0;
    for (std::size_t face = 0; face < faces.sizes.size(); ++face) {
        auto h = mesh.halfedge_handle(OpenMesh::FaceHandle(static_cast<int>(face)));
        for (Index k = 0; k < faces.sizes[face]; ++k, ++i) {
            f(h, mesh.to_vertex_handle(h), faces.corners[i]);
            h = mesh.next_halfedge_handle(h);
        }
    }
}

template <OpenMeshMesh M, class Texcoords, class Indices>
void fill_texcoords(M& mesh, const FilledFaces& faces, const Texcoords& texcoords,
                    const Indices& of_corners) {
    if (of_corners.empty() ||
        (!mesh.has_halfedge_texcoords2D() && !mesh.has_vertex_texcoords2D()))
        return;
    for_each_corner(mesh, faces, [&](auto h, auto v, Index corner) {
        const auto uv = convert<typename M::TexCoord2D>(texcoords[of_corners[corner]], 2);
        if (mesh.has_halfedge_texcoords2D())
            mesh.set_texcoord2D(h, uv);
        if (mesh.has_vertex_texcoords2D())
            mesh.set_texcoord2D(v, uv);
    });
}

/// \tparam V  types of properties
template <class... V, OpenMeshMesh M>
void fill_halfedges(M& mesh, const FilledFaces& faces, const FaceVaryingChannels& c) {
    const auto fill = [&]<class Value>(OpenMesh::HPropHandleT<Value> property) {
        using C = Components<Value>;
        if (C::n != c.n || !mesh.get_property_handle(property, c.name))
            return;
        for_each_corner(mesh, faces, [&](auto h, auto, Index corner) {
            const double* numbers = c.view()[c.corner_values[corner]];
            typename C::Scalar* to = C::data(mesh.property(property, h));
            for (int k = 0; k < C::n; ++k)
                to[k] = static_cast<typename C::Scalar>(numbers[k]);
        });
    };
    (fill(OpenMesh::HPropHandleT<V>()), ...);
}

template <OpenMeshMesh M>
void fill_face_varying(M& mesh, const FilledFaces& faces,
                       const std::vector<FaceVaryingChannels>& all) {
    using namespace OpenMesh;
    for (const FaceVaryingChannels& c : all)
        fill_halfedges<float, double, Vec2f, Vec2d, Vec3f, Vec3d, Vec4f, Vec4d>(mesh,
                                                                                faces, c);
}

}  // namespace detail

/// Makes the mesh this one, with its numbers of vertices and faces; what was in it goes, but
/// requested attributes and properties stay. In triangle meshes other faces are fans of
/// triangles from their first corner, one after the other.
///
/// Of the rest the mesh gets what it has requested: texture coordinates of halfedges and of
/// vertices (where a seam passes, one of them), face-varying channels where halfedges have a
/// property of the name, of float or double or OpenMesh's vectors of these, features as OpenMeshOptions say (flags for
/// infinitely sharp edges and vertices, properties for all). Normals are the mesh's own, by
/// update_normals().
/// \return what build_topology() and build_features() return; NonManifoldEdge, with the face,
///         where triangles would meet in an edge of more than two; then the mesh is as it was.
///         NonManifoldVertex where OpenMesh cannot link a face; then it is empty.
template <OpenMeshMesh M>
Status fill_openmesh(const MeshData& data, M& mesh, const OpenMeshOptions& options = {}) {
    const Result<detail::FilledFaces> faces =
        detail::fill_connectivity(mesh, data, M::is_triangles(), options);
    if (!faces)
        return faces.error();
    detail::fill_points(mesh, data.positions);
    detail::fill_texcoords(mesh, *faces, data.uvs, data.face_uvs);
    detail::fill_face_varying(mesh, *faces, data.face_varying);
    return ok();
}

/// The same of a tessellation, triangle meshes as by triangles(). Normals of vertices and of
/// halfedges (those of the side of a sharp edge that the face is on) where the mesh has requested
/// them, and texture coordinates and face-varying channels where both have them.
/// \return NonManifoldVertex where facets meet in a point only, as between holes; then the mesh is
///         as it was, or empty where it is OpenMesh that refuses
template <OpenMeshMesh M>
Status fill_openmesh(const Tessellation& t, M& mesh) {
    const Result<detail::FilledFaces> faces =
        detail::fill_connectivity(mesh, t, M::is_triangles());
    if (!faces)
        return faces.error();
    detail::fill_points(mesh, t.positions);
    detail::fill_texcoords(mesh, *faces, t.texcoords, t.facet_texcoords);
    detail::fill_face_varying(mesh, *faces, t.face_varying);
    const auto normal = [](const Vec3<double>& n) {
        return detail::convert<typename M::Normal>(n, 3);
    };
    if (mesh.has_vertex_normals()) {
        for (std::size_t v = 0; v < t.positions.size(); ++v)
            mesh.set_normal(OpenMesh::VertexHandle(static_cast<int>(v)),
                            normal(t.normals[v]));
    }
    if (mesh.has_halfedge_normals()) {
        detail::for_each_corner(mesh, *faces, [&](auto h, auto, Index corner) {
            mesh.set_normal(h, normal(t.normals[t.facet_normals[corner]]));
        });
    }
    return ok();
}

}  // namespace osdx::inline OSDX_ABI
