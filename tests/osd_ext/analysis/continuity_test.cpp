// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/analysis/continuity.h>
#include <osdx/build_patch_table.h>
#include <osdx/evaluator.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "eval/bases/jet.h"
#include "eval/bases/patch_basis.h"
#include "tests/support/high_orders.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx::test {
namespace {

Surface build(const MeshData& mesh, int degree) {
    auto s = Surface::build(mesh, {.degree = degree});
    if (!s)
        throw std::runtime_error(s.error().message);
    return *std::move(s);
}

// ------------------------------------------------------------------------ patch edges

/// The same point of a patch edge in the two patches, and a point further along, with the
/// first patch on the left.
struct EdgePoint {
    PatchPoint left, left_ahead, right, right_ahead;
    bool is_sharp = false;  ///< on an infinitely sharp edge: smooth on each side alone
};

/// Two points on every side of every cell that lies between two patches.
std::vector<EdgePoint> edge_points(const Surface& s) {
    const PatchTable& table = s.patches();
    std::vector<EdgePoint> points;
    for (const Cell& cell : table.cells()) {
        if (!table.has_surface(s.base().face(cell.quarter)))
            continue;
        for (int side = 0; side < 4; ++side) {
            const Vec2<double> along = turn(cell.x_axis, side), out = turn(along, 3);
            const auto corner = square_corner<double>(side);
            const Vec2<double> start =
                cell.origin + corner.x * cell.x_axis + corner.y * turn(cell.x_axis, 1);
            bool is_sharp = false;
            const auto locate = [&](double t, bool left) {
                const Vec2<double> q = start + t * along;
                QuarterPoint at{cell.quarter, q.x, q.y};
                if (left)
                    return table.locate(at, -out);
                const int crossed = q.y == 0 && out.y < 0   ? 0
                                    : q.x == 1 && out.x > 0 ? 1
                                    : q.y == 1 && out.y > 0 ? 2
                                    : q.x == 0 && out.x < 0 ? 3
                                                            : -1;
                if (crossed < 0)
                    return table.locate(at, out);
                at = cross_side(s.base(), at, crossed);
                if (at.quarter == kInvalidIndex ||
                    !table.has_surface(s.base().face(at.quarter)))
                    return PatchPoint{};
                const Index h = halfedge_of_side(s.base(), cell.quarter, crossed);
                is_sharp = h != kInvalidIndex &&
                           s.features().edge(s.base().edge[h]) >= kInfinitelySharp;
                // Along sides 0 and 2 x becomes y: a quarter turn; the others turn back.
                return table.locate(at, turn(out, crossed % 2 == 0 ? 1 : 3));
            };
            // Dyadic, hence exact, and off the corners of cells on the other side.
            for (const double t : {9.0 / 32, 23.0 / 32}) {
                const double ahead = t + 1.0 / 32;
                EdgePoint e{locate(t, true), locate(ahead, true), locate(t, false),
                            locate(ahead, false)};
                e.is_sharp = is_sharp;
                if (e.right.patch != kInvalidIndex && e.left.patch != e.right.patch)
                    points.push_back(e);
            }
        }
    }
    return points;
}

// ------------------------------------------------------------------------ spline charts

constexpr int kOrder = 6;
using J = Jet<double, kOrder>;
using J3 = std::array<J, 3>;

/// f(x, y), whose arguments have no values.
J compose(const J& f, const J& x, const J& y) {
    const JetPowers<double, kOrder> px(x), py(y);
    J sum;
    for (int m = 0; m <= kOrder; ++m) {
        for (int j = 0; j <= m; ++j)
            sum += f.c[J::index(m - j, j)] * (px.power[m - j] * py.power[j]);
    }
    return sum;
}

/// The x and y for which s(x, y) and t(x, y) are the variables, up to values.
std::pair<J, J> inverse(J s, J t) {
    const double a = s.c[1], b = s.c[2], c = t.c[1], d = t.c[2], det = a * d - b * c;
    J u, v;
    u.c[1] = v.c[2] = 1;
    s.c[0] = s.c[1] = s.c[2] = t.c[0] = t.c[1] = t.c[2] = 0;
    J x, y;
    for (int k = 0; k < kOrder; ++k) {  // each step is right to one order more
        const J p = u - compose(s, x, y), q = v - compose(t, x, y);
        x = (1 / det) * (d * p - b * q);
        y = (1 / det) * (a * q - c * p);
    }
    return {x, y};
}

/// s_i and h_i of an n-gon by Wachspress' coordinates, as they are published.
/// Source: see PatchBasis.
std::pair<J, J> side_parameters(int n, int i, Vec2<double> xy) {
    J x(xy.x), y(xy.y);
    x.c[1] = y.c[2] = 1;
    const double pi = std::numbers::pi;
    std::vector<J> l;
    for (int k = 0; k < n; ++k) {
        const double angle = 2 * pi * (k - 0.5) / n;
        l.push_back(J(std::cos(pi / n)) - std::cos(angle) * x - std::sin(angle) * y);
    }
    J sum, at_end, at_start;
    for (int v = 0; v < n; ++v) {
        J w(1.0);
        for (int k = 0; k < n; ++k) {
            if (k != v && k != (v + 1) % n)
                w = w * l[k];
        }
        sum += w;
        if (v == i)
            at_end = w;
        if (v == (i + n - 1) % n)
            at_start = w;
    }
    return {at_end / (at_end + at_start), J(1.0) - (at_end + at_start) / sum};
}

/// The same on a side of the triangle (1,0), (0,1), (-1,0), the domain of one sector at a smooth
/// border: half a side of what the border mirrors.
std::pair<J, J> triangle_parameters(int side, Vec2<double> xy) {
    J x(xy.x), y(xy.y);
    x.c[1] = y.c[2] = 1;
    const J one(1.0), first = 0.5 * (one + x - y), last = 0.5 * (one - x - y);
    const J half = 0.5 * y / (y + (side == 0 ? first : last));
    return {side == 0 ? J(0.5) + half : J(0.5) - half, 0.5 * (side == 0 ? last : first)};
}

/// Made once for each class.
const PatchBasis& basis_of(const PatchClass& c) {
    static std::map<PatchClass, PatchBasis> bases;
    return bases.try_emplace(c, c).first->second;
}

/// The surface at a point of a patch edge in the parameters of the B-spline there, in edges
/// of the base mesh: the first runs along the edge, the second to the left of it.
J3 in_spline_parameters(const Surface& s, const PatchPoint& at, const PatchPoint& ahead,
                        bool on_the_left) {
    const PatchTable& table = s.patches();
    const PatchRef patch = table.patch(at.patch);
    const PatchBasis& basis = basis_of(table.class_of(at.patch));
    const PatchClass& c = basis.patch_class();
    const DomainPoint p{static_cast<int>(at.sector), at.a, at.b};
    J3 f;
    const J sum =
        basis.for_each_weight<kOrder>(p, Chart::Native, [&](Index i, const J& w) {
            for (int k = 0; k < 3; ++k)
                f[k] += s.points()[patch.points[i]][k] * w;
        });
    // Native coordinates as functions of the parameters.
    J x, y;
    if (c.kind == PatchKind::Regular) {
        const double da = ahead.a - at.a, db = ahead.b - at.b;
        const double a = (da > 0) - (da < 0), b = (db > 0) - (db < 0);
        x.c[1] = a, x.c[2] = -b;
        y.c[1] = b, y.c[2] = a;
    } else {
        const int side =
            static_cast<int>(at.a == 1 ? at.sector : at.sector + 1) % c.n_polygon();
        const bool is_triangle = c.n_sectors == 1 && c.border == PatchBorder::Smooth;
        const double intervals = c.kind == PatchKind::EV ? c.degree - 1 : c.degree;
        // Sides run counter-clockwise, the patch on their left.
        const double sign = on_the_left ? 1 : -1;
        const auto [along, inwards] =
            is_triangle ? triangle_parameters(side, basis.to_native(p))
                        : side_parameters(c.n_polygon(), side, basis.to_native(p));
        std::tie(x, y) = inverse(sign * intervals * along, sign * intervals * inwards);
    }
    for (J& g : f) {
        g = compose(g / sum, x, y);
        for (int m = 0; m <= kOrder; ++m) {
            for (int j = 0; j <= m; ++j)
                g.c[J::index(m - j, j)] *= std::ldexp(1.0, patch.level * m);
        }
    }
    return f;
}

/// The largest coefficient of one order; not a number if one is not.
double order_max(const J& x, int m) {
    double max = 0;
    for (int j = 0; j <= m; ++j) {
        const double value = std::abs(x.c[J::index(m - j, j)]);
        if (value > max || std::isnan(value))
            max = value;
    }
    return max;
}

/// A quad face becomes five: a smaller one within, and one at each side.
MeshData inset(MeshData mesh, Index face) {
    Index first = 0;
    for (Index f = 0; f < face; ++f)
        first += mesh.face_sizes[f];
    const std::array v = {mesh.face_vertices[first], mesh.face_vertices[first + 1],
                          mesh.face_vertices[first + 2], mesh.face_vertices[first + 3]};
    Vec3<double> centre(0);
    for (const Index i : v)
        centre += 0.25 * mesh.positions[i];
    const auto inner = static_cast<Index>(mesh.positions.size());
    for (Index i = 0; i < 4; ++i) {
        mesh.positions.push_back(0.5 * (centre + mesh.positions[v[i]]));
        mesh.face_vertices[first + i] = inner + i;
        const Index next = (i + 1) % 4;
        mesh.face_sizes.push_back(4);
        mesh.face_vertices.insert(mesh.face_vertices.end(),
                                  {v[i], v[next], inner + next, inner + i});
    }
    return mesh;
}

/// The patch of pole 0 is of level 0, and next to a region of finer ones: the far corner of
/// its control net is a vertex that is not isolated.
MeshData pole_near_small_patches(int degree) {
    const auto d = static_cast<Index>(degree), k = d + 1;
    return random_displaced(inset(pole(5, k, 2), 2 * (d - 1) * k), 5, 0.02);
}

struct EdgeCounts {
    int mixed = 0;       ///< multisided and regular
    int levels = 0;      ///< of these, of different levels
    double order_d = 0;  ///< largest jump of order d, which is free
};

/// Compares both sides of patch edges, up to n of them.
EdgeCounts expect_order_d_minus_one(const Surface& s, std::size_t n,
                                    double tolerance = 1e-13) {
    const PatchTable& table = s.patches();
    const int d = table.degree();
    const auto is_regular = [&](const PatchPoint& p) {
        return table.class_of(p.patch).kind == PatchKind::Regular;
    };
    std::vector<EdgePoint> regular, others;
    for (const EdgePoint& e : edge_points(s)) {
        if (e.is_sharp)
            continue;
        (is_regular(e.left) && is_regular(e.right) ? regular : others).push_back(e);
    }
    EdgeCounts counts;
    const auto compare = [&](const std::vector<EdgePoint>& edges, std::size_t most) {
        // An odd step: both points of an edge, all sides and all levels come up.
        const std::size_t step = edges.size() / std::max<std::size_t>(most, 1) | 1;
        for (std::size_t i = 0; i < edges.size(); i += step) {
            const EdgePoint& e = edges[i];
            const J3 left = in_spline_parameters(s, e.left, e.left_ahead, true),
                     right = in_spline_parameters(s, e.right, e.right_ahead, false);
            const int level_left = table.patch(e.left.patch).level,
                      level_right = table.patch(e.right.patch).level,
                      level = std::max(level_left, level_right);
            if (is_regular(e.left) != is_regular(e.right)) {
                ++counts.mixed;
                counts.levels += level_left != level_right;
            }
            for (int k = 0; k < 3; ++k) {
                const J jump = left[k] - right[k];
                for (int m = 0; m < d; ++m) {
                    // In edges of its own level a patch is right to a few hundred ulps of
                    // the points, which are about 1.
                    EXPECT_LE(order_max(jump, m), tolerance * std::ldexp(1.0, level * m))
                        << "order " << m << " patches " << e.left.patch << " "
                        << e.right.patch;
                }
                if (d <= kOrder)
                    counts.order_d = std::max(counts.order_d, order_max(jump, d));
            }
        }
    };
    compare(regular, n / 4);
    compare(others, n);
    return counts;
}

// Every patch is, at its sides, the one B-spline of the regular mesh there: the two sides
// agree in all derivatives below d, whatever kinds and levels of patches meet.
TEST(Continuity, IsOfOrderDMinusOneInTheSplineParameters) {
    for (const auto& [name, mesh] : closed_meshes()) {
        for (const int d : test::thinned<int>({2, 3, 4, 5, 6, 7})) {
            SCOPED_TRACE(name + " d" + std::to_string(d));
            const EdgeCounts counts = expect_order_d_minus_one(build(mesh, d), 80);
            // The next order differs, so that the comparison can fail.
            if (d <= kOrder) {
                EXPECT_GT(counts.order_d, 0.05);
            }
        }
    }
    for (const int d : test::thinned<int>({5, 3, 6, 7, 4})) {
        SCOPED_TRACE("pole near small patches d" + std::to_string(d));
        const auto counts =
            expect_order_d_minus_one(build(pole_near_small_patches(d), d), 200);
        EXPECT_GT(counts.mixed, 0);
        EXPECT_GT(counts.levels, 0);
    }
}

// ------------------------------------------------------------------------ the report

// The angle of two normals and the curvatures come from derivatives that are right to a few
// thousand ulps near corners, in patches whose curvature is some ten times the diagonal.
TEST(Continuity, IsReported) {
    for (const auto& [name, mesh] : closed_meshes()) {
        for (int d = 2; d <= 7; ++d) {
            const Surface s = build(mesh, d);
            const Continuity c = measure_continuity(s, d <= 4 ? 8 : 2);
            SCOPED_TRACE(name + " d" + std::to_string(d));
            EXPECT_GT(c.n_samples, 100u);
            EXPECT_LE(c.gap_max, 1e-14);
            EXPECT_LE(c.normal_jump_deg_max, 1e-11);
            EXPECT_EQ(c.n_sharp_samples, 0u);
            EXPECT_GT(c.curvature_max, 1);
            // Quadratic splines have jumps of curvature: the report sees them.
            if (d == 2) {
                EXPECT_GT(c.curvature_jump_max, 0.01);
                EXPECT_LT(c.curvature_jump_max, 2);
            } else {
                EXPECT_LE(c.curvature_jump_max, 1e-12);
            }
        }
    }
}

TEST(Continuity, MeasuresEveryEdgeFromBothSides) {
    // Eight patches of three quarters each, which turn two of their sides outwards.
    EXPECT_EQ(measure_continuity(build(cube(), 3)).n_samples, 24u * 2 * 9);
    EXPECT_EQ(measure_continuity(build(cube(), 3), 3).n_samples, 24u * 2 * 4);
    // A regular patch per face, with four quarters.
    EXPECT_EQ(measure_continuity(build(torus(4, 5), 3), 1).n_samples, 20u * 8 * 2);
    // At the ends of an edge, where more patches meet, it is still the one across.
    for (const auto& [name, mesh] : closed_meshes()) {
        for (const int d : {2, 3, 4, 5}) {
            const Surface s = build(mesh, d);
            EXPECT_EQ(measure_continuity(s, 1).n_samples, edge_points(s).size())
                << name << " d" << d;
        }
    }
}

TEST(Continuity, IsRelativeToTheSize) {
    MeshData mesh = random_displaced(prism(5), 4, 0.1);
    const Continuity a = measure_continuity(build(mesh, 2));
    for (auto& p : mesh.positions)
        p *= 1024.0;  // exact in binary
    const Continuity b = measure_continuity(build(mesh, 2));
    EXPECT_EQ(a.gap_max, b.gap_max);
    EXPECT_EQ(a.normal_jump_deg_max, b.normal_jump_deg_max);
    EXPECT_EQ(a.curvature_jump_max, b.curvature_jump_max);
    EXPECT_EQ(a.curvature_max, b.curvature_max);
}

TEST(Continuity, DoesNotDependOnThreads) {
    const Surface s = build(random_displaced(pole(5, 3, 2), 4, 0.1), 2);
    const auto report = [&](std::size_t n_threads) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                          n_threads);
        const Continuity c = measure_continuity(s);
        return std::tuple(c.gap_max, c.normal_jump_deg_max, c.curvature_jump_max,
                          c.curvature_max, c.n_samples, c.worst_normal.quarter,
                          c.worst_normal.x, c.worst_normal.y, c.worst_curvature.quarter,
                          c.worst_curvature.x, c.worst_curvature.y);
    };
    const auto serial = report(1);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(report(8), serial);
}

