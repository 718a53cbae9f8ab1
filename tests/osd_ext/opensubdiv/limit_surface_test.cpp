// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "far/refine/refinement.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using namespace test;

/// As many as the largest semi-sharp crease of these tests lasts, and one more.
constexpr int kLevels = 4;

struct LimitPoint {
    QuarterPoint at;
    Vec3<double> p;
    bool at_dart;
};

/// The limit of a vertex without semi-sharp edges, in a mesh of quads: of a smooth one
/// (n^2 v + 4 sum of edge neighbours + sum of face neighbours) / (n (n + 5)) [Halstead, Kass
/// and DeRose 1993], of a crease (1, 4, 1)/6, of a corner the vertex.
Vec3<double> limit_of_vertex(const RefinedLevel& level,
                             const std::vector<Vec3<double>>& points, Index v) {
    const Topology& t = level.topology;
    const Features& f = level.features;
    std::vector<Index> sharp;
    Vec3<double> edges(0), faces(0);
    double n = 0;
    t.for_each_edge(v, [&](Index e, Index other) {
        if (f.edge(e) >= kInfinitelySharp)
            sharp.push_back(other);
    });
    t.for_each_outgoing(v, [&](Index h) {
        edges += points[t.to_vertex(h)];
        faces += points[t.to_vertex(t.next(h))];
        ++n;
    });
    if (f.vertex(v) >= kInfinitelySharp || sharp.size() > 2)
        return points[v];
    if (sharp.size() == 2)
        return (points[sharp[0]] + 4.0 * points[v] + points[sharp[1]]) / 6.0;
    return (n * n * points[v] + 4.0 * edges + faces) / (n * (n + 5));
}

bool is_dart(const RefinedLevel& level, Index v) {
    int n_sharp = 0;
    level.topology.for_each_edge(v, [&](Index e, Index) {
        n_sharp += level.features.edge(e) >= kInfinitelySharp;
    });
    return n_sharp == 1 && level.features.vertex(v) < kInfinitelySharp;
}

/// The limits of all vertices of the last level by our own refinement, from every face.
std::vector<LimitPoint> limit_points(const MeshData& mesh, const Features& features) {
    Refinement refinement(topology_of(mesh), 3, features);
    for (int l = 0; l < kLevels; ++l)
        refinement.add_level();
    const RefinedLevel& last = refinement.level(kLevels);
    const std::vector<Vec3<double>> points = refinement.points(mesh.positions);
    std::vector<LimitPoint> result;
    const Topology& t = last.topology;
    for (Index f = 0; f < t.n_faces(); ++f) {
        if (last.features.is_hole(f))
            continue;
        // Face 4 f + k of a level is at corner k of face f, and its first corner is there.
        std::array<int, kLevels> corners{};
        Index quarter = f;
        for (int l = kLevels; l > 1; --l) {
            corners[l - 1] = static_cast<int>(quarter % 4);
            quarter /= 4;
        }
        Vec2<double> origin(0), axis(1, 0);
        for (int l = 1; l < kLevels; ++l) {
            const auto c = square_corner<double>(corners[l]);
            origin += c.x * axis + c.y * turn(axis, 1);
            axis = 0.5 * turn(axis, corners[l]);
        }
        for (int k = 0; k < 4; ++k) {
            const auto c = square_corner<double>(k);
            const auto q = origin + c.x * axis + c.y * turn(axis, 1);
            const Index v = t.vertex[4 * f + k];
            result.push_back({{quarter, q.x, q.y},
                              limit_of_vertex(last, points, v),
                              is_dart(last, v)});
        }
    }
    return result;
}

/// The largest distance between the limit surface and the limit points. Darts count where the
/// isolation is kLevels: there OpenSubdiv takes the limit of a smooth vertex of that level.
double worst_distance(const MeshData& mesh, const Features& features,
                      const Features& passed, int isolation) {
    const Topology base = topology_of(mesh);
    const auto limit = LimitSurface::build(base, passed, mesh.positions, isolation);
    if (!limit) {
        ADD_FAILURE() << limit.error().message;
        return 0;
    }
    double worst = 0;
    for (const LimitPoint& point : limit_points(mesh, features)) {
        if (point.at_dart && isolation != kLevels)
            continue;
        const double distance =
            glm::length(limit->evaluate(to_address(base, point.at)).p - point.p);
        if (distance > worst || std::isnan(distance))
            worst = distance;
    }
    return worst;
}

bool has_surface(const Topology& base, const ResolvedFeatures& bordered) {
    return std::ranges::count(bordered.hole, true) < base.n_faces();
}

// Five to nine levels of sums of weights that round, of points of about 1 to 10.
constexpr double kTol = 1e-14;

constexpr BoundaryRule kRules[] = {BoundaryRule::None, BoundaryRule::EdgeOnly,
                                   BoundaryRule::EdgeAndCorner};

