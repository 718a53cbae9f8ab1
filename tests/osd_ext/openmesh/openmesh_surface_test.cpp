// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <concepts>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/openmesh.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "tests/osd_ext/openmesh/openmesh_meshes.h"
#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

/// The faces that are not deleted, by handle.
template <class M>
std::map<int, std::vector<int>> faces_by_handle(const M& mesh) {
    std::map<int, std::vector<int>> result;
    const auto faces = live_faces(mesh);
    std::size_t i = 0;
    for (auto f = mesh.faces_sbegin(); f != mesh.faces_end(); ++f)
        result[f->idx()] = faces[i++];
    return result;
}

/// Of `before` and `after` as OpenMesh has them, number by number.
template <class M>
std::vector<Index> map_by_hand(const M& before, const M& after) {
    const auto old_faces = faces_by_handle(before), new_faces = faces_by_handle(after);
    std::map<int, Index> number;
    for (const auto& face : new_faces)
        number.emplace(face.first, static_cast<Index>(number.size()));
    std::vector<Index> result;
    for (const auto& [handle, vertices] : old_faces) {
        const auto i = new_faces.find(handle);
        const bool lives = i != new_faces.end() && i->second == vertices;
        result.push_back(lives ? number[handle] : kInvalidIndex);
    }
    return result;
}

/// A quarter point of each face, and the first corner: where addresses of the map have to lie.
std::vector<Vec3<double>> corners_of(const OpenMeshArrays& arrays,
                                     const std::vector<Vec3<double>>& positions) {
    std::vector<Vec3<double>> result;
    std::size_t at = 0;
    for (const Index n : arrays.face_sizes) {
        result.push_back(positions[arrays.face_vertices[at]]);
        at += n;
    }
    return result;
}

template <class M>
void expect_that_of(const OpenMeshSurface& surface, const M& mesh) {
    const Result<Surface> expected = Surface::build(arrays_by_hand(mesh));
    ASSERT_TRUE(expected) << expected.error().message;
    expect_same_surface(surface.surface(), *expected);
}

template <class M>
class OpenMeshSurfaceOf : public testing::Test {};
TYPED_TEST_SUITE(OpenMeshSurfaceOf, MeshTypes);

TYPED_TEST(OpenMeshSurfaceOf, MovesWherePointsMoved) {
    TypeParam mesh = torus_mesh<TypeParam>();
    for (const bool with_deleted : {false, true}) {
        if (with_deleted) {
            mesh.delete_vertex(OpenMesh::VertexHandle(9));
            mesh.delete_isolated_vertices();
        }
        Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
        ASSERT_TRUE(surface) << surface.error().message;
        expect_that_of(*surface, mesh);
        const PatchTable* table = &surface->surface().patches();
        const Vec3<double> before = surface->surface().evaluate({3, 0.25, 0.5}).p;
        for (const auto v : mesh.vertices())
            mesh.point(v)[v.idx() % 3] += 0.0625f * float(1 + v.idx() % 5);
        const Result<OpenMeshUpdate> update = surface->update(mesh);
        ASSERT_TRUE(update) << update.error().message;
        EXPECT_FALSE(update->rebuilt);
        EXPECT_TRUE(update->faces.empty());
        EXPECT_EQ(update->face(5), 5u);
        EXPECT_EQ(&surface->surface().patches(), table);
        EXPECT_NE(surface->surface().evaluate({3, 0.25, 0.5}).p, before);
        expect_that_of(*surface, mesh);
    }
}

template <class M>
constexpr bool kTriangles = std::derived_from<M, OpenMesh::TriConnectivity>;

/// Of OpenMesh's own operations.
template <class M>
struct Edit {
    std::string name;
    std::function<void(M&)> apply;
};

