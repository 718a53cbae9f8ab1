// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/openmesh.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

// Exact equality: nothing may be dropped, doubled, turned or renumbered on the way.
void expect_same(const MeshData& actual, const MeshData& expected) {
    EXPECT_EQ(actual.positions, expected.positions);
    EXPECT_EQ(actual.face_sizes, expected.face_sizes);
    EXPECT_EQ(actual.face_vertices, expected.face_vertices);
}

TEST(Mesh, RoundTripKeepsEveryNumber) {
    for (const auto& [name, data] : test::closed_meshes()) {
        SCOPED_TRACE(name);
        const Result<Mesh> mesh = build_mesh(data);
        ASSERT_TRUE(mesh) << mesh.error().message;
        expect_same(*to_mesh_data(*mesh), data);
    }
}

TEST(Mesh, RoundTripKeepsPolesAndLargeFaces) {
    for (const Index n : {3u, 5u, 8u, 64u, 360u}) {
        for (const MeshData& data : {test::pole(n, 2, 3), test::prism(n),
                                     test::bipyramid(n), test::face_pole(n, 2, 2)}) {
            SCOPED_TRACE(n);
            const Result<Mesh> mesh = build_mesh(data);
            ASSERT_TRUE(mesh) << mesh.error().message;
            expect_same(*to_mesh_data(*mesh), data);
        }
    }
}

TEST(Mesh, TakesMeshesWithOtherTraits) {
    OpenMesh::PolyMesh_ArrayKernelT<> mesh;  // float positions
    std::vector<OpenMesh::VertexHandle> v;
    for (const auto& p : test::tetrahedron().positions)
        v.push_back(mesh.add_vertex({float(p.x), float(p.y), float(p.z)}));
    mesh.add_face(v[0], v[1], v[2]);
    mesh.add_face(v[0], v[3], v[1]);
    mesh.add_face(v[0], v[2], v[3]);
    mesh.add_face(v[1], v[3], v[2]);
    expect_same(*to_mesh_data(mesh), test::tetrahedron());
}

TEST(Mesh, KeepsAVertexThatNoFaceUses) {
    MeshData data = test::cube();
    data.positions.insert(data.positions.begin(), {7, 8, 9});
    data.positions.emplace_back(10, 11, 12);
    for (Index& v : data.face_vertices)
        ++v;
    const Result<Mesh> mesh = build_mesh(data);
    ASSERT_TRUE(mesh) << mesh.error().message;
    expect_same(*to_mesh_data(*mesh), data);
    const Topology t = build_topology(*mesh);
    ASSERT_EQ(t.n_vertices(), 10u);
    EXPECT_EQ(t.vertex_halfedge[0], kInvalidIndex);
    EXPECT_EQ(t.vertex_halfedge[9], kInvalidIndex);
    EXPECT_EQ(t.valence(0), 0u);
    EXPECT_EQ(t.valence(1), 3u);
}

// ---------------------------------------------------------------------- refusals

/// Faces over enough vertices, vertex v on line 11 + v and face f on line 101 + f.
MeshData mesh_of(Index n_vertices, const std::vector<std::vector<Index>>& faces) {
    MeshData data;
    for (Index v = 0; v < n_vertices; ++v) {
        data.positions.emplace_back(v, v * v, 1);
        data.vertex_lines.push_back(11 + v);
    }
    for (const auto& face : faces) {
        data.face_sizes.push_back(static_cast<Index>(face.size()));
        data.face_vertices.insert(data.face_vertices.end(), face.begin(), face.end());
        data.face_lines.push_back(static_cast<Index>(101 + data.face_lines.size()));
    }
    return data;
}

