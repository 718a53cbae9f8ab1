// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/face_varying.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/tessellate.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;
using Vec = Vec2<double>;

constexpr FaceVaryingRule kSmoothRules[] = {
    FaceVaryingRule::None, FaceVaryingRule::CornersOnly, FaceVaryingRule::CornersPlus1,
    FaceVaryingRule::CornersPlus2, FaceVaryingRule::Boundaries};

TextureSurface texture_of(const MeshData& mesh, const PatchTableOptions& patches = {},
                          std::optional<FaceVaryingRule> rule = {},
                          const FeatureOptions& tags = {}) {
    const auto surface = Surface::build(mesh, patches, tags);
    EXPECT_TRUE(surface) << (surface ? "" : surface.error().message);
    auto t = TextureSurface::build(*surface, mesh, tags, rule);
    EXPECT_TRUE(t) << (t ? "" : t.error().message);
    return std::move(*t);
}

/// One texture coordinate for each vertex: x and y of its position. No seams.
MeshData with_projected_uvs(MeshData mesh) {
    mesh.uvs.clear();
    for (const auto& p : mesh.positions)
        mesh.uvs.emplace_back(p.x, p.y);
    mesh.face_uvs = mesh.face_vertices;
    return mesh;
}

/// Random texture coordinates; corners at a vertex agree about every other time.
MeshData with_random_uvs(MeshData mesh, unsigned seed) {
    std::mt19937 random(seed);
    mesh.uvs.clear();
    mesh.face_uvs.clear();
    for (std::size_t i = 0; i < 2 * mesh.positions.size(); ++i) {
        const double u = double(random()) / 0x1p32, v = double(random()) / 0x1p32;
        mesh.uvs.emplace_back(u, v);
    }
    for (const Index v : mesh.face_vertices)
        mesh.face_uvs.push_back(2 * v + static_cast<Index>(random() % 4 == 0));
    return mesh;
}

/// torus(m, n) unrolled into the unit square: (i / m, j / n) at vertex (i, j), with seams
/// where the square ends.
MeshData unrolled_torus(Index m, Index n) {
    MeshData mesh = torus(m, n);
    for (Index i = 0; i <= m; ++i) {
        for (Index j = 0; j <= n; ++j)
            mesh.uvs.emplace_back(double(i) / m, double(j) / n);
    }
    for (Index i = 0; i < m; ++i) {
        for (Index j = 0; j < n; ++j) {
            const Index k = i * (n + 1) + j;
            mesh.face_uvs.insert(mesh.face_uvs.end(), {k, k + n + 1, k + n + 2, k + 1});
        }
    }
    return mesh;
}

std::vector<NamedMesh> meshes() {
    auto all = closed_meshes();
    for (auto& mesh : open_meshes())
        all.push_back(std::move(mesh));
    return all;
}

// ---- Linear ----

// Against repeated halving: a level of linear subdivision has its points at half steps of the
// quarters. Sums of few terms below 1: some ulps.
TEST(Texture, LinearRuleIsTheLimitOfLinearSubdivision) {
    for (const NamedMesh& m : meshes()) {
        SCOPED_TRACE(m.name);
        const MeshData mesh = with_random_uvs(m.data, 3);
        const TextureSurface texture = texture_of(mesh);
        ASSERT_EQ(texture.channel().rule, FaceVaryingRule::All);
        const Topology& base = texture.channel().topology;
        std::vector<Vec> uvs;  // of each corner
        for (const Index i : mesh.face_uvs)
            uvs.push_back(mesh.uvs[i]);
        for (Index h = 0; h < base.n_halfedges(); ++h) {
            const Index f = base.face(h);
            Vec centre(0);
            for (Index g = base.face_offsets[f]; g < base.face_offsets[f + 1]; ++g)
                centre += uvs[g] / double(base.face_size(f));
            const Vec corner = uvs[h], next = 0.5 * (corner + uvs[base.next(h)]),
                      prev = 0.5 * (corner + uvs[base.prev(h)]);
            // The quarter after one more halving.
            const Vec expected[3][3] = {
                {corner, 0.5 * (corner + next), next},
                {0.5 * (corner + prev), 0.25 * (corner + next + prev + centre),
                 0.5 * (next + centre)},
                {prev, 0.5 * (prev + centre), centre}};
            for (int j = 0; j < 3; ++j) {
                for (int i = 0; i < 3; ++i) {
                    const auto p = texture.evaluate(QuarterPoint{h, 0.5 * i, 0.5 * j}).p;
                    ASSERT_LT(glm::length(p - expected[j][i]), 1e-15)
                        << "quarter " << h << ", " << i << ", " << j;
                }
            }
            ASSERT_EQ(texture.evaluate(QuarterPoint{h, 0, 0}).p, corner);
        }
    }
}

