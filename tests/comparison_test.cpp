// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "osd_ext/comparison.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <random>

#include "osd_ext/continuity.h"
#include "osd_ext/surface.h"
#include "tests/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

Surface surface_of(const MeshData& mesh) {
    auto s = Surface::build(mesh);
    EXPECT_TRUE(s) << (s ? "" : s.error().message);
    return std::move(*s);
}

LimitSurface limit_of(const Surface& s, int isolation = 8) {
    auto l =
        LimitSurface::build(s.base(), s.points().first(s.base().n_vertices()), isolation);
    EXPECT_TRUE(l) << (l ? "" : l.error().message);
    return std::move(*l);
}

/// The smooth function of the parameters that `make` gives, moved along its normal.
SurfaceFunction offset(const Surface& s, double by) {
    return [&s, by](const QuarterPoint& q) {
        SurfaceJet<double> j = s.evaluator().evaluate<double>(s.points(), q);
        j.p += by * normal(j);
        return j;
    };
}

// On a grid without extraordinary points both are the same bicubic B-spline.
TEST(LimitSurface, EqualsOursOnARegularMesh) {
    const Surface s = surface_of(random_displaced(torus(8, 6), 1, 0.05));
    const LimitSurface limit = limit_of(s);
    for (Index f = 0; f < s.base().n_faces(); ++f) {
        for (const auto& [u, v] :
             {std::pair(0.1, 0.7), std::pair(0.5, 0.5), std::pair(1.0, 0.0)}) {
            const auto a = s.evaluate({f, u, v}), b = limit.evaluate({f, u, v});
            // Tens of roundings of coordinates and second differences of size 1 to 10.
            EXPECT_LT(glm::length(a.p - b.p), 1e-14);
            EXPECT_LT(glm::length(a.du - b.du), 1e-13);
            EXPECT_LT(glm::length(a.duv - b.duv), 1e-13);
            EXPECT_LT(glm::length(a.dvv - b.dvv), 1e-13);
        }
    }
}

// In the sub-faces of pentagons, away from their edges, where Far's patches are regular and
// so differentiated exactly. Central differences err by h^2 times third derivatives, and by
// eps/h: 1e-8 for h = 1e-5; second ones of first ones the same.
TEST(LimitSurface, DifferentiatesInTheFacesOfPolygons) {
    const Surface s = surface_of(random_displaced(dodecahedron(), 4, 0.05));
    const LimitSurface limit = limit_of(s);
    constexpr double h = 1e-5;
    for (Index q = 0; q < s.base().n_halfedges(); q += 7) {
        const Address a = to_address(s.base(), {q, 0.55, 0.6});
        const auto jet = limit.evaluate(a);
        const auto left = limit.evaluate({a.face, a.u - h, a.v}),
                   right = limit.evaluate({a.face, a.u + h, a.v}),
                   below = limit.evaluate({a.face, a.u, a.v - h}),
                   above = limit.evaluate({a.face, a.u, a.v + h});
        const double inverse = 1 / (2 * h);
        EXPECT_LT(glm::length(jet.du - inverse * (right.p - left.p)), 1e-7) << q;
        EXPECT_LT(glm::length(jet.dv - inverse * (above.p - below.p)), 1e-7) << q;
        EXPECT_LT(glm::length(jet.duu - inverse * (right.du - left.du)), 1e-7) << q;
        EXPECT_LT(glm::length(jet.duv - inverse * (above.du - below.du)), 1e-7) << q;
        EXPECT_LT(glm::length(jet.dvv - inverse * (above.dv - below.dv)), 1e-7) << q;
    }
}

TEST(Comparison, FindsNoDistanceOnARegularMesh) {
    const Surface s = surface_of(random_displaced(torus(8, 6), 1, 0.05));
    const LimitSurface limit = limit_of(s);
    const auto d = measure_distance(s.base(), s.function(),
                                    surface_function(s.base(), limit), 4, 1.0);
    ASSERT_TRUE(d);
    EXPECT_LT(d->distance_max, 1e-14);
    EXPECT_LT(d->normal_deg_max, 1e-10);
    EXPECT_GT(d->n_samples, 0u);
}

