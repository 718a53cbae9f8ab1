// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/address.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

constexpr Index kSizes[] = {3, 4, 5, 6, 9, 10, 17};

/// A mesh whose face 0 has n sides.
Topology mesh_with_face(Index n) {
    return test::topology_of(test::prism(n));
}

/// Tiles in a row, by search instead of a square root.
int tiles(Index n) {
    if (n == 3)
        return 2;
    int row = 3;
    while (n > 9 && row * row < int(n))
        ++row;
    return row;
}

// Coordinates are sums of an integer below 8 and a half of x: three bits are lost.
constexpr double kTol = 8 * 2.3e-16;

void expect_same(const QuarterPoint& actual, const QuarterPoint& expected) {
    EXPECT_EQ(actual.quarter, expected.quarter);
    EXPECT_NEAR(actual.x, expected.x, kTol);
    EXPECT_NEAR(actual.y, expected.y, kTol);
}

std::vector<Vec2<double>> inner_points() {
    std::vector<Vec2<double>> points;
    std::mt19937 random(5);
    const auto next = [&] { return (double(random()) + 1) / 4294967298.0; };
    for (int i = 0; i < 20; ++i) {
        const double x = next();
        points.emplace_back(x, next());
    }
    return points;
}

TEST(Address, RoundTrip) {
    for (const Index n : kSizes) {
        SCOPED_TRACE(n);
        const Topology t = mesh_with_face(n);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            for (const auto& p : inner_points()) {
                const Address a = to_address(t, {h, p.x, p.y});
                EXPECT_EQ(a.face, t.face(h));
                expect_same(to_quarter(t, a), {h, p.x, p.y});
            }
        }
    }
}

TEST(Address, QuadHasTheUnitSquare) {
    const Topology t = test::topology_of(test::cube());
    const double corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        const Index i = h - t.face_offsets[t.face(h)];
        const auto& here = corner[i];
        const auto& next = corner[(i + 1) % 4];
        const auto& before = corner[(i + 3) % 4];
        const Address at_corner = to_address(t, {h, 0, 0});
        EXPECT_EQ(at_corner.u, here[0]);
        EXPECT_EQ(at_corner.v, here[1]);
        const Address leaving = to_address(t, {h, 1, 0});
        EXPECT_EQ(leaving.u, (here[0] + next[0]) / 2);
        EXPECT_EQ(leaving.v, (here[1] + next[1]) / 2);
        const Address entering = to_address(t, {h, 0, 1});
        EXPECT_EQ(entering.u, (here[0] + before[0]) / 2);
        EXPECT_EQ(entering.v, (here[1] + before[1]) / 2);
        const Address centre = to_address(t, {h, 1, 1});
        EXPECT_EQ(centre.u, 0.5);
        EXPECT_EQ(centre.v, 0.5);
    }
}

TEST(Address, OtherFacesHaveTiles) {
    for (const Index n : kSizes) {
        if (n == 4)
            continue;
        SCOPED_TRACE(n);
        const Topology t = mesh_with_face(n);
        const int row = tiles(n);
        for (Index i = 0; i < n; ++i) {
            const Index h = t.face_offsets[0] + i;
            const int column = int(i) % row, line = int(i) / row;
            const double u = column, v = line;
            const Address corner = to_address(t, {h, 0, 0});
            EXPECT_EQ(corner.u, u);
            EXPECT_EQ(corner.v, v);
            const Address leaving =
                to_address(t, {h, 1, 0});  // u runs towards corner i + 1
            EXPECT_EQ(leaving.u, u + 0.5);
            EXPECT_EQ(leaving.v, v);
            const Address entering = to_address(t, {h, 0, 1});
            EXPECT_EQ(entering.u, u);
            EXPECT_EQ(entering.v, v + 0.5);
            const Address centre = to_address(t, {h, 1, 1});
            EXPECT_EQ(centre.u, u + 0.5);
            EXPECT_EQ(centre.v, v + 0.5);
        }
    }
}