TEST(LimitSurface, IsTheLimitOfOurRefinementOnOpenMeshes) {
    for (const auto& [name, mesh] : open_meshes()) {
        const Topology base = topology_of(mesh);
        for (const BoundaryRule rule : kRules) {
            SCOPED_TRACE(name + ", boundary rule " + std::to_string(int(rule)));
            Features f;
            f.boundary = rule;
            const ResolvedFeatures bordered = resolve(base, f);
            if (!has_surface(base, bordered))
                continue;
            EXPECT_LT(worst_distance(mesh, f, f, 6), kTol);
            EXPECT_LT(worst_distance(mesh, f, bordered, kLevels), kTol);
        }
    }
}

/// Creases, corners and a hole at random.
Features random_features(const Topology& t, unsigned seed, bool integers) {
    // Eighths are exact in OpenSubdiv's floats.
    static constexpr double kSharpness[] = {0.125, 0.5,   1, 1.5, 2,
                                            2.375, 2.875, 3, 10,  10};
    std::mt19937 random(seed);
    const auto sharpness = [&] {
        const double s = kSharpness[random() % std::size(kSharpness)];
        return integers ? std::ceil(s) : s;
    };
    Features f;
    f.edge_sharpness.resize(t.n_edges);
    f.vertex_sharpness.resize(t.n_vertices());
    f.hole.resize(t.n_faces());
    for (double& s : f.edge_sharpness) {
        if (random() % 4 == 0)
            s = sharpness();
    }
    for (double& s : f.vertex_sharpness) {
        if (random() % 8 == 0)
            s = sharpness();
    }
    f.hole[random() % t.n_faces()] = true;
    f.boundary = kRules[random() % 3];
    f.smooth_triangles = seed % 2 == 1;
    return f;
}

TEST(LimitSurface, IsTheLimitOfOurRefinementWithSharpFeatures) {
    auto meshes = open_meshes();
    for (auto& mesh : closed_meshes())
        meshes.push_back(std::move(mesh));
    std::vector<unsigned> seeds(2 * meshes.size());
    std::iota(seeds.begin(), seeds.end(), 0u);
    const std::vector<bool> kinds = {true, false};
    for (const auto& [seed, integers] : test::thinned(test::combinations(seeds, kinds))) {
        const auto& [name, mesh] = meshes[seed / 2];
        SCOPED_TRACE(name + (integers ? ", integers" : ", fractions"));
        const Topology base = topology_of(mesh);
        const Features f = random_features(base, seed, integers);
        const ResolvedFeatures bordered = resolve(base, f);
        if (!has_surface(base, bordered))
            continue;
        // OpenSubdiv averages fractions in float: half an ulp of an edge.
        const double tolerance = integers ? kTol : std::ldexp(1.0, -24);
        EXPECT_LT(worst_distance(mesh, f, f, kLevels), tolerance);
        EXPECT_LT(worst_distance(mesh, f, bordered, 6), tolerance);
    }
}

// A ring of edges with 2 and 3 in turn: averages that tell Chaikin's method from the other,
// and that are exact in float.
TEST(LimitSurface, TakesTheCreaseMethod) {
    const MeshData mesh = random_displaced(torus(5, 6), 8, 0.05);
    const Topology base = topology_of(mesh);
    Features f;
    f.edge_sharpness.resize(base.n_edges);
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        const Index a = base.vertex[h], b = base.to_vertex(h);
        if (a < 6 && b < 6)
            f.edge_sharpness[base.edge[h]] = ((a + 1) % 6 == b ? a : b) % 2 == 0 ? 2 : 3;
    }
    ASSERT_EQ(std::ranges::count(f.edge_sharpness, 0.0), base.n_edges - 6);
    EXPECT_LT(worst_distance(mesh, f, f, kLevels), kTol);
    Features chaikin = f;
    chaikin.creases = CreaseMethod::Chaikin;
    EXPECT_LT(worst_distance(mesh, chaikin, chaikin, kLevels), kTol);
    EXPECT_GT(worst_distance(mesh, chaikin, f, kLevels), 1e-4);
}

// What the header says: sharp above the isolation is smooth.
TEST(LimitSurface, NeedsIsolationForSemiSharpCreases) {
    const MeshData mesh = random_displaced(torus(5, 6), 8, 0.05);
    const Topology base = topology_of(mesh);
    Features f;
    f.edge_sharpness.assign(base.n_edges, 3);
    EXPECT_LT(worst_distance(mesh, f, f, 3), kTol);
    EXPECT_GT(worst_distance(mesh, f, f, 2), 1e-3);
}

TEST(LimitSurface, OfHolesOnlyIsBuilt) {
    const MeshData mesh = grid(2, 2);
    const Topology base = topology_of(mesh);
    Features f;
    f.boundary = BoundaryRule::None;
    EXPECT_TRUE(LimitSurface::build(base, f, mesh.positions, 2));
}

}  // namespace
}  // namespace osdx