// Central differences err by eps / h and, in smooth patches, by h^2 / 6 of third derivatives
// of some hundreds: both are below 1e-8 for h = 1e-5.
TEST(Texture, DerivativesAreThoseInBaseUV) {
    constexpr double h = 1e-5;
    for (const NamedMesh& m : closed_meshes()) {
        SCOPED_TRACE(m.name);
        const TextureSurface linear = texture_of(with_random_uvs(m.data, 4));
        const TextureSurface smooth = texture_of(
            with_projected_uvs(m.data), {.degree = 4}, FaceVaryingRule::CornersPlus1);
        const Topology& base = linear.channel().topology;
        for (Index q = 0; q < base.n_halfedges(); ++q) {
            const Address a = to_address(base, QuarterPoint{q, 0.3, 0.6});
            for (const TextureSurface* t : {&linear, &smooth}) {
                const TextureJet jet = t->evaluate(a);
                const auto at = [&](double u, double v) {
                    return t->evaluate(Address{a.face, a.u + u, a.v + v}).p;
                };
                ASSERT_LT(glm::length((at(h, 0) - at(-h, 0)) / (2 * h) - jet.du), 1e-7);
                ASSERT_LT(glm::length((at(0, h) - at(0, -h)) / (2 * h) - jet.dv), 1e-7);
            }
        }
    }
}

// ---- Smooth ----

// Coordinates that are two components of the positions are those of the surface.
TEST(Texture, SmoothRulesWithoutSeamsFollowTheSurface) {
    for (const NamedMesh& m : closed_meshes()) {
        for (const int degree : {2, 3, 5}) {
            for (const FaceVaryingRule rule : kSmoothRules) {
                SCOPED_TRACE(testing::Message() << m.name << ", degree " << degree
                                                << ", rule " << int(rule));
                const MeshData mesh = with_projected_uvs(m.data);
                const auto surface = Surface::build(mesh, {.degree = degree});
                ASSERT_TRUE(surface) << surface.error().message;
                const TextureSurface texture = texture_of(mesh, {.degree = degree}, rule);
                for (Index q = 0; q < surface->base().n_halfedges(); ++q) {
                    const Address a =
                        to_address(surface->base(), QuarterPoint{q, 0.25, 0.7});
                    const auto s = surface->evaluate(a);
                    const auto t = texture.evaluate(a);
                    // The same sums in blocks of other channels.
                    ASSERT_LT(glm::length(t.p - Vec(s.p)), 1e-14);
                    ASSERT_LT(glm::length(t.du - Vec(s.du)), 1e-13);
                    ASSERT_LT(glm::length(t.dv - Vec(s.dv)), 1e-13);
                }
            }
        }
    }
}

// Pinned at its corners only, the unrolled square is regular, and the rules of the border and
// of the inside reproduce linear functions.
TEST(Texture, SmoothRulesOverSeamsKeepTheUnrolledTorus) {
    const MeshData mesh = unrolled_torus(4, 5);
    for (const FaceVaryingRule rule :
         {FaceVaryingRule::CornersOnly, FaceVaryingRule::CornersPlus1,
          FaceVaryingRule::CornersPlus2}) {
        SCOPED_TRACE(int(rule));
        const TextureSurface texture = texture_of(mesh, {}, rule);
        for (Index f = 0; f < 20; ++f) {
            for (int k = 0; k < 25; ++k) {
                const double u = 0.25 * (k % 5), v = 0.25 * (k / 5);
                const Vec expected((f / 5 + u) / 4, (f % 5 + v) / 5);
                const TextureJet jet = texture.evaluate(Address{f, u, v});
                ASSERT_LT(glm::length(jet.p - expected), 1e-14);
                ASSERT_LT(glm::length(jet.du - Vec(0.25, 0)), 1e-13);
                ASSERT_LT(glm::length(jet.dv - Vec(0, 0.2)), 1e-13);
            }
        }
    }
}

