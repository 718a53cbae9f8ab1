// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/build_patch_table.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/patch_table_view.h>
#include <osdx/topology.h>

#include "far/patches/isolation_bound.h"
#include "far/refine/refinement.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using Point = Vec3<double>;

constexpr int kLastDegree = 9;

struct Patches {
    Patches(const MeshData& mesh, int degree)
        : base(test::topology_of(mesh)),
          table(*build_patch_table(base, {}, {.degree = degree})) {}

    Topology base;
    PatchTable table;
};

/// With points, and the refined meshes whose parts the control nets should be.
struct PatchesAndMeshes : Patches {
    PatchesAndMeshes(const MeshData& mesh, int degree)
        : Patches(mesh, degree), refinement(base, degree), points(mesh.positions) {
        level_points.push_back(mesh.positions);
        for (int l = 1; l < table.n_levels(); ++l) {
            refinement.add_level();
            level_points.push_back(refinement.points(mesh.positions));
        }
        points.resize(table.n_points());
        table.refresh_points<double>(points);
    }

    Refinement refinement;
    std::vector<Point> points;
    std::vector<std::vector<Point>> level_points;
};

// Points near 1, and averages of them over up to 5 levels of 5 sums of some 10 terms. A
// point that is found twice within this distance fails its test.
constexpr double kTol = 1e-13;

std::string name_of(const PatchClass& c) {
    const char* kind = c.kind == PatchKind::Regular ? "regular "
                       : c.kind == PatchKind::EV    ? "EV "
                                                    : "EF ";
    return kind + std::to_string(c.n_sectors);
}

/// How many patches of each class there are at each level.
std::map<std::pair<std::string, int>, int> census(const PatchTable& table) {
    std::map<std::pair<std::string, int>, int> result;
    for (Index i = 0; i < table.n_patches(); ++i)
        ++result[{name_of(table.class_of(i)), table.patch(i).level}];
    return result;
}
using Census = std::map<std::pair<std::string, int>, int>;

/// The same without regular patches.
Census irregular_census(const PatchTable& table) {
    Census result = census(table);
    std::erase_if(result, [](const auto& c) { return c.first.first == "regular 4"; });
    return result;
}

template <class Case, class F>
void for_each(F&& f) {
    for (const auto& [name, mesh] : test::closed_meshes()) {
        for (int d = kMinDegree; d <= kLastDegree; ++d) {
            SCOPED_TRACE(name + ", degree " + std::to_string(d));
            f(Case(mesh, d));
            if (testing::Test::HasFatalFailure())
                return;
        }
    }
}

// ---------------------------------------------------------------------- classes

TEST(PatchClass, CountsAndOrdersItsPoints) {
    for (int d = kMinDegree; d <= kMaxDegree; ++d) {
        EXPECT_EQ((PatchClass{PatchKind::Regular, d, 4}.n_points()), (d + 1) * (d + 1));
        for (const int n : {3, 5, 8, 360}) {
            const PatchClass ev{PatchKind::EV, d, n}, ef{PatchKind::EF, d, n};
            EXPECT_EQ(ev.n_points(), 1 + n * (d - 1) + n * (d - 1) * (d - 1));
            EXPECT_EQ(ef.n_points(), n * d * d);
            // The order that the header states.
            int next = 0;
            EXPECT_EQ(ev.ev_point(n - 1, 0, 0), next++);
            for (int i = 0; i < n; ++i) {
                for (int b = 1; b < d; ++b) {
                    EXPECT_EQ(ev.ev_point((i + n - 1) % n, 0, b), next);
                    EXPECT_EQ(ev.ev_point(i, b, 0), next++);
                }
            }
            for (int i = 0; i < n; ++i) {
                for (int a = 1; a < d; ++a) {
                    for (int b = 1; b < d; ++b)
                        EXPECT_EQ(ev.ev_point(i, a, b), next++);
                }
            }
            EXPECT_EQ(next, ev.n_points());
            next = 0;
            for (int i = 0; i < n; ++i) {
                for (int p = 0; p < d; ++p) {
                    for (int q = 0; q < d; ++q)
                        EXPECT_EQ(ef.ef_point(i, p, q), next++);
                }
            }
        }
    }
}

TEST(PatchTable, PatchesAreWellFormed) {
    for_each<Patches>([](const Patches& c) {
        const PatchTable& table = c.table;
        ASSERT_EQ(table.n_base_points(), c.base.n_vertices());
        ASSERT_EQ(table.base().vertex, c.base.vertex);
        ASSERT_EQ(table.n_points(),
                  table.n_base_points() + table.refined_points().n_rows());
        std::vector<PatchClass> classes(table.classes().begin(), table.classes().end());
        std::ranges::sort(classes);
        ASSERT_EQ(std::ranges::adjacent_find(classes), classes.end()) << "a class twice";
        std::vector<bool> used(table.n_points(), false);
        int last_level = 0;
        for (Index i = 0; i < table.n_patches(); ++i) {
            const PatchRef patch = table.patch(i);
            const PatchClass& patch_class = table.class_of(i);
            ASSERT_EQ(table.classes()[patch.patch_class], patch_class);
            ASSERT_EQ(patch_class.degree, table.degree());
            ASSERT_EQ(patch_class.kind == PatchKind::Regular, patch_class.n_sectors == 4);
            ASSERT_EQ(patch.points.size(), patch_class.n_points());
            last_level = std::max(last_level, patch.level);
            std::vector<Index> sorted(patch.points.begin(), patch.points.end());
            std::ranges::sort(sorted);
            ASSERT_LT(sorted.back(), table.n_points());
            const bool at_base = patch.level == 0;
            ASSERT_EQ(at_base, sorted.front() < table.n_base_points());
            ASSERT_EQ(at_base, sorted.back() < table.n_base_points());
            if (patch_class.kind != PatchKind::Regular) {
                ASSERT_EQ(std::ranges::adjacent_find(sorted), sorted.end())
                    << "patch " << i << " has a point twice";
            }
            for (const Index p : patch.points)
                used[p] = true;
        }
        ASSERT_EQ(table.n_levels(), last_level + 1);
        // No refined point is made for nothing: a patch or another point needs it.
        for (const Index p : table.refined_points().indices)
            used[p] = true;
        for (Index p = table.n_base_points(); p < table.n_points(); ++p)
            ASSERT_TRUE(used[p]) << "point " << p;
    });
}

