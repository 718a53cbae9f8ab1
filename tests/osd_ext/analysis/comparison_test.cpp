// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/analysis/comparison.h>
#include <osdx/analysis/continuity.h>
#include <osdx/evaluator.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/query.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using namespace test;

Surface surface_of(const MeshData& mesh) {
    auto s = Surface::build(mesh);
    EXPECT_TRUE(s) << (s ? "" : s.error().message);
    return std::move(*s);
}

LimitSurface limit_of(const Surface& s, int isolation = 8) {
    auto l = LimitSurface::build(s.base(), s.features(),
                                 s.points().first(s.base().n_vertices()), isolation);
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
    const auto d = measure_distance(s.base(), s.features(), surface_function(s),
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
    const SurfaceFunction ours = surface_function(s);
    double worst = 0;
    for (Index q = 0; q < s.base().n_halfedges(); ++q) {
        const QuarterPoint at{q, 0.4, 0.3};
        const auto jet = ours(at);
        // Start from elsewhere, across the quarter's sides too.
        for (const auto& [x, y] : {std::pair(0.9, 0.9), std::pair(0.05, 0.6)}) {
            const auto c = closest_point(s.base(), s.features(), ours,
                                         jet.p + 0.01 * normal(jet), {q, x, y}, 1e-13);
            worst = std::max(worst, std::abs(c.distance - 0.01));
        }
    }
    EXPECT_LT(worst, 1e-14);
    const auto d = measure_distance(s.base(), s.features(), ours, offset(s, 0.0), 4, 1.0);
    ASSERT_TRUE(d);
    EXPECT_LT(d->distance_max, 1e-14);
}

// Points of another quarter: the walk crosses sides of quarters, faces and n-gons.
TEST(Comparison, WalksToPointsOfOtherFaces) {
    const Surface s = surface_of(dodecahedron());
    const SurfaceFunction ours = surface_function(s);
    const Topology& base = s.base();
    for (Index q = 0; q < base.n_halfedges(); ++q) {
        const Vec3<double> target = ours({q, 0.1, 0.2}).p;
        for (const QuarterPoint& start :
             {QuarterPoint{base.ccw(q), 0.5, 0.5}, QuarterPoint{base.next(q), 0.5, 0.5},
              QuarterPoint{base.next(base.twin[q]), 0.4, 0.4}}) {
            const auto c = closest_point(base, s.features(), ours, target, start, 1e-13);
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
        const Vec3<double> p = surface_function(s)({q, 0.2, 0.3}).p;
        double brute = INFINITY;
        for (const auto& x : dense.positions)
            brute = std::min(brute, glm::length(x - p));
        const auto c = closest_point(s.base(), s.features(), to, p, {q, 0.2, 0.3}, 1e-13);
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
    const auto coarse = isolation_error(s.base(), s.features(), positions, 2, 1.0);
    const auto fine = isolation_error(s.base(), s.features(), positions, 8, 1.0);
    ASSERT_TRUE(coarse && fine);
    EXPECT_GT(*coarse, 1e-5);
    EXPECT_LT(*fine, *coarse / 4);
}

// ------------------------------------------------------------------------ open and sharp

/// A limit surface with what the comparison asks for.
struct Limit {
    Topology base;
    ResolvedFeatures features;
    std::vector<Vec3<double>> positions;
    std::optional<LimitSurface> surface;

    Limit(const MeshData& mesh, Features f)
        : base(topology_of(mesh)),
          features(resolve(base, std::move(f))),
          positions(mesh.positions) {
        auto built = LimitSurface::build(base, features, positions, 5);
        EXPECT_TRUE(built);
        surface.emplace(std::move(*built));
    }
    Limit(const Limit&) = delete;

    SurfaceFunction function() const { return surface_function(base, *surface); }
    ClosestPoint closest(const Vec3<double>& target, const QuarterPoint& start,
                         AtCrease at_crease = AtCrease::Cross) const {
        const SurfaceFunction checked = [&](const QuarterPoint& q) {
            EXPECT_FALSE(features.is_hole(base.face(q.quarter)));
            return surface->evaluate(to_address(base, q));
        };
        return closest_point(base, features, checked, target, start, 1e-13, at_crease);
    }
};

/// A cube whose face 0 has infinitely sharp edges.
Features rim(const MeshData& mesh) {
    const Topology t = topology_of(mesh);
    Features f;
    f.edge_sharpness.resize(t.n_edges);
    for (Index h = 0; h < t.face_size(0); ++h)
        f.edge_sharpness[t.edge[h]] = kInfinitelySharp;
    return f;
}

/// Unit vector along side 0 at a point of it, and the one in the tangent plane that leaves
/// the quarter there.
struct Rim {
    Vec3<double> along, out;
};
Rim rim_at(const Topology& base, const SurfaceJet<double>& s, Index quarter) {
    const auto d = turn(Vec2<double>(1, 0), -quarter_turns(base, quarter));
    const Vec3<double> along = glm::normalize(d.x * s.du + d.y * s.dv);
    return {along, glm::cross(along, normal(s))};
}

// A point outside of the border in the tangent plane, and lifted off it: the distance has its
// minimum at the foot on the border curve. The walks start in the same and the next quarters.
TEST(ClosestPoint, StopsAtBorders) {
    int n = 0;
    for (const auto& [name, mesh] : open_meshes()) {
        if (name.find("pole") != std::string::npos)
            continue;  // 64 small faces at a vertex: other feet are as close
        SCOPED_TRACE(name);
        const Limit s(mesh, {});
        const SurfaceFunction f = s.function();
        for (Index q = 0; q < s.base.n_halfedges(); ++q) {
            if (!s.base.is_border(q))
                continue;
            const QuarterPoint foot{q, 0.6, 0};
            const SurfaceJet<double> jet = f(foot);
            const Vec3<double> offset =
                0.03 * rim_at(s.base, jet, q).out + 0.01 * normal(jet);
            for (const QuarterPoint& start :
                 {QuarterPoint{q, 0.5, 0.2}, QuarterPoint{q, 0.1, 0},
                  QuarterPoint{s.base.next(q), 0.2, 0.8}}) {
                const ClosestPoint c = s.closest(jet.p + offset, start);
                EXPECT_LE(c.distance, glm::length(offset) + 1e-14) << q;
                EXPECT_EQ(c.at.quarter, q);
                EXPECT_NEAR(c.at.x, 0.6, 1e-7);  // the distance feels its square
                EXPECT_EQ(c.at.y, 0);
                ++n;
            }
        }
    }
    EXPECT_GT(n, test::fewest(100));
}

// Outside of the only corner both border edges hold the point.
TEST(ClosestPoint, StopsAtCornersOfTheBorder) {
    Features f;
    f.boundary = BoundaryRule::EdgeAndCorner;
    const Limit s(grid(1, 1), f);
    for (Index q = 0; q < 4; ++q) {
        const Vec3<double> corner = s.positions[s.base.vertex[q]], centre(0.5, 0.5, 0);
        const ClosestPoint c = s.closest(corner + 0.1 * (corner - centre), {q, 0.7, 0.9});
        EXPECT_EQ(c.at.quarter, q);
        EXPECT_EQ(c.at.x, 0);
        EXPECT_EQ(c.at.y, 0);
        EXPECT_NEAR(c.distance, 0.1 * std::sqrt(0.5), 1e-15);
    }
}

TEST(ClosestPoint, WalksAroundHoles) {
    const MeshData mesh = random_displaced(grid(3, 3), 4, 0.05);
    Features f;
    const Limit whole(mesh, f);
    f.hole.assign(9, false);
    f.hole[4] = true;
    const Limit s(mesh, f);
    for (Index h = 16; h < 20; ++h) {  // of face 4
        const Index outer = s.base.twin[h];
        // A point that lies in the hole, near its side.
        const Vec3<double> target = whole.function()({h, 0.9, 0.1}).p;
        const ClosestPoint c = s.closest(target, {outer, 0.5, 0.5});
        EXPECT_EQ(s.base.face(c.at.quarter), s.base.face(outer));
        EXPECT_GT(c.distance, 0.01);
        EXPECT_LT(c.distance, 0.1);
        EXPECT_TRUE(c.at.x == 0 || c.at.y == 0);
    }
}

TEST(ClosestPoint, CrossesCreasesOrStopsThere) {
    const MeshData mesh = random_displaced(cube(), 3, 0.05);
    const Limit s(mesh, rim(mesh));
    const SurfaceFunction f = s.function();
    int n_on_crease = 0;
    for (Index q = 0; q < s.base.face_size(0); ++q) {
        const Vec3<double> target = f({q, 0.7, 0.15}).p;
        const Index outer = s.base.next(s.base.twin[q]);
        const QuarterPoint start{outer, 0.3, 0.6};
        const ClosestPoint across = s.closest(target, start);
        EXPECT_LT(across.distance, 1e-12);
        EXPECT_EQ(s.base.face(across.at.quarter), 0u);
        const ClosestPoint stopped = s.closest(target, start, AtCrease::Stop);
        EXPECT_NE(s.base.face(stopped.at.quarter), 0u);
        // Where the faces meet at an acute angle the foot is inside: along the normal.
        const SurfaceJet<double> foot = f(stopped.at);
        const Vec3<double> r = target - foot.p;
        if (stopped.at.x > 0 && stopped.at.y > 0) {
            EXPECT_NEAR(std::abs(glm::dot(normal(foot), r)), stopped.distance, 1e-9);
            continue;
        }
        const auto d = turn(stopped.at.y == 0 ? Vec2<double>(1, 0) : Vec2<double>(0, 1),
                            -quarter_turns(s.base, stopped.at.quarter));
        const Vec3<double> tangent = glm::normalize(d.x * foot.du + d.y * foot.dv);
        EXPECT_LT(std::abs(glm::dot(tangent, r)), 1e-8);
        ++n_on_crease;
    }
    EXPECT_GE(n_on_crease, 2);
}

// Outside of a convex crease the distance falls towards it on both sides.
TEST(ClosestPoint, EndsOnCreases) {
    const MeshData mesh = random_displaced(cube(), 3, 0.05);
    const Limit s(mesh, rim(mesh));
    const SurfaceFunction f = s.function();
    for (Index q = 0; q < s.base.face_size(0); ++q) {
        const QuarterPoint foot{q, 0.6, 0}, other = cross_side(s.base, foot, 0);
        const Vec3<double> n = normal(f(foot)) + normal(f(other));
        const Vec3<double> target = f(foot).p + 0.05 * glm::normalize(n);
        for (const QuarterPoint& start :
             {QuarterPoint{q, 0.4, 0.3}, QuarterPoint{other.quarter, 0.3, 0.4}}) {
            const ClosestPoint c = s.closest(target, start);
            EXPECT_NEAR(c.distance, 0.05, 1e-12);
        }
    }
}

// Independent: brute force over a dense sampling, from targets all around.
TEST(ClosestPoint, AgreesWithBruteForceOnOpenMeshes) {
    std::mt19937 random(9);
    const auto next = [&] { return 2.0 * double(random()) / 0xffffffffu - 1.0; };
    for (const auto& [name, mesh] : open_meshes()) {
        SCOPED_TRACE(name);
        const Limit s(mesh, {});
        const Tessellation dense = tessellate(s.base, s.features, 16, s.function());
        for (int i = 0; i < 20; ++i) {
            const double x = next(), y = next(), z = next();
            const Vec3<double> target(1.5 * x, 1.5 * y, z);
            std::size_t nearest = 0;
            double brute = INFINITY;
            for (std::size_t k = 0; k < dense.positions.size(); ++k) {
                const double d = glm::length(dense.positions[k] - target);
                if (d < brute) {
                    brute = d;
                    nearest = k;
                }
            }
            const ClosestPoint c =
                s.closest(target, to_quarter(s.base, dense.addresses[nearest]));
            EXPECT_LE(c.distance, brute);
            // A sixteenth of an edge between samples, whose squares the distance feels.
            EXPECT_GT(c.distance, brute - 0.05);
            // At a minimum inside the difference is along the normal.
            if (c.at.x > 0 && c.at.y > 0 && c.at.x < 1 && c.at.y < 1) {
                const auto n = normal(c.jet);
                EXPECT_NEAR(std::abs(glm::dot(n, c.jet.p - target)), c.distance, 1e-9);
            }
        }
    }
}

TEST(Comparison, FindsNoDistanceOfAnOpenMeshFromItself) {
    for (const auto& [name, mesh] : open_meshes()) {
        SCOPED_TRACE(name);
        const Limit s(mesh, {});
        const SurfaceFunction f = s.function();
        const auto same = measure_distance(s.base, s.features, f, f, 4, 1.0);
        ASSERT_TRUE(same);
        EXPECT_EQ(same->distance_max, 0);
        EXPECT_EQ(same->normal_deg_max, 0);
        EXPECT_EQ(same->n_samples, 2 * 9u * s.base.n_halfedges());
    }
}

TEST(Comparison, LeavesHolesOut) {
    const MeshData mesh = random_displaced(grid(3, 3), 4, 0.05);
    Features f;
    const Limit whole(mesh, f);  // holes do not change the faces beside them
    f.boundary = BoundaryRule::None;
    const ResolvedFeatures bordered = resolve(whole.base, f);
    const auto never_in_holes = [&](const SurfaceFunction& surface) -> SurfaceFunction {
        return [&whole, surface](const QuarterPoint& q) {
            EXPECT_EQ(whole.base.face(q.quarter), 4u);
            return surface(q);
        };
    };
    const auto d =
        measure_distance(whole.base, bordered, never_in_holes(whole.function()),
                         never_in_holes(whole.function()), 4, 1.0);
    ASSERT_TRUE(d);
    EXPECT_EQ(d->n_samples, 2 * 9u * 4);
    EXPECT_LT(d->distance_max, 1e-14);
    const auto error = isolation_error(whole.base, bordered, whole.positions, 3, 1.0);
    ASSERT_TRUE(error);
    EXPECT_LT(*error, 1e-14);  // one regular face
    // Nothing but holes.
    const MeshData quad = grid(1, 1);
    const Topology base = topology_of(quad);
    const auto none = measure_distance(base, resolve(base, f), whole.function(),
                                       whole.function(), 4, 1.0);
    ASSERT_TRUE(none);
    EXPECT_EQ(none->n_samples, 0u);
    EXPECT_EQ(none->distance_rms, 0);
    EXPECT_EQ(none->normal_deg_rms, 0);
}

// Two surfaces that differ a little, creases included, whose sides meet at some 70 degrees:
// next to the crease the closest point is often on its other side, but normals are compared
// on one.
TEST(Comparison, ComparesNormalsOnTheSameSideOfCreases) {
    const MeshData mesh = random_displaced(cube(), 3, 0.05);
    const Limit a(mesh, rim(mesh)), b(random_displaced(mesh, 5, 0.01), rim(mesh));
    const auto d =
        measure_distance(a.base, a.features, a.function(), b.function(), 8, 1.0);
    ASSERT_TRUE(d);
    EXPECT_GT(d->distance_max, 1e-3);
    EXPECT_LT(d->distance_max, 0.02);
    EXPECT_GT(d->normal_deg_max, 0.1);
    EXPECT_LT(d->normal_deg_max, 5);
}

TEST(Comparison, IsolationErrorOfSharpFeatures) {
    const MeshData mesh = random_displaced(torus(4, 5), 3, 0.05);
    const Topology base = topology_of(mesh);
    Features f;
    f.edge_sharpness.resize(base.n_edges);
    // A ring of infinitely sharp edges is exact at once.
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        if (base.vertex[h] < 5 && base.to_vertex(h) < 5)
            f.edge_sharpness[base.edge[h]] = kInfinitelySharp;
    }
    const auto error = [&](int isolation) {
        const auto e = isolation_error(base, f, mesh.positions, isolation, 1.0);
        EXPECT_TRUE(e);
        return *e;
    };
    EXPECT_LT(error(1), 1e-14);
    // A semi-sharp one only from its sharpness on.
    for (double& s : f.edge_sharpness)
        s = std::min(s, 4.0);
    EXPECT_GT(error(2), 1e-4);
    EXPECT_LT(error(4), 1e-14);
}

TEST(Comparison, DoesNotDependOnTheNumberOfThreads) {
    const Surface s = surface_of(random_displaced(dodecahedron(), 2, 0.05));
    const LimitSurface limit = limit_of(s);
    const auto run = [&] {
        return *measure_distance(s.base(), s.features(), surface_function(s),
                                 surface_function(s.base(), limit), 4, 1.0);
    };
    const SurfaceDistance many = run();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const SurfaceDistance single = run();
    EXPECT_EQ(many.distance_max, single.distance_max);
    EXPECT_EQ(many.distance_rms, single.distance_rms);
    EXPECT_EQ(many.normal_deg_rms, single.normal_deg_rms);
}

MeshData moved(MeshData mesh, double scale, const Vec3<double>& shift) {
    for (Vec3<double>& p : mesh.positions)
        p = scale * p + shift;
    return mesh;
}

SurfaceDistance distance_to_limit(const MeshData& mesh) {
    const Surface s = surface_of(mesh);
    const LimitSurface limit = limit_of(s);
    const auto d = measure_distance(s.base(), s.features(), surface_function(s),
                                    surface_function(s.base(), limit), 4,
                                    bounding_diagonal(mesh.positions));
    EXPECT_TRUE(d);
    return d ? *d : SurfaceDistance();
}

// By powers of two, of some 1e-120 to 1e120: products of four lengths are no numbers.
TEST(Comparison, IsTheSameAtEveryScaleToTheBit) {
    const MeshData mesh = random_displaced(cube(), 3, 0.05);
    const SurfaceDistance one = distance_to_limit(mesh);
    const Continuity own = measure_continuity(surface_of(mesh), 4);
    EXPECT_GT(one.distance_max, 1e-3);
    for (const int power : {-400, -100, 70, 400}) {
        const MeshData scaled = moved(mesh, std::ldexp(1, power), Vec3<double>(0));
        const SurfaceDistance d = distance_to_limit(scaled);
        EXPECT_EQ(d.distance_max, one.distance_max) << power;
        EXPECT_EQ(d.distance_rms, one.distance_rms) << power;
        EXPECT_EQ(d.normal_deg_max, one.normal_deg_max) << power;
        EXPECT_EQ(d.normal_deg_rms, one.normal_deg_rms) << power;
        const Continuity c = measure_continuity(surface_of(scaled), 4);
        EXPECT_EQ(c.gap_max, own.gap_max) << power;
        EXPECT_EQ(c.curvature_max, own.curvature_max) << power;
        EXPECT_EQ(c.curvature_jump_max, own.curvature_jump_max) << power;
    }
}

TEST(Comparison, OfAMeshWithoutSizeIsFinite) {
    const MeshData mesh = moved(cube(), 0, {1, 2, 3});
    const SurfaceDistance d = distance_to_limit(mesh);
    EXPECT_LT(d.distance_max, 1e-12);  // rounding of coordinates of 3
    EXPECT_EQ(d.normal_deg_max, 0);
    const Continuity c = measure_continuity(surface_of(mesh), 4);
    EXPECT_LT(c.gap_max, 1e-12);
    EXPECT_EQ(c.curvature_max, 0);
}

TEST(Comparison, RefusesAUnitThatIsNoLength) {
    const Surface s = surface_of(cube());
    const auto d = measure_distance(s.base(), s.features(), surface_function(s),
                                    surface_function(s), 4, NAN);
    ASSERT_FALSE(d);
    EXPECT_EQ(d.error().code, ErrorCode::InvalidOption);
}

// Two cubes whose surfaces pass each other more closely than ours is to the limit: the near
// one looks the other way.
TEST(Comparison, KeepsToItsSheet) {
    MeshData two = cube();
    const MeshData other = moved(cube(), 1, {1.66, 0, 0});
    const double lonely = distance_to_limit(two).normal_deg_max;
    const auto n = static_cast<Index>(two.positions.size());
    two.positions.insert(two.positions.end(), other.positions.begin(),
                         other.positions.end());
    two.face_sizes.insert(two.face_sizes.end(), other.face_sizes.begin(),
                          other.face_sizes.end());
    for (const Index v : other.face_vertices)
        two.face_vertices.push_back(v + n);
    EXPECT_LT(distance_to_limit(two).normal_deg_max, lonely + 1e-6);
}

}  // namespace
}  // namespace osdx
