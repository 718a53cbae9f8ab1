// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <osdx/embree/ray_scene.h>
#include <osdx/surface.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

const std::vector<Vec3<float>> kPoints = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
const std::vector<std::array<Index, 3>> kTriangle = {{0, 1, 2}};

Vec3<float> random_direction(std::mt19937& random) {
    std::normal_distribution<float> gauss;
    Vec3<float> d;
    do {
        d = {gauss(random), gauss(random), gauss(random)};
    } while (glm::length(d) < 1e-3f);
    return glm::normalize(d);
}

TEST(RayScene, RefusesATriangleThatNamesAMissingPoint) {
    const std::vector<std::array<Index, 3>> triangles = {{0, 1, 2}, {0, 1, 3}};
    const auto scene = RayScene::build(kPoints, triangles);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, ErrorCode::IndexOutOfRange);
    EXPECT_EQ(scene.error().element, 1u);
}

TEST(RayScene, RefusesAPointThatIsNotFinite) {
    auto points = kPoints;
    points[2].y = NAN;
    const auto scene = RayScene::build(points, kTriangle);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, ErrorCode::NonFinitePoint);
    EXPECT_EQ(scene.error().element, 2u);
}

TEST(RayScene, HitsOneTriangleWhereItShould) {
    const auto scene = RayScene::build(kPoints, kTriangle);
    ASSERT_TRUE(scene);
    const auto hit = scene->intersect({{0.25f, 0.5f, 2}, {0, 0, -1}});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->triangle, 0u);
    EXPECT_DOUBLE_EQ(hit->t, 2);
    EXPECT_DOUBLE_EQ(hit->u, 0.25);
    EXPECT_DOUBLE_EQ(hit->v, 0.5);
    EXPECT_FALSE(scene->intersect({{0.75f, 0.5f, 2}, {0, 0, -1}}));
}

// All seven regions of the triangle's plane, by the sign of the nearest point.
TEST(RayScene, NearestPointAgreesWithSampling) {
    const auto scene = RayScene::build(kPoints, kTriangle);
    ASSERT_TRUE(scene);
    std::mt19937 random(42);
    std::uniform_real_distribution<float> uniform(-1, 2);
    for (int n = 0; n < 200; ++n) {
        const Vec3<float> p(uniform(random), uniform(random), uniform(random));
        const auto hit = scene->nearest(p);
        ASSERT_TRUE(hit);
        float best = INFINITY;
        constexpr int kGrid = 100;
        for (int i = 0; i <= kGrid; ++i) {
            for (int j = 0; i + j <= kGrid; ++j)
                best =
                    std::min(best, glm::length(Vec3<float>(i, j, 0) / float(kGrid) - p));
        }
        EXPECT_LE(hit->t, best + 1e-6);    // float rounding of a length near 1
        EXPECT_GE(hit->t, best - 0.0101);  // the grid's spacing
        EXPECT_NEAR(glm::length(Vec3<double>(hit->u, hit->v, 0) - Vec3<double>(p)),
                    hit->t, 1e-6);
    }
}

// From inside of a closed surface no ray escapes.
TEST(TessellatedScene, IsWatertight) {
    const auto s = Surface::build(random_displaced(dodecahedron(), 7, 0.05));
    ASSERT_TRUE(s);
    const auto scene = TessellatedScene::build(s->tessellate(10));
    ASSERT_TRUE(scene);
    std::mt19937 random(42);
    for (int n = 0; n < 100000; ++n) {
        const auto d = random_direction(random);
        ASSERT_TRUE(scene->rays().intersect({{0, 0, 0}, d}))
            << "ray " << n << " towards " << d.x << " " << d.y << " " << d.z;
    }
}

// The address of a hit names a surface point near the hit: off by the sagitta of a facet,
// h^2/8 of its size h with curvatures near 1, and by the bend of (u, v) inside it.
TEST(TessellatedScene, AddressesNameTheHitPoint) {
    const auto s = Surface::build(dodecahedron());
    ASSERT_TRUE(s);
    const auto tessellation = s->tessellate(16);
    const auto scene = TessellatedScene::build(tessellation);
    ASSERT_TRUE(scene);
    std::mt19937 random(43);
    for (int n = 0; n < 2000; ++n) {
        const auto d = random_direction(random);
        const auto hit = scene->rays().intersect({{0, 0, 0}, d});
        ASSERT_TRUE(hit);
        const auto p = s->evaluate(scene->address(*hit)).p;
        EXPECT_LT(glm::length(p - hit->t * Vec3<double>(d)), 0.01) << n;
    }
}