// ---------------------------------------------------------------------- cover

TEST(PatchTable, CellsCoverEachQuarterAndPatchOnce) {
    for_each<Patches>([](const Patches& c) {
        const std::vector<Cell> cells = c.table.cells();
        std::vector<std::vector<Cell>> of_quarter(c.base.n_halfedges());
        for (const Cell& cell : cells) {
            ASSERT_LT(cell.quarter, c.base.n_halfedges());
            ASSERT_LT(cell.patch, c.table.n_patches());
            of_quarter[cell.quarter].push_back(cell);
        }
        std::mt19937 random(11);
        const auto next = [&] { return (double(random()) + 0.5) / 4294967296.0; };
        for (Index q = 0; q < c.base.n_halfedges(); ++q) {
            double area = 0;
            for (const Cell& cell : of_quarter[q])
                area += glm::dot(cell.x_axis, cell.x_axis);
            ASSERT_EQ(area, 1.0) << "quarter " << q;  // powers of 1/4: no rounding
            for (int k = 0; k < 4; ++k) {
                const Vec2<double> p(next(), next());
                int n = 0;
                for (const Cell& cell : of_quarter[q]) {
                    const Vec2<double> r = p - cell.origin, x = cell.x_axis,
                                       y = turn(cell.x_axis, 1);
                    const double size = glm::dot(x, x);
                    const double a = glm::dot(r, x) / size, b = glm::dot(r, y) / size;
                    n += a > 0 && a < 1 && b > 0 && b < 1;
                }
                ASSERT_EQ(n, 1) << "quarter " << q << " at " << p.x << ", " << p.y;
            }
        }

        // The cells of a patch add up to the area of its chart.
        std::vector<double> patch_area(c.table.n_patches(), 0.0);
        for (const Cell& cell : cells) {
            const auto middle = cell.origin + 0.5 * (cell.x_axis + turn(cell.x_axis, 1));
            const PatchPoint at =
                c.table.locate(QuarterPoint{cell.quarter, middle.x, middle.y});
            // A quarter is half a unit of (u, v) wide.
            const double side = at.scale * 0.5 * glm::length(cell.x_axis);
            patch_area[cell.patch] += side * side;
        }
        for (Index i = 0; i < c.table.n_patches(); ++i) {
            const PatchClass& patch_class = c.table.class_of(i);
            const double sectors =
                patch_class.kind == PatchKind::Regular ? 1 : patch_class.n_sectors;
            // Sums of n_sectors d^2/4 equal terms at most.
            ASSERT_NEAR(patch_area[i], sectors, 1e-12 * sectors) << "patch " << i;
        }
    });
}

// Addresses below 32 keep 48 bits after the point, and eight levels take eight of them.
constexpr double kChartTol = 1e-11;

TEST(PatchTable, LocateFindsTheCellAndItsDerivative) {
    for_each<Patches>([](const Patches& c) {
        for (const Cell& cell : c.table.cells()) {
            const auto x = cell.x_axis, y = turn(cell.x_axis, 1);
            const auto middle = cell.origin + 0.5 * (x + y);
            const auto inside = cell.origin + 0.375 * x + 0.25 * y;
            const QuarterPoint point{cell.quarter, inside.x, inside.y};
            const PatchPoint at = c.table.locate(point);
            ASSERT_EQ(at.patch, cell.patch);
            ASSERT_LT(at.sector, c.table.class_of(at.patch).n_sectors);
            ASSERT_TRUE(at.a >= 0 && at.a <= 1 && at.b >= 0 && at.b <= 1);
            const PatchPoint same = c.table.locate(to_address(c.base, point));
            ASSERT_EQ(same.patch, at.patch);
            ASSERT_EQ(same.sector, at.sector);
            ASSERT_NEAR(same.a, at.a, kChartTol);
            ASSERT_NEAR(same.b, at.b, kChartTol);
            // From the corners of the cell, looking to its middle.
            for (int k = 0; k < 4; ++k) {
                const auto s = square_corner<double>(k);
                const auto corner = cell.origin + s.x * x + s.y * y;
                const PatchPoint from_corner = c.table.locate(
                    QuarterPoint{cell.quarter, corner.x, corner.y}, middle - corner);
                ASSERT_EQ(from_corner.patch, cell.patch);
                ASSERT_EQ(from_corner.sector, at.sector);
            }

            // The chart is affine within a cell: differences are exact but for rounding.
            const Address a = to_address(c.base, {cell.quarter, middle.x, middle.y});
            const double step = 0.125 * glm::length(x);  // stays in the cell
            const PatchPoint from = c.table.locate(a);
            const PatchPoint along_u = c.table.locate(Address{a.face, a.u + step, a.v});
            const PatchPoint along_v = c.table.locate(Address{a.face, a.u, a.v + step});
            const auto du =
                from.scale * step * turn(Vec2<double>(1, 0), from.quarter_turns);
            const auto dv =
                from.scale * step * turn(Vec2<double>(0, 1), from.quarter_turns);
            ASSERT_NEAR(along_u.a - from.a, du.x, kChartTol);
            ASSERT_NEAR(along_u.b - from.b, du.y, kChartTol);
            ASSERT_NEAR(along_v.a - from.a, dv.x, kChartTol);
            ASSERT_NEAR(along_v.b - from.b, dv.y, kChartTol);
        }
    });
}

