// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/openmesh.h>
#include <osdx/subdivide.h>
#include <osdx/surface.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

#include "tests/osd_ext/openmesh/openmesh_meshes.h"
#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

/// As the mesh's points hold it.
template <class M>
Vec3<double> rounded(const Vec3<double>& p) {
    using T = typename OpenMesh::vector_traits<typename M::Point>::value_type;
    return Vec3<double>(Vec3<T>(p));
}

/// What fills a mesh has to find all of this again, and OpenMesh's own faces agree.
template <class M>
void expect_filled(const M& mesh, const std::vector<Vec3<double>>& positions,
                   const std::vector<std::vector<int>>& faces) {
    ASSERT_EQ(mesh.n_vertices(), positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v)
        ASSERT_EQ(point_of(mesh, int(v)), rounded<M>(positions[v]));
    EXPECT_EQ(live_faces(mesh), faces);
}

std::vector<std::vector<int>> faces_of(const MeshData& data) {
    std::vector<std::vector<int>> faces;
    auto at = data.face_vertices.begin();
    for (const Index n : data.face_sizes) {
        faces.emplace_back(at, at + n);
        at += n;
    }
    return faces;
}

std::vector<std::vector<int>> cut_by_hand(const std::vector<std::vector<int>>& faces) {
    std::vector<std::vector<int>> result;
    for (const auto& f : faces) {
        for (std::size_t i = 2; i < f.size(); ++i)
            result.push_back({f[0], f[i - 1], f[i]});
    }
    return result;
}

template <class M>
constexpr bool kTriangles = std::derived_from<M, OpenMesh::TriConnectivity>;

template <class M>
class OpenMeshFill : public testing::Test {};
TYPED_TEST_SUITE(OpenMeshFill, MeshTypes);

TYPED_TEST(OpenMeshFill, OfMeshData) {
    auto meshes = closed_meshes();
    for (auto&& mesh : open_meshes())
        meshes.push_back(std::move(mesh));
    TypeParam mesh;  // one after the other, with what the last one left
    for (const auto& [name, data] : meshes) {
        SCOPED_TRACE(name);
        const Status s = fill_openmesh(data, mesh);
        ASSERT_TRUE(s) << s.error().message;
        const auto faces = faces_of(data);
        expect_filled(mesh, data.positions,
                      kTriangles<TypeParam> ? cut_by_hand(faces) : faces);
        // And as OpenMesh itself would have linked it.
        const auto linked = openmesh_of<TypeParam>(data);
        EXPECT_EQ(mesh.n_edges(), linked.n_edges());
        for (const auto v : linked.vertices()) {
            EXPECT_EQ(mesh.valence(v), linked.valence(v));
            EXPECT_EQ(mesh.is_boundary(v), linked.is_boundary(v));
        }
    }
}

// A refined mesh that went through OpenMesh is refined again as the mesh itself.
TYPED_TEST(OpenMeshFill, OfRefinedMeshes) {
    TypeParam base = torus_mesh<TypeParam>();
    for (const auto h : base.halfedges()) {
        const bool sharp = h.from().idx() / 7 == 2 && h.to().idx() / 7 == 2;
        if (sharp)
            base.status(h.edge()).set_feature(true);
    }
    base.status(OpenMesh::VertexHandle(40)).set_feature(true);
    base.request_halfedge_texcoords2D();
    for (const auto h : base.halfedges())
        base.set_texcoord2D(h, {float(h.to().idx()), float(h.face().idx() % 3)});
    const Result<MeshData> data = to_mesh_data(base);
    ASSERT_TRUE(data);
    ASSERT_EQ(features_of(*data).edge_sharpness.size(), base.n_edges());

    const Result<SubdividedMesh> once = subdivide(*data);
    ASSERT_TRUE(once);
    PolyDouble fine;
    fine.request_edge_status();
    fine.request_vertex_status();
    fine.request_halfedge_texcoords2D();
    const Status s = fill_openmesh(once->data, fine);
    ASSERT_TRUE(s) << s.error().message;
    std::size_t n_features = 0;
    for (const auto e : fine.edges())
        n_features += fine.status(e).feature();
    EXPECT_EQ(n_features, 14u);  // 7, halved
    const Result<MeshData> back = to_mesh_data(fine);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->positions, once->data.positions);
    EXPECT_EQ(back->face_vertices, once->data.face_vertices);
    EXPECT_EQ(features_of(*back), features_of(once->data));
    const Result<SubdividedMesh> ours = subdivide(*back);
    const Result<SubdividedMesh> theirs = subdivide(once->data);
    ASSERT_TRUE(ours && theirs);
    EXPECT_EQ(ours->data.positions, theirs->data.positions);
    EXPECT_EQ(ours->data.face_vertices, theirs->data.face_vertices);
    ASSERT_EQ(ours->data.face_uvs.size(), theirs->data.face_uvs.size());
    for (std::size_t c = 0; c < theirs->data.face_uvs.size(); ++c) {
        // Rounded to float once, of numbers up to 42.
        EXPECT_NEAR(glm::length(ours->data.uvs[ours->data.face_uvs[c]] -
                                theirs->data.uvs[theirs->data.face_uvs[c]]),
                    0, 42 * 6e-8);
    }
}

