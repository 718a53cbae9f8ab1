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
    EXPECT_FLOAT_EQ(hit->t, 2);
    EXPECT_FLOAT_EQ(hit->u, 0.25f);
    EXPECT_FLOAT_EQ(hit->v, 0.5f);
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
        EXPECT_LE(hit->t, best + 1e-6f);    // float rounding of a length near 1
        EXPECT_GE(hit->t, best - 0.0101f);  // the grid's spacing
        EXPECT_NEAR(glm::length(Vec3<float>(hit->u, hit->v, 0) - p), hit->t, 1e-6f);
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
        EXPECT_LT(glm::length(p - Vec3<double>(hit->t * d)), 0.01) << n;
    }
}

}  // namespace
}  // namespace osdx