/// As a back end would, from what PatchTableView says alone.
PatchPoint locate_by_view(const PatchTableView& view, Index quarter, double x, double y) {
    const auto turned = [](int k, double& a, double& b) {
        for (; k > 0; --k)
            std::tie(a, b) = std::pair(-b, a);
    };
    Index node = view.nodes[quarter];
    while (node >> 30 == 0) {
        const int k = y > 0.5 ? (x > 0.5 ? 2 : 3) : (x > 0.5 ? 1 : 0);
        x = 2 * (x - (k == 1 || k == 2));
        y = 2 * (y - (k >= 2));
        turned(4 - k, x, y);
        node = view.nodes[node + static_cast<Index>(k)];
    }
    PatchLeaf leaf{node & 0xfffffff, 0, 0, 0, 2, 0};
    if (node >> 30 == 2) {
        leaf = view.leaves[node & 0x7fffffff];
    } else if (view.patches[leaf.patch].level() == 0) {
        const int k = node >> 28 & 3;
        leaf.size = 1;
        leaf.turns = static_cast<std::uint8_t>(k);
        leaf.x = view.degree % 2 == 0 ? 1 : k == 1 || k == 2 ? 2 : 0;
        leaf.y = view.degree % 2 == 0 ? 1 : k >= 2 ? 2 : 0;
    }
    turned(leaf.turns, x, y);
    const PatchClass& c = view.classes[view.patches[leaf.patch].patch_class()];
    PatchPoint at;
    at.patch = leaf.patch;
    at.sector = leaf.sector;
    at.a = (leaf.x + leaf.size * x) / c.extent();
    at.b = (leaf.y + leaf.size * y) / c.extent();
    return at;
}

TEST(PatchTableView, IsEnoughToFindPatchesAndMakePoints) {
    for_each<PatchesAndMeshes>([](const PatchesAndMeshes& c) {
        const PatchTableView view = c.table.view();
        std::mt19937 random(3);
        const auto number = [&] { return double(random()) / 0x1p32; };
        for (Index quarter = 0; quarter < c.base.n_halfedges(); ++quarter) {
            const double x = number(), y = number();
            const PatchPoint mine = locate_by_view(view, quarter, x, y);
            const PatchPoint at = c.table.locate(QuarterPoint{quarter, x, y});
            ASSERT_EQ(mine.patch, at.patch);
            ASSERT_EQ(mine.sector, at.sector);
            ASSERT_EQ(mine.a, at.a);
            ASSERT_EQ(mine.b, at.b);
            const PatchRef patch = c.table.patch(at.patch);
            const PatchRecord& record = view.patches[at.patch];
            ASSERT_EQ(record.patch_class(), patch.patch_class);
            ASSERT_EQ(record.level(), patch.level);
            ASSERT_TRUE(std::ranges::equal(
                view.points.subspan(record.first_point,
                                    static_cast<std::size_t>(
                                        view.classes[record.patch_class()].n_points())),
                patch.points));
        }
        // A pass for each group, its rows in any order: here from the last.
        std::vector<Point> points(c.points.begin(),
                                  c.points.begin() + view.n_base_points);
        points.resize(view.n_base_points + view.row_offsets.size() - 1, Point(NAN));
        for (std::size_t g = 0; g + 1 < view.row_groups.size(); ++g) {
            for (Index r = view.row_groups[g + 1]; r-- > view.row_groups[g];) {
                Point sum(0);
                for (std::size_t k = view.row_offsets[r]; k < view.row_offsets[r + 1];
                     ++k)
                    sum += view.row_weights[k] * points[view.row_points[k]];
                points[view.n_base_points + r] = sum;
            }
        }
        ASSERT_EQ(points, c.points);
    });
}

// ---------------------------------------------------------------------- control nets