// Control points of one level only move: patches of two levels come apart.
TEST(Continuity, ABrokenSurfaceIsReported) {
    for (const int d : {3, 4}) {
        Surface s = build(pole(5, 4, 1), d);
        const PatchTable& table = s.patches();
        const auto levels_meet = [&](const EdgePoint& e) {
            return table.patch(e.left.patch).level != table.patch(e.right.patch).level;
        };
        const auto edges = edge_points(s);
        const auto edge = std::ranges::find_if(edges, levels_meet);
        ASSERT_NE(edge, edges.end());
        // One that the left patch feels at this point and the right one does not have.
        const PatchRef left = table.patch(edge->left.patch);
        std::vector<double> w(left.points.size());
        s.evaluator().weights(edge->left, 0, Chart::Native, w);
        const auto strongest = std::ranges::max_element(w) - w.begin();
        const Index point = left.points[strongest];
        EXPECT_TRUE(std::ranges::find(table.patch(edge->right.patch).points, point) ==
                    table.patch(edge->right.patch).points.end());

        // The surface has no door for this: its points always fit each other.
        auto& moved = const_cast<Vec3<double>&>(s.points()[point]);
        const Vec3<double> before = moved;
        moved += Vec3<double>(0, 0, 0.01);
        const double shift = 0.01 * w[strongest] /
                             bounding_diagonal(s.points().first(s.base().n_vertices()));
        const Continuity broken = measure_continuity(s, 32);
        EXPECT_GE(broken.gap_max, 0.9 * shift);
        EXPECT_LE(broken.gap_max, 0.01);
        EXPECT_GT(broken.normal_jump_deg_max, 0.01);
        EXPECT_GT(broken.curvature_jump_max, 1e-3);
        moved = before;
        EXPECT_LE(measure_continuity(s).gap_max, 1e-14);
    }
}

