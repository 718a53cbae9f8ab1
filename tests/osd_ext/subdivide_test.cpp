// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/address.h>
#include <osdx/build_topology.h>
#include <osdx/subdivide.h>
#include <osdx/topology.h>

#include "far/refine/grids/even_grids.h"
#include "far/refine/refinement.h"
#include "tests/support/refine_support.h"
#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;
using Point = Vec3<double>;

SubdividedMesh subdivided(const MeshData& mesh, const SubdivideOptions& options) {
    auto result = subdivide(mesh, options);
    EXPECT_TRUE(result) << (result ? "" : result.error().message);
    return std::move(*result);
}

/// Small ones with features of all kinds.
std::vector<NamedMesh> meshes() {
    std::vector<NamedMesh> all;
    for (auto&& some :
         {closed_meshes(), open_meshes(), creased_meshes(), semi_sharp_meshes()}) {
        for (const NamedMesh& m : some) {
            if (m.data.face_sizes.size() < 40)
                all.push_back(m);
        }
    }
    return all;
}

/// The points that faces use, and the centroids of the faces: a mesh whatever its numbers.
struct Cloud {
    std::vector<Point> points, centroids;

    explicit Cloud(const MeshData& mesh) {
        std::vector<bool> used(mesh.positions.size(), false);
        const Index* corner = mesh.face_vertices.data();
        for (const Index n : mesh.face_sizes) {
            Point& sum = centroids.emplace_back(0);
            for (Index i = 0; i < n; ++i) {
                used[corner[i]] = true;
                sum += mesh.positions[corner[i]] / double(n);
            }
            corner += n;
        }
        for (Index v = 0; v < used.size(); ++v) {
            if (used[v])
                points.push_back(mesh.positions[v]);
        }
    }
};

/// Every point of one set has a partner in the other within the tolerance, and there are as
/// many in both.
void expect_same_points(const std::vector<Point>& a, const std::vector<Point>& b,
                        double tolerance) {
    ASSERT_EQ(a.size(), b.size());
    std::vector<bool> taken(b.size(), false);
    for (const Point& p : a) {
        Index best = kInvalidIndex;
        for (Index i = 0; i < b.size(); ++i) {
            if (!taken[i] && (best == kInvalidIndex ||
                              glm::distance(p, b[i]) < glm::distance(p, b[best])))
                best = i;
        }
        ASSERT_LE(glm::distance(p, b[best]), tolerance);
        taken[best] = true;
    }
}

void expect_same_mesh(const MeshData& a, const MeshData& b) {
    const Cloud x(a), y(b);
    const double tolerance = 1e-13 * diagonal(a);
    expect_same_points(x.points, y.points, tolerance);
    expect_same_points(x.centroids, y.centroids, tolerance);
}

TEST(Subdivide, GivesTheLastLevelOfRefinement) {
    for (const auto& [name, mesh] : meshes()) {
        for (const int d : {2, 3, 4, 5}) {
            for (const int n_levels : {0, 1, 2}) {
                SCOPED_TRACE(name + ", degree " + std::to_string(d) + ", levels " +
                             std::to_string(n_levels));
                const SubdividedMesh ours =
                    subdivided(mesh, {.degree = d, .levels = n_levels});
                Refinement theirs(topology_of(mesh), d, features_of(mesh));
                for (int i = 0; i < n_levels; ++i)
                    theirs.add_level();
                const Topology& last = theirs.topology(n_levels);
                expect_same_mesh(ours.data,
                                 to_mesh_data(last, theirs.points(mesh.positions)));
                EXPECT_EQ(ours.n_border_edges,
                          std::ranges::count(last.twin, kInvalidIndex));
                if (n_levels > 0 && d % 2 == 0) {
                    EXPECT_EQ(ours.data.positions.size(), Cloud(ours.data).points.size());
                }
                if (HasFatalFailure())
                    return;
            }
        }
    }
}