const std::vector<std::vector<Index>> kTetrahedron = {
    {0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};

void expect_refusal(const MeshData& data, ErrorCode code, Index element, Index line,
                    std::string_view words) {
    SCOPED_TRACE(words);
    const Result<Mesh> mesh = build_mesh(data);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().code, code) << mesh.error().message;
    EXPECT_EQ(mesh.error().element, element);
    EXPECT_EQ(mesh.error().line, line);
    EXPECT_NE(mesh.error().message.find(words), std::string::npos)
        << mesh.error().message;
    const Result<Topology> topology = build_topology(data);
    ASSERT_FALSE(topology);
    EXPECT_EQ(topology.error().message, mesh.error().message);
}

TEST(MeshRefuses, AMeshWithoutVerticesOrFaces) {
    expect_refusal({}, ErrorCode::EmptyMesh, kInvalidIndex, 0, "no vertices");
    expect_refusal(mesh_of(3, {}), ErrorCode::EmptyMesh, kInvalidIndex, 0, "no faces");
}

TEST(MeshRefuses, SizesThatDoNotAddUp) {
    MeshData more = mesh_of(4, kTetrahedron);
    more.face_vertices.push_back(0);
    expect_refusal(more, ErrorCode::SizeMismatch, kInvalidIndex, 0, "12");
    MeshData fewer = mesh_of(4, kTetrahedron);
    fewer.face_vertices.pop_back();
    expect_refusal(fewer, ErrorCode::SizeMismatch, kInvalidIndex, 0, "11");
    MeshData huge = mesh_of(4, kTetrahedron);  // the sum wraps around in 32 bits
    huge.face_sizes = {0xffffffffu, 13};
    expect_refusal(huge, ErrorCode::SizeMismatch, kInvalidIndex, 0, "12");
}

TEST(MeshRefuses, AMissingVertex) {
    expect_refusal(mesh_of(4, {{0, 1, 2}, {0, 4, 1}, {0, 2, 3}, {1, 3, 2}}),
                   ErrorCode::IndexOutOfRange, 1, 102, "face 1 names vertex 4");
    expect_refusal(mesh_of(4, {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, kInvalidIndex}}),
                   ErrorCode::IndexOutOfRange, 3, 104, "face 3 names vertex 4294967295");
}

TEST(MeshRefuses, AFaceOfTwoVertices) {
    expect_refusal(mesh_of(4, {{0, 1, 2}, {0, 3}, {0, 2, 3}}), ErrorCode::FaceTooSmall, 1,
                   102, "face 1 has 2 vertices");
    expect_refusal(mesh_of(4, {{0, 1, 2}, {0, 1, 3}, {}}), ErrorCode::FaceTooSmall, 2,
                   103, "face 2 has 0 vertices");
}

TEST(MeshRefuses, AVertexTwiceInAFace) {
    expect_refusal(mesh_of(4, {{0, 1, 2}, {0, 3, 1, 3}}), ErrorCode::RepeatedVertex, 1,
                   102, "face 1 names vertex 3 twice");
    expect_refusal(mesh_of(4, {{2, 1, 2}}), ErrorCode::RepeatedVertex, 0, 101,
                   "face 0 names vertex 2 twice");
}

TEST(MeshRefuses, APositionThatIsNoNumber) {
    const double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                          std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()};
    for (const double value : bad) {
        for (int axis = 0; axis < 3; ++axis) {
            MeshData data = mesh_of(4, kTetrahedron);
            data.positions[2][axis] = value;
            expect_refusal(data, ErrorCode::NonFinitePoint, 2, 13, "vertex 2");
        }
    }
}

TEST(MeshRefuses, BrokenTextureCoordinates) {
    MeshData data = mesh_of(4, kTetrahedron);
    data.uvs = {{0, 0}, {1, 0}, {NAN, 0}};
    data.face_uvs = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
    EXPECT_TRUE(build_mesh(data));  // no face names the one that is no number
    data.face_uvs[7] = 2;
    expect_refusal(data, ErrorCode::NonFinitePoint, 2, 103, "texture coordinate 2");
    data.face_uvs[4] = 3;
    expect_refusal(data, ErrorCode::IndexOutOfRange, 1, 102, "texture coordinate 3");
    data.face_uvs.pop_back();
    expect_refusal(data, ErrorCode::SizeMismatch, kInvalidIndex, 0, "11 face corners");
}