TEST(Continuity, CountsNothingBeyondBordersAndHoles) {
    for (const auto& [name, mesh] : open_meshes()) {
        for (const BoundaryRule rule :
             {BoundaryRule::None, BoundaryRule::EdgeOnly, BoundaryRule::EdgeAndCorner}) {
            for (const int d : {3, 4, 5}) {
                SCOPED_TRACE(name + " d" + std::to_string(d) + ", boundary rule " +
                             std::to_string(int(rule)));
                const auto s = Surface::build(mesh, {.degree = d}, {.boundary = rule});
                ASSERT_TRUE(s) << s.error().message;
                const Continuity c = measure_continuity(*s, 1);
                EXPECT_EQ(c.n_samples, edge_points(*s).size());
                EXPECT_EQ(c.n_sharp_samples, 0u);
                EXPECT_LE(c.gap_max, 1e-14);
            }
        }
    }
}

// The edges of one face are infinitely sharp: the surface has the angles of a rounded cube's
// rim there, and is smooth elsewhere.
TEST(Continuity, KeepsSharpEdgesApart) {
    MeshData mesh = random_displaced(cube(), 3, 0.05);
    for (int i = 0; i < 4; ++i) {
        const auto v = [&](int k) { return static_cast<int>(mesh.face_vertices[k % 4]); };
        mesh.tags.push_back({"crease", {v(i), v(i + 1)}, {10}, {}, 0});
    }
    for (const int d : {3, 5}) {
        const auto s = Surface::build(mesh, {.degree = d});
        ASSERT_TRUE(s) << s.error().message;
        const Continuity c = measure_continuity(*s);
        EXPECT_LE(c.gap_max, 1e-14);
        EXPECT_LE(c.normal_jump_deg_max, 1e-10);
        EXPECT_GT(c.sharp_normal_jump_deg_max, 30);
        EXPECT_LT(c.sharp_normal_jump_deg_max, 120);
        // Both sides of four edges in two quarters each, of at least one cell.
        EXPECT_GE(c.n_sharp_samples, 2u * 4 * 2 * 9);
        EXPECT_LT(c.n_sharp_samples, c.n_samples);
        const Index h = c.worst_sharp_normal.quarter;
        EXPECT_GE(std::max(s->features().edge(s->base().edge[h]),
                           s->features().edge(s->base().edge[s->base().prev(h)])),
                  kInfinitelySharp);
    }
}