// No grid takes these: the points are those of Refinement to the last bit.
TEST(Subdivide, IsRefinementWhereEvenDegreesAreSemiSharp) {
    int n_tested = 0;
    for (const auto& [name, mesh] : semi_sharp_meshes()) {
        if (EvenGrids::takes(features_of(mesh)))
            continue;
        SCOPED_TRACE(name);
        const MeshData ours = subdivided(mesh, {.degree = 4, .levels = 2}).data;
        Refinement theirs(topology_of(mesh), 4, features_of(mesh));
        theirs.add_level();
        theirs.add_level();
        const auto points = theirs.points(mesh.positions);
        const Topology& last = theirs.topology(2);
        ASSERT_EQ(ours.face_vertices.size(), last.n_halfedges());
        for (Index h = 0; h < last.n_halfedges(); ++h)
            ASSERT_EQ(ours.positions[ours.face_vertices[h]], points[last.vertex[h]]);
        ++n_tested;
    }
    EXPECT_GE(n_tested, 5);
}

TEST(Subdivide, GoesOnFromItsOwnTags) {
    for (const auto& [name, mesh] : meshes()) {
        for (const int d : {3, 5}) {
            SCOPED_TRACE(name + ", degree " + std::to_string(d));
            const MeshData once = subdivided(mesh, {.degree = d}).data;
            expect_same_mesh(subdivided(once, {.degree = d}).data,
                             subdivided(mesh, {.degree = d, .levels = 2}).data);
            if (HasFatalFailure())
                return;
        }
    }
}

TEST(Subdivide, IgnoresTags) {
    MeshData plain = cube(), tagged = cube();
    add_crease(tagged, {0, 1});
    for (const int d : {2, 3}) {
        const auto points = subdivided(plain, {.degree = d}).data.positions;
        EXPECT_NE(points, subdivided(tagged, {.degree = d}).data.positions);
        const SubdividedMesh ignored =
            subdivided(tagged, {.degree = d, .features = {.ignore_tags = true}});
        EXPECT_EQ(points, ignored.data.positions);
        EXPECT_TRUE(ignored.data.tags.empty());
    }
}

TEST(Subdivide, DoesNotDependOnThreads) {
    const MeshData mesh = semi_sharp_meshes().front().data;
    for (const int d : {2, 3}) {
        const auto run = [&](int n_threads) {
            return with_threads(
                n_threads, [&] { return subdivided(mesh, {.degree = d, .levels = 4}); });
        };
        const MeshData one = run(1).data, three = run(3).data;
        EXPECT_EQ(one.positions, three.positions);
        EXPECT_EQ(one.face_vertices, three.face_vertices);
    }
}

// ------------------------------------------------------------ texture coordinates

int texture_tag(const MeshData& mesh) {
    for (const Tag& tag : mesh.tags) {
        if (tag.name == "facevaryinginterpolateboundary")
            return tag.ints.at(0);
    }
    return -1;
}

/// A texture coordinate for each vertex, x and y of its position: no seams.
MeshData with_projected_uvs(MeshData mesh) {
    mesh.uvs.assign(mesh.positions.begin(), mesh.positions.end());
    mesh.face_uvs = mesh.face_vertices;
    return mesh;
}

TEST(SubdivideTexture, FollowsThePositionsWhereItIsSmooth) {
    for (const MeshData& plain : {pole(5, 2, 1), prism(7)}) {
        const MeshData mesh = with_projected_uvs(plain);
        for (const int d : {3, 5}) {
            const MeshData fine =
                subdivided(
                    mesh,
                    {.degree = d, .levels = 2, .uv_rule = FaceVaryingRule::CornersOnly})
                    .data;
            EXPECT_EQ(texture_tag(fine), int(FaceVaryingRule::CornersOnly));
            ASSERT_EQ(fine.face_uvs.size(), fine.face_vertices.size());
            for (std::size_t c = 0; c < fine.face_uvs.size(); ++c) {
                ASSERT_EQ(fine.uvs[fine.face_uvs[c]],
                          Vec2<double>(fine.positions[fine.face_vertices[c]]));
            }
        }
    }
}