// A surface and the one at distance 0.01 along its normals: the closest point from one to
// the other is the foot of the normal, where both have the same normal.
TEST(Comparison, MeasuresAnOffset) {
    const Surface s = surface_of(random_displaced(cube(), 3, 0.05));
    const SurfaceFunction ours = s.function();
    double worst = 0;
    for (Index q = 0; q < s.base().n_halfedges(); ++q) {
        const QuarterPoint at{q, 0.4, 0.3};
        const auto jet = ours(at);
        // Start from elsewhere, across the quarter's sides too.
        for (const auto& [x, y] : {std::pair(0.9, 0.9), std::pair(0.05, 0.6)}) {
            const auto c = closest_point(s.base(), ours, jet.p + 0.01 * normal(jet),
                                         {q, x, y}, 1e-13);
            worst = std::max(worst, std::abs(c.distance - 0.01));
        }
    }
    EXPECT_LT(worst, 1e-14);
    const auto d = measure_distance(s.base(), ours, offset(s, 0.0), 4, 1.0);
    ASSERT_TRUE(d);
    EXPECT_LT(d->distance_max, 1e-14);
}

// Points of another quarter: the walk crosses sides of quarters, faces and n-gons.
TEST(Comparison, WalksToPointsOfOtherFaces) {
    const Surface s = surface_of(dodecahedron());
    const SurfaceFunction ours = s.function();
    const Topology& base = s.base();
    for (Index q = 0; q < base.n_halfedges(); ++q) {
        const Vec3<double> target = ours({q, 0.1, 0.2}).p;
        for (const QuarterPoint& start :
             {QuarterPoint{base.ccw(q), 0.5, 0.5}, QuarterPoint{base.next(q), 0.5, 0.5},
              QuarterPoint{base.next(base.twin[q]), 0.4, 0.4}}) {
            const auto c = closest_point(base, ours, target, start, 1e-13);
            EXPECT_LT(c.distance, 1e-10) << "quarter " << q << " from " << start.quarter;
        }
    }
}

// Independent: brute force over a dense sampling bounds the closest distance from above,
// and from below by the spacing.
TEST(Comparison, AgreesWithBruteForce) {
    const Surface s = surface_of(cube());
    const LimitSurface limit = limit_of(s);
    const SurfaceFunction to = surface_function(s.base(), limit);
    const Tessellation dense = tessellate(s.base(), {}, 128, to);
    for (const Index q : {Index(0), Index(5), Index(17)}) {
        const Vec3<double> p = s.function()({q, 0.2, 0.3}).p;
        double brute = INFINITY;
        for (const auto& x : dense.positions)
            brute = std::min(brute, glm::length(x - p));
        const auto c = closest_point(s.base(), to, p, {q, 0.2, 0.3}, 1e-13);
        EXPECT_LE(c.distance, brute + 1e-12);
        EXPECT_GT(c.distance, brute - 2.0 / 128);
        // At the foot the difference is along the normal.
        const auto n = normal(c.jet);
        EXPECT_NEAR(std::abs(glm::dot(n, c.jet.p - p)), c.distance, 1e-9);
    }
}

TEST(Comparison, IsolationErrorFallsWithIsolation) {
    const Surface s = surface_of(cube());
    const auto positions = s.points().first(s.base().n_vertices());
    const auto coarse = isolation_error(s.base(), positions, 2, 1.0);
    const auto fine = isolation_error(s.base(), positions, 8, 1.0);
    ASSERT_TRUE(coarse && fine);
    EXPECT_GT(*coarse, 1e-5);
    EXPECT_LT(*fine, *coarse / 4);
}

TEST(Comparison, DoesNotDependOnTheNumberOfThreads) {
    const Surface s = surface_of(random_displaced(dodecahedron(), 2, 0.05));
    const LimitSurface limit = limit_of(s);
    const auto run = [&] {
        return *measure_distance(s.base(), s.function(),
                                 surface_function(s.base(), limit), 4, 1.0);
    };
    const SurfaceDistance many = run();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const SurfaceDistance single = run();
    EXPECT_EQ(many.distance_max, single.distance_max);
    EXPECT_EQ(many.distance_rms, single.distance_rms);
    EXPECT_EQ(many.normal_deg_rms, single.normal_deg_rms);
}

}  // namespace
}  // namespace osdx