TEST(Continuity, DiagonalOfPoints) {
    const std::vector<Vec3<double>> points = {{1, 2, 3}, {-2, 6, 3}, {0, 3, 15}};
    EXPECT_EQ(bounding_diagonal(points), 13);  // of 3 x 4 x 12
    EXPECT_EQ(bounding_diagonal({}), 0);
}

// ------------------------------------------------------------------------ sharp features

std::vector<NamedMesh> bordered_meshes() {
    auto meshes = open_meshes();
    for (auto& mesh : creased_meshes())
        meshes.push_back(std::move(mesh));
    return meshes;
}

// Across every smooth edge, whatever borders, creases and darts the patches are cut by.
TEST(ContinuityAtBorders, IsOfOrderDMinusOneInTheSplineParameters) {
    auto meshes = bordered_meshes();
    const std::size_t n_infinite = meshes.size();
    for (auto& mesh : semi_sharp_meshes())
        meshes.push_back(std::move(mesh));
    std::vector<std::pair<std::size_t, int>> cases;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        for (int d = 2; d <= 7; ++d) {
            // Not all, for the time that it takes.
            if (i < n_infinite || (i + std::size_t(d)) % 9 == 0)
                cases.emplace_back(i, d);
        }
    }
    int n_meshes = 0, n_differ = 0;
    for (const auto& [i, d] : test::thinned(cases)) {
        const auto& [name, mesh] = meshes[i];
        SCOPED_TRACE(name + " d" + std::to_string(d));
        // Derivatives of an n-gon of 64 sides keep a digit less, and so do those of
        // order 6 of the blends of seventh powers in a border's correction.
        const double tolerance = name.starts_with("pole 64") || d == 7 ? 1e-11 : 1e-12;
        const auto counts = expect_order_d_minus_one(build(mesh, d), 16, tolerance);
        n_meshes += d <= kOrder;
        n_differ += d <= kOrder && counts.order_d > 1e-3;
    }
    // Where the next order does not differ all patches are pieces of one surface.
    EXPECT_GT(n_differ, 0.9 * n_meshes);
}