// Rule Boundaries: every vertex of a seam is pinned, and between them the values run evenly,
// the same on both sides up to the shift of the texture.
TEST(Texture, LinearBoundariesRunEvenlyAlongSeams) {
    const MeshData mesh = unrolled_torus(4, 5);
    const TextureSurface texture = texture_of(mesh, {}, FaceVaryingRule::Boundaries);
    for (Index j = 0; j < 5; ++j) {
        for (const double t : {0.0, 0.1, 0.25, 0.5, 0.8}) {
            const Vec first = texture.evaluate(Address{j, 0, t}).p,
                      last = texture.evaluate(Address{15 + j, 1, t}).p;
            EXPECT_LT(glm::length(first - Vec(0, (j + t) / 5)), 1e-14) << j << " " << t;
            EXPECT_LT(glm::length(last - Vec(1, (j + t) / 5)), 1e-14) << j << " " << t;
        }
    }
}

// Rule None: seams are the uniform cubic B-spline curves of their values, whatever lies beside.
TEST(Texture, SmoothRulesOverSeamsGiveSplineCurves) {
    MeshData mesh = random_displaced(torus(6, 5), 5, 0.1);
    std::mt19937 random(2);
    // A single seam around the torus between faces (5, j) and (0, j).
    for (int i = 0; i < 7 * 5; ++i) {
        const double u = double(random()) / 0x1p32, v = double(random()) / 0x1p32;
        mesh.uvs.emplace_back(u, v);
    }
    for (Index f = 0; f < 30; ++f) {
        const Index i = f / 5, j = f % 5, k = (j + 1) % 5;
        mesh.face_uvs.insert(mesh.face_uvs.end(),
                             {i * 5 + j, i * 5 + 5 + j, i * 5 + 5 + k, i * 5 + k});
    }
    const TextureSurface texture = texture_of(mesh, {}, FaceVaryingRule::None);
    for (const bool last : {false, true}) {
        for (Index j = 0; j < 5; ++j) {
            const auto value = [&](Index at) {
                return mesh.uvs[(last ? 30 : 0) + at % 5];
            };
            for (const double t : {0.0, 0.3, 0.5, 0.9}) {
                const double s = 1 - t;
                const Vec expected = (s * s * s * value(j + 4) +
                                      (3 * t * t * t - 6 * t * t + 4) * value(j) +
                                      (3 * s * s * s - 6 * s * s + 4) * value(j + 1) +
                                      t * t * t * value(j + 2)) /
                                     6.0;
                const Address a{last ? 25 + j : j, last ? 1.0 : 0.0, t};
                ASSERT_LT(glm::length(texture.evaluate(a).p - expected), 1e-14)
                    << last << " " << j << " " << t;
            }
        }
    }
}

// ---- Tessellations ----

TEST(Texture, IsCarriedIntoTessellations) {
    for (const NamedMesh& m : meshes()) {
        const MeshData mesh = with_random_uvs(m.data, 6);
        const TextureSurface texture = texture_of(mesh);
        const Topology base = topology_of(mesh);
        const Topology& cut = texture.channel().topology;
        const ResolvedFeatures features;
        for (const int rate : {1, 2, 3}) {
            SCOPED_TRACE(testing::Message() << m.name << ", rate " << rate);
            Tessellation t = tessellate(base, features, rate, [](const QuarterPoint&) {
                return SurfaceJet<double>();
            });
            texture.add_to(t, rate);
            ASSERT_EQ(t.facet_texcoords.size(), t.facet_points.size());
            std::map<Index, std::set<Index>> of_point;
            for (std::size_t f = 0, c = 0; f < t.facet_sizes.size(); ++f) {
                for (Index i = 0; i < t.facet_sizes[f]; ++i, ++c) {
                    const Vec& uv = t.texcoords[t.facet_texcoords[c]];
                    const Address a{t.facet_faces[f], t.facet_uvs[c].x, t.facet_uvs[c].y};
                    // From the face on the other side, perhaps: some ulps.
                    ASSERT_LT(glm::length(uv - texture.evaluate(a).p), 1e-15);
                    of_point[t.facet_points[c]].insert(t.facet_texcoords[c]);
                    const QuarterPoint q = to_quarter(base, a);
                    if (q.x == 0 && q.y == 0) {
                        ASSERT_EQ(t.facet_texcoords[c], cut.vertex[q.quarter]);
                    }
                }
            }
            // Several at a point only where the topology is cut.
            for (Index p = 0; p < t.positions.size(); ++p) {
                const QuarterPoint q = to_quarter(base, t.addresses[p]);
                if (q.x == 0 && q.y == 0)
                    continue;
                const bool on_edge = q.x == 0 || q.y == 0;
                const Index h = q.y == 0 ? q.quarter : base.prev(q.quarter);
                const bool split = on_edge && !base.is_border(h) && cut.is_border(h);
                ASSERT_EQ(of_point[p].size(), split ? 2u : 1u);
            }
        }
    }
}

