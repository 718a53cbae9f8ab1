// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/face_varying_surface.h>
#include <osdx/features.h>
#include <osdx/openmesh.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "tests/osd_ext/openmesh/openmesh_meshes.h"
#include "tests/support/test_meshes.h"

// Adds to what the others declare.
// clang-format off
#include <OpenMesh/Core/Geometry/EigenVectorT.hh>
// clang-format on

namespace osdx {
namespace {

using namespace test;

/// Some faces, a vertex with its faces, and what is then loose.
template <class M>
void delete_some(M& mesh) {
    mesh.delete_face(OpenMesh::FaceHandle(0));
    mesh.delete_vertex(OpenMesh::VertexHandle(17));
    mesh.delete_face(OpenMesh::FaceHandle(38));  // has no vertex with the others
    mesh.delete_isolated_vertices();
    ASSERT_GT(mesh.n_vertices(),
              size_t(std::distance(mesh.vertices_sbegin(), mesh.vertices_end())));
}

/// The faces by the places of their vertices, turned to begin with the least.
template <class M>
std::multiset<std::vector<std::array<double, 3>>> face_places(
    const std::vector<std::vector<int>>& faces, const M& mesh) {
    std::multiset<std::vector<std::array<double, 3>>> result;
    for (const auto& face : faces) {
        std::vector<std::array<double, 3>> places;
        for (const int v : face) {
            const Vec3<double> p = point_of(mesh, v);
            places.push_back({p.x, p.y, p.z});
        }
        std::rotate(places.begin(), std::ranges::min_element(places), places.end());
        result.insert(places);
    }
    return result;
}

template <class M>
class OpenMeshArraysOf : public testing::Test {};
TYPED_TEST_SUITE(OpenMeshArraysOf, MeshTypes);

TYPED_TEST(OpenMeshArraysOf, LeaveOutWhatIsDeleted) {
    TypeParam mesh = torus_mesh<TypeParam>();
    delete_some(mesh);
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    ASSERT_TRUE(arrays) << arrays.error().message;

    const MeshData expected = arrays_by_hand(mesh);
    EXPECT_EQ(arrays->face_sizes, expected.face_sizes);
    EXPECT_EQ(arrays->face_vertices, expected.face_vertices);
    EXPECT_EQ(arrays->view().n_vertices, expected.positions.size());
    EXPECT_EQ(to_mesh_data(mesh, *arrays).positions, expected.positions);
    EXPECT_TRUE(build_topology(arrays->view()));

    // The faces that OpenMesh has once it has collected the garbage.
    std::vector<std::vector<int>> by_handles;
    std::size_t at = 0;
    for (const Index n : arrays->face_sizes) {
        by_handles.emplace_back();
        for (Index i = 0; i < n; ++i)
            by_handles.back().push_back(
                arrays->vertex_handle(arrays->face_vertices[at++]).idx());
    }
    TypeParam collected = mesh;
    collected.garbage_collection();
    EXPECT_EQ(collected.n_vertices(), arrays->vertices.size());
    EXPECT_EQ(face_places(by_handles, mesh),
              face_places(live_faces(collected), collected));
}

TYPED_TEST(OpenMeshArraysOf, NumberHandlesBothWays) {
    TypeParam mesh = torus_mesh<TypeParam>();
    for (int pass = 0; pass < 2; ++pass) {
        const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
        ASSERT_TRUE(arrays);
        EXPECT_EQ(arrays->faces.all_live(), pass == 0);
        Index n = 0;
        for (const auto f : mesh.all_faces()) {
            const bool live = !mesh.status(f).deleted();
            EXPECT_EQ(arrays->number(f), live ? n : kInvalidIndex);
            if (live) {
                EXPECT_EQ(arrays->face_handle(n++), f);
            }
        }
        EXPECT_EQ(arrays->faces.size(), n);
        n = 0;
        for (const auto v : mesh.all_vertices()) {
            const bool live = !mesh.status(v).deleted();
            EXPECT_EQ(arrays->number(v), live ? n : kInvalidIndex);
            if (live) {
                EXPECT_EQ(arrays->vertex_handle(n++), v);
            }
        }
        EXPECT_EQ(arrays->vertices.size(), n);
        EXPECT_EQ(arrays->number(OpenMesh::FaceHandle(static_cast<int>(mesh.n_faces()))),
                  kInvalidIndex);
        EXPECT_EQ(arrays->number(OpenMesh::VertexHandle()), kInvalidIndex);
        if (pass == 0)
            delete_some(mesh);
    }
}

TYPED_TEST(OpenMeshArraysOf, ReadMeshesWithoutStatus) {
    TypeParam mesh = torus_mesh<TypeParam>();
    const MeshData expected = arrays_by_hand(mesh);
    mesh.release_vertex_status();
    mesh.release_halfedge_status();
    mesh.release_edge_status();
    mesh.release_face_status();
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    ASSERT_TRUE(arrays);
    EXPECT_EQ(arrays->face_vertices, expected.face_vertices);
    EXPECT_TRUE(arrays->creases.empty());
    EXPECT_TRUE(arrays->corners.empty());
}

// ---------------------------------------------------------------------- features

/// A closed curve of edges, by the handles of its vertices.
const std::vector<int> kCurve = {7, 8, 9, 10, 11, 12, 13, 7};

template <class M>
auto edge_between(const M& mesh, int a, int b) {
    return mesh.edge_handle(
        mesh.find_halfedge(OpenMesh::VertexHandle(a), OpenMesh::VertexHandle(b)));
}

// Against the tags of MeshData, which a reader of their own takes.
TYPED_TEST(OpenMeshArraysOf, FlagsAreCreasesAndCorners) {
    TypeParam mesh = torus_mesh<TypeParam>();
    MeshData expected = arrays_by_hand(mesh);
    for (std::size_t i = 1; i < kCurve.size(); ++i) {
        mesh.status(edge_between(mesh, kCurve[i - 1], kCurve[i])).set_feature(true);
        add_crease(expected, {Index(kCurve[i - 1]), Index(kCurve[i])});
    }
    mesh.status(OpenMesh::VertexHandle(30)).set_feature(true);
    add_corner(expected, 30);

    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    ASSERT_TRUE(arrays);
    EXPECT_EQ(arrays->crease_sharpness, std::vector<float>(kCurve.size() - 1, 10));
    EXPECT_EQ(arrays->corners, std::vector<Index>{30});
    const Topology t = topology_of(expected);
    EXPECT_EQ(*build_features(arrays->view(), t), features_of(expected));
    const Result<Surface> ours =
        Surface::build(arrays->view(), positions(mesh, *arrays).channels());
    const Result<Surface> theirs = Surface::build(expected);
    ASSERT_TRUE(ours && theirs);
    expect_same_surface(*ours, *theirs);
    EXPECT_EQ(build_features(to_mesh_data(mesh, *arrays), t)->edge_sharpness,
              features_of(expected).edge_sharpness);

    const Result<OpenMeshArrays> soft = read_openmesh(mesh, {.feature_sharpness = 1.5f});
    ASSERT_TRUE(soft);
    EXPECT_EQ(soft->crease_sharpness, std::vector<float>(kCurve.size() - 1, 1.5f));
    EXPECT_EQ(soft->corner_sharpness, std::vector<float>{1.5f});
}

template <class T, class M>
void set_sharpness(M& mesh, const std::string& name, MeshData& expected) {
    OpenMesh::EPropHandleT<T> of_edges;
    OpenMesh::VPropHandleT<T> of_vertices;
    mesh.add_property(of_edges, name);
    mesh.add_property(of_vertices, name);
    // Properties that nobody set may hold anything.
    for (const auto e : mesh.edges())
        mesh.property(of_edges, e) = 0;
    for (const auto v : mesh.vertices())
        mesh.property(of_vertices, v) = 0;
    for (std::size_t i = 1; i < kCurve.size(); ++i) {
        const double s = i == 3 ? 0 : i == 4 ? -1 : 0.25 * double(i);
        const auto e = edge_between(mesh, kCurve[i - 1], kCurve[i]);
        mesh.property(of_edges, e) = T(s);
        if (i > 2)
            mesh.status(e).set_feature(true);  // replaced, but for i = 3
        if (i != 4)
            add_crease(expected, {Index(kCurve[i - 1]), Index(kCurve[i])},
                       i == 3 ? 10 : s);
    }
    mesh.property(of_vertices, OpenMesh::VertexHandle(20)) = T(2.5);
    add_corner(expected, 20, 2.5);
}

TYPED_TEST(OpenMeshArraysOf, PropertiesReplaceFlags) {
    for (const std::string name : {"osdx:sharpness", "weight"}) {
        for (const bool in_double : {false, true}) {
            TypeParam mesh = torus_mesh<TypeParam>();
            MeshData expected = arrays_by_hand(mesh);
            in_double ? set_sharpness<double>(mesh, name, expected)
                      : set_sharpness<float>(mesh, name, expected);
            const Result<OpenMeshArrays> arrays =
                read_openmesh(mesh, {.sharpness = name});
            ASSERT_TRUE(arrays);
            EXPECT_EQ(arrays->crease_sharpness.size(), kCurve.size() - 2);
            EXPECT_EQ(*build_features(arrays->view(), topology_of(expected)),
                      features_of(expected));
            // By another name it is no property of sharpness: flags alone.
            EXPECT_EQ(
                read_openmesh(mesh, {.sharpness = "other"})->crease_sharpness.size(),
                kCurve.size() - 3);
        }
    }
}

TYPED_TEST(OpenMeshArraysOf, FeaturesOfDeletedElementsAreNone) {
    TypeParam mesh = torus_mesh<TypeParam>();
    for (const auto e : mesh.edges())
        mesh.status(e).set_feature(true);
    for (const auto v : mesh.vertices())
        mesh.status(v).set_feature(true);
    OpenMesh::FPropHandleT<bool> hole;
    mesh.add_property(hole, "osdx:hole");
    for (const auto f : mesh.faces())
        mesh.property(hole, f) = f.idx() % 5 == 0;
    delete_some(mesh);
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    ASSERT_TRUE(arrays);
    EXPECT_EQ(arrays->corners.size(), arrays->vertices.size());
    const Result<Topology> t = build_topology(arrays->view());
    ASSERT_TRUE(t);
    EXPECT_EQ(arrays->crease_sharpness.size(), t->n_edges);
    const Result<Features> features = build_features(arrays->view(), *t);
    ASSERT_TRUE(features) << features.error().message;
    EXPECT_EQ(std::ranges::count(features->edge_sharpness, 10.0), t->n_edges);
    for (Index f = 0; f < arrays->faces.size(); ++f)
        EXPECT_EQ(features->is_hole(f), arrays->face_handle(f).idx() % 5 == 0);
    EXPECT_EQ(build_features(to_mesh_data(mesh, *arrays), *t)->hole, features->hole);
}

TEST(OpenMeshArrays, FeaturesOfEdgesWithoutFacesAreNone) {
    auto mesh = openmesh_of<PolyFloat>(cube());
    const auto h = mesh.new_edge(mesh.add_vertex({2, 2, 2}), mesh.add_vertex({3, 2, 2}));
    mesh.status(mesh.edge_handle(h)).set_feature(true);
    mesh.status(OpenMesh::EdgeHandle(5)).set_feature(true);
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    ASSERT_TRUE(arrays);
    EXPECT_EQ(arrays->crease_sharpness, std::vector<float>{10});
    EXPECT_TRUE(Surface::build(arrays->view(), positions(mesh, *arrays).channels()));
}

TEST(OpenMeshArrays, AreOfTheSameSurfaceIfNothingDiffers) {
    auto mesh = openmesh_of<PolyFloat>(cube());
    OpenMesh::FPropHandleT<bool> hole;
    mesh.add_property(hole, "osdx:hole");
    const auto arrays_with = [&](int edge, int vertex, int face,
                                 OpenMeshOptions options) {
        PolyFloat copy = mesh;
        copy.status(OpenMesh::EdgeHandle(edge)).set_feature(true);
        copy.status(OpenMesh::VertexHandle(vertex)).set_feature(true);
        copy.property(hole, OpenMesh::FaceHandle(face)) = true;
        return *read_openmesh(copy, options);
    };
    const OpenMeshArrays arrays = arrays_with(1, 2, 3, {});
    EXPECT_TRUE(arrays.same_surface(arrays_with(1, 2, 3, {})));
    EXPECT_FALSE(arrays.same_surface(arrays_with(4, 2, 3, {})));
    EXPECT_FALSE(arrays.same_surface(arrays_with(1, 4, 3, {})));
    EXPECT_FALSE(arrays.same_surface(arrays_with(1, 2, 4, {})));
    EXPECT_FALSE(arrays.same_surface(arrays_with(1, 2, 3, {.feature_sharpness = 2})));
    OpenMeshOptions rules;
    rules.boundary = BoundaryRule::EdgeAndCorner;
    EXPECT_FALSE(arrays.same_surface(arrays_with(1, 2, 3, rules)));
    rules = {};
    rules.crease_method = CreaseMethod::Chaikin;
    EXPECT_FALSE(arrays.same_surface(arrays_with(1, 2, 3, rules)));
    rules = {};
    rules.smooth_triangles = true;
    EXPECT_FALSE(arrays.same_surface(arrays_with(1, 2, 3, rules)));
}

TEST(OpenMeshArrays, TakeTheRulesFromTheOptions) {
    const auto mesh = openmesh_of<PolyDouble>(grid(3, 3));
    for (const BoundaryRule boundary :
         {BoundaryRule::None, BoundaryRule::EdgeOnly, BoundaryRule::EdgeAndCorner}) {
        OpenMeshOptions options;
        options.boundary = boundary;
        options.crease_method = CreaseMethod::Chaikin;
        options.smooth_triangles = true;
        const Result<OpenMeshArrays> arrays = read_openmesh(mesh, options);
        ASSERT_TRUE(arrays);
        const Topology t = topology_of(grid(3, 3));
        const Features expected = {{}, {}, {}, boundary, CreaseMethod::Chaikin, true};
        EXPECT_EQ(*build_features(arrays->view(), t), expected);
        EXPECT_EQ(*build_features(*to_mesh_data(mesh, options), t), expected);
    }
}

// ---------------------------------------------------------------------- channels

TYPED_TEST(OpenMeshArraysOf, PositionsAreThoseOfTheMesh) {
    using T = PositionScalar<TypeParam>;
    TypeParam mesh = torus_mesh<TypeParam>();
    const Result<OpenMeshArrays> all = read_openmesh(mesh);
    const VertexChannels<T> whole = positions(mesh, *all);
    EXPECT_FALSE(whole.is_copy());
    EXPECT_EQ(whole.channels().data, &mesh.points()[0][0]);

    delete_some(mesh);
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    VertexChannels<T> copy = positions(mesh, *arrays);
    EXPECT_TRUE(copy.is_copy());
    const VertexChannels<T> moved = std::move(copy), copied = moved;
    Index n = 0;
    for (const auto v : mesh.vertices()) {
        for (const VertexChannels<T>& c : {moved, copied}) {
            ASSERT_EQ(c.channels().n, 3);
            for (int i = 0; i < 3; ++i)
                EXPECT_EQ(c.channels()[n][i], mesh.point(v)[i]);
        }
        ++n;
    }
    EXPECT_EQ(n, arrays->vertices.size());
}

template <class V, class M>
void expect_channels(const M& mesh, const OpenMeshArrays& arrays,
                     OpenMesh::VPropHandleT<V> property, int n) {
    const auto values = vertex_channels(mesh, arrays, property);
    ASSERT_TRUE(values) << values.error().message;
    EXPECT_EQ(values->is_copy(), !arrays.vertices.all_live());
    const auto c = values->channels();
    EXPECT_EQ(c.n, n);
    Index i = 0;
    for (auto v = mesh.vertices_sbegin(); v != mesh.vertices_end(); ++v, ++i) {
        for (int k = 0; k < n; ++k) {
            if constexpr (std::is_arithmetic_v<V>)
                EXPECT_EQ(c[i][k], mesh.property(property, *v));
            else
                EXPECT_EQ(c[i][k], mesh.property(property, *v)[k]);
        }
    }
}

TYPED_TEST(OpenMeshArraysOf, PropertiesAreChannels) {
    TypeParam mesh = torus_mesh<TypeParam>();
    mesh.request_vertex_colors();
    mesh.request_vertex_texcoords2D();
    OpenMesh::VPropHandleT<double> weight;
    OpenMesh::VPropHandleT<int> count;
    OpenMesh::VPropHandleT<OpenMesh::Vec4f> velocity;
    mesh.add_property(weight, "weight");
    mesh.add_property(count, "count");
    mesh.add_property(velocity, "velocity");
    for (const auto v : mesh.vertices()) {
        const int i = v.idx();
        typename TypeParam::Color color;
        for (int k = 0; k < int(color.size()); ++k)
            color[k] = static_cast<typename TypeParam::Color::value_type>(i + 100 * k);
        mesh.set_color(v, color);
        mesh.set_texcoord2D(v, {float(i), float(-i)});
        mesh.property(weight, v) = 1.0 / (1 + i);
        mesh.property(count, v) = i * i;
        mesh.property(velocity, v) = {float(i), 1, 2, float(3 * i)};
    }
    const int n_colors = int(typename TypeParam::Color().size());
    for (int pass = 0; pass < 2; ++pass) {
        const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
        ASSERT_TRUE(arrays);
        expect_channels(mesh, *arrays, mesh.vertex_colors_pph(), n_colors);
        expect_channels(mesh, *arrays, mesh.vertex_texcoords2D_pph(), 2);
        expect_channels(mesh, *arrays, weight, 1);
        expect_channels(mesh, *arrays, count, 1);
        expect_channels(mesh, *arrays, velocity, 4);
        const auto by_name = vertex_channels<OpenMesh::Vec4f>(mesh, *arrays, "velocity");
        const auto by_handle = vertex_channels(mesh, *arrays, velocity);
        ASSERT_TRUE(by_name && by_handle);
        EXPECT_EQ(by_name->channels()[5][3], by_handle->channels()[5][3]);

        const auto other_type =
            vertex_channels<OpenMesh::Vec3f>(mesh, *arrays, "velocity");
        ASSERT_FALSE(other_type);
        EXPECT_EQ(other_type.error().code, ErrorCode::InvalidOption);
        EXPECT_NE(other_type.error().message.find("velocity"), std::string::npos);
        EXPECT_FALSE(vertex_channels(mesh, *arrays, mesh.vertex_texcoords3D_pph()));
        if (pass == 0)
            delete_some(mesh);
    }
}

struct EigenTraits : OpenMesh::DefaultTraits {
    using Point = Eigen::Vector3d;
    using Normal = Eigen::Vector3d;
};
struct WideTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::VectorT<long double, 3>;
    using Normal = Point;
};

TEST(OpenMeshArrays, TakePointsOfOtherLibraries) {
    const MeshData data = random_displaced(torus(5, 4), 3, 0.05);
    const auto eigen = openmesh_of<OpenMesh::PolyMesh_ArrayKernelT<EigenTraits>>(data);
    const Result<OpenMeshArrays> arrays = read_openmesh(eigen);
    ASSERT_TRUE(arrays);
    const VertexChannels<double> points = positions(eigen, *arrays);
    EXPECT_FALSE(points.is_copy());
    const auto wide = openmesh_of<OpenMesh::PolyMesh_ArrayKernelT<WideTraits>>(data);
    const VertexChannels<double> narrowed = positions(wide, *arrays);
    EXPECT_TRUE(narrowed.is_copy());
    for (Index v = 0; v < arrays->vertices.size(); ++v) {
        for (int i = 0; i < 3; ++i) {
            EXPECT_EQ(points.channels()[v][i], data.positions[v][i]);
            EXPECT_EQ(narrowed.channels()[v][i], data.positions[v][i]);
        }
    }
    const Result<OpenMeshSurface> ours = OpenMeshSurface::build(eigen);
    const Result<Surface> theirs = Surface::build(data);
    ASSERT_TRUE(ours && theirs);
    expect_same_surface(ours->surface(), *theirs);
}

// ---------------------------------------------------------------------- texture coordinates

TYPED_TEST(OpenMeshArraysOf, TexcoordsBecomeOneWhereTheyAreEqual) {
    TypeParam mesh = torus_mesh<TypeParam>();
    mesh.request_vertex_texcoords2D();
    mesh.request_halfedge_texcoords2D();
    for (const auto v : mesh.vertices())
        mesh.set_texcoord2D(v, {float(v.idx()), 0.5f});
    // Faces of odd handles lie in another chart.
    for (const auto h : mesh.halfedges()) {
        const float chart = h.face().idx() % 2 == 0 ? 0.0f : 1.0f;
        mesh.set_texcoord2D(h, {float(h.to().idx()), chart});
    }
    delete_some(mesh);

    const Result<MeshData> data = to_mesh_data(mesh);
    ASSERT_TRUE(data);
    const auto faces = live_faces(mesh);
    ASSERT_EQ(data->face_uvs.size(), data->face_vertices.size());
    std::set<std::pair<int, int>> different;
    std::size_t at = 0, f = 0;
    for (auto i = mesh.faces_sbegin(); i != mesh.faces_end(); ++i, ++f) {
        for (const int v : faces[f]) {
            const int chart = i->idx() % 2;
            EXPECT_EQ(data->uvs[data->face_uvs[at++]], Vec2<double>(v, chart));
            different.emplace(v, chart);
        }
    }
    EXPECT_EQ(data->uvs.size(), different.size());
    EXPECT_TRUE(check_uvs(*data));

    mesh.release_halfedge_texcoords2D();
    const Result<MeshData> of_vertices = to_mesh_data(mesh);
    ASSERT_TRUE(of_vertices);
    at = 0;
    for (const auto& face : faces) {
        for (const int v : face)
            EXPECT_EQ(of_vertices->uvs[of_vertices->face_uvs[at++]],
                      Vec2<double>(v, 0.5));
    }
    EXPECT_EQ(of_vertices->uvs.size(), of_vertices->positions.size());
    mesh.release_vertex_texcoords2D();
    EXPECT_TRUE(to_mesh_data(mesh)->face_uvs.empty());
}

// A surface over a property of halfedges has its values at the corners.
TYPED_TEST(OpenMeshArraysOf, PropertiesOfHalfedgesAreFaceVarying) {
    TypeParam mesh = torus_mesh<TypeParam>();
    mesh.request_halfedge_texcoords2D();
    OpenMesh::HPropHandleT<OpenMesh::Vec3f> paint;
    OpenMesh::HPropHandleT<double> weight;
    mesh.add_property(paint, "paint");
    mesh.add_property(weight, "weight");
    for (const auto h : mesh.halfedges()) {
        const int chart = h.face().idx() % 2, v = h.to().idx();
        mesh.property(paint, h) = {float(v), float(chart), 3};
        mesh.property(weight, h) = v + 0.25 * chart;
        mesh.set_texcoord2D(h, {float(chart), float(v)});
    }
    delete_some(mesh);
    const Result<OpenMeshArrays> arrays = read_openmesh(mesh);
    ASSERT_TRUE(arrays);
    const auto colors = halfedge_channels<OpenMesh::Vec3f>(mesh, *arrays, "paint");
    const auto weights = halfedge_channels(mesh, *arrays, weight, FaceVaryingRule::None);
    const auto uvs = halfedge_channels(mesh, *arrays, mesh.halfedge_texcoords2D_pph());
    ASSERT_TRUE(colors && weights && uvs);
    EXPECT_EQ(colors->name, "paint");
    EXPECT_EQ(weights->rule, FaceVaryingRule::None);
    EXPECT_EQ(colors->n, 3);
    EXPECT_EQ(weights->n, 1);
    // The same corners agree in all of them.
    EXPECT_EQ(colors->corner_values, weights->corner_values);
    EXPECT_EQ(colors->corner_values, uvs->corner_values);
    EXPECT_EQ(uvs->corner_values, to_mesh_data(mesh, *arrays).face_uvs);

    const auto surface = OpenMeshSurface::build(mesh);
    ASSERT_TRUE(surface) << surface.error().message;
    const auto painted = FaceVaryingSurface::build(surface->surface(), colors->corners());
    ASSERT_TRUE(painted) << painted.error().message;
    const Buffer<double> points = painted->values(colors->view());
    const auto faces = live_faces(mesh);
    std::size_t corner = 0;
    Index f = 0;
    for (auto i = mesh.faces_sbegin(); i != mesh.faces_end(); ++i, ++f) {
        for (const int v : faces[f]) {
            double at[3];
            painted->evaluate(points, 3, QuarterPoint{Index(corner), 0, 0}, 0, at);
            EXPECT_EQ(at[0], v);
            EXPECT_EQ(at[1], i->idx() % 2);
            EXPECT_EQ(at[2], 3);
            const Index value = colors->corner_values[corner++];
            EXPECT_EQ(weights->values[value], v + 0.25 * (i->idx() % 2));
        }
    }
    EXPECT_FALSE(halfedge_channels<float>(mesh, *arrays, "paint"));
    EXPECT_FALSE(halfedge_channels<float>(mesh, *arrays, "nothing"));
}

// ---------------------------------------------------------------------- refusals

template <class M>
void expect_refusal(const M& mesh, ErrorCode code, int element,
                    const std::string& words) {
    SCOPED_TRACE(words);
    const Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
    ASSERT_FALSE(surface);
    EXPECT_EQ(surface.error().code, code) << surface.error().message;
    EXPECT_EQ(surface.error().element, static_cast<Index>(element));
    EXPECT_NE(surface.error().message.find(words), std::string::npos)
        << surface.error().message;
}

TYPED_TEST(OpenMeshArraysOf, RefusalsNameHandles) {
    TypeParam mesh = torus_mesh<TypeParam>();
    delete_some(mesh);
    TypeParam bad = mesh;
    bad.point(OpenMesh::VertexHandle(21))[1] = NAN;
    expect_refusal(bad, ErrorCode::NonFinitePoint, 21, "vertex 21 has");
    // That of a deleted vertex does not matter.
    bad.set_point(OpenMesh::VertexHandle(21), mesh.point(OpenMesh::VertexHandle(21)));
    bad.point(OpenMesh::VertexHandle(17))[1] = NAN;
    EXPECT_TRUE(OpenMeshSurface::build(bad));

    bad = mesh;
    const auto f = OpenMesh::FaceHandle(30);
    const int v = bad.to_vertex_handle(bad.halfedge_handle(f)).idx();
    bad.status(OpenMesh::VertexHandle(v)).set_deleted(true);
    const Result<OpenMeshArrays> arrays = read_openmesh(bad);
    ASSERT_FALSE(arrays);
    EXPECT_EQ(arrays.error().code, ErrorCode::IndexOutOfRange);
    EXPECT_NE(arrays.error().message.find("vertex " + std::to_string(v) + ", which is"),
              std::string::npos);

    bad = mesh;
    OpenMesh::EPropHandleT<float> sharpness;
    bad.add_property(sharpness, "osdx:sharpness");
    for (const auto e : bad.edges())
        bad.property(sharpness, e) = 0;
    const auto edge = bad.edge_handle(bad.halfedge_handle(f));
    bad.property(sharpness, edge) = NAN;
    expect_refusal(bad, ErrorCode::InvalidFeature, edge.idx(),
                   "edge " + std::to_string(edge.idx()));
    bad.property(sharpness, edge) = 0;
    OpenMesh::VPropHandleT<double> of_vertices;
    bad.add_property(of_vertices, "osdx:sharpness");
    for (const auto w : bad.vertices())
        bad.property(of_vertices, w) = 0;
    bad.property(of_vertices, OpenMesh::VertexHandle(v)) = NAN;
    expect_refusal(bad, ErrorCode::InvalidFeature, v, "vertex " + std::to_string(v));
}

TEST(OpenMeshArrays, RefuseWhatOpenMeshTakes) {
    // Two fans of faces at a vertex, after deleted elements.
    auto mesh = openmesh_of<PolyDouble>(random_displaced(grid(4, 4), 1, 0.01));
    const auto delete_faces = [&](std::initializer_list<int> faces) {
        for (const int f : faces)
            mesh.delete_face(OpenMesh::FaceHandle(f));
    };
    delete_faces({0, 1, 2, 3});
    ASSERT_TRUE(OpenMeshSurface::build(mesh));
    delete_faces({5, 8});  // vertex 11 is between 4 and 9 then
    expect_refusal(mesh, ErrorCode::NonManifoldVertex, 11, "vertex 11 joins");

    // An edge of four faces that OpenMesh has twice.
    auto twice = openmesh_of<PolyDouble>(cube());
    twice.delete_face(OpenMesh::FaceHandle(0));
    twice.delete_isolated_vertices();
    const auto h = twice.halfedge_handle(OpenMesh::FaceHandle(2));
    const int a = twice.from_vertex_handle(h).idx(), b = twice.to_vertex_handle(h).idx();
    std::vector<OpenMesh::VertexHandle> v;
    for (int i = 0; i < 2; ++i)
        v.push_back(twice.add_vertex({2.0 + i, 3.0, i * 1.0}));
    // By links alone: add_face() refuses it.
    const auto ab = twice.new_edge(OpenMesh::VertexHandle(a), OpenMesh::VertexHandle(b));
    const auto bc = twice.new_edge(OpenMesh::VertexHandle(b), v[0]);
    const auto ca = twice.new_edge(v[0], OpenMesh::VertexHandle(a));
    const auto face = twice.new_face();
    twice.set_halfedge_handle(face, ab);
    for (const auto& [from, to] : {std::pair(ab, bc), {bc, ca}, {ca, ab}}) {
        twice.set_next_halfedge_handle(from, to);
        twice.set_face_handle(from, face);
    }
    const Result<OpenMeshSurface> surface = OpenMeshSurface::build(twice);
    ASSERT_FALSE(surface);
    const Error& error = surface.error();
    EXPECT_EQ(error.code, ErrorCode::NonManifoldEdge) << error.message;
    EXPECT_EQ(error.element, static_cast<Index>(face.idx()));
    EXPECT_NE(error.message.find("face " + std::to_string(face.idx()) + " "),
              std::string::npos)
        << error.message;
    EXPECT_NE(error.message.find("vertices " + std::to_string(std::min(a, b)) + " and " +
                                 std::to_string(std::max(a, b))),
              std::string::npos)
        << error.message;

    twice.new_face();
    const Result<OpenMeshArrays> empty = read_openmesh(twice);
    ASSERT_FALSE(empty);
    EXPECT_EQ(empty.error().code, ErrorCode::FaceTooSmall);
    EXPECT_EQ(empty.error().element, static_cast<Index>(face.idx() + 1));

    EXPECT_EQ(OpenMeshSurface::build(PolyDouble()).error().code, ErrorCode::EmptyMesh);
}

TEST(OpenMeshArrays, MessagesSpeakOfHandles) {
    OpenMeshArrays arrays;
    arrays.faces = {4, {true, false, true, false}};                  // 1 and 3
    arrays.vertices = {6, {true, true, false, false, true, false}};  // 2, 3 and 5
    const auto message = [&](std::string text) {
        return arrays.by_handles(fail(ErrorCode::InvalidOption, std::move(text), 1))
            .message;
    };
    EXPECT_EQ(
        message(
            "face 1 and face 0 have opposite orientations: both run from vertex 2 to 1"),
        "face 3 and face 1 have opposite orientations: both run from vertex 5 to 3");
    EXPECT_EQ(message("face 1 is number 3 of 3 at the edge of vertices 0 and 2"),
              "face 3 is number 3 of 3 at the edge of vertices 2 and 5");
    EXPECT_EQ(message("face 0 names vertex 7, but the mesh has 3 vertices"),
              "face 1 names vertex 7, but the mesh has 3 vertices");
    EXPECT_EQ(message("vertex 0 has the position (1, nan, 0)"),
              "vertex 2 has the position (1, nan, 0)");
    EXPECT_EQ(message("degree 1 is not in 2..15"), "degree 1 is not in 2..15");
    EXPECT_EQ(arrays.by_handles(fail(ErrorCode::NotIsolated, "", 1)).element, 3u);
    EXPECT_EQ(arrays.by_handles(fail(ErrorCode::ValenceTwo, "", 1)).element, 3u);
    EXPECT_EQ(arrays.by_handles(fail(ErrorCode::EmptyMesh, "")).element, kInvalidIndex);
}

}  // namespace
}  // namespace osdx
