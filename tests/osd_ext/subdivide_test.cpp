// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
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
#include "tests/support/thinned.h"

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
    const std::vector<int> degrees = {2, 3, 4, 5}, levels = {0, 1, 2};
    for (const auto& [named, d, n_levels] :
         thinned(combinations(meshes(), degrees, levels))) {
        const MeshData& mesh = named.data;
        SCOPED_TRACE(named.name + ", degree " + std::to_string(d) + ", levels " +
                     std::to_string(n_levels));
        const SubdividedMesh ours = subdivided(mesh, {.degree = d, .levels = n_levels});
        Refinement theirs(topology_of(mesh), d, features_of(mesh));
        for (int i = 0; i < n_levels; ++i)
            theirs.add_level();
        const Topology& last = theirs.topology(n_levels);
        expect_same_mesh(ours.data, to_mesh_data(last, theirs.points(mesh.positions)));
        EXPECT_EQ(ours.n_border_edges, std::ranges::count(last.twin, kInvalidIndex));
        if (n_levels > 0 && d % 2 == 0) {
            EXPECT_EQ(ours.data.positions.size(), Cloud(ours.data).points.size());
        }
        if (HasFatalFailure())
            return;
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

// Six channels, of which each two are the texture's, by all rules: the same to the bit.
TEST(SubdivideFaceVarying, GoesTheWayOfTheTexture) {
    MeshData mesh = random_displaced(prism(5), 1, 0.05);
    FaceVaryingChannels c;
    c.name = "paint";
    c.n = 6;
    for (Index i = 0; i < mesh.face_vertices.size(); ++i) {
        mesh.face_uvs.push_back(mesh.face_vertices[i] + (i % 3 == 0 ? 10 : 0));
    }
    c.corner_values = mesh.face_uvs;
    for (Index i = 0; i < 20; ++i) {
        mesh.uvs.emplace_back(i * i % 17 / 16.0, i / 3.0);
        for (int k = 0; k < 3; ++k)
            c.values.insert(c.values.end(), {mesh.uvs.back().x, mesh.uvs.back().y});
    }
    for (int rule = 0; rule <= int(FaceVaryingRule::All); ++rule) {
        c.rule = static_cast<FaceVaryingRule>(rule);
        mesh.face_varying = {c};
        const MeshData fine =
            subdivided(mesh, {.degree = 3, .levels = 2, .uv_rule = c.rule}).data;
        ASSERT_EQ(fine.face_varying.size(), 1u);
        const FaceVaryingChannels& own = fine.face_varying.front();
        EXPECT_EQ(own.name, "paint");
        EXPECT_EQ(own.rule, c.rule);
        EXPECT_EQ(own.corner_values, fine.face_uvs);
        ASSERT_EQ(own.n_values(), fine.uvs.size());
        for (Index i = 0; i < own.n_values(); ++i) {
            for (int k = 0; k < 6; ++k)
                ASSERT_EQ(own.view()[i][k], fine.uvs[i][k % 2]);
        }
        EXPECT_TRUE(build_topology(fine));
    }
    EXPECT_TRUE(subdivided(mesh, {.degree = 2}).data.face_varying.empty());
}

// ------------------------------------------------------------ channels

/// Numbers for each vertex that tell whether they are mixed up: the position, a constant, and
/// five that a hash makes, which share triples with those.
MeshData with_channels(MeshData mesh) {
    mesh.channels = {{"place", 3, {}}, {"one", 1, {}}, {"five", 5, {}}};
    for (Index v = 0; v < mesh.positions.size(); ++v) {
        for (int k = 0; k < 3; ++k)
            mesh.channels[0].values.push_back(mesh.positions[v][k]);
        mesh.channels[1].values.push_back(0.7);
        for (Index k = 0; k < 5; ++k)
            mesh.channels[2].values.push_back(double((v * 37 + k * 11) % 101) / 101);
    }
    return mesh;
}

TEST(SubdivideChannels, FollowThePositions) {
    for (const auto& [name, plain] : meshes()) {
        const MeshData mesh = with_channels(plain);
        for (const int d : {2, 3, 4, 5}) {
            for (const int n_levels : {0, 2}) {
                SCOPED_TRACE(name + ", degree " + std::to_string(d) + ", levels " +
                             std::to_string(n_levels));
                const MeshData fine =
                    subdivided(mesh, {.degree = d, .levels = n_levels}).data;
                EXPECT_EQ(
                    fine.positions,
                    subdivided(plain, {.degree = d, .levels = n_levels}).data.positions);
                ASSERT_EQ(fine.channels.size(), 3u);
                const std::size_t n = fine.positions.size();
                for (std::size_t i = 0; i < 3; ++i) {
                    ASSERT_EQ(fine.channels[i].name, mesh.channels[i].name);
                    ASSERT_EQ(fine.channels[i].n, mesh.channels[i].n);
                    ASSERT_EQ(fine.channels[i].values.size(),
                              n * static_cast<std::size_t>(mesh.channels[i].n));
                }
                for (std::size_t v = 0; v < n; ++v) {
                    for (int k = 0; k < 3; ++k) {
                        ASSERT_EQ(fine.channels[0].view()[v][k], fine.positions[v][k]);
                    }
                    // A few tens of roundings of sums that are one.
                    ASSERT_NEAR(fine.channels[1].values[v], 0.7, 1e-14);
                }
            }
        }
    }
}

// Of the weights as Refinement has them, in rows; by numbers where the numbers are its own.
TEST(SubdivideChannels, AreThoseOfRefinement) {
    int n_tested = 0;
    for (const auto& [name, plain] : semi_sharp_meshes()) {
        if (EvenGrids::takes(features_of(plain)))
            continue;
        SCOPED_TRACE(name);
        const MeshData mesh = with_channels(plain);
        const MeshData fine = subdivided(mesh, {.degree = 4, .levels = 2}).data;
        Refinement theirs(topology_of(mesh), 4, features_of(mesh));
        theirs.add_level();
        theirs.add_level();
        const Topology& last = theirs.topology(2);
        for (int k = 0; k < 5; ++k) {
            std::vector<Point> base;
            for (std::size_t v = 0; v < mesh.positions.size(); ++v)
                base.emplace_back(mesh.channels[2].view()[v][k], 0, 0);
            const auto points = theirs.points(base);
            for (Index h = 0; h < last.n_halfedges(); ++h) {
                ASSERT_EQ(fine.channels[2].view()[fine.face_vertices[h]][k],
                          points[last.vertex[h]].x);
            }
        }
        ++n_tested;
    }
    EXPECT_GE(n_tested, 5);
}

// Three of them are a position: other grids, by other numbers.
TEST(SubdivideChannels, AreThePositionsOfAnotherMesh) {
    for (const MeshData& plain : {pole(5, 2, 1), prism(7), open_meshes().front().data}) {
        const MeshData mesh = with_channels(plain);
        MeshData other = plain;
        for (std::size_t v = 0; v < other.positions.size(); ++v) {
            const double* x = mesh.channels[2].view()[v];
            other.positions[v] = {x[4], x[0], x[2]};
        }
        for (const int d : {2, 3, 4, 5}) {
            const MeshData fine = subdivided(mesh, {.degree = d, .levels = 2}).data;
            const auto points =
                subdivided(other, {.degree = d, .levels = 2}).data.positions;
            for (std::size_t v = 0; v < points.size(); ++v) {
                const double* x = fine.channels[2].view()[v];
                ASSERT_EQ(points[v], Point(x[4], x[0], x[2]));
            }
        }
    }
}

TEST(SubdivideChannels, AreRefusedAgainstTheirShape) {
    MeshData mesh = with_channels(cube());
    mesh.channels[2].values[11] = NAN;
    const auto result = subdivide(mesh);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::NonFinitePoint);
    EXPECT_EQ(result.error().element, 2u);
    mesh.channels[2].values.pop_back();
    EXPECT_EQ(subdivide(mesh).error().code, ErrorCode::SizeMismatch);
}