TEST(MeshRefuses, AnEdgeOfThreeFaces) {
    expect_refusal(mesh_of(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}),
                   ErrorCode::NonManifoldEdge, 2, 103, "face 2");
    // A closed tetrahedron with a fin.
    auto faces = kTetrahedron;
    faces.push_back({1, 2, 4});
    expect_refusal(mesh_of(5, faces), ErrorCode::NonManifoldEdge, 4, 105, "face 4");
}

// Far apart in the file, where a few faces at a time know nothing of the others.
TEST(MeshRefuses, AnEdgeOfManyFacesFarApart) {
    constexpr Index kLength = 300;
    const auto vertex = [](Index row, Index side) { return 2 * (row % kLength) + side; };
    const auto quad = [&](Index row, Index side) {
        return std::vector<Index>{vertex(row, side), vertex(row, 1 - side),
                                  vertex(row + 1, 1 - side), vertex(row + 1, side)};
    };
    // A strip of quads that closes, and its back side: one fan at each vertex, and four faces at
    // each edge between two rows.
    std::vector<std::vector<Index>> faces;
    for (Index row = 0; row < kLength; ++row)
        faces.push_back(quad(row, 0));
    ASSERT_TRUE(build_topology(mesh_of(2 * kLength, faces)));
    auto third = faces;
    third.push_back(quad(140, 1));
    expect_refusal(mesh_of(2 * kLength, third), ErrorCode::NonManifoldEdge, kLength,
                   101 + kLength,
                   "face 300 is number 3 of 3 at the edge of vertices 280");
    for (Index row = 0; row < kLength; ++row)
        faces.push_back(quad(row, 1));
    expect_refusal(mesh_of(2 * kLength, faces), ErrorCode::NonManifoldEdge, kLength,
                   101 + kLength, "face 300 is number 3 of 4 at the edge of vertices 0");
    // With a triangle, which lacks the side between rows 299 and 0.
    faces.back().pop_back();
    expect_refusal(mesh_of(2 * kLength, faces), ErrorCode::NonManifoldEdge, kLength,
                   101 + kLength, "face 300 is number 3 of 3 at the edge of vertices 0");
}

TEST(MeshRefuses, FacesOfOppositeOrientation) {
    expect_refusal(mesh_of(4, {{0, 1, 2}, {0, 1, 3}}), ErrorCode::OppositeFaces, 1, 102,
                   "face 1 and face 0");
    auto faces = kTetrahedron;
    faces[2] = {0, 3, 2};
    expect_refusal(mesh_of(4, faces), ErrorCode::OppositeFaces, 2, 103, "face 2");
}

TEST(MeshRefuses, AVertexOfTwoFans) {
    auto two_closed = kTetrahedron;
    for (const std::vector<Index>& face : kTetrahedron) {
        std::vector<Index> other;
        for (const Index v : face)
            other.push_back(v == 2 ? v : v + 4);
        two_closed.push_back(other);
    }
    expect_refusal(mesh_of(8, two_closed), ErrorCode::NonManifoldVertex, 2, 13,
                   "vertex 2");
    expect_refusal(mesh_of(5, {{0, 1, 2}, {3, 4, 1}}), ErrorCode::NonManifoldVertex, 1,
                   12, "vertex 1");
    auto open_and_closed = kTetrahedron;
    open_and_closed.push_back({3, 4, 5});
    expect_refusal(mesh_of(6, open_and_closed), ErrorCode::NonManifoldVertex, 3, 14,
                   "vertex 3");
}