// At equal addresses, from every face that has the curve at its edge.
TEST(ContinuityAtBorders, CurvesAreBSplineCurvesFromBothSides) {
    int n_all = 0;
    for (const auto& [name, mesh] : bordered_meshes()) {
        const auto curves = sharp_curves(mesh);
        for (int d = 2; d <= 7; ++d) {
            const Surface s = build(mesh, d);
            int n_compared = 0;
            for (const SharpCurve& c : curves) {
                for (std::size_t i = 0; i < c.halfedges.size(); ++i) {
                    if (!s.patches().has_surface(s.base().face(c.halfedges[i])))
                        continue;
                    for (const double u : {0.0, 0.07, 0.25, 0.4, 0.5, 0.66, 0.9, 1.0}) {
                        const double t = double(i) + u, reach = 0.5 * (d + 1);
                        if ((c.dart_at_start && t < reach) ||
                            (c.dart_at_end && c.polygon.n_edges() - t < reach))
                            continue;
                        const auto p = s.evaluate(to_address(
                            s.base(), edge_point(s.base(), c.halfedges[i], u)));
                        // Tens of ulps; tau of a large n-gon rounds by n.
                        ASSERT_LE(glm::length(p.p - curve_point(c.polygon, d, t)), 1e-12)
                            << name << " d" << d << " edge " << i << " of "
                            << c.polygon.n_edges() << " at " << u;
                        ++n_compared;
                    }
                }
            }
            n_all += n_compared;
            // Short creases between darts have no part that the darts do not reach.
            EXPECT_TRUE(n_compared > 0 || d > 2 || name.find("spike") < name.size() ||
                        name == "rule none" || name == "two darts")
                << name << " d" << d;
        }
    }
    EXPECT_GT(n_all, test::fewest(10000));
}

// The patch of a smooth corner of degree 5 reaches over two faces. A crease one face away from
// the border is in its way: found as a gap of 0.05 of the diagonal.
TEST(ContinuityAtBorders, SmoothCornersKeepTheirDistanceFromCreases) {
    MeshData mesh = random_displaced(grid(5, 4), 7, 0.1);
    for (int j = 0; j < 4; ++j)
        mesh.tags.push_back({"crease", {5 + j, 6 + j}, {10}, {}, 0});
    for (const int d : {4, 5, 7}) {
        const Surface s = build(mesh, d);
        EXPECT_LE(measure_continuity(s).gap_max, 1e-14) << "d" << d;
    }
}

