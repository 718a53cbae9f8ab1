// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Surfaces of Gregory patches: how they cover meshes of all kinds and join.

#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/analysis/continuity.h>
#include <osdx/build_patch_table.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

Surface build(const MeshData& mesh, int levels = 0) {
    Result<Surface> s = Surface::build(
        mesh, {.family = PatchFamily::Gregory, .gregory = {.levels = levels}});
    if (!s)
        throw std::runtime_error(s.error().message);
    return std::move(*s);
}

std::vector<NamedMesh> meshes() {
    auto result = closed_meshes();
    for (auto& mesh : open_meshes())
        result.push_back(std::move(mesh));
    return result;
}

// No refinement: a patch for each face that is not regular, and the bicubic B-spline patch for
// each that is.
TEST(GregorySurface, HasOnePatchForEachFace) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        const Surface s = build(mesh), multisided = std::move(*Surface::build(mesh));
        const PatchTable& table = s.patches();
        EXPECT_EQ(table.n_patches(), s.base().n_faces());
        EXPECT_EQ(table.n_levels(), 1);
        for (Index f = 0; f < s.base().n_faces(); ++f) {
            const PatchClass& c =
                table.class_of(table.locate(Address{f, 0.3, 0.2}).patch);
            if (c.kind == PatchKind::Gregory) {
                EXPECT_EQ(c.n_sectors, static_cast<int>(s.base().face_size(f)));
                continue;
            }
            const auto a = s.evaluate({f, 0.3, 0.2}),
                       b = multisided.evaluate({f, 0.3, 0.2});
            const PatchPoint there = multisided.patches().locate(Address{f, 0.3, 0.2});
            if (multisided.patches().class_of(there.patch).kind == PatchKind::Regular) {
                EXPECT_LE(glm::distance(a.p, b.p), 1e-14 * diagonal(mesh));
            }
        }
    }
}

// Points are sums of hundreds of terms at poles, where the sides are short (measured: 1.2e-9).
TEST(GregorySurface, IsSmoothAcrossAllEdges) {
    for (const auto& [name, mesh] : meshes()) {
        for (const int levels : {0, 1, 2}) {
            SCOPED_TRACE(name + ", levels " + std::to_string(levels));
            const Continuity c = measure_continuity(build(mesh, levels), 4);
            EXPECT_LE(c.gap_max, 1e-14);
            EXPECT_LE(c.normal_jump_deg_max, 1e-8);
            EXPECT_EQ(c.n_sharp_samples, 0u);
        }
    }
}

// Patches of different levels stand side by side where semi-sharp creases are refined, but at
// irregular vertices only those of one level: two levels in the faces of one were a gap of
// 0.003 of the diagonal.
TEST(GregorySurface, LevelsMeetWhereSemiSharpCreasesEnd) {
    for (const auto& [name, mesh] : semi_sharp_meshes()) {
        SCOPED_TRACE(name);
        const Surface s = build(mesh);
        const Continuity c = measure_continuity(s, 4);
        EXPECT_LE(c.gap_max, 1e-13);
        // Where more than two infinitely sharp edges meet, or at a sharp vertex, lies the tip of
        // a cone.
        bool cone = false;
        for (Index v = 0; v < s.base().n_vertices(); ++v) {
            int n_sharp = 0;
            s.base().for_each_edge(v, [&](Index e, Index) {
                n_sharp += s.features().edge(e) >= kInfinitelySharp;
            });
            cone |= n_sharp > 2 || s.features().vertex(v) >= kInfinitelySharp;
        }
        if (!cone) {
            EXPECT_LE(c.normal_jump_deg_max, 1e-8);
        }
    }
}

TEST(GregorySurface, ComesCloserToTheLimitWithEachLevel) {
    const MeshData mesh = dodecahedron();
    const Surface fine = build(mesh, 6);
    double before = 1;
    for (int levels = 0; levels < 4; ++levels) {
        const Surface s = build(mesh, levels);
        double worst = 0;
        for (Index f = 0; f < s.base().n_faces(); ++f) {
            for (const double u : {0.0, 0.2, 0.45}) {
                worst = std::max(worst, glm::distance(s.evaluate({f, u, 0.3}).p,
                                                      fine.evaluate({f, u, 0.3}).p));
            }
        }
        // A half is what an edge shrinks by alone.
        EXPECT_LT(worst, 0.5 * before);
        before = worst;
    }
}

