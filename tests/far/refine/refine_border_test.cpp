// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/topology.h>

#include "far/mesh/topology_edits.h"
#include "far/refine/refinement.h"
#include "tests/support/spline_reference.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

// Refinement at borders, creases, corners and in parts.

namespace osdx {
namespace {

using Point = Vec3<double>;
using test::Polygon;

// Points of about 1 to 10, through at most three levels of up to seven factors with short
// rows: some ten ulps of the largest.
constexpr double kTol = 1e-13;

Refinement refined(const MeshData& mesh, int degree, int levels) {
    Refinement r(test::topology_of(mesh), degree, test::features_of(mesh));
    for (int i = 0; i < levels; ++i)
        r.add_level();
    return r;
}

std::vector<test::NamedMesh> open_and_creased_meshes() {
    auto meshes = test::open_meshes();
    for (auto& mesh : test::creased_meshes())
        meshes.push_back(std::move(mesh));
    return meshes;
}

std::string at_degree(const std::string& name, int d) {
    return name + ", degree " + std::to_string(d);
}

TEST(RefineBorder, RowsSumToOne) {
    auto meshes = open_and_creased_meshes();
    for (auto& mesh : test::semi_sharp_meshes())
        meshes.push_back(std::move(mesh));
    for (const auto& [name, mesh] : meshes) {
        for (int d = 2; d <= 8; ++d) {
            SCOPED_TRACE(at_degree(name, d));
            const Refinement r = refined(mesh, d, 2);
            for (int l = 1; l <= 2; ++l) {
                for (const StencilTable& s : r.factors(l)) {
                    for (Index row = 0; row < s.n_rows(); ++row) {
                        double sum = 0;
                        for (std::size_t k = s.offsets[row]; k < s.offsets[row + 1];
                             ++k) {
                            // The hull of the mesh holds the surface.
                            ASSERT_GT(s.weights[k], 0) << "row " << row;
                            sum += s.weights[k];
                        }
                        // Rows of up to 64 + 1 terms.
                        ASSERT_NEAR(sum, 1, 1e-14) << "row " << row;
                    }
                }
            }
        }
    }
}

// ---------------------------------------------------------------------- curves

// Even degrees: the Curve points are the control points of the curve, once from each side of a
// crease. Odd degrees: the vertices on sharp edges are.
TEST(RefineBorder, CurvesAreBSplineCurves) {
    for (const auto& [name, mesh] : open_and_creased_meshes()) {
        const std::vector<test::SharpCurve> curves = test::sharp_curves(mesh);
        ASSERT_FALSE(curves.empty() && name.find("spike") == std::string::npos);
        for (int d = 2; d <= 9; ++d) {
            SCOPED_TRACE(at_degree(name, d));
            const bool even = d % 2 == 0;
            Refinement r = refined(mesh, d, 0);
            for (int l = 1; l <= 3; ++l) {
                r.add_level();
                const RefinedLevel& level = r.level(l);
                const std::vector<Point> all = r.points(mesh.positions);
                std::vector<Point> actual;
                std::vector<bool> is_on_curve(all.size(), false);
                if (even) {
                    for (Index v = 0; v < all.size(); ++v)
                        is_on_curve[v] = level.even->point_kinds[v] == PointKind::Curve;
                } else {
                    for (Index h = 0; h < level.topology.n_halfedges(); ++h) {
                        if (level.features.edge(level.topology.edge[h]) >=
                            kInfinitelySharp)
                            is_on_curve[level.topology.vertex[h]] =
                                is_on_curve[level.topology.to_vertex(h)] = true;
                    }
                }
                for (Index v = 0; v < all.size(); ++v) {
                    if (is_on_curve[v])
                        actual.push_back(all[v]);
                }

                std::vector<bool> used(actual.size(), false);
                std::size_t n_expected = 0, n_compared = 0;
                for (const test::SharpCurve& c : curves) {
                    const auto points = test::refined_polygon(c.polygon, d, l);
                    n_expected += points.size();
                    ASSERT_EQ(points.size(), std::size_t(c.polygon.n_edges() * (1 << l)) +
                                                 (even || c.polygon.is_closed ? 0 : 1));
                    for (std::size_t i = 0; i < points.size(); ++i) {
                        const double t = std::ldexp(double(i) + (even ? 0.5 : 0.0), -l),
                                     reach = 0.5 * (d + 1);
                        if ((c.dart_at_start && t < reach) ||
                            (c.dart_at_end && c.polygon.n_edges() - t < reach))
                            continue;
                        ++n_compared;
                        std::size_t k = 0;
                        while (k < actual.size() &&
                               ((even && used[k]) ||
                                !(glm::distance(actual[k], points[i]) < kTol)))
                            ++k;
                        ASSERT_LT(k, actual.size())
                            << "level " << l << ", point " << i << " of a curve of "
                            << c.polygon.n_edges() << " edges";
                        used[k] = true;
                    }
                }
                if (even) {
                    EXPECT_EQ(actual.size(), n_expected);
                }
                if (n_compared == n_expected) {
                    EXPECT_EQ(std::ranges::count(used, false), 0);
                }
            }
        }
    }
}

// Where a curve begins and ends at corners or is a ring, its points and those of the other side
// of the crease are the same numbers.
TEST(RefineBorder, BothSidesOfACreaseAreEqualBitForBit) {
    for (const auto& [name, mesh] : test::creased_meshes()) {
        const Topology base = test::topology_of(mesh);
        const bool is_ring = name == "ring around a torus" ||
                             name == "cube with a sharp rim" ||
                             name == "cube of sharp edges";
        if (!is_ring)
            continue;
        for (int d = 2; d <= 8; d += 2) {
            SCOPED_TRACE(at_degree(name, d));
            const Refinement r = refined(mesh, d, 3);
            const std::vector<Point> points = r.points(mesh.positions);
            std::map<std::tuple<double, double, double>, int> n_times;
            for (Index v = 0; v < points.size(); ++v) {
                if (r.level(3).even->point_kinds[v] == PointKind::Curve)
                    ++n_times[{points[v].x, points[v].y, points[v].z}];
            }
            EXPECT_FALSE(n_times.empty());
            for (const auto& [p, n] : n_times)
                ASSERT_EQ(n, 2);
        }
    }
}

// ---------------------------------------------------------------------- regular grids

/// The refinement of an open grid of m x n quads that is continued by point reflection at all
/// four sides: rows of the result run along j.
std::vector<std::vector<Point>> refined_grid(const MeshData& mesh, Index m, Index n,
                                             int d, int levels) {
    std::vector<std::vector<Point>> rows, result;
    for (Index i = 0; i <= m; ++i) {
        Polygon row;
        for (Index j = 0; j <= n; ++j)
            row.points.push_back(mesh.positions[i * (n + 1) + j]);
        rows.push_back(test::refined_polygon(row, d, levels));
    }
    for (std::size_t j = 0; j < rows[0].size(); ++j) {
        Polygon column;
        for (const auto& row : rows)
            column.points.push_back(row[j]);
        const auto points = test::refined_polygon(column, d, levels);
        result.resize(points.size());
        for (std::size_t i = 0; i < points.size(); ++i)
            result[i].push_back(points[i]);
    }
    return result;
}

/// A grid of m x n quads with pinned corners.
MeshData bumpy_grid(Index m, Index n) {
    MeshData mesh = test::random_displaced(test::grid(m, n), m * 7 + n, 0.3);
    mesh.tags.push_back({"interpolateboundary", {1}, {}, {}, 0});
    return mesh;
}

/// The points of a level, by where they are when the grid is plane: linear functions are
/// reproduced, so that this is the place in the parameters. Levels of even degree from 1 on
/// leave out the points on the border.
std::map<std::pair<int, int>, std::vector<Point>> by_parameters(const MeshData& mesh,
                                                                const MeshData& plane,
                                                                int d, int levels) {
    const Refinement r = refined(mesh, d, levels);
    const auto points = r.points(mesh.positions), places = r.points(plane.positions);
    const double fine = std::ldexp(1.0, levels + 1);
    std::map<std::pair<int, int>, std::vector<Point>> result;
    for (Index v = 0; v < points.size(); ++v) {
        if (d % 2 == 0 && r.level(levels).even->point_kinds[v] != PointKind::Inner)
            continue;
        const Point at = fine * places[v];
        EXPECT_NEAR(at.x, std::round(at.x), 1e-11) << "vertex " << v;
        EXPECT_NEAR(at.y, std::round(at.y), 1e-11) << "vertex " << v;
        result[{int(std::round(at.x)), int(std::round(at.y))}].push_back(points[v]);
    }
    return result;
}

TEST(RefineBorder, IsTheTensorProductOnGridsThatGoOnByReflection) {
    for (const auto& [m, n] : {std::pair(4u, 5u), {1u, 1u}, {1u, 6u}, {2u, 3u}}) {
        const MeshData mesh = bumpy_grid(m, n);
        for (int d = kMinDegree; d <= kMaxDegree; ++d) {
            for (int l = 1; l <= (d <= 7 ? 3 : 1); ++l) {
                SCOPED_TRACE(std::to_string(m) + " x " + std::to_string(n) + ", degree " +
                             std::to_string(d) + ", level " + std::to_string(l));
                const auto expected = refined_grid(mesh, m, n, d, l);
                const auto actual = by_parameters(mesh, test::grid(m, n), d, l);
                ASSERT_EQ(actual.size(), expected.size() * expected[0].size());
                const int odd = d % 2;
                for (std::size_t i = 0; i < expected.size(); ++i) {
                    for (std::size_t j = 0; j < expected[i].size(); ++j) {
                        const auto at = actual.find({2 * i + 1 - odd, 2 * j + 1 - odd});
                        ASSERT_NE(at, actual.end()) << i << ", " << j;
                        ASSERT_EQ(at->second.size(), 1u);
                        ASSERT_LE(glm::distance(at->second[0], expected[i][j]), kTol)
                            << i << ", " << j;
                    }
                }
            }
        }
    }
}

// A crease straight across a grid: both parts are grids of their own.
TEST(RefineBorder, ACreaseAcrossAGridPartsIt) {
    const Index m = 5, n = 4, at = 2;
    MeshData mesh = bumpy_grid(m, n);
    std::vector<Index> path;
    for (Index j = 0; j <= n; ++j)
        path.push_back(at * (n + 1) + j);
    test::add_crease(mesh, path);
    MeshData lower, upper;
    const auto begin = mesh.positions.begin();
    lower.positions.assign(begin, begin + (at + 1) * (n + 1));
    upper.positions.assign(begin + at * (n + 1), mesh.positions.end());
    for (int d = kMinDegree; d <= 9; ++d) {
        for (int l = 1; l <= 2; ++l) {
            SCOPED_TRACE(std::to_string(d) + ", level " + std::to_string(l));
            const auto actual = by_parameters(mesh, test::grid(m, n), d, l);
            const int odd = d % 2, line = int(at) << (l + 1);
            std::size_t n_points = 0;
            const auto compare = [&](const MeshData& part, Index quads, int shift) {
                const auto expected = refined_grid(part, quads, n, d, l);
                for (std::size_t i = 0; i < expected.size(); ++i) {
                    for (std::size_t j = 0; j < expected[i].size(); ++j) {
                        const auto found = actual.find(
                            {int(2 * i + 1) - odd + shift, int(2 * j + 1) - odd});
                        ASSERT_NE(found, actual.end()) << i << ", " << j;
                        ASSERT_EQ(found->second.size(), 1u);
                        ASSERT_LE(glm::distance(found->second[0], expected[i][j]), kTol)
                            << i << ", " << j;
                        n_points += found->first.first != line || shift == 0;
                    }
                }
            };
            compare(lower, at, 0);
            compare(upper, m - at, line);
            EXPECT_EQ(n_points, actual.size());
        }
    }
}

// ---------------------------------------------------------------------- semi-sharp

MeshData with_sharpness(MeshData mesh, double sharpness) {
    for (Tag& tag : mesh.tags) {
        if (tag.name == "crease" || tag.name == "corner")
            tag.floats = {sharpness};
    }
    return mesh;
}

/// Creases everywhere: rings, darts, junctions, corners, at n-gons and borders.
std::vector<test::NamedMesh> tagged_meshes() {
    auto meshes = test::creased_meshes();
    unsigned seed = 1;
    for (const auto& [name, plain] : open_and_creased_meshes()) {
        MeshData mesh = plain;
        std::mt19937 random(seed++);
        const Topology t = test::topology_of(mesh);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            if (random() % 4 == 0)
                test::add_crease(mesh, {t.vertex[h], t.to_vertex(h)});
        }
        for (Index v = 0; v < t.n_vertices(); ++v) {
            if (random() % 9 == 0)
                test::add_corner(mesh, v);
        }
        meshes.push_back({name + ", tagged at random", std::move(mesh)});
    }
    return meshes;
}

/// The points of the corners of the mesh at level 1: even degrees number those of sharp meshes,
/// that are cut, and of others alike.
std::vector<Point> first_corner_points(const MeshData& mesh, int d) {
    const Refinement r = refined(mesh, d, 1);
    auto points = r.points(mesh.positions);
    if (d % 2 == 0)
        points.resize(r.topology(0).n_halfedges());
    return points;
}

void expect_near(const std::vector<Point>& actual, const std::vector<Point>& expected,
                 double tolerance = kTol) {
    ASSERT_EQ(actual.size(), expected.size());
    for (std::size_t i = 0; i < actual.size(); ++i)
        ASSERT_LE(glm::distance(actual[i], expected[i]), tolerance) << "point " << i;
}

TEST(RefineBorder, SharpnessOfALevelOrMoreIsSharpOnThatLevel) {
    for (const auto& [name, mesh] : tagged_meshes()) {
        for (int d = 2; d <= 9; ++d) {
            SCOPED_TRACE(at_degree(name, d));
            const auto expected = first_corner_points(with_sharpness(mesh, 10), d);
            for (const double s : {1.0, 2.0, 9.5})
                expect_near(first_corner_points(with_sharpness(mesh, s), d), expected);
            if (testing::Test::HasFatalFailure())
                return;
        }
    }
}

/// Largest distance.
double difference(const std::vector<Point>& a, const std::vector<Point>& b) {
    double max = a.size() == b.size() ? 0 : 1e300;
    for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
        max = std::max(max, glm::distance(a[i], b[i]));
    return max;
}

// Sharpness one is spent after a level: what follows is the plain refinement of that mesh.
TEST(RefineBorder, WhatFollowsSharpnessOneIsPlain) {
    int n_meshes = 0;
    for (const auto& [name, tagged] : tagged_meshes()) {
        const MeshData mesh = with_sharpness(tagged, 1);
        const Topology base = test::topology_of(mesh);
        if (std::ranges::count(base.twin, kInvalidIndex) > 0)
            continue;  // the border stays sharp
        ++n_meshes;
        for (int d = 2; d <= 9; ++d) {
            SCOPED_TRACE(at_degree(name, d));
            Refinement r = refined(mesh, d, 1);
            const std::vector<Point> first = r.points(mesh.positions);
            if (d % 2 == 0) {
                EXPECT_TRUE(r.level(1).even->rays.empty());
                EXPECT_TRUE(r.level(1).even->junctions.empty());
            }
            Refinement plain(r.topology(1), d);
            r.add_level();
            plain.add_level();
            expect_near(r.points(mesh.positions), plain.points(first));
            if (mesh.positions.size() < 60) {
                r.add_level();
                plain.add_level();
                expect_near(r.points(mesh.positions), plain.points(first));
            }
            // The tags did something.
            const Refinement smooth = refined(with_sharpness(mesh, 0), d, 1);
            if (d > 2) {
                EXPECT_GT(
                    difference(smooth.points(mesh.positions),
                               std::vector<Point>(
                                   first.begin(),
                                   first.begin() + smooth.topology(1).n_vertices())),
                    1e-3);
            }
        }
    }
    EXPECT_GE(n_meshes, test::fewest(10));
}

// Degrees 3 and 4 have one smoothing a level, in which a fraction mixes the sharp and the
// smooth point. Further smoothings mix what is mixed already.
TEST(RefineBorder, AFractionMixesSharpAndSmooth) {
    for (const auto& [name, mesh] : tagged_meshes()) {
        for (const int d : {3, 4}) {
            SCOPED_TRACE(at_degree(name, d));
            const auto smooth = first_corner_points(with_sharpness(mesh, 0), d),
                       sharp = first_corner_points(with_sharpness(mesh, 2), d);
            for (const double s : {0.25, 0.5, 0.9}) {
                std::vector<Point> mixture;
                for (std::size_t i = 0; i < smooth.size(); ++i)
                    mixture.push_back(s * sharp[i] + (1 - s) * smooth[i]);
                expect_near(first_corner_points(with_sharpness(mesh, s), d), mixture);
            }
        }
        // Between sharp and smooth, and continuous at both ends.
        for (int d = 5; d <= 8; ++d) {
            SCOPED_TRACE(at_degree(name, d));
            const auto smooth = first_corner_points(with_sharpness(mesh, 0), d),
                       sharp = first_corner_points(with_sharpness(mesh, 1), d),
                       half = first_corner_points(with_sharpness(mesh, 0.5), d),
                       little = first_corner_points(with_sharpness(mesh, 1e-9), d),
                       most = first_corner_points(with_sharpness(mesh, 1 - 1e-9), d);
            const double all = difference(smooth, sharp);
            if (all > 0) {  // some have nothing to tag
                EXPECT_GT(difference(half, sharp), 0.2 * all);
                EXPECT_GT(difference(half, smooth), 0.2 * all);
            }
            EXPECT_LT(difference(little, smooth), 1e-7);
            EXPECT_LT(difference(most, sharp), 1e-7);
        }
    }
}

// On the level where the fraction is left, two levels down: degree 2 mixes there alone, and
// others are continuous where the sharpness passes whole numbers.
TEST(RefineBorder, AFractionMixesOnItsLevel) {
    for (const test::NamedMesh& tagged : tagged_meshes()) {
        const MeshData& mesh = tagged.data;
        const Topology base = test::topology_of(mesh);
        if (std::ranges::count(base.twin, kInvalidIndex) > 0)
            continue;  // for the time that it takes
        for (int d = 2; d <= 7; ++d) {
            SCOPED_TRACE(at_degree(tagged.name, d));
            const auto corners = [&](double s) {
                const Refinement r = refined(with_sharpness(mesh, s), d, 2);
                auto points = r.points(mesh.positions);
                if (d % 2 == 0)
                    points.resize(r.topology(1).n_halfedges());
                return points;
            };
            const auto one = corners(1), two = corners(2);
            expect_near(corners(1 + 1e-9), one, 1e-7);
            expect_near(corners(2 - 1e-9), two, 1e-7);
            expect_near(corners(2 + 1e-9), two);  // of the next level
            if (d > 3)
                continue;
            std::vector<Point> mixture;
            for (std::size_t i = 0; i < one.size(); ++i)
                mixture.push_back(0.3 * two[i] + 0.7 * one[i]);
            expect_near(corners(1.3), mixture);
        }
    }
}

TEST(RefineBorder, ChaikinAveragesAlongTheCrease) {
    MeshData mesh = test::random_displaced(test::torus(6, 6), 8, 0.05);
    for (int d = 2; d <= 9; ++d) {
        SCOPED_TRACE(d);
        const auto points = [&](double even, double odd, const char* method, int levels) {
            MeshData tagged = mesh;
            for (Index v = 0; v < 6; ++v)
                test::add_crease(tagged, {v, (v + 1) % 6}, v % 2 == 0 ? even : odd);
            tagged.tags.push_back({"creasemethod", {}, {}, {method}, 0});
            const Refinement r = refined(tagged, d, levels);
            if (levels == 1 && even != odd) {
                // What is left next to the vertices: 3/4 of the edge's own, 1/4 of the other.
                const bool chaikin = method == std::string("chaikin");
                int n_low = 0, n_high = 0;
                const auto count = [&](double s) {
                    n_low += s == (chaikin ? 0.5 : 0.25);
                    n_high += s == (chaikin ? 1.0 : 1.25);
                };
                if (d % 2 == 0) {
                    for (const Ray& ray : r.level(1).even->rays)
                        count(ray.sharpness);
                }
                for (const double s : r.level(1).features.edge_sharpness)
                    count(s);
                EXPECT_EQ(n_low, 6);
                EXPECT_EQ(n_high, 6);
            }
            return r.points(mesh.positions);
        };
        // Alike on both sides of every vertex: the same averages.
        EXPECT_EQ(points(1.75, 1.75, "chaikin", 3), points(1.75, 1.75, "normal", 3));
        // 2.25 and 1.25 become 1 and 0.5: all at once on level 3. Without averages 1.25 and
        // 0.25. The first level is sharp either way.
        EXPECT_EQ(points(2.25, 1.25, "chaikin", 1), points(2.25, 1.25, "normal", 1));
        EXPECT_GT(
            difference(points(2.25, 1.25, "chaikin", 3), points(2.25, 1.25, "normal", 3)),
            1e-4);
    }
}

// ---------------------------------------------------------------------- parts

/// Halfedges, vertices and so on of a part of a level in the whole level.
struct PartMap {
    std::vector<Index> halfedges, vertices;
};

/// From the map of the level above.
PartMap descend(const Refinement& part, const Refinement& whole, int l,
                const PartMap& above) {
    const bool odd = part.degree() % 2 == 1;
    const RefinedLevel &p = part.level(l), &w = whole.level(l);
    const Topology &t = p.topology, &full = w.topology;
    PartMap map;
    map.halfedges.assign(t.n_halfedges(), kInvalidIndex);
    map.vertices.assign(t.n_vertices(), kInvalidIndex);
    std::vector<std::pair<Index, Index>> open;
    for (Index h = 0; h < part.topology(l - 1).n_halfedges(); ++h) {
        const Index child = p.children[h];
        if (child == kInvalidIndex)
            continue;
        const Index full_child = w.children[above.halfedges[h]];
        EXPECT_EQ(full_child, above.halfedges[h]);
        if (odd) {
            open.emplace_back(4 * child, 4 * full_child);
        } else {
            map.vertices[child] = full_child;
            if (p.even->corner_halfedges[child] != kInvalidIndex)
                open.emplace_back(p.even->corner_halfedges[child],
                                  w.even->corner_halfedges[full_child]);
        }
    }
    // What is next to, or across from, what is known to be the same is the same.
    while (!open.empty()) {
        const auto [h, g] = open.back();
        open.pop_back();
        if (map.halfedges[h] != kInvalidIndex) {
            EXPECT_EQ(map.halfedges[h], g);
            continue;
        }
        map.halfedges[h] = g;
        Index& v = map.vertices[t.vertex[h]];
        EXPECT_TRUE(v == kInvalidIndex || v == full.vertex[g]);
        v = full.vertex[g];
        EXPECT_EQ(t.face_size(t.face(h)), full.face_size(full.face(g)));
        open.emplace_back(t.next(h), full.next(g));
        if (t.is_border(h)) {
            // A border that is none of the whole mesh is a gap.
            EXPECT_EQ(p.is_gap(t.edge[h]), !full.is_border(g)) << "halfedge " << h;
        } else {
            open.emplace_back(t.twin[h], full.twin[g]);
            EXPECT_FALSE(p.is_gap(t.edge[h]));
        }
        if (!odd && !w.even->rays.empty() && full.edge[g] < w.even->edge_rays.size() &&
            w.even->edge_rays[full.edge[g]] != kInvalidIndex) {
            EXPECT_FALSE(p.even->rays.empty());
            const Index ray =
                p.even->rays.empty() ? kInvalidIndex : p.even->edge_rays[t.edge[h]];
            EXPECT_NE(ray, kInvalidIndex) << "a ray is lost";
            if (ray == kInvalidIndex)
                continue;
            const Ray& whole_ray = w.even->rays[w.even->edge_rays[full.edge[g]]];
            EXPECT_EQ(p.even->rays[ray].sharpness, whole_ray.sharpness);
            map.vertices[p.even->rays[ray].point] = whole_ray.point;
        }
    }
    for (const Junction& j : odd ? std::vector<Junction>() : p.even->junctions) {
        const Index g = map.halfedges[t.face_offsets[j.face]];
        if (g == kInvalidIndex)
            continue;
        const auto found =
            std::ranges::find(w.even->junctions, full.face(g), &Junction::face);
        EXPECT_NE(found, w.even->junctions.end());
        if (found == w.even->junctions.end())
            continue;
        EXPECT_EQ(j.n_sharp, found->n_sharp);
        EXPECT_EQ(j.vertex_sharpness, found->vertex_sharpness);
        EXPECT_EQ(j.rays, found->rays);
        map.vertices[j.point] = found->point;
    }
    return map;
}

struct PartCounts {
    std::size_t known = 0, unknown = 0;
};

/// Refines a part, and less and less of it, and compares the points that are known with those
/// of the whole. What is not known is made no number on the way.
void expect_part_of_whole(const MeshData& mesh, int d, int levels, unsigned seed,
                          PartCounts& counts) {
    const Refinement whole = refined(mesh, d, levels);
    Refinement part = refined(mesh, d, 0), whole_so_far = refined(mesh, d, 0);
    std::mt19937 random(seed);
    PartMap map;
    for (Index h = 0; h < part.topology(0).n_halfedges(); ++h)
        map.halfedges.push_back(h);
    std::vector<Point> points = part.points(mesh.positions);
    std::vector<Flags> wanted(1);
    std::vector<std::vector<Point>> points_of_level(1);
    for (int l = 1; l <= levels; ++l) {
        const Topology& parent = part.topology(l - 1);
        // The surroundings of a face in the middle of what there is.
        Flags keep(parent.n_faces(), false);
        if (parent.n_faces() > 0)
            keep[random() % parent.n_faces()] = true;
        part.add_level(grown(parent, keep, d / 2 + 1));
        whole_so_far.add_level();
        map = descend(part, whole, l, map);
        if (testing::Test::HasFailure())
            return;

        const RefinedLevel& level = part.level(l);
        for (const StencilTable& factor : part.factors(l)) {
            std::vector<Point> next(factor.n_rows());
            factor.apply(std::span<const Point>(points), std::span(next));
            points = std::move(next);
        }
        const std::vector<Point> expected = whole_so_far.points(mesh.positions);
        ASSERT_EQ(points.size(), level.topology.n_vertices());
        for (Index v = 0; v < points.size(); ++v) {
            if (!level.is_known(v)) {
                ++counts.unknown;
                points[v] = Point(std::numeric_limits<double>::quiet_NaN());
                continue;
            }
            if (map.vertices[v] == kInvalidIndex)
                continue;  // beside no face that there is
            ++counts.known;
            // The same sums in another order at most.
            ASSERT_LE(glm::distance(points[v], expected[map.vertices[v]]), kTol)
                << "level " << l << ", vertex " << v;
        }
        Flags& some = wanted.emplace_back(points.size());
        for (Index v = 0; v < points.size(); ++v)
            some[v] = level.is_known(v) && random() % 3 == 0;
        points_of_level.push_back(points);
    }
    // The chain makes the same sums: equal bits.
    const Refinement::Chain chain = part.chain(wanted);
    const auto n_base = static_cast<Index>(mesh.positions.size());
    std::vector<Point> values = mesh.positions;
    values.resize(n_base + chain.rows.n_rows());
    chain.rows.extend(n_base, 3, std::span(&values[0].x, 3 * values.size()));
    for (std::size_t l = 1; l < wanted.size(); ++l) {
        for (Index v = 0; v < wanted[l].size(); ++v) {
            if (wanted[l][v]) {
                ASSERT_EQ(values[chain.place[l][v]], points_of_level[l][v])
                    << "level " << l << ", vertex " << v;
            }
        }
    }
}

TEST(RefineBorder, PartsAreAsTheWhole) {
    auto meshes = tagged_meshes();
    for (auto& mesh : test::open_meshes())
        meshes.push_back(std::move(mesh));
    for (auto& mesh : test::closed_meshes())
        meshes.push_back(std::move(mesh));
    for (auto& mesh : test::semi_sharp_meshes())
        meshes.push_back(std::move(mesh));
    const std::size_t n = meshes.size();
    for (std::size_t i = 0; i < n; ++i)
        meshes.push_back({meshes[i].name + ", 2.5", with_sharpness(meshes[i].data, 2.5)});
    unsigned seed = 1;
    for (int d = 2; d <= 7; ++d) {
        PartCounts counts;
        for (const auto& [name, mesh] : meshes) {
            if (++seed % 4 != 0)
                continue;
            SCOPED_TRACE(at_degree(name, d) + ", seed " + std::to_string(seed));
            expect_part_of_whole(mesh, d, 3, seed, counts);
            if (testing::Test::HasFailure())
                return;
        }
        EXPECT_GT(counts.known, std::size_t(test::fewest(3000))) << "degree " << d;
        if (d > 2) {
            EXPECT_GT(counts.unknown, std::size_t(test::fewest(1000))) << "degree " << d;
        }
    }
}

// Of what is beside a gap after the first smoothing nothing is known, and each one after it
// moves on by a ring: so much is lost, and no more.
TEST(RefineBorder, OnlyWhatIsCloseToAGapIsUnknown) {
    const MeshData mesh = test::random_displaced(test::grid(14, 14), 1, 0.1);
    for (int d = 2; d <= 9; ++d) {
        SCOPED_TRACE(d);
        Refinement r = refined(mesh, d, 0);
        Flags keep(r.topology(0).n_faces(), false);
        keep[3 * 14 + 1] = true;
        r.add_level(grown(r.topology(0), keep, 5));
        const RefinedLevel& level = r.level(1);
        const Topology& t = level.topology;
        std::vector<bool> near(t.n_vertices(), false);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            if (t.is_border(h) && level.is_gap(t.edge[h]))
                near[t.vertex[h]] = near[t.to_vertex(h)] = true;
        }
        EXPECT_GT(std::ranges::count(near, true), 10);
        const int smoothings = d % 2 == 1 ? (d - 1) / 2 : (d - 2) / 2;
        if (smoothings == 0)
            near.assign(near.size(), false);
        for (int i = 1; i < smoothings; ++i) {
            const std::vector<bool> before = near;
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                for (Index g = t.next(h); g != h; g = t.next(g)) {
                    if (before[t.vertex[g]])
                        near[t.vertex[h]] = true;
                }
            }
        }
        std::size_t n_known = 0;
        for (Index v = 0; v < t.n_vertices(); ++v) {
            EXPECT_EQ(level.is_known(v), !near[v]) << "vertex " << v;
            n_known += level.is_known(v);
        }
        EXPECT_GT(n_known, 20u);
    }
}

TEST(RefineBorder, AllOfALevelIsTheLevelAndNoneIsEmpty) {
    for (const auto& [name, mesh] : tagged_meshes()) {
        for (const int d : {2, 3, 4, 5}) {
            SCOPED_TRACE(at_degree(name, d));
            Refinement all = refined(mesh, d, 0), none = refined(mesh, d, 0);
            all.add_level(Flags(all.topology(0).n_faces(), true));
            none.add_level(Flags(none.topology(0).n_faces(), false));
            const Refinement whole = refined(mesh, d, 1);
            EXPECT_EQ(all.topology(1).twin, whole.topology(1).twin);
            EXPECT_EQ(all.topology(1).edge, whole.topology(1).edge);
            EXPECT_EQ(std::ranges::count(all.level(1).gap, true), 0);
            EXPECT_EQ(std::ranges::count(all.level(1).known, false), 0);
            EXPECT_EQ(none.topology(1).n_faces(), 0u);
            EXPECT_EQ(none.topology(1).n_halfedges(), 0u);
            EXPECT_EQ(std::ranges::count(none.level(1).children, kInvalidIndex),
                      none.topology(0).n_halfedges());
        }
    }
}

}  // namespace
}  // namespace osdx