Vec3<double> random_unit(std::mt19937& random) {
    return glm::normalize(Vec3<double>(random_direction(random)));
}

/// Of rays from outside at vertices that face them: those that do not end there.
int count_leaks(const Tessellation& t, int n_rays) {
    const auto scene = TessellatedScene::build(t);
    EXPECT_TRUE(scene);
    Vec3<double> lo = t.positions[0], hi = lo;
    for (const Vec3<double>& p : t.positions) {
        lo = glm::min(lo, p);
        hi = glm::max(hi, p);
    }
    const double size = std::hypot(hi.x - lo.x, hi.y - lo.y, hi.z - lo.z);
    std::mt19937 random(7);
    int n_leaks = 0;
    for (int n = 0; n < n_rays;) {
        const std::size_t i = random() % t.positions.size();
        const Vec3<double> d = random_unit(random);
        if (std::abs(glm::dot(d, t.normals[i])) < 0.7)
            continue;
        ++n;
        const Vec3<double> origin = t.positions[i] - 2 * size * d;
        const auto hit = scene->rays().intersect({origin, t.positions[i] - origin});
        n_leaks += !hit || hit->t > 1.001;
    }
    return n_leaks;
}

Tessellation round_one(double scale, const Vec3<double>& shift) {
    MeshData mesh = random_displaced(dodecahedron(), 7, 0.05);
    for (Vec3<double>& p : mesh.positions)
        p = scale * p + shift;
    const auto s = Surface::build(mesh);
    EXPECT_TRUE(s);
    return s->tessellate(8);
}

// Edge functions of the three edges of a triangle in floats have signs of rounding there.
TEST(TessellatedScene, IsWatertightAtVertices) {
    EXPECT_EQ(count_leaks(round_one(1, Vec3<double>(0)), 200000), 0);
}

// Floats have no squares of 1e19 and 1e-20 times it, and steps of 0.5 at six millions.
TEST(TessellatedScene, IsWatertightAtAnyScaleAndPlace) {
    for (const double scale : {1e-140, 1e-30, 1e19, 1e140})
        EXPECT_EQ(count_leaks(round_one(scale, Vec3<double>(0)), 2000), 0) << scale;
    EXPECT_EQ(count_leaks(round_one(1, {6.4e6, 4.2e5, 0}), 2000), 0);
}

TEST(TessellatedScene, FindsTheNearestPointAtAnyScaleAndPlace) {
    for (const double scale : {1e-140, 1e-30, 1.0, 1e19, 1e140}) {
        const Vec3<double> shift =
            scale == 1 ? Vec3<double>(6.4e6, 4.2e5, 0) : Vec3<double>(0);
        const Tessellation t = round_one(scale, shift);
        const auto scene = TessellatedScene::build(t);
        ASSERT_TRUE(scene);
        for (std::size_t i = 0; i < t.positions.size(); i += 7) {
            const auto hit = scene->rays().nearest(t.positions[i]);
            ASSERT_TRUE(hit) << scale;
            EXPECT_LT(hit->t, 1e-6 * scale);  // floats in units of the scene
        }
        EXPECT_FALSE(scene->rays().nearest(Vec3<double>(NAN, 0, 0)));
    }
}

TEST(TessellatedScene, AnswersRaysThatAreNone) {
    const auto scene = TessellatedScene::build(round_one(1, Vec3<double>(0)));
    ASSERT_TRUE(scene);
    const RayScene& rays = scene->rays();
    EXPECT_FALSE(rays.intersect({{0, 0, 0}, {0, 0, 0}}));
    EXPECT_FALSE(rays.intersect({{0, 0, 0}, {NAN, 0, 0}}));
    EXPECT_FALSE(rays.intersect({{INFINITY, 0, 0}, {1, 0, 0}}));
    EXPECT_TRUE(rays.intersect({{1e12, 0, 0}, {-1e-100, 0, 0}}));
    EXPECT_EQ(scene->address({}).face, kInvalidIndex);
}

TEST(RayScene, OfOneThatWasMovedFromIsEmpty) {
    auto scene = RayScene::build(kPoints, kTriangle);
    ASSERT_TRUE(scene);
    const RayScene taken = std::move(*scene);
    EXPECT_TRUE(taken.nearest({0, 0, 0}));
    EXPECT_FALSE(scene->nearest({0, 0, 0}));
    EXPECT_FALSE(scene->intersect({{0.25, 0.5, 2}, {0, 0, -1}}));
}

}  // namespace
}  // namespace osdx