TEST(GregorySurface, RefinesEverywhereOnDemand) {
    const MeshData mesh = torus(5, 6);  // regular
    for (const bool uniform : {false, true}) {
        const auto s =
            Surface::build(mesh, {.family = PatchFamily::Gregory,
                                  .gregory = {.levels = 2, .uniform = uniform}});
        ASSERT_TRUE(s);
        EXPECT_EQ(s->patches().n_patches(), uniform ? 16 * 30u : 30u);
    }
    // The two lengths differ at irregular vertices, and make surfaces as smooth as each other.
    const auto paper = Surface::build(
        cube(), {.family = PatchFamily::Gregory, .gregory = {.paper_tangents = true}});
    ASSERT_TRUE(paper);
    EXPECT_LE(measure_continuity(*paper).normal_jump_deg_max, 1e-10);
    EXPECT_GT(glm::distance(paper->evaluate({0, 0.3, 0.4}).p,
                            build(cube()).evaluate({0, 0.3, 0.4}).p),
              1e-4);
}

// Without centre points the patches keep their tangent planes at all edges, and quads all they
// have; inside they are further from the limit.
TEST(GregorySurface, TakesNormalisedPatches) {
    for (const MeshData& mesh : {dodecahedron(), octahedron(), prism(7)}) {
        const Surface centred = build(mesh), fine = build(mesh, 6);
        auto s = Surface::build(
            mesh, {.family = PatchFamily::Gregory, .gregory = {.normalised = true}});
        ASSERT_TRUE(s);
        const Continuity c = measure_continuity(*s, 4);
        EXPECT_LE(c.gap_max, 1e-14);
        EXPECT_LE(c.normal_jump_deg_max, 1e-8);
        double squares[2] = {0, 0};
        for (Index f = 0; f < s->base().n_faces(); ++f) {
            const Index n = s->base().face_size(f);
            const PatchClass& pc =
                s->patches().class_of(s->patches().locate(Address{f, 0.3, 0.2}).patch);
            EXPECT_EQ(pc.normalised, n != 4);
            EXPECT_EQ(pc.n_points(), 5 * static_cast<int>(n));
            const Vec3<double> edge = s->evaluate({f, 0.3, 0}).p;
            EXPECT_LE(glm::distance(edge, centred.evaluate({f, 0.3, 0}).p),
                      1e-14 * diagonal(mesh));
            // In the middle, where the two differ most, and only along the normal: addresses
            // of the three surfaces slide along each other.
            const Address middle =
                to_address(s->base(), {s->base().face_offsets[f], 1, 1});
            const Vec3<double> p = s->evaluate(middle).p, q = centred.evaluate(middle).p;
            if (n == 4) {
                EXPECT_LE(glm::distance(p, q), 1e-14 * diagonal(mesh));
            }
            const SurfaceJet<double> limit = fine.evaluate(middle);
            const double there = glm::dot(p - limit.p, normal(limit)),
                         here = glm::dot(q - limit.p, normal(limit));
            squares[0] += there * there;
            squares[1] += here * here;
        }
        EXPECT_GT(squares[0], squares[1]);
    }
}

TEST(GregorySurface, RefusesOtherDegreesAndLevels) {
    const auto error = [](int degree, int levels) {
        const auto s = Surface::build(cube(), {.degree = degree,
                                               .family = PatchFamily::Gregory,
                                               .gregory = {.levels = levels}});
        return s ? ErrorCode::NotBuilt : s.error().code;
    };
    EXPECT_EQ(error(4, 0), ErrorCode::InvalidOption);
    EXPECT_EQ(error(3, 11), ErrorCode::InvalidOption);
    EXPECT_EQ(error(3, -1), ErrorCode::InvalidOption);
}

}  // namespace
}  // namespace osdx