// A spike, and a corner where curves end, is its vertex from every face.
TEST(ContinuityAtBorders, PinnedVerticesAreOnTheSurface) {
    for (const auto& [name, mesh] : bordered_meshes()) {
        for (int d = 2; d <= 5; ++d) {
            const Surface s = build(mesh, d);
            const Topology& t = s.base();
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                const Index v = t.vertex[h];
                int n_sharp = 0;
                t.for_each_edge(v, [&](Index e, Index) {
                    n_sharp += s.features().edge(e) >= kInfinitelySharp;
                });
                if (!s.patches().has_surface(t.face(h)) ||
                    (s.features().vertex(v) < kInfinitelySharp && n_sharp < 3))
                    continue;
                const auto p = s.evaluate(to_address(t, {h, 0, 0})).p;
                EXPECT_LE(glm::length(p - mesh.positions[v]), 1e-13)
                    << name << " d" << d << " vertex " << v;
            }
        }
    }
}

// Whatever semi-sharp edges end there too.
TEST(ContinuityAtBorders, PinnedVerticesStayWhereSemiSharpEdgesEnd) {
    for (const int n_rays : {1, 2, 3, 4}) {
        MeshData mesh = border_fan(5);
        mesh.positions[0].z = 1;
        mesh.tags.push_back({"corner", {0}, {kInfinitelySharp}, {}, 0});
        for (int i = 0; i < n_rays; ++i)
            mesh.tags.push_back({"crease", {0, 2 * i + 3}, {1.5 + i}, {}, 0});
        for (int d = 2; d <= 7; ++d) {
            const Surface s = build(mesh, d);
            for (Index f = 0; f < 5; ++f) {
                const auto p = s.evaluate({f, 0, 0}).p;
                EXPECT_LE(glm::length(p - mesh.positions[0]), 1e-13)
                    << "d" << d << " face " << f << " of " << n_rays;
            }
        }
    }
}

// The normals and curvatures that the report compares are derivatives in charts that pinned
// corners and darts stretch: some more digits are lost there than on closed meshes.
TEST(ContinuityAtBorders, IsReported) {
    auto meshes = bordered_meshes();
    const std::size_t n_infinite = meshes.size();
    for (auto& mesh : semi_sharp_meshes())
        meshes.push_back(std::move(mesh));
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const auto& [name, mesh] = meshes[i];
        for (int d = 2; d <= 4; ++d) {
            if (i >= n_infinite && (i + std::size_t(d)) % 3 != 0)
                continue;  // for the time that it takes
            SCOPED_TRACE(name + " d" + std::to_string(d));
            const Continuity c = measure_continuity(build(mesh, d), 2);
            EXPECT_LE(c.gap_max, 1e-14);
            EXPECT_LE(c.normal_jump_deg_max, 1e-9);
            if (d > 2) {
                EXPECT_LE(c.curvature_jump_max, 1e-9);
            }
        }
    }
}

// All of a quarter that has a surface, once; nothing of those of holes.
TEST(ContinuityAtBorders, CellsCoverWhatIsNoHole) {
    auto meshes = bordered_meshes();
    for (auto& mesh : semi_sharp_meshes())
        meshes.push_back(std::move(mesh));
    for (const auto& [name, mesh] : meshes) {
        const Topology base = topology_of(mesh);
        const ResolvedFeatures f = resolve(base, features_of(mesh));
        for (int d = 2; d <= 5; ++d) {
            const auto table =
                build_patch_table(base, features_of(mesh),
                                  {.degree = d, .multisided = {.crease_end_level = 3}});
            ASSERT_TRUE(table) << table.error().message;
            std::vector<double> area(base.n_halfedges(), 0.0);
            for (const Cell& cell : table->cells()) {
                area[cell.quarter] += glm::dot(cell.x_axis, cell.x_axis);
                const auto middle =
                    cell.origin + 0.5 * cell.x_axis + 0.5 * turn(cell.x_axis, 1);
                // Two cells of the same area in one place would take the room of others.
                const PatchPoint at =
                    table->locate(QuarterPoint{cell.quarter, middle.x, middle.y});
                ASSERT_EQ(at.patch, cell.patch) << name << " d" << d;
                ASSERT_TRUE(at.a >= 0 && at.a <= 1 && at.b >= 0 && at.b <= 1);
            }
            for (Index q = 0; q < base.n_halfedges(); ++q) {
                const bool hole = f.is_hole(base.face(q));
                ASSERT_EQ(table->has_surface(base.face(q)), !hole);
                ASSERT_EQ(area[q], hole ? 0 : 1) << name << " d" << d << " quarter " << q;
            }
        }
    }
}