// ---------------------------------------------------------------------- features

// All kinds of features, once around through status flags and properties.
template <class T>
void expect_features_kept(const NamedMesh& m) {
    SCOPED_TRACE(m.name);
    PolyDouble mesh;
    mesh.request_edge_status();
    mesh.request_vertex_status();
    OpenMesh::EPropHandleT<T> of_edges;
    OpenMesh::VPropHandleT<T> of_vertices;
    OpenMesh::FPropHandleT<bool> hole;
    mesh.add_property(of_edges, "osdx:sharpness");
    mesh.add_property(of_vertices, "osdx:sharpness");
    mesh.add_property(hole, "osdx:hole");
    const Status s = fill_openmesh(m.data, mesh);
    ASSERT_TRUE(s) << s.error().message;
    const Topology t = topology_of(m.data);
    const Features expected = features_of(m.data);
    OpenMeshOptions options;
    options.boundary = expected.boundary;
    options.crease_method = expected.creases;
    options.smooth_triangles = expected.smooth_triangles;
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh, options);
    ASSERT_TRUE(arrays) << arrays.error().message;
    const Features seen = *build_features(arrays->view(), t);
    for (Index e = 0; e < t.n_edges; ++e)
        ASSERT_EQ(seen.edge(e), expected.edge(e));
    for (Index v = 0; v < t.n_vertices(); ++v)
        ASSERT_EQ(seen.vertex(v), expected.vertex(v));
    for (Index f = 0; f < t.n_faces(); ++f)
        ASSERT_EQ(seen.is_hole(f), expected.is_hole(f));
    EXPECT_EQ(seen.boundary, expected.boundary);
    // Flags are those of what is infinitely sharp.
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        const auto e = mesh.edge_handle(
            mesh.find_halfedge(OpenMesh::VertexHandle(int(t.vertex[h])),
                               OpenMesh::VertexHandle(int(t.to_vertex(h)))));
        ASSERT_EQ(mesh.status(e).feature(), expected.edge(t.edge[h]) >= kInfinitelySharp);
    }
}

TEST(OpenMeshFillFeatures, AreKept) {
    for (const NamedMesh& m : creased_meshes())
        expect_features_kept<double>(m);
    for (const NamedMesh& m : semi_sharp_meshes()) {
        expect_features_kept<float>(m);
        expect_features_kept<double>(m);
    }
}

TEST(OpenMeshFillFeatures, OfTrianglesAreThoseOfTheFaces) {
    MeshData data = random_displaced(grid(3, 3), 1, 0.01);
    add_crease(data, {4, 5, 6});
    data.tags.push_back({"hole", {4}, {}, {}, 0});
    TriFloat mesh;
    mesh.request_edge_status();
    OpenMesh::FPropHandleT<bool> hole;
    mesh.add_property(hole, "osdx:hole");
    ASSERT_TRUE(fill_openmesh(data, mesh));
    std::set<std::pair<int, int>> sharp;
    for (const auto e : mesh.edges()) {
        if (mesh.status(e).feature())
            sharp.emplace(std::minmax(e.v0().idx(), e.v1().idx()));
    }
    EXPECT_EQ(sharp, (std::set<std::pair<int, int>>{{4, 5}, {5, 6}}));
    for (const auto f : mesh.faces())
        EXPECT_EQ(mesh.property(hole, f), f.idx() / 2 == 4);
}

// ---------------------------------------------------------------------- tessellations

/// With creases, so that there are several normals at points.
Surface creased_surface() {
    MeshData data = random_displaced(cube(), 1, 0.05);
    const Topology t = topology_of(data);
    for (Index h = 0; h < 4; ++h)
        add_crease(data, {t.vertex[h], t.to_vertex(h)});
    Result<Surface> surface = Surface::build(data);
    EXPECT_TRUE(surface) << surface.error().message;
    return std::move(*surface);
}