/// Vertices of a level by position.
class VertexFinder {
public:
    explicit VertexFinder(const std::vector<Point>& points) : points_(points) {
        for (Index v = 0; v < points.size(); ++v)
            order_.push_back(v);
        std::ranges::sort(order_, {}, [&](Index v) { return points[v].x; });
    }
    /// The vertex at p, kInvalidIndex if there is none or more than one.
    Index find(const Point& p) const {
        const auto x_of = [&](Index v) { return points_[v].x; };
        Index found = kInvalidIndex;
        for (auto i = std::ranges::lower_bound(order_, p.x - kTol, {}, x_of);
             i != order_.end() && x_of(*i) <= p.x + kTol; ++i) {
            if (glm::distance(points_[*i], p) > kTol)
                continue;
            if (found != kInvalidIndex)
                return kInvalidIndex;
            found = *i;
        }
        return found;
    }

private:
    const std::vector<Point>& points_;
    std::vector<Index> order_;
};

/// Is there a face with these corners in this order?
bool is_face(const Topology& t, const std::vector<Index>& corners) {
    bool found = false;
    t.for_each_outgoing(corners[0], [&](Index h) {
        if (found || t.to_vertex(h) != corners[1] ||
            t.face_size(t.face(h)) != corners.size())
            return;
        found = true;
        for (const Index v : corners) {
            found = found && t.vertex[h] == v;
            h = t.next(h);
        }
    });
    return found;
}

/// The faces of the control net of a patch, counter-clockwise, as indices of its points.
std::vector<std::vector<int>> net_faces(const PatchClass& c) {
    std::vector<std::vector<int>> faces;
    const int d = c.degree, n = c.n_sectors;
    switch (c.kind) {
        case PatchKind::Regular:
            for (int t = 0; t < d; ++t) {
                for (int s = 0; s < d; ++s) {
                    const int i = t * (d + 1) + s;
                    faces.push_back({i, i + 1, i + d + 2, i + d + 1});
                }
            }
            break;
        case PatchKind::EV:
            for (int i = 0; i < n; ++i) {
                for (int a = 0; a < d - 1; ++a) {
                    for (int b = 0; b < d - 1; ++b)
                        faces.push_back({c.ev_point(i, a, b), c.ev_point(i, a + 1, b),
                                         c.ev_point(i, a + 1, b + 1),
                                         c.ev_point(i, a, b + 1)});
                }
            }
            break;
        case PatchKind::EF:
            faces.emplace_back();
            for (int i = 0; i < n; ++i) {
                faces.front().push_back(c.ef_point(i, 0, 0));
                for (int p = 0; p < d - 1; ++p) {
                    for (int q = 0; q < d - 1; ++q)
                        faces.push_back({c.ef_point(i, p, q), c.ef_point(i, p + 1, q),
                                         c.ef_point(i, p + 1, q + 1),
                                         c.ef_point(i, p, q + 1)});
                }
                // The row of quads across side i + 1, between corners i and i + 1.
                const int next = (i + 1) % n;
                for (int q = 0; q < d - 1; ++q)
                    faces.push_back({c.ef_point(i, 0, q), c.ef_point(i, 0, q + 1),
                                     c.ef_point(next, q + 1, 0), c.ef_point(next, q, 0)});
            }
            break;
        case PatchKind::Gregory:
            break;  // no mesh of its own
    }
    return faces;
}

// The control points of a patch of level l are vertices of the mesh of level l, and lie to
// each other as the order of the class says.
TEST(PatchTable, ControlNetsArePartsOfTheRefinedMeshes) {
    for_each<PatchesAndMeshes>([](const PatchesAndMeshes& c) {
        std::vector<VertexFinder> finders;
        for (const auto& points : c.level_points)
            finders.emplace_back(points);
        std::vector<Index> vertex_of(c.table.n_points(), kInvalidIndex);
        for (Index i = 0; i < c.table.n_patches(); ++i) {
            const PatchRef patch = c.table.patch(i);
            const Topology& t = c.refinement.topology(patch.level);
            for (const Index p : patch.points) {
                if (vertex_of[p] == kInvalidIndex)
                    vertex_of[p] = finders[patch.level].find(c.points[p]);
                ASSERT_NE(vertex_of[p], kInvalidIndex)
                    << "point " << p << " of patch " << i << ", level " << patch.level;
                ASSERT_TRUE(patch.level > 0 || vertex_of[p] == p);
            }
            for (const auto& face : net_faces(c.table.class_of(i))) {
                std::vector<Index> corners;
                for (const int local : face)
                    corners.push_back(vertex_of[patch.points[local]]);
                ASSERT_TRUE(is_face(t, corners)) << "patch " << i;
            }
        }
    });
}

/// A point of the mesh itself, in the quarter at the corner h: see QuarterPoint.
struct MeshPoint {
    Index h;
    Vec2<double> p;
};

Point bilinear(const Point& p00, const Point& p10, const Point& p11, const Point& p01,
               Vec2<double> at) {
    return (1 - at.x) * (1 - at.y) * p00 + at.x * (1 - at.y) * p10 + at.x * at.y * p11 +
           (1 - at.x) * at.y * p01;
}

Point position(const Topology& t, const std::vector<Point>& points, const MeshPoint& at) {
    const Point& corner = points[t.vertex[at.h]];
    Point centre(0.0);
    const Index f = t.face(at.h);
    for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
        centre += points[t.vertex[h]] / double(t.face_size(f));
    return bilinear(corner, 0.5 * (corner + points[t.to_vertex(at.h)]), centre,
                    0.5 * (corner + points[t.vertex[t.prev(at.h)]]), at.p);
}