// Every corner has a value of its own: seams everywhere. The sums are exact.
TEST(SubdivideTexture, IsBilinearInQuadsWhereItIsLinear) {
    constexpr Index kLevels = 2, kSize = 1 << kLevels;
    MeshData mesh = torus(3, 4);
    for (Index c = 0; c < mesh.face_vertices.size(); ++c) {
        mesh.face_uvs.push_back(c);
        mesh.uvs.emplace_back(c / 8.0, c * c % 31);
    }
    const MeshData fine = subdivided(mesh, {.levels = kLevels}).data;
    EXPECT_EQ(texture_tag(fine), int(FaceVaryingRule::All));
    // Face (i, j) of a base face, row by row, and its corners; as QuadGrids has them.
    const Index* corner = fine.face_uvs.data();
    for (Index f = 0; f < mesh.face_sizes.size(); ++f) {
        const auto* p = &mesh.uvs[4 * f];
        for (Index j = 0; j < kSize; ++j) {
            for (Index i = 0; i < kSize; ++i) {
                for (int k = 0; k < 4; ++k) {
                    const Vec2<double> at =
                        (Vec2<double>(i, j) + square_corner<double>(k)) / double(kSize);
                    ASSERT_EQ(fine.uvs[*corner++],
                              (1 - at.y) * ((1 - at.x) * p[0] + at.x * p[1]) +
                                  at.y * ((1 - at.x) * p[3] + at.x * p[2]));
                }
            }
        }
    }
    EXPECT_EQ(corner, fine.face_uvs.data() + fine.face_uvs.size());
}

TEST(SubdivideTexture, TakesTheRuleOfTheTags) {
    MeshData mesh = with_projected_uvs(cube());
    mesh.tags = {{"facevaryinginterpolateboundary", {4}, {}, {}, 0}};
    EXPECT_EQ(texture_tag(subdivided(mesh, {}).data), int(FaceVaryingRule::Boundaries));
    EXPECT_EQ(texture_tag(subdivided(mesh, {.features = {.ignore_tags = true}}).data),
              int(FaceVaryingRule::All));
    const SubdivideOptions none = {.uv_rule = FaceVaryingRule::None};
    EXPECT_EQ(texture_tag(subdivided(mesh, none).data), int(FaceVaryingRule::None));
}

TEST(SubdivideTexture, IsDroppedByEvenDegrees) {
    const MeshData fine =
        subdivided(with_projected_uvs(cube()), {.degree = 2, .levels = 2}).data;
    EXPECT_TRUE(fine.uvs.empty());
    EXPECT_TRUE(fine.face_uvs.empty());
    EXPECT_EQ(texture_tag(fine), -1);
}

// ------------------------------------------------------------ refusals

TEST(SubdivideRefuses, WhatItCannotRefine) {
    const auto refuse = [](const MeshData& mesh, const SubdivideOptions& options,
                           ErrorCode code) {
        const auto result = subdivide(mesh, options);
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, code) << result.error().message;
    };
    using enum ErrorCode;
    refuse(cube(), {.degree = kMinDegree - 1}, InvalidOption);
    refuse(cube(), {.degree = kMaxDegree + 1}, InvalidOption);
    refuse(cube(), {.levels = -1}, InvalidOption);
    // 24 corners, 24 4^14 = 6.4e9 of them.
    refuse(cube(), {.levels = 14}, InvalidOption);
    EXPECT_EQ(subdivide(cube(), {.levels = 14}).error().message,
              "14 levels give 6442450944 face corners, more than 4294967294");
    refuse({}, {}, EmptyMesh);

    MeshData bad = cube();
    bad.tags = {{"crease", {0, 6}, {1}, {}, 0}};
    refuse(bad, {}, InvalidTag);
    EXPECT_TRUE(subdivide(bad, {.features = {.ignore_tags = true}}));
    bad.tags = {{"smoothtriangles", {}, {}, {"smooth"}, 0}};
    refuse(bad, {.degree = 2}, UnsupportedTag);
    EXPECT_TRUE(subdivide(bad, {.degree = 3}));

    bad = with_projected_uvs(cube());
    bad.face_uvs[3] = 8;
    refuse(bad, {}, IndexOutOfRange);
    bad = with_projected_uvs(cube());
    bad.tags = {{"facevaryinginterpolateboundary", {9}, {}, {}, 0}};
    refuse(bad, {}, InvalidTag);
}

}  // namespace
}  // namespace osdx