TYPED_TEST(OpenMeshFill, OfTessellations) {
    const Surface surface = creased_surface();
    for (const int rate : {2, 3}) {
        const Tessellation t = surface.tessellate(rate);
        ASSERT_GT(t.normals.size(), t.positions.size());
        TypeParam mesh;
        mesh.request_vertex_normals();
        mesh.request_halfedge_normals();
        const Status s = fill_openmesh(t, mesh);
        ASSERT_TRUE(s) << s.error().message;

        std::vector<std::vector<int>> faces, normals;
        std::size_t at = 0;
        for (const Index n : t.facet_sizes) {
            faces.emplace_back(&t.facet_points[at], &t.facet_points[at] + n);
            normals.emplace_back(&t.facet_normals[at], &t.facet_normals[at] + n);
            at += n;
        }
        if (kTriangles<TypeParam>) {
            faces.clear();
            normals.clear();
            for (const auto& [a, b, c] : triangles(t))
                faces.push_back({int(a), int(b), int(c)});
            for (const auto& corners : triangle_corners(t)) {
                normals.emplace_back();
                for (const Index c : corners)
                    normals.back().push_back(int(t.facet_normals[c]));
            }
        }
        expect_filled(mesh, {t.positions.begin(), t.positions.end()}, faces);
        // Closed, and like a sphere.
        EXPECT_EQ(int(mesh.n_vertices() + mesh.n_faces()) - int(mesh.n_edges()), 2);
        for (const auto h : mesh.halfedges())
            ASSERT_FALSE(mesh.is_boundary(h));

        const auto vector = [](const typename TypeParam::Normal& n) {
            return Vec3<double>(n[0], n[1], n[2]);
        };
        for (const auto v : mesh.vertices())
            EXPECT_EQ(vector(mesh.normal(v)), rounded<TypeParam>(t.normals[v.idx()]));
        for (const auto f : mesh.faces()) {
            auto h = mesh.halfedge_handle(f);
            for (const int n : normals[f.idx()]) {
                EXPECT_EQ(vector(mesh.normal(h)), rounded<TypeParam>(t.normals[n]));
                h = mesh.next_halfedge_handle(h);
            }
            // They are on the side of the facet, which is nearly flat.
            EXPECT_GT(glm::dot(vector(mesh.calc_normal(f)),
                               vector(mesh.normal(mesh.halfedge_handle(f)))),
                      0.5);
        }
    }
}

TYPED_TEST(OpenMeshFill, TakesTexcoords) {
    Tessellation t = creased_surface().tessellate(2);
    for (Index i = 0; i < t.facet_points.size(); ++i) {
        t.texcoords.emplace_back(i, 0.5 * i);
        t.facet_texcoords.push_back(i);
    }
    TypeParam mesh;
    ASSERT_TRUE(fill_openmesh(t, mesh));  // not asked for
    mesh.request_vertex_texcoords2D();
    mesh.request_halfedge_texcoords2D();
    ASSERT_TRUE(fill_openmesh(t, mesh));
    const auto corners = triangle_corners(t);
    Index corner = 0;
    for (const auto f : mesh.faces()) {
        auto h = mesh.halfedge_handle(f);
        for (Index i = 0; i < mesh.valence(f); ++i) {
            const Index c = kTriangles<TypeParam> ? corners[f.idx()][i] : corner++;
            EXPECT_EQ(mesh.texcoord2D(h)[0], float(c));
            EXPECT_EQ(mesh.texcoord2D(h)[1], 0.5f * float(c));
            EXPECT_EQ(Index(mesh.to_vertex_handle(h).idx()), t.facet_points[c]);
            h = mesh.next_halfedge_handle(h);
        }
    }
    for (const auto v : mesh.vertices()) {
        const auto c = static_cast<Index>(mesh.texcoord2D(v)[0]);
        EXPECT_EQ(t.facet_points[c], Index(v.idx()));  // that of one of its corners
    }
}