/// The same point of the surface in the next level, by the numbering of Refinement.
MeshPoint next_level(const Topology& t, const Topology& child, bool odd,
                     const MeshPoint& at) {
    const int k = at.p.y > 0.5 ? (at.p.x > 0.5 ? 2 : 3) : (at.p.x > 0.5 ? 1 : 0);
    const auto in_child = turn(2.0 * (at.p - square_corner<double>(k)), -k);
    if (odd)  // the quarter is face h of the child
        return {4 * at.h + k, in_child};
    // The quarter is the cell of vertex h of the child, and the faces around that vertex
    // are those of the vertex, edge, face and edge at the corners of the quarter.
    const Index face[4] = {t.vertex[at.h], t.n_vertices() + t.edge[at.h],
                           t.n_vertices() + t.n_edges + t.face(at.h),
                           t.n_vertices() + t.edge[t.prev(at.h)]};
    Index outgoing = kInvalidIndex;
    child.for_each_outgoing(at.h, [&](Index h) {
        if (child.face(h) == face[k])
            outgoing = h;
    });
    return {outgoing, 1.0 - in_child};
}

/// The control net at a point of the patch's chart, straight between control points.
Point net_position(const PatchTable& table, const std::vector<Point>& points,
                   const PatchPoint& at) {
    const PatchClass& c = table.class_of(at.patch);
    const auto net = table.patch(at.patch).points;
    const int d = c.degree, n = c.n_sectors, i = static_cast<int>(at.sector);
    const auto grid = [&](Vec2<double> p, auto&& index) {
        const int x = static_cast<int>(p.x), y = static_cast<int>(p.y);
        return bilinear(points[net[index(x, y)]], points[net[index(x + 1, y)]],
                        points[net[index(x + 1, y + 1)]], points[net[index(x, y + 1)]],
                        p - Vec2<double>(x, y));
    };
    const Vec2<double> chart(at.a, at.b);
    if (c.kind == PatchKind::Regular)  // [0,1]^2 is the middle of d edges
        return grid(chart + (d - 1) / 2.0, [&](int x, int y) { return y * (d + 1) + x; });
    if (c.kind == PatchKind::EV)
        return grid(chart * ((d - 1) / 2.0),
                    [&](int a, int b) { return c.ev_point(i, a, b); });
    const auto corner = [&](int sector, int p, int q) {
        return points[net[c.ef_point((sector + n) % n, p, q)]];
    };
    const Vec2<double> p = chart * (d / 2.0) - 0.5;  // in steps from corner i of the face
    if (p.x >= 0 && p.y >= 0)
        return grid(p, [&](int a, int b) { return c.ef_point(i, a, b); });
    if (p.x < 0 && p.y < 0) {
        Point centre(0.0);
        for (int k = 0; k < n; ++k)
            centre += corner(k, 0, 0) / double(n);
        const Point here = corner(i, 0, 0);
        return bilinear(centre, 0.5 * (here + corner(i - 1, 0, 0)), here,
                        0.5 * (here + corner(i + 1, 0, 0)), 2.0 * p + 1.0);
    }
    // In the rows of quads across side i + 1 or i, p away from this corner's side of them.
    const bool after = p.x < 0;
    const double across = after ? -p.x : -p.y, along = after ? p.y : p.x;
    const int q = static_cast<int>(along);
    const auto here = [&](int k) { return after ? corner(i, 0, k) : corner(i, k, 0); };
    const auto there = [&](int k) {
        return after ? corner(i + 1, k, 0) : corner(i - 1, 0, k);
    };
    return bilinear(here(q), there(q), there(q + 1), here(q + 1), {across, along - q});
}

// A point of the surface has its place in the refined mesh, by the numbering of Refinement,
// and its place in the control net of its patch. They are the same place.
TEST(PatchTable, LocateAgreesWithTheRefinedMeshes) {
    for_each<PatchesAndMeshes>([](const PatchesAndMeshes& c) {
        const bool odd = c.table.degree() % 2 == 1;
        std::mt19937 random(13);
        const auto next = [&] { return (double(random()) + 0.5) / 4294967296.0; };
        for (const Cell& cell : c.table.cells()) {
            for (int k = 0; k < 4; ++k) {
                const auto inside =
                    cell.origin + next() * cell.x_axis + next() * turn(cell.x_axis, 1);
                const QuarterPoint point{cell.quarter, inside.x, inside.y};
                const PatchPoint at = c.table.locate(point);
                const int level = c.table.patch(at.patch).level;
                MeshPoint place{point.quarter, {point.x, point.y}};
                for (int l = 0; l < level; ++l)
                    place = next_level(c.refinement.topology(l),
                                       c.refinement.topology(l + 1), odd, place);
                const Point expected =
                    position(c.refinement.topology(level), c.level_points[level], place);
                const Point actual = net_position(c.table, c.points, at);
                ASSERT_LE(glm::distance(actual, expected), kTol)
                    << "patch " << at.patch << ", " << name_of(c.table.class_of(at.patch))
                    << ", level " << level << ", sector " << at.sector << ", a " << at.a
                    << ", b " << at.b;
            }
        }
    });
}

// ---------------------------------------------------------------------- which patches