// Mirror images stand for what lies beyond the border: a regular grid needs no refinement.
TEST(ContinuityAtBorders, RegularBordersAndCreasesStayAtLevelZero) {
    MeshData mesh = random_displaced(grid(6, 5), 1, 0.1);
    mesh.tags.push_back({"interpolateboundary", {1}, {}, {}, 0});
    MeshData creased = mesh;
    for (Index j = 0; j <= 5; ++j) {
        if (j < 5)
            add_crease(creased, {3 * 6 + j, 3 * 6 + j + 1});
    }
    for (int d = 2; d <= 9; ++d) {
        for (const bool is_creased : {false, true}) {
            const Surface s = build(is_creased ? creased : mesh, d);
            EXPECT_EQ(s.patches().n_levels(), 1) << d;
            // One a face, or one a vertex on each side of the crease.
            const Index n = d % 2 == 1 ? 30 : is_creased ? 48 : 42;
            EXPECT_EQ(s.patches().n_patches(), n) << d;
            for (Index i = 0; i < s.patches().n_patches(); ++i)
                EXPECT_EQ(s.patches().class_of(i).kind, PatchKind::Regular);
        }
    }
    // Then the whole surface is the tensor product of rows that go on by reflection.
    for (int d = 2; d <= 9; ++d) {
        const Surface s = build(mesh, d);
        for (const auto& [u, v] : {std::pair(0.0, 0.0), std::pair(0.3, 1.9),
                                   std::pair(2.8, 4.95), std::pair(5.6, 2.5)}) {
            Polygon column;
            for (Index i = 0; i <= 6; ++i) {
                const auto row = mesh.positions.begin() + i * 6;
                column.points.push_back(curve_point({{row, row + 6}}, d, v));
            }
            const auto i = static_cast<Index>(u), j = static_cast<Index>(v);
            const auto p = s.evaluate({i * 5 + j, u - i, v - j}).p;
            EXPECT_LE(glm::length(p - curve_point(column, d, u)), 1e-13)
                << d << " at " << u << ", " << v;
        }
    }
}

std::vector<Address> some_addresses(const Surface& s) {
    std::vector<Address> result;
    for (Index q = 0; q < s.base().n_halfedges(); ++q) {
        if (!s.patches().has_surface(s.base().face(q)) || q % 3 != 0)
            continue;
        for (const auto& [x, y] : {std::pair(0.0, 0.0), std::pair(0.4, 0.0),
                                   std::pair(0.1, 0.03), std::pair(0.8, 0.6)})
            result.push_back(to_address(s.base(), {q, x, y}));
    }
    return result;
}

TEST(ContinuityAtBorders, TheSurfaceIsLinearInThePositions) {
    for (const auto& [name, mesh] : bordered_meshes()) {
        const MeshData other = random_displaced(mesh, 99, 0.5);
        for (const int d : {3, 4}) {
            Surface a = build(mesh, d);
            const Surface b = build(other, d);
            std::vector<SurfaceJet<double>> expected;
            for (const Address& at : some_addresses(a)) {
                const auto ja = a.evaluate(at, Chart::Native),
                           jb = b.evaluate(at, Chart::Native);
                SurfaceJet<double> sum;
                sum.p = 0.3 * ja.p - 1.7 * jb.p;
                sum.du = 0.3 * ja.du - 1.7 * jb.du;
                sum.dvv = 0.3 * ja.dvv - 1.7 * jb.dvv;
                expected.push_back(sum);
            }
            std::vector<Vec3<double>> positions;
            for (Index v = 0; v < mesh.positions.size(); ++v)
                positions.push_back(0.3 * mesh.positions[v] - 1.7 * other.positions[v]);
            ASSERT_TRUE(a.set_positions(positions));
            std::size_t i = 0;
            for (const Address& at : some_addresses(a)) {
                const auto j = a.evaluate(at, Chart::Native);
                const SurfaceJet<double>& e = expected[i++];
                ASSERT_LE(glm::length(j.p - e.p), 1e-13 * 8) << name << " d" << d;
                ASSERT_LE(glm::length(j.du - e.du), 1e-12 * (1 + glm::length(e.du)));
                ASSERT_LE(glm::length(j.dvv - e.dvv), 1e-11 * (1 + glm::length(e.dvv)))
                    << name << " d" << d;
            }
        }
    }
}

TEST(ContinuityAtBorders, BaseWeightsGiveTheSurface) {
    for (const auto& [name, mesh] : bordered_meshes()) {
        for (const int d : {3, 4}) {
            const Surface s = build(mesh, d);
            const auto all = some_addresses(s);
            for (std::size_t i = 0; i < all.size(); i += 9) {
                const auto jet = s.evaluate(all[i]);
                const Vec3<double> expected[] = {jet.p,   jet.du,  jet.dv,
                                                 jet.duu, jet.duv, jet.dvv};
                for (int r = 0; r < 6; ++r) {
                    std::vector<double> w(mesh.positions.size(), 0.0);
                    s.add_base_weights(all[i], r, 2.0, w);
                    Vec3<double> sum(0);
                    // Weights are as large as the patch is small, and pinned corners stretch
                    // the chart by ten and more.
                    const double scale = s.patches().locate(all[i]).scale;
                    double weight = 0, size = r == 0 ? 1 : r < 3 ? scale : scale * scale;
                    for (std::size_t v = 0; v < w.size(); ++v) {
                        sum += 0.5 * w[v] * mesh.positions[v];
                        weight += 0.5 * w[v];
                        size += std::abs(w[v]);
                    }
                    EXPECT_LE(glm::length(sum - expected[r]), 1e-11 * size)
                        << name << " d" << d << " derivative " << r;
                    EXPECT_NEAR(weight, r == 0 ? 1 : 0, 1e-11 * size)
                        << name << " d" << d << " derivative " << r;
                }
            }
        }
    }
}