TEST(Texture, OfTheUnrolledTorusIsAGrid) {
    const MeshData mesh = unrolled_torus(3, 4);
    const auto surface = Surface::build(mesh);
    ASSERT_TRUE(surface);
    const TextureSurface texture = texture_of(mesh);
    Tessellation t = surface->tessellate(2);
    texture.add_to(t, 2);
    EXPECT_EQ(t.positions.size(), 6u * 8);
    EXPECT_EQ(t.texcoords.size(), 7u * 9);
}

TEST(Texture, LeavesHolesOut) {
    MeshData mesh = with_random_uvs(torus(4, 5), 1);
    mesh.tags = {{"hole", {0, 3, 4, 19}, {}, {}, 0}};
    const TextureSurface texture = texture_of(mesh);
    ResolvedFeatures features;
    features.hole.assign(20, false);
    for (const Index f : {0, 3, 4, 19})
        features.hole[f] = true;
    Tessellation t = tessellate(topology_of(mesh), features, 3,
                                [](const QuarterPoint&) { return SurfaceJet<double>(); });
    texture.add_to(t, 3);
    EXPECT_EQ(t.facet_sizes.size(), 16u * 9);
    EXPECT_EQ(t.facet_texcoords.size(), t.facet_points.size());
    const std::set<Index> used(t.facet_texcoords.begin(), t.facet_texcoords.end());
    EXPECT_EQ(used.size(), t.texcoords.size());
}

TEST(Texture, DoesNotDependOnTheNumberOfThreads) {
    const MeshData mesh = with_random_uvs(dodecahedron(), 2);
    const TextureSurface texture = texture_of(mesh);
    const auto texcoords = [&] {
        Tessellation t = Surface::build(mesh)->tessellate(9);
        texture.add_to(t, 9);
        return t.texcoords;
    };
    const auto many = texcoords();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_TRUE(many == texcoords());
}

// ---- What decides the rule, and errors ----

TEST(Texture, TakesItsRuleFromTheTags) {
    MeshData mesh = with_projected_uvs(cube());
    EXPECT_EQ(texture_of(mesh).channel().rule, FaceVaryingRule::All);
    mesh.tags = {{"facevaryinginterpolateboundary", {1}, {}, {}, 0}};
    EXPECT_EQ(texture_of(mesh).channel().rule, FaceVaryingRule::CornersOnly);
    EXPECT_EQ(texture_of(mesh, {}, FaceVaryingRule::None).channel().rule,
              FaceVaryingRule::None);
    EXPECT_EQ(texture_of(mesh, {}, {}, {.ignore_tags = true}).channel().rule,
              FaceVaryingRule::All);
}

TEST(TextureRefuses, WhatItCannotBuild) {
    const auto surface = Surface::build(cube());
    ASSERT_TRUE(surface);
    const auto refuse = [&](const MeshData& mesh, ErrorCode code) {
        const auto t = TextureSurface::build(*surface, mesh);
        ASSERT_FALSE(t);
        EXPECT_EQ(t.error().code, code) << t.error().message;
    };
    using enum ErrorCode;
    refuse(cube(), NoTexcoords);
    const MeshData good = with_projected_uvs(cube());
    EXPECT_TRUE(TextureSurface::build(*surface, good, {}, FaceVaryingRule::None));
    MeshData bad = good;
    bad.face_uvs[3] = 8;
    refuse(bad, IndexOutOfRange);
    bad = good;
    bad.tags = {{"facevaryinginterpolateboundary", {9}, {}, {}, 0}};
    refuse(bad, InvalidTag);
    refuse(with_projected_uvs(prism(5)), SizeMismatch);
}

}  // namespace
}  // namespace osdx