template <class M>
std::vector<Edit<M>> edits() {
    using OpenMesh::EdgeHandle, OpenMesh::FaceHandle, OpenMesh::VertexHandle;
    std::vector<Edit<M>> result = {
        {"split a face",
         [](M& m) {
             const auto f = FaceHandle(10);
             m.split(f, m.add_vertex(m.calc_face_centroid(f)));
         }},
        {"split an edge",
         [](M& m) {
             const auto e = m.edge_handle(m.halfedge_handle(FaceHandle(11)));
             const auto v = m.add_vertex(m.calc_edge_midpoint(e));
             if constexpr (kTriangles<M>) {
                 m.split(e, v);
             } else {
                 // Its faces are cut too: surfaces take no vertices of two faces.
                 m.split_edge(e, v);
                 std::vector<OpenMesh::SmartHalfedgeHandle> into;
                 for (const auto h : m.vih_range(v))
                     into.push_back(h);
                 for (const auto h : into)
                     m.insert_edge(h, h.next().next().next());
             }
         }},
        {"delete a face", [](M& m) { m.delete_face(FaceHandle(12)); }},
        {"delete the first face", [](M& m) { m.delete_face(FaceHandle(0)); }},
        {"delete a vertex",
         [](M& m) {
             m.delete_vertex(VertexHandle(9));
             m.delete_isolated_vertices();
         }},
        {"delete a face and put it back",
         [](M& m) {
             const auto f = FaceHandle(13);
             std::vector<OpenMesh::VertexHandle> face;
             for (const auto v : m.fv_ccw_range(f))
                 face.push_back(v);
             m.delete_face(f, false);
             m.add_face(face);
         }},
        {"a feature",
         [](M& m) {
             m.status(EdgeHandle(20)).set_feature(true);
             m.status(EdgeHandle(20)).set_feature(false);
             m.delete_face(FaceHandle(14));
         }},
        {"several",
         [](M& m) {
             m.delete_face(FaceHandle(3));
             const auto f = FaceHandle(25);
             m.split(f, m.add_vertex(m.calc_face_centroid(f)));
             m.delete_vertex(VertexHandle(23));
             m.delete_isolated_vertices();
         }},
    };
    if constexpr (kTriangles<M>) {
        result.push_back({"flip", [](M& m) {
                              for (const auto e : m.edges()) {
                                  if (e.idx() > 30 && m.is_flip_ok(e))
                                      return m.flip(e);
                              }
                          }});
        result.push_back({"collapse", [](M& m) {
                              for (const auto h : m.halfedges()) {
                                  if (h.idx() > 50 && m.is_collapse_ok(h))
                                      return m.collapse(h);
                              }
                          }});
    }
    return result;
}

TYPED_TEST(OpenMeshSurfaceOf, IsBuiltAnewWhereFacesChanged) {
    for (const auto& [name, edit] : edits<TypeParam>()) {
        SCOPED_TRACE(name);
        TypeParam mesh = torus_mesh<TypeParam>();
        Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
        ASSERT_TRUE(surface);
        const TypeParam before = mesh;
        const OpenMeshArrays old_arrays = surface->arrays();
        edit(mesh);
        const Result<OpenMeshUpdate> update = surface->update(mesh);
        ASSERT_TRUE(update) << update.error().message;
        EXPECT_TRUE(update->rebuilt);
        expect_that_of(*surface, mesh);
        EXPECT_EQ(update->faces, map_by_hand(before, mesh));

        // Most faces live on, with their corners where they were.
        const auto old_corners = corners_of(old_arrays, arrays_by_hand(before).positions);
        const auto new_corners =
            corners_of(surface->arrays(), arrays_by_hand(mesh).positions);
        std::size_t n_living = 0;
        for (Index f = 0; f < update->faces.size(); ++f) {
            if (update->faces[f] == kInvalidIndex)
                continue;
            ++n_living;
            EXPECT_EQ(new_corners[update->face(f)], old_corners[f]);
            EXPECT_EQ(surface->arrays().face_handle(update->faces[f]),
                      old_arrays.face_handle(f));
        }
        EXPECT_LT(n_living, update->faces.size());
        EXPECT_GE(n_living + 12, update->faces.size());

        // And now that is what it moves from.
        for (const auto v : mesh.vertices())
            mesh.point(v)[1] *= 2;
        const Result<OpenMeshUpdate> moved = surface->update(mesh);
        ASSERT_TRUE(moved);
        EXPECT_FALSE(moved->rebuilt);
        expect_that_of(*surface, mesh);
    }
}