// Each extraordinary vertex and face has its one multisided patch; what base meshes do not
// isolate becomes vertices for odd and faces for even degrees.
TEST(PatchTable, EachIrregularityHasOnePatch) {
    for_each<Patches>([](const Patches& c) {
        std::map<int, int> expected, actual;
        for (Index v = 0; v < c.base.n_vertices(); ++v)
            ++expected[static_cast<int>(c.base.valence(v))];
        for (Index f = 0; f < c.base.n_faces(); ++f)
            ++expected[static_cast<int>(c.base.face_size(f))];
        expected.erase(4);
        for (Index i = 0; i < c.table.n_patches(); ++i) {
            const PatchClass& patch_class = c.table.class_of(i);
            if (patch_class.kind == PatchKind::Regular)
                continue;
            ++actual[patch_class.n_sectors];
            const PatchKind kind =
                c.table.degree() % 2 == 1 ? PatchKind::EV : PatchKind::EF;
            ASSERT_TRUE(c.table.patch(i).level == 0 || patch_class.kind == kind);
        }
        ASSERT_EQ(actual, expected);
    });
}

TEST(PatchTable, ARegularMeshIsOnePatchPerFaceOrVertex) {
    for (int d = kMinDegree; d <= kMaxDegree; ++d) {
        SCOPED_TRACE(d);
        const Patches c(test::torus(3, 5), d);  // nets wrap around: points repeat
        EXPECT_EQ(census(c.table), (Census{{{"regular 4", 0}, 15}}));
        EXPECT_EQ(c.table.n_points(), 15u);
        EXPECT_EQ(c.table.n_levels(), 1);
    }
}

// What is irregular beyond a crease is no neighbour, however close.
TEST(PatchTable, BesideBordersAndCreasesPatchesStayRegular) {
    constexpr Index kWidth = 6, kHeight = 5;
    MeshData mesh = test::grid(2 * kWidth, kHeight);
    const auto vertex = [](Index i, Index j) { return i * (kHeight + 1) + j; };
    std::vector<Index> crease;
    for (Index j = 0; j <= kHeight; ++j)
        crease.push_back(vertex(kWidth, j));
    test::add_crease(mesh, crease);
    // Two triangles instead of a quad in the next column but one.
    mesh.face_sizes.insert(mesh.face_sizes.end(), {3, 3});
    const Index split = (kWidth + 1) * kHeight + 1, first = 4 * split;
    const std::vector<Index> quad(mesh.face_vertices.begin() + first,
                                  mesh.face_vertices.begin() + first + 4);
    mesh.face_sizes.erase(mesh.face_sizes.begin() + split);
    mesh.face_vertices.erase(mesh.face_vertices.begin() + first,
                             mesh.face_vertices.begin() + first + 4);
    mesh.face_vertices.insert(mesh.face_vertices.end(),
                              {quad[0], quad[1], quad[2], quad[0], quad[2], quad[3]});
    const Topology base = test::topology_of(mesh);
    const Result<Features> features =
        build_features(mesh, base, {.boundary = BoundaryRule::EdgeAndCorner});
    ASSERT_TRUE(features);
    for (int d = kMinDegree; d <= kMaxDegree; ++d) {
        SCOPED_TRACE(d);
        const auto table = build_patch_table(base, *features, {.degree = d});
        ASSERT_TRUE(table);
        for (Index f = 0; f < kWidth * kHeight; ++f) {
            for (const double u : {0.1, 0.6}) {
                for (const double v : {0.3, 0.8}) {
                    const Index patch = table->locate(Address{f, u, v}).patch;
                    ASSERT_EQ(table->class_of(patch).kind, PatchKind::Regular) << f;
                    ASSERT_EQ(table->patch(patch).level, 0) << f;
                }
            }
        }
        EXPECT_GT(table->n_levels(), 1);
    }
}

TEST(PatchTable, OfACube) {
    // Corners are 1 edge apart, then 2, 4; degree d needs d - 1. For even degrees they
    // become triangles with 1, 3 rows of quads between them; d - 1 are needed again.
    EXPECT_EQ(census(Patches(test::cube(), 2).table), (Census{{{"EV 3", 0}, 8}}));
    EXPECT_EQ(census(Patches(test::cube(), 3).table), (Census{{{"EV 3", 1}, 8}}));
    EXPECT_EQ(irregular_census(Patches(test::cube(), 4).table),
              (Census{{{"EF 3", 2}, 8}}));
    EXPECT_EQ(irregular_census(Patches(test::cube(), 5).table),
              (Census{{{"EV 3", 2}, 8}}));
}

TEST(PatchTable, OfADodecahedron) {
    // Degree 2: after one step pentagons and triangles still meet at corners.
    EXPECT_EQ(irregular_census(Patches(test::dodecahedron(), 2).table),
              (Census{{{"EF 3", 2}, 20}, {{"EF 5", 2}, 12}}));
    // Degree 3: after one step corners and centres are opposite in a quad.
    EXPECT_EQ(irregular_census(Patches(test::dodecahedron(), 3).table),
              (Census{{{"EV 3", 2}, 20}, {{"EV 5", 2}, 12}}));
}