// ------------------------------------------------------------ names of faces

/// A name for each face but those of number 1.
MeshData with_names(MeshData mesh) {
    for (Index f = 0; f < mesh.face_sizes.size(); ++f) {
        mesh.groups.names.push_back("g" + std::to_string(f));
        mesh.groups.faces.push_back(f == 1 ? kInvalidIndex : f);
        mesh.materials.faces.push_back(f % 2);
    }
    mesh.materials.names = {"red", "blue"};
    mesh.material_files = {"a.mtl"};
    return mesh;
}

// A face of a cube or of a prism lies in a plane, and so do all faces of degree 3 or 5 in it
// where each edge is sharp: their points say which it is.
TEST(SubdivideNames, AreThoseOfTheFaceAround) {
    for (const MeshData& solid : {cube(), prism(5), prism(3)}) {
        MeshData mesh = with_names(solid);
        std::vector<Point> normals, centres;
        const Index* corner = mesh.face_vertices.data();
        for (const Index n : mesh.face_sizes) {
            const auto at = [&](Index i) { return mesh.positions[corner[i % n]]; };
            normals.push_back(glm::normalize(glm::cross(at(1) - at(0), at(2) - at(0))));
            centres.push_back(at(0));
            for (Index i = 0; i < n; ++i)
                add_crease(mesh, {corner[i], corner[(i + 1) % n]});
            corner += n;
        }
        for (const int d : {3, 5}) {
            for (const int n_levels : {0, 1, 2}) {
                const MeshData fine =
                    subdivided(mesh, {.degree = d, .levels = n_levels}).data;
                ASSERT_EQ(fine.groups.names, mesh.groups.names);
                ASSERT_EQ(fine.materials.names, mesh.materials.names);
                EXPECT_EQ(fine.material_files, mesh.material_files);
                ASSERT_EQ(fine.groups.faces.size(), fine.face_sizes.size());
                EXPECT_TRUE(fine.objects.faces.empty());
                const Index* v = fine.face_vertices.data();
                for (std::size_t f = 0; f < fine.face_sizes.size(); ++f) {
                    const Index group = fine.groups.faces[f];
                    const Index parent = group == kInvalidIndex ? 1 : group;
                    ASSERT_EQ(fine.materials.faces[f], parent % 2);
                    for (Index i = 0; i < fine.face_sizes[f]; ++i) {
                        const Point off = fine.positions[v[i]] - centres[parent];
                        ASSERT_NEAR(glm::dot(off, normals[parent]), 0, 1e-13);
                    }
                    v += fine.face_sizes[f];
                }
            }
        }
    }
}

TEST(SubdivideNames, AreDroppedByEvenDegrees) {
    const MeshData fine = subdivided(with_names(cube()), {.degree = 2}).data;
    EXPECT_TRUE(fine.groups.faces.empty());
    EXPECT_TRUE(fine.groups.names.empty());
    EXPECT_TRUE(fine.materials.faces.empty());
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