// Of a tessellation and of a refined mesh, by name and by the size of the vectors.
TYPED_TEST(OpenMeshFill, TakesFaceVaryingChannels) {
    Tessellation t = creased_surface().tessellate(2);
    FaceVaryingChannels paint;
    paint.name = "paint";
    paint.n = 3;
    for (Index i = 0; i < t.facet_points.size(); ++i) {
        paint.values.insert(paint.values.end(), {double(i), 0.5 * i, -1});
        paint.corner_values.push_back(i);
    }
    t.face_varying = {paint};
    TypeParam mesh;
    ASSERT_TRUE(fill_openmesh(t, mesh));  // not asked for
    OpenMesh::HPropHandleT<OpenMesh::Vec3f> property;
    OpenMesh::HPropHandleT<float> other;
    mesh.add_property(property, "paint");
    mesh.add_property(other, "other");
    ASSERT_TRUE(fill_openmesh(t, mesh));
    const auto corners = triangle_corners(t);
    Index corner = 0;
    for (const auto f : mesh.faces()) {
        auto h = mesh.halfedge_handle(f);
        for (Index i = 0; i < mesh.valence(f); ++i) {
            const Index c = kTriangles<TypeParam> ? corners[f.idx()][i] : corner++;
            EXPECT_EQ(mesh.property(property, h),
                      OpenMesh::Vec3f(float(c), 0.5f * float(c), -1));
            h = mesh.next_halfedge_handle(h);
        }
    }

    MeshData data = random_displaced(cube(), 1, 0.1);
    FaceVaryingChannels weight;
    weight.name = "weight";
    weight.values.assign(8, 0);
    for (Index v = 0; v < 8; ++v)
        weight.values[v] = v;
    weight.corner_values = data.face_vertices;
    data.face_varying = {weight};
    PolyDouble fine;
    OpenMesh::HPropHandleT<double> weights;
    fine.add_property(weights, "weight");
    ASSERT_TRUE(fill_openmesh(data, fine));
    for (const auto f : fine.faces()) {
        for (const auto h : f.halfedges())
            EXPECT_EQ(fine.property(weights, h), h.to().idx());
    }
}

// ---------------------------------------------------------------------- what was there

TYPED_TEST(OpenMeshFill, LeavesNothingOfWhatWasThere) {
    TypeParam mesh = torus_mesh<TypeParam>();
    OpenMesh::VPropHandleT<int> kept;
    mesh.add_property(kept, "kept");
    mesh.property(kept, OpenMesh::VertexHandle(0)) = 7;
    for (const auto e : mesh.edges())
        mesh.status(e).set_feature(true);
    for (const auto v : mesh.vertices())
        mesh.status(v).set_feature(true);
    mesh.delete_vertex(OpenMesh::VertexHandle(0));
    ASSERT_TRUE(fill_openmesh(cube(), mesh));
    EXPECT_EQ(mesh.n_vertices(), 8u);
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    ASSERT_TRUE(arrays);
    EXPECT_TRUE(arrays->vertices.all_live());
    EXPECT_TRUE(arrays->faces.all_live());
    EXPECT_TRUE(arrays->creases.empty());
    EXPECT_TRUE(arrays->corners.empty());
    OpenMesh::VPropHandleT<int> found;
    EXPECT_TRUE(mesh.get_property_handle(found, "kept"));
    EXPECT_EQ(mesh.property(found, OpenMesh::VertexHandle(0)), 0);
}

TYPED_TEST(OpenMeshFill, RefusesAndKeepsWhatWasThere) {
    TypeParam mesh = torus_mesh<TypeParam>();
    const auto before = live_faces(mesh);
    MeshData twice = cube();
    twice.face_vertices[5] = twice.face_vertices[4];
    EXPECT_EQ(fill_openmesh(twice, mesh).error().code, ErrorCode::RepeatedVertex);
    EXPECT_EQ(fill_openmesh(twice, mesh).error().element, 1u);
    MeshData tagged = cube();
    add_crease(tagged, {0, 0});
    EXPECT_EQ(fill_openmesh(tagged, mesh).error().code, ErrorCode::InvalidTag);
    EXPECT_EQ(fill_openmesh(Tessellation(), mesh).error().code, ErrorCode::EmptyMesh);
    EXPECT_EQ(live_faces(mesh), before);
    EXPECT_EQ(point_of(mesh, 3), point_of(torus_mesh<TypeParam>(), 3));
}

// Two quads whose first diagonals are the same edge: fans of triangles would be four there.
TEST(OpenMeshFillTriangles, RefusesAnEdgeOfFourTriangles) {
    MeshData data;
    for (int i = 0; i < 5; ++i)
        data.positions.emplace_back(i, i * i, 1);
    data.face_sizes = {4, 4};
    data.face_vertices = {0, 1, 2, 3, 0, 3, 2, 4};
    ASSERT_TRUE(build_topology(data));
    TriDouble mesh = openmesh_of<TriDouble>(tetrahedron());
    const Status s = fill_openmesh(data, mesh);
    ASSERT_FALSE(s);
    EXPECT_EQ(s.error().code, ErrorCode::NonManifoldEdge);
    EXPECT_EQ(s.error().element, 1u);
    EXPECT_NE(s.error().message.find("face 1 "), std::string::npos) << s.error().message;
    EXPECT_EQ(mesh.n_faces(), 4u);
    PolyDouble polygons;
    EXPECT_TRUE(fill_openmesh(data, polygons));
}

}  // namespace
}  // namespace osdx