/// A pole keeps its level only if d - 1 edges lie between it and the next extraordinary
/// vertex.
TEST(PatchTable, VerticesThatAreFarEnoughApartStayAtLevelZero) {
    for (int d = kMinDegree; d <= kLastDegree; ++d) {
        for (const Index n : {3u, 5u, 8u, 12u}) {
            SCOPED_TRACE("degree " + std::to_string(d) + ", n = " + std::to_string(n));
            const Index far = Index(d - 1);
            const Patches apart(test::pole(n, far, far), d);
            Census expected = {{{"EV 3", 0}, int(2 * n)}};
            expected[{"EV " + std::to_string(n), 0}] += 2;
            EXPECT_EQ(irregular_census(apart.table), expected);
            EXPECT_EQ(apart.table.n_levels(), 1);
            EXPECT_EQ(apart.table.n_points(), apart.base.n_vertices());
            if (d == 2)
                continue;  // no edge less is possible

            // d - 2 edges from pole to corner.
            const Census near_pole =
                irregular_census(Patches(test::pole(n, far - 1, far), d).table);
            for (const auto& [key, count] : near_pole)
                EXPECT_GT(key.second, 0) << key.first;

            // d - 2 edges from corner to corner; the poles stay.
            const Census near_corners =
                irregular_census(Patches(test::pole(n, far, far - 1), d).table);
            for (const auto& [key, count] : near_corners) {
                const bool is_pole = key.second == 0;
                EXPECT_EQ(count, is_pole ? 2 : int(2 * n)) << key.first;
                EXPECT_EQ(key.first, (d % 2 == 1 || is_pole ? "EV " : "EF ") +
                                         std::to_string(is_pole ? n : 3));
            }
            EXPECT_EQ(near_corners.size(), 2u);
        }
    }
}

/// A face keeps its level only if d - 1 rows of quads lie between it and the next one.
TEST(PatchTable, FacesThatAreFarEnoughApartStayAtLevelZero) {
    for (int d = kMinDegree; d <= kLastDegree; ++d) {
        for (const Index n : {3u, 5u, 8u}) {
            SCOPED_TRACE("degree " + std::to_string(d) + ", n = " + std::to_string(n));
            const Index far = Index(d);  // d - 1 rows
            const Patches apart(test::face_pole(n, far, far), d);
            Census expected = {{{"EF 3", 0}, int(2 * n)}};
            expected[{"EF " + std::to_string(n), 0}] += 2;
            EXPECT_EQ(irregular_census(apart.table), expected);
            EXPECT_EQ(apart.table.n_levels(), 1);

            const Census near_pole =
                irregular_census(Patches(test::face_pole(n, far - 1, far), d).table);
            for (const auto& [key, count] : near_pole)
                EXPECT_GT(key.second, 0) << key.first;
        }
    }
}

TEST(PatchTable, TakesAnyValence) {
    for (const Index n : {64u, 360u}) {
        const std::string name = std::to_string(n);
        for (int d = 2; d <= 5; ++d) {
            SCOPED_TRACE("degree " + std::to_string(d) + ", n = " + name);
            const Index k = Index(d - 1);
            EXPECT_EQ(irregular_census(Patches(test::pole(n, k, k), d).table),
                      (Census{{{"EV " + name, 0}, 2}, {{"EV 3", 0}, int(2 * n)}}));
        }
        for (int d = 2; d <= 3; ++d) {
            SCOPED_TRACE("degree " + std::to_string(d) + ", n = " + name);
            const std::string kind = d == 2 ? "EF " : "EV ";
            EXPECT_EQ(irregular_census(Patches(test::prism(n), d).table),
                      (Census{{{kind + name, 2}, 2}, {{kind + "3", 2}, int(2 * n)}}));
        }
    }
}

TEST(PatchTable, LooseVerticesChangeNothing) {
    const MeshData mesh = test::random_displaced(test::dodecahedron(), 4, 0.05);
    MeshData loose = mesh;
    loose.positions.insert(loose.positions.begin(), {7, 8, 9});
    for (Index& v : loose.face_vertices)
        ++v;
    for (int d = 2; d <= 5; ++d) {
        SCOPED_TRACE(d);
        const PatchesAndMeshes expected(mesh, d), actual(loose, d);
        EXPECT_EQ(census(actual.table), census(expected.table));
        ASSERT_EQ(actual.table.n_points(), expected.table.n_points() + 1);
        for (Index p = 0; p < expected.table.n_points(); ++p)
            EXPECT_EQ(actual.points[p + 1], expected.points[p]) << "point " << p;
    }
}

// ---------------------------------------------------------------------- isolation

/// How many cells of each level wait for the next one: four times as many as the areas of the
/// leaves beyond it, in cells.
std::vector<double> open_cells(const PatchTable& table) {
    std::vector<double> open(table.n_levels(), 0.0);
    for (const Cell& cell : table.cells()) {
        // From level 1 on leaves are as large as the cells of their levels.
        for (int l = 1; l < table.patch(cell.patch).level; ++l)
            open[l] += std::ldexp(1, 2 * (l - table.patch(cell.patch).level));
    }
    return open;
}

/// As long as there are any on a level.
Index n_semi_sharp_edges(const Features& features, int level) {
    const auto n = std::ranges::count_if(features.edge_sharpness, is_semi_sharp);
    const bool any = std::ranges::any_of(
        features.edge_sharpness, [&](double s) { return is_semi_sharp(s) && s > level; });
    return any ? static_cast<Index>(n) : 0;
}