// Far from an edit the surface is what it was, at the same (u, v).
TYPED_TEST(OpenMeshSurfaceOf, KeepsAddressesOfFacesThatLiveOn) {
    TypeParam mesh = openmesh_of<TypeParam>(random_displaced(torus(12, 12), 1, 0.01));
    Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
    ASSERT_TRUE(surface);
    std::vector<Vec3<double>> before;
    for (Index f = 0; f < surface->arrays().faces.size(); ++f)
        before.push_back(surface->surface().evaluate({f, 0.25, 0.125}).p);
    mesh.delete_face(OpenMesh::FaceHandle(0));
    const Result<OpenMeshUpdate> update = surface->update(mesh);
    ASSERT_TRUE(update);
    std::size_t n_same = 0;
    for (Index f = 0; f < before.size(); ++f) {
        if (const Index g = update->face(f); g != kInvalidIndex)
            n_same += surface->surface().evaluate({g, 0.25, 0.125}).p == before[f];
    }
    EXPECT_GT(n_same, before.size() * 3 / 4);
    EXPECT_LT(n_same, before.size());
}

TYPED_TEST(OpenMeshSurfaceOf, IsBuiltAnewWhereFeaturesChanged) {
    TypeParam mesh = torus_mesh<TypeParam>();
    Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
    ASSERT_TRUE(surface);
    mesh.status(OpenMesh::EdgeHandle(20)).set_feature(true);
    MeshData expected = arrays_by_hand(mesh);
    const auto h = mesh.halfedge_handle(OpenMesh::EdgeHandle(20), 0);
    add_crease(expected, {Index(mesh.from_vertex_handle(h).idx()),
                          Index(mesh.to_vertex_handle(h).idx())});
    const std::function<void()> changes[] = {
        [] {},
        [&] {
            mesh.status(OpenMesh::VertexHandle(5)).set_feature(true);
            add_corner(expected, 5);
        },
        [&] {
            OpenMesh::FPropHandleT<bool> hole;
            mesh.add_property(hole, "osdx:hole");
            mesh.property(hole, OpenMesh::FaceHandle(7)) = true;
            expected.tags.push_back({"hole", {7}, {}, {}, 0});
        },
    };
    for (const auto& change : changes) {
        change();
        const Result<OpenMeshUpdate> update = surface->update(mesh);
        ASSERT_TRUE(update) << update.error().message;
        EXPECT_TRUE(update->rebuilt);
        ASSERT_EQ(update->faces.size(), mesh.n_faces());
        for (Index f = 0; f < update->faces.size(); ++f)
            EXPECT_EQ(update->faces[f], f);
        const Result<Surface> other = Surface::build(expected);
        ASSERT_TRUE(other);
        for (const Index f : {0u, 3u, 9u, 20u}) {
            EXPECT_EQ(surface->surface().evaluate({f, 0.25, 0.5}).p,
                      other->evaluate({f, 0.25, 0.5}).p);
        }
        EXPECT_FALSE(surface->update(mesh)->rebuilt);
    }
}

// The faces are the same though their handles are others.
TYPED_TEST(OpenMeshSurfaceOf, MovesWhereOnlyHandlesChanged) {
    TypeParam mesh = torus_mesh<TypeParam>();
    Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
    ASSERT_TRUE(surface);
    const auto last = OpenMesh::FaceHandle(static_cast<int>(mesh.n_faces()) - 1);
    std::vector<OpenMesh::VertexHandle> face;
    for (const auto v : mesh.fv_ccw_range(last))
        face.push_back(v);
    mesh.delete_face(last, false);
    const auto again = mesh.add_face(face);
    ASSERT_NE(again, last);
    const Result<OpenMeshUpdate> update = surface->update(mesh);
    ASSERT_TRUE(update);
    EXPECT_FALSE(update->rebuilt);
    expect_that_of(*surface, mesh);
    EXPECT_EQ(surface->arrays().number(again), static_cast<Index>(last.idx()));
    EXPECT_EQ(surface->arrays().number(last), kInvalidIndex);
}