// A border vertex, a crease, a corner, a spike of 360 faces.
TEST(ContinuityAtBorders, TakesAnyValence) {
    std::vector<NamedMesh> meshes = {{"border", border_fan(360)},
                                     {"pole", pole(360, 2, 2)}};
    meshes.push_back({"spike", meshes[1].data});
    add_corner(meshes.back().data, 0);
    meshes.push_back({"crease", meshes[1].data});
    const auto spoke = [](Index i) {
        return std::vector<Index>{0, 2 + i * 2 * 3, 2 + (i * 2 + 1) * 3};
    };
    add_crease(meshes.back().data, spoke(0));
    add_crease(meshes.back().data, spoke(170));
    meshes.push_back({"junction", meshes.back().data});
    add_crease(meshes.back().data, spoke(200));
    for (const auto& [name, mesh] : meshes) {
        SCOPED_TRACE(name);
        const Surface s = build(mesh, 3);
        bool has_large = false;
        for (Index i = 0; i < s.patches().n_patches(); ++i)
            has_large |= s.patches().class_of(i).n_sectors > 100;
        EXPECT_TRUE(has_large);
        // Both sides of some edges of the large patch. Its sides are short in its domain, 1/720
        // and less: m derivatives of its parameters keep that much less.
        int n_compared = 0;
        const auto edges = edge_points(s);
        std::size_t n_large = 0;
        for (const EdgePoint& e : edges) {
            if (e.is_sharp || (s.patches().class_of(e.left.patch).n_sectors < 100 &&
                               s.patches().class_of(e.right.patch).n_sectors < 100))
                continue;
            if (n_large++ % 97 != 0)
                continue;
            const auto a = s.evaluator().evaluate<double>(s.points(), e.left,
                                                          Chart::Native),
                       b = s.evaluator().evaluate<double>(s.points(), e.right,
                                                          Chart::Native);
            EXPECT_LE(glm::length(a.p - b.p), 1e-13);
            EXPECT_LE(glm::length(normal(a) - normal(b)), 1e-9);
            const auto ca = curvature(a), cb = curvature(b);
            EXPECT_LE(std::abs(ca.mean - cb.mean), 1e-6 * (1 + std::abs(ca.mean)));
            ++n_compared;
        }
        EXPECT_GE(n_compared, 4);
    }
}

// ------------------------------------------------------------------------ total curvature

/// Integral of the Gauss curvature over the surface.
double total_curvature(const Surface& s, int n) {
    constexpr double kNodes[] = {0.5 - 0.3872983346207417, 0.5, 0.5 + 0.3872983346207417};
    constexpr double kWeights[] = {5.0 / 18, 4.0 / 9, 5.0 / 18};
    double sum = 0;
    for (const Cell& cell : s.patches().cells()) {
        const Vec2<double> y_axis = turn(cell.x_axis, 1);
        double of_cell = 0;
        for (int i = 0; i < 3 * n; ++i) {
            for (int j = 0; j < 3 * n; ++j) {
                const double x = (i / 3 + kNodes[i % 3]) / n,
                             y = (j / 3 + kNodes[j % 3]) / n;
                const auto q = cell.origin + x * cell.x_axis + y * y_axis;
                const auto jet = s.evaluator().evaluate<double>(
                    s.points(), QuarterPoint{cell.quarter, q.x, q.y});
                of_cell += kWeights[i % 3] * kWeights[j % 3] * curvature(jet).gauss *
                           glm::length(glm::cross(jet.du, jet.dv));
            }
        }
        // (u, v) run half as fast as the quarter's coordinates.
        sum += of_cell * glm::dot(cell.x_axis, cell.x_axis) / 4 / (n * n);
    }
    return sum;
}

// Gauss and Bonnet: it holds for degree two as well, since the normal does not jump. The
// quadrature errs at the knots inside of multisided patches, where derivatives of the
// curvature jump, for degree two the curvature itself.
TEST(Continuity, TotalCurvatureIsTwoPiTimesEulersNumber) {
    for (const auto& [name, mesh] : closed_meshes()) {
        const Topology t = topology_of(mesh);
        const double euler = double(t.n_vertices()) - t.n_edges + t.n_faces();
        for (int d = 2; d <= 5; ++d) {
            const Surface s = build(mesh, d);
            const std::size_t n_cells = s.patches().cells().size();
            const int n = n_cells < 250 ? 4 : n_cells < 1000 ? 2 : 1;
            EXPECT_NEAR(total_curvature(s, n) / (2 * std::numbers::pi), euler,
                        d == 2 ? 2e-2 : 5e-3)
                << name << " d" << d;
        }
    }
}

}  // namespace
}  // namespace osdx::test