/// Corners of faces (odd degrees) or vertices (even degrees) that wait for level 1.
Index first_open_corners(const PatchTable& table) {
    const Topology& t = table.base();
    std::vector<bool> open(table.degree() % 2 == 1 ? t.n_faces() : t.n_vertices());
    const auto cell_of = [&](Index h) {
        return table.degree() % 2 == 1 ? t.face(h) : t.vertex[h];
    };
    for (const Cell& cell : table.cells()) {
        if (table.patch(cell.patch).level > 0)
            open[cell_of(cell.quarter)] = true;
    }
    Index n = 0;
    for (Index h = 0; h < t.n_halfedges(); ++h)
        n += open[cell_of(h)];
    return n;
}

// What is left open stays far below its bound, so that only what never ends meets that.
TEST(Isolation, LeavesLittleOpen) {
    double closest = 0;
    for (const auto& meshes : {test::closed_meshes(), test::open_meshes(),
                               test::creased_meshes(), test::semi_sharp_meshes()}) {
        for (const auto& [name, mesh] : meshes) {
            SCOPED_TRACE(name);
            const Topology base = test::topology_of(mesh);
            const Features features = test::features_of(mesh);
            for (int d = kMinDegree; d <= 7; ++d) {
                SCOPED_TRACE(d);
                if (!check_surface(mesh, base, features, d))
                    continue;
                const PatchTableOptions options{.degree = d};
                const detail::IsolationBound bound(options);
                const auto table = build_patch_table(base, features, options);
                ASSERT_TRUE(table);
                EXPECT_LT(table->n_levels(), bound.last_level - 2);
                const std::vector<double> open = open_cells(*table);
                for (int l = 1; l < table->n_levels(); ++l) {
                    const double most = bound.most_cells(l, first_open_corners(*table),
                                                         n_semi_sharp_edges(features, l));
                    closest = std::max(closest, open[l] / most);
                }
            }
        }
    }
    EXPECT_LT(closest, 0.4);
    EXPECT_GT(closest, 0.01);
}

// A ring too few leaves nets without their points, or with sums over a part of the vertices
// that they mean: a curve of sharp edges that ends where the refined part does.
TEST(Isolation, RefinesAllThatNetsReach) {
    for (const auto& meshes : {test::closed_meshes(), test::open_meshes(),
                               test::creased_meshes(), test::semi_sharp_meshes()}) {
        for (const auto& [name, mesh] : test::thinned(meshes)) {
            SCOPED_TRACE(name);
            const Topology base = test::topology_of(mesh);
            for (const BoundaryRule rule :
                 {BoundaryRule::None, BoundaryRule::EdgeAndCorner}) {
                const auto features = build_features(mesh, base, {.boundary = rule});
                ASSERT_TRUE(features);
                for (const int d : {2, 3, 5}) {
                    SCOPED_TRACE(d);
                    if (!check_surface(mesh, base, *features, d))
                        continue;
                    // Ends of creases need no depth: they would take most of the time.
                    const PatchTableOptions options{
                        .degree = d, .multisided = {.crease_end_level = 2}};
                    detail::IsolationBound bound(options);
                    const auto table =
                        detail::build_patch_table(base, *features, options, bound);
                    bound.more_rings = d;
                    const auto wider =
                        detail::build_patch_table(base, *features, options, bound);
                    ASSERT_TRUE(table && wider);
                    EXPECT_TRUE(*table == *wider);
                }
            }
        }
    }
}

/// A torus, one face of which is two triangles.
MeshData torus_with_triangles() {
    MeshData mesh = test::torus(16, 16);
    const std::vector<Index> quad(mesh.face_vertices.end() - 4, mesh.face_vertices.end());
    mesh.face_vertices.resize(mesh.face_vertices.size() - 4);
    mesh.face_sizes.back() = 3;
    mesh.face_sizes.push_back(3);
    for (const int i : {0, 1, 2, 0, 2, 3})
        mesh.face_vertices.push_back(quad[i]);
    return mesh;
}

// Whether levels or cells are at an end.
TEST(Isolation, RefusesWhatDoesNotBecomeRegular) {
    const Topology base = test::topology_of(torus_with_triangles());
    for (int d = kMinDegree; d <= 7; ++d) {
        SCOPED_TRACE(d);
        const PatchTableOptions options{.degree = d};
        const auto whole = build_patch_table(base, {}, options);
        ASSERT_TRUE(whole);
        ASSERT_GT(whole->n_levels(), 2);
        detail::IsolationBound few_levels(options), few_cells(options);
        few_cells.cells_of_corner = 0;
        for (int l = 0; l <= whole->n_levels(); ++l) {
            few_levels.last_level = l;
            const bool enough = l >= whole->n_levels() - 1;
            const auto table = detail::build_patch_table(base, {}, options, few_levels);
            ASSERT_EQ(table.has_value(), enough) << l;
            if (enough) {
                EXPECT_TRUE(*table == *whole);
                continue;
            }
            EXPECT_EQ(table.error().code, ErrorCode::NotIsolated);
            int deepest = 0;
            for (const Cell& cell : whole->cells()) {
                if (whole->base().face(cell.quarter) == table.error().element)
                    deepest = std::max(deepest, whole->patch(cell.patch).level);
            }
            EXPECT_GT(deepest, l);
        }
        const auto table = detail::build_patch_table(base, {}, options, few_cells);
        ASSERT_FALSE(table);
        EXPECT_EQ(table.error().code, ErrorCode::NotIsolated);
    }
}

}  // namespace
}  // namespace osdx