TEST(Address, PrintedRowsOfTiles) {
    // DESIGN: D = 2 for N = 3, 3 for N = 5..9, else 1 + floor(sqrt(N - 1)).
    const std::pair<Index, double> first_of_second_row[] = {
        {3, 2}, {5, 3}, {6, 3}, {9, 3}, {10, 4}, {16, 4}, {17, 5}, {26, 6}};
    for (const auto& [n, corner] : first_of_second_row) {
        SCOPED_TRACE(n);
        const Topology t = mesh_with_face(n);
        const Address a = to_address(t, {t.face_offsets[0] + Index(corner), 0, 0});
        EXPECT_EQ(a.u, 0.0);
        EXPECT_EQ(a.v, 1.0);
    }
}

TEST(Address, OutOfRangeIsClamped) {
    const Topology quads = test::topology_of(test::cube());
    const Address quad = to_address(quads, to_quarter(quads, {2, 1.5, -0.25}));
    EXPECT_EQ(quad.face, 2u);
    EXPECT_EQ(quad.u, 1.0);
    EXPECT_EQ(quad.v, 0.0);
    for (const Index n : {3u, 5u, 17u}) {
        SCOPED_TRACE(n);
        const Topology t = mesh_with_face(n);
        for (const double u : {-3.0, 0.75, 2.5, 100.0}) {
            for (const double v : {-3.0, 0.75, 2.5, 100.0}) {
                const QuarterPoint q = to_quarter(t, {0, u, v});
                EXPECT_EQ(t.face(q.quarter), 0u);
                EXPECT_TRUE(q.x >= 0 && q.x <= 1 && q.y >= 0 && q.y <= 1);
            }
        }
        const QuarterPoint beyond = to_quarter(t, {0, 0.75, 0.25});
        expect_same(beyond, {t.face_offsets[0], 1, 0.5});
        // What rounding leaves just below a tile belongs to the tile.
        const QuarterPoint below = to_quarter(t, {0, 1 - 1e-12, 0.25});
        expect_same(below, {t.face_offsets[0] + 1, 0, 0.5});
    }
}

TEST(Address, DerivativeIsTwiceTheRotation) {
    for (const Index n : kSizes) {
        SCOPED_TRACE(n);
        const Topology t = mesh_with_face(n);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            const Address a = to_address(t, {h, 0.5, 0.5});
            const QuarterPoint along_u = to_quarter(t, {a.face, a.u + 0.125, a.v});
            const QuarterPoint along_v = to_quarter(t, {a.face, a.u, a.v + 0.125});
            const int turns = quarter_turns(t, h);
            const auto du = turn(Vec2<double>(0.25, 0), turns);
            const auto dv = turn(Vec2<double>(0, 0.25), turns);
            expect_same(along_u, {h, 0.5 + du.x, 0.5 + du.y});
            expect_same(along_v, {h, 0.5 + dv.x, 0.5 + dv.y});
        }
    }
}

