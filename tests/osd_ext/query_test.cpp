// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/query.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

// The nearest points: tests/osd_ext/analysis/comparison_test.cpp.

namespace osdx {
namespace {

using Point = Vec3<double>;

Surface surface_of(const MeshData& mesh) {
    auto s = Surface::build(mesh);
    EXPECT_TRUE(s) << (s ? "" : s.error().message);
    return std::move(*s);
}

TEST(IntersectRay, FindsThePointThatTheRayWasAimedAt) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    for (const auto& [name, mesh] : test::closed_meshes()) {
        SCOPED_TRACE(name);
        const Surface s = surface_of(mesh);
        for (int i = 0; i < 50; ++i) {
            const auto face = static_cast<Index>(random() % s.base().n_faces());
            const Address at = {face, 0.1 + 0.3 * unit(random), 0.1 + 0.3 * unit(random)};
            const SurfaceJet<double> jet = s.evaluate(at);
            // Not so flat that the ray leaves the face before it meets the surface.
            const Point tangent = glm::normalize(jet.du);
            const Point direction =
                -glm::normalize(normal(jet) + (unit(random) - 0.5) * tangent);
            const double t = 1 + unit(random);
            const Address start = {face, at.u + 0.05 * unit(random),
                                   at.v - 0.05 * unit(random)};
            const RayPoint hit =
                intersect_ray(s.base(), surface_function(s), jet.p - t * direction,
                              direction, start, 1e-13);
            EXPECT_LE(hit.distance, 1e-13);
            EXPECT_LE(glm::distance(hit.jet.p, jet.p), 1e-11);
            EXPECT_NEAR(hit.t, t, 1e-11);
        }
    }
}

TEST(IntersectRay, StopsWithinTheTolerance) {
    const Surface s = surface_of(test::cube());
    const Address start = {0, 0.4, 0.4};
    const Point p = s.evaluate(start).p, n = normal(s.evaluate(start));
    int n_evaluated = 0;
    const SurfaceFunction counted = [&](const QuarterPoint& q) {
        ++n_evaluated;
        return surface_function(s)(q);
    };
    const Point origin = p + n + 0.01 * s.evaluate(start).du;
    RayPoint hit = intersect_ray(s.base(), counted, origin, -n, start, 0.1);
    EXPECT_EQ(n_evaluated, 1);
    EXPECT_EQ(hit.jet.p, p);
    hit = intersect_ray(s.base(), counted, origin, -n, start, 0, 2);
    EXPECT_EQ(n_evaluated, 4);
    EXPECT_LE(hit.distance, 1e-6);
}

// A ray that passes over the surface: it meets the tangent plane beyond where that is near.
TEST(IntersectRay, TakesNoStepThatLeadsAway) {
    const Surface s = surface_of(test::cube());
    const Address start = {0, 0.5, 0.5};
    const SurfaceJet<double> jet = s.evaluate(start);
    const Point n = normal(jet),
                direction = glm::normalize(glm::normalize(jet.du) - 0.01 * n);
    const RayPoint hit =
        intersect_ray(s.base(), surface_function(s), jet.p + 0.1 * n - direction,
                      direction, start, 1e-12);
    EXPECT_EQ(hit.jet.p, jet.p);
    EXPECT_NEAR(hit.distance, 0.1, 1e-3);
}

}  // namespace
}  // namespace osdx