TYPED_TEST(OpenMeshSurfaceOf, StaysAsItWasOnErrors) {
    TypeParam mesh = torus_mesh<TypeParam>();
    mesh.delete_vertex(OpenMesh::VertexHandle(9));
    mesh.delete_isolated_vertices();
    Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
    ASSERT_TRUE(surface);
    const TypeParam before = mesh;
    const std::pair<ErrorCode, std::function<void()>> damages[] = {
        {ErrorCode::NonFinitePoint,
         [&] { mesh.point(OpenMesh::VertexHandle(21))[2] = INFINITY; }},
        {ErrorCode::NonFinitePoint,
         [&] {
             mesh.delete_face(OpenMesh::FaceHandle(30));
             mesh.point(OpenMesh::VertexHandle(21))[2] = NAN;
         }},
        {ErrorCode::IndexOutOfRange,
         [&] { mesh.status(OpenMesh::VertexHandle(21)).set_deleted(true); }},
        {ErrorCode::EmptyMesh,
         [&] {
             for (const auto f : mesh.faces())
                 mesh.delete_face(f, false);
         }},
    };
    for (const auto& [code, damage] : damages) {
        SCOPED_TRACE(static_cast<int>(code));
        damage();
        const PatchTable* table = &surface->surface().patches();
        const Result<OpenMeshUpdate> update = surface->update(mesh);
        ASSERT_FALSE(update);
        EXPECT_EQ(update.error().code, code) << update.error().message;
        if (code == ErrorCode::NonFinitePoint) {
            EXPECT_EQ(update.error().element, 21u);
            EXPECT_NE(update.error().message.find("vertex 21 "), std::string::npos)
                << update.error().message;
        }
        EXPECT_EQ(&surface->surface().patches(), table);
        expect_that_of(*surface, before);
        mesh = before;
        const Result<OpenMeshUpdate> again = surface->update(mesh);
        ASSERT_TRUE(again);
        EXPECT_FALSE(again->rebuilt);
    }
}

TEST(OpenMeshSurface, TakesMeshesOfOtherTypesAndOptions) {
    const MeshData data = random_displaced(torus(6, 7), 1, 0.02);
    const auto with_floats = openmesh_of<PolyFloat>(data);
    const auto with_doubles = openmesh_of<PolyDouble>(data);
    PatchTableOptions patches;
    patches.degree = 4;
    Result<OpenMeshSurface> surface = OpenMeshSurface::build(with_floats, {}, patches);
    ASSERT_TRUE(surface);
    const Result<OpenMeshUpdate> update = surface->update(with_doubles);
    ASSERT_TRUE(update);
    EXPECT_FALSE(update->rebuilt);
    const Result<Surface> expected = Surface::build(data, patches);
    ASSERT_TRUE(expected);
    expect_same_surface(surface->surface(), *expected);
    // A rebuilt surface has the options of the first.
    auto edited = with_doubles;
    edited.delete_face(OpenMesh::FaceHandle(2));
    ASSERT_TRUE(surface->update(edited));
    const Result<Surface> rebuilt = Surface::build(arrays_by_hand(edited), patches);
    ASSERT_TRUE(rebuilt);
    expect_same_surface(surface->surface(), *rebuilt);
    EXPECT_FALSE(OpenMeshSurface::build(with_floats, {}, {.degree = 99}));
}

TEST(OpenMeshSurface, MapsFacesWhoseFirstVertexIsAnother) {
    const auto mesh = torus_mesh<PolyDouble>();
    auto turned = mesh;
    const auto f = OpenMesh::FaceHandle(4);
    turned.set_halfedge_handle(f, turned.next_halfedge_handle(turned.halfedge_handle(f)));
    Result<OpenMeshSurface> surface = OpenMeshSurface::build(mesh);
    ASSERT_TRUE(surface);
    const Result<OpenMeshUpdate> update = surface->update(turned);
    ASSERT_TRUE(update);
    // (u, v) in it are turned.
    EXPECT_TRUE(update->rebuilt);
    for (Index i = 0; i < update->faces.size(); ++i)
        EXPECT_EQ(update->faces[i], i == 4 ? kInvalidIndex : i);
    expect_that_of(*surface, turned);
}

}  // namespace
}  // namespace osdx