TEST(Mesh, TakesOpenMeshesAndVerticesOfTwoFaces) {
    const MeshData meshes[] = {
        mesh_of(3, {{0, 1, 2}}),
        mesh_of(3, {{0, 1, 2}, {0, 2, 1}}),
        // A tetrahedron with vertex 4 in the middle of an edge.
        mesh_of(5, {{0, 4, 1, 2}, {0, 3, 1, 4}, {0, 2, 3}, {1, 3, 2}}),
    };
    for (const MeshData& data : meshes) {
        const Result<Mesh> mesh = build_mesh(data);
        ASSERT_TRUE(mesh) << mesh.error().message;
        expect_same(*to_mesh_data(*mesh), data);
    }
}

TEST(MeshRefuses, WithoutALineWhereTheMeshHasNone) {
    MeshData data = mesh_of(3, {{0, 1, 1}});
    data.face_lines.clear();
    data.vertex_lines.clear();
    expect_refusal(data, ErrorCode::RepeatedVertex, 0, 0, "face 0");
}

// ---------------------------------------------------------------------- the test meshes

struct Counts {
    Index vertices, faces;
    int euler;
    std::vector<std::pair<Index, Index>> valences, sizes;  ///< value and how often
};

Counts counts_of(const Topology& t) {
    const auto histogram = [](Index n, auto&& value) {
        std::vector<Index> values;
        for (Index i = 0; i < n; ++i)
            values.push_back(value(i));
        std::ranges::sort(values);
        std::vector<std::pair<Index, Index>> result;
        for (const Index v : values) {
            if (result.empty() || result.back().first != v)
                result.emplace_back(v, 0);
            ++result.back().second;
        }
        return result;
    };
    return {t.n_vertices(), t.n_faces(),
            static_cast<int>(t.n_vertices() + t.n_faces()) - static_cast<int>(t.n_edges),
            histogram(t.n_vertices(), [&](Index v) { return t.valence(v); }),
            histogram(t.n_faces(), [&](Index f) { return t.face_size(f); })};
}

// The counts that the header of the test meshes promises: other tests rest on them.
TEST(TestMeshes, AreWhatTheyClaim) {
    using H = std::vector<std::pair<Index, Index>>;
    const Counts ico = counts_of(test::topology_of(test::truncated_icosahedron()));
    EXPECT_EQ(ico.vertices, 60u);
    EXPECT_EQ(ico.valences, (H{{3, 60}}));
    EXPECT_EQ(ico.sizes, (H{{5, 12}, {6, 20}}));
    const Counts dodecahedron = counts_of(test::topology_of(test::dodecahedron()));
    EXPECT_EQ(dodecahedron.valences, (H{{3, 20}}));
    EXPECT_EQ(dodecahedron.sizes, (H{{5, 12}}));
    const Counts two_holes = counts_of(test::topology_of(test::double_torus()));
    EXPECT_EQ(two_holes.euler, -2);
    EXPECT_EQ(two_holes.valences, (H{{3, 8}, {4, 24}, {5, 16}}));
    EXPECT_EQ(two_holes.sizes, (H{{4, two_holes.faces}}));
    EXPECT_EQ(counts_of(test::topology_of(test::torus(3, 5))).valences, (H{{4, 15}}));
    for (const Index n : {5u, 8u, 64u, 360u}) {
        const Counts c = counts_of(test::topology_of(test::pole(n, 2, 3)));
        EXPECT_EQ(c.euler, 2);
        EXPECT_EQ(c.valences, (H{{3, 2 * n}, {4, c.vertices - 2 * n - 2}, {n, 2}}));
        EXPECT_EQ(c.sizes, (H{{4, c.faces}}));
        const Counts dual = counts_of(test::topology_of(test::face_pole(n, 2, 3)));
        EXPECT_EQ(dual.sizes, (H{{3, 2 * n}, {4, dual.faces - 2 * n - 2}, {n, 2}}));
        EXPECT_EQ(dual.valences, (H{{4, dual.vertices}}));
        EXPECT_EQ(counts_of(test::topology_of(test::prism(n))).sizes,
                  n == 4 ? (H{{4, 6}}) : (H{{4, n}, {n, 2}}));
    }
}

}  // namespace
}  // namespace osdx