TEST(Address, TurnsAreCounterClockwise) {
    const Vec2<double> p(3, 1);
    const Vec2<double> turned[] = {{3, 1}, {-1, 3}, {-3, -1}, {1, -3}};
    for (int k = -8; k < 8; ++k)
        EXPECT_EQ(turn(p, k), turned[(k + 8) % 4]) << k;
    const Vec2<int> corners[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (int k = 0; k < 4; ++k)
        EXPECT_EQ(square_corner<int>(k), corners[k]) << k;
}

QuarterPoint on_side(Index quarter, int side, double t) {
    const double sides[4][2] = {{t, 0}, {1, t}, {t, 1}, {0, t}};
    return {quarter, sides[side][0], sides[side][1]};
}

int side_of(const QuarterPoint& p) {
    return p.y == 0 ? 0 : p.x == 1 ? 1 : p.y == 1 ? 2 : 3;
}

/// The bilinear position in the quarter: continuous over the mesh, and generic positions
/// tell its points apart.
Vec3<double> position(const Topology& t, const std::vector<Vec3<double>>& points,
                      const QuarterPoint& p) {
    const Index h = p.quarter;
    const auto corner = points[t.vertex[h]];
    const auto leaving = 0.5 * (corner + points[t.to_vertex(h)]);
    const auto entering = 0.5 * (corner + points[t.vertex[t.prev(h)]]);
    Vec3<double> centre(0.0);
    const Index f = t.face(h);
    for (Index g = t.face_offsets[f]; g < t.face_offsets[f + 1]; ++g)
        centre += points[t.vertex[g]] / double(t.face_size(f));
    return (1 - p.x) * (1 - p.y) * corner + p.x * (1 - p.y) * leaving +
           p.x * p.y * centre + (1 - p.x) * p.y * entering;
}

// Positions are about 1 and sums of some ten terms.
constexpr double kPositionTol = 1e-14;

void expect_same_position(const Vec3<double>& a, const Vec3<double>& b) {
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(a[c], b[c], kPositionTol);
}

void expect_the_same_point_elsewhere(const std::vector<test::NamedMesh>& meshes) {
    for (const auto& [name, mesh] : meshes) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(mesh);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            for (int side = 0; side < 4; ++side) {
                const QuarterPoint p = on_side(h, side, 0.375);
                const QuarterPoint q = cross_side(t, p, side);
                const bool beyond = (side == 0 && t.is_border(h)) ||
                                    (side == 3 && t.is_border(t.prev(h)));
                EXPECT_EQ(q.quarter == kInvalidIndex, beyond);
                if (q.quarter == kInvalidIndex)
                    continue;
                EXPECT_NE(q.quarter, h);
                expect_same_position(position(t, mesh.positions, q),
                                     position(t, mesh.positions, p));
                const QuarterPoint back = cross_side(t, q, side_of(q));
                EXPECT_EQ(back.quarter, h);
                EXPECT_EQ(back.x, p.x);
                EXPECT_EQ(back.y, p.y);
            }
        }
    }
}

TEST(Address, CrossSideIsTheSamePointElsewhere) {
    expect_the_same_point_elsewhere(test::closed_meshes());
}

TEST(Address, CrossSideEndsAtBorders) {
    expect_the_same_point_elsewhere(test::open_meshes());
}

TEST(Address, SidesLieOnTheirEdges) {
    const MeshData mesh = test::dodecahedron();
    const Topology t = test::topology_of(mesh);
    for (Index q = 0; q < t.n_halfedges(); ++q) {
        for (int side = 0; side < 4; ++side) {
            const Index h = halfedge_of_side(t, q, side);
            EXPECT_EQ(h == kInvalidIndex, side == 1 || side == 2);
            if (h == kInvalidIndex)
                continue;
            EXPECT_EQ(t.face(h), t.face(q));
            // Quarters run from a corner: the first half of a side, the second of another.
            const QuarterPoint p = on_side(q, side, 0.5);
            expect_same_position(
                position(t, mesh.positions, p),
                position(t, mesh.positions, edge_point(t, h, side == 0 ? 0.25 : 0.75)));
        }
    }
}

TEST(Address, EdgePointRunsAlongTheEdge) {
    for (const auto& [name, mesh] : test::closed_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(mesh);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            for (int k = 0; k <= 8; ++k) {
                const double s = k / 8.0;
                const QuarterPoint p = edge_point(t, h, s);
                EXPECT_EQ(t.face(p.quarter), t.face(h));
                const auto expected = (1 - s) * mesh.positions[t.vertex[h]] +
                                      s * mesh.positions[t.to_vertex(h)];
                expect_same_position(position(t, mesh.positions, p), expected);
                const QuarterPoint twin = edge_point(t, t.twin[h], 1 - s);
                expect_same_position(position(t, mesh.positions, twin), expected);
            }
        }
    }
}

}  // namespace
}  // namespace osdx
