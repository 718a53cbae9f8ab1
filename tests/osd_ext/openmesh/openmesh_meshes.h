// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <gtest/gtest.h>

#include <osdx/openmesh.h>

#include "tests/support/test_meshes.h"

/// Meshes of OpenMesh of several types, linked face by face.
namespace osdx::test {

struct DoubleTraits : OpenMesh::DefaultTraitsDouble {};
using PolyFloat = OpenMesh::PolyMesh_ArrayKernelT<>;
using PolyDouble = OpenMesh::PolyMesh_ArrayKernelT<DoubleTraits>;
using TriFloat = OpenMesh::TriMesh_ArrayKernelT<>;
using TriDouble = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;
using MeshTypes = testing::Types<PolyFloat, PolyDouble, TriFloat, TriDouble>;

/// Faces with status flags; triangle meshes cut other faces themselves.
template <class M>
M openmesh_of(const MeshData& data) {
    M mesh;
    mesh.request_vertex_status();
    mesh.request_halfedge_status();
    mesh.request_edge_status();
    mesh.request_face_status();
    for (const auto& p : data.positions) {
        typename M::Point q;
        for (int i = 0; i < 3; ++i) {
            using T = typename OpenMesh::vector_traits<typename M::Point>::value_type;
            q[i] = static_cast<T>(p[i]);
        }
        mesh.add_vertex(q);
    }
    std::size_t at = 0;
    for (const Index n : data.face_sizes) {
        std::vector<OpenMesh::VertexHandle> face;
        for (Index i = 0; i < n; ++i)
            face.emplace_back(static_cast<int>(data.face_vertices[at++]));
        mesh.add_face(face);
    }
    return mesh;
}

/// What the mesh has, vertices by their handles: by OpenMesh's own iterators.
template <class M>
std::vector<std::vector<int>> live_faces(const M& mesh) {
    std::vector<std::vector<int>> faces;
    for (auto f = mesh.faces_sbegin(); f != mesh.faces_end(); ++f) {
        faces.emplace_back();
        for (auto v = mesh.cfv_ccwbegin(*f); v.is_valid(); ++v)
            faces.back().push_back(v->idx());
    }
    return faces;
}

template <class M>
Vec3<double> point_of(const M& mesh, int vertex) {
    const auto& p = mesh.point(OpenMesh::VertexHandle(vertex));
    return {p[0], p[1], p[2]};
}

/// The same as MeshData without read_openmesh().
template <class M>
MeshData arrays_by_hand(const M& mesh) {
    MeshData data;
    std::vector<Index> number(mesh.n_vertices(), kInvalidIndex);
    for (auto v = mesh.vertices_sbegin(); v != mesh.vertices_end(); ++v) {
        number[v->idx()] = static_cast<Index>(data.positions.size());
        data.positions.push_back(point_of(mesh, v->idx()));
    }
    for (const auto& face : live_faces(mesh)) {
        data.face_sizes.push_back(static_cast<Index>(face.size()));
        for (const int v : face)
            data.face_vertices.push_back(number[v]);
    }
    return data;
}

/// Tori, about which a closed surface of any type of mesh can be laid.
template <class M>
M torus_mesh() {
    return openmesh_of<M>(random_displaced(torus(6, 7), 1, 0.02));
}

inline void expect_same_surface(const Surface& a, const Surface& b) {
    ASSERT_EQ(a.base().n_faces(), b.base().n_faces());
    ASSERT_EQ(a.base().n_vertices(), b.base().n_vertices());
    for (Index f = 0; f < a.base().n_faces(); ++f) {
        for (const Vec2<double> uv :
             {Vec2<double>(0.125, 0.25), Vec2<double>(0.5, 0.375)}) {
            const auto p = a.evaluate({f, uv.x, uv.y}), q = b.evaluate({f, uv.x, uv.y});
            ASSERT_EQ(p.p, q.p) << "face " << f;
            ASSERT_EQ(p.du, q.du) << "face " << f;
        }
    }
}

}  // namespace osdx::test
