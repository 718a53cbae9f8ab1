// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/topology.h>

#include "far/refine/stencil_rows.h"
#include "tests/support/refine_support.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using Point = Vec3<double>;
using test::NamedMesh;

constexpr int kLastDegree = 9;  // the eigenvalue table ends here

Refinement refined(const MeshData& mesh, int degree, int levels) {
    Refinement r(test::topology_of(mesh), degree);
    for (int i = 0; i < levels; ++i)
        r.add_level();
    return r;
}

/// Bound of the relative error of a point. A row of m positive weights that sum to one errs
/// by at most m eps: m/2 roundings of the weights and as many of the sum, each relative to
/// the largest point. The factors' errors add up.
double rounding(const Refinement& r) {
    return double(test::sum_of_longest_rows(r)) * std::numeric_limits<double>::epsilon();
}

double largest(const std::vector<Point>& points) {
    double result = 0;
    for (const Point& p : points)
        result = std::max(result, glm::length(p));
    return result;
}

void expect_near(const std::vector<Point>& actual, const std::vector<Point>& expected,
                 double tolerance) {
    ASSERT_EQ(actual.size(), expected.size());
    for (std::size_t i = 0; i < actual.size(); ++i)
        ASSERT_LE(glm::distance(actual[i], expected[i]), tolerance) << "point " << i;
}

std::vector<Point> applied(const StencilTable& table, const std::vector<Point>& in) {
    std::vector<Point> out(table.n_rows());
    table.apply(std::span<const Point>(in), std::span(out));
    return out;
}

template <class F>
void for_each_case(int levels, F&& f) {
    for (const NamedMesh& mesh : test::closed_meshes()) {
        for (int d = kMinDegree; d <= kLastDegree; ++d) {
            SCOPED_TRACE(mesh.name + ", degree " + std::to_string(d));
            f(mesh.data, refined(mesh.data, d, levels));
            if (testing::Test::HasFatalFailure())
                return;
        }
    }
}

TEST(Refine, CountsVerticesAsItSays) {
    for_each_case(2, [](const MeshData&, const Refinement& r) {
        ASSERT_EQ(r.n_levels(), 3);
        for (int l = 1; l <= 2; ++l) {
            const Topology& above = r.topology(l - 1);
            const Topology& t = r.topology(l);
            const bool odd = r.degree() % 2 == 1;
            const Index cells = above.n_vertices() + above.n_edges + above.n_faces();
            ASSERT_EQ(t.n_vertices(), odd ? cells : above.n_halfedges());
            ASSERT_EQ(t.n_faces(), odd ? above.n_halfedges() : cells);
            ASSERT_EQ(r.factors(l).back().n_rows(), t.n_vertices());
        }
    });
}

TEST(Refine, OneStepLeavesOneKindOfIrregularity) {
    for_each_case(1, [](const MeshData&, const Refinement& r) {
        const Topology& t = r.topology(1);
        if (r.degree() % 2 == 1) {
            for (Index f = 0; f < t.n_faces(); ++f)
                ASSERT_EQ(t.face_size(f), 4u);
        } else {
            for (Index v = 0; v < t.n_vertices(); ++v)
                ASSERT_EQ(t.valence(v), 4u);
        }
    });
}

TEST(Refine, StencilsSumToOne) {
    for_each_case(2, [](const MeshData&, const Refinement& r) {
        const StencilTable table = r.stencils();
        const double tolerance = rounding(r);
        for (Index row = 0; row < table.n_rows(); ++row) {
            long double sum = 0;  // so that the test itself does not round
            for (std::size_t k = table.offsets[row]; k < table.offsets[row + 1]; ++k) {
                ASSERT_GT(table.weights[k],
                          0.0);  // the hull of the mesh holds the surface
                sum += table.weights[k];
            }
            ASSERT_NEAR(double(sum), 1.0, tolerance) << "row " << row;
        }
    });
}

TEST(Refine, StencilsGiveThePoints) {
    for_each_case(2, [](const MeshData& mesh, const Refinement& r) {
        expect_near(applied(r.stencils(), mesh.positions), r.points(mesh.positions),
                    2 * rounding(r) * largest(mesh.positions));
    });
}

TEST(Refine, CommutesWithAffineMaps) {
    const auto map = [](const Point& p) {
        return Point(0.3 * p.x - 1.2 * p.y + 0.4 * p.z + 2, 0.9 * p.x + 0.2 * p.y - 1,
                     0.5 * p.y - 0.7 * p.z + 0.5);
    };
    for_each_case(2, [&](const MeshData& mesh, const Refinement& r) {
        std::vector<Point> mapped_base, mapped_points;
        for (const Point& p : mesh.positions)
            mapped_base.push_back(map(p));
        for (const Point& p : r.points(mesh.positions))
            mapped_points.push_back(map(p));
        // The map has a norm below 2.
        expect_near(
            r.points(mapped_base), mapped_points,
            2 * rounding(r) * (largest(mapped_base) + 2 * largest(mesh.positions)));
    });
}

TEST(Refine, LevelsFollowEachOther) {
    for_each_case(2, [](const MeshData& mesh, const Refinement& r) {
        Refinement first(r.topology(0), r.degree());
        first.add_level();
        Refinement second(first.topology(1), r.degree());
        second.add_level();
        ASSERT_EQ(second.topology(1).vertex, r.topology(2).vertex);
        ASSERT_EQ(second.topology(1).twin, r.topology(2).twin);
        ASSERT_EQ(second.points(first.points(mesh.positions)), r.points(mesh.positions));
    });
}

// Every row reads only what stands before it, wanted points are those of the levels (by the
// same sums: equal bits), and nothing is made that neither is wanted nor read.
TEST(Refine, ChainMakesTheWantedPoints) {
    for_each_case(2, [](const MeshData& mesh, const Refinement& r) {
        std::vector<std::vector<std::uint8_t>> wanted;
        std::vector<std::vector<Point>> points;
        Refinement levels(r.topology(0), r.degree());
        std::mt19937 random(7);
        for (int l = 0; l <= 2; ++l) {
            if (l > 0)
                levels.add_level();
            points.push_back(levels.points(mesh.positions));
            wanted.emplace_back(r.topology(l).n_vertices(), false);
            for (std::size_t v = 0; l > 0 && v < wanted[l].size(); ++v)
                wanted[l][v] = random() % 5 == 0;
        }
        const Refinement::Chain chain = r.chain(wanted);
        const Index n_base = r.topology(0).n_vertices();
        std::vector<Point> values = mesh.positions;
        values.resize(n_base + chain.rows.n_rows());
        chain.rows.extend(n_base, 3, std::span(&values[0].x, 3 * values.size()));

        std::vector<bool> used(values.size(), false);
        for (Index i = 0; i < chain.rows.n_rows(); ++i) {
            for (std::size_t k = chain.rows.offsets[i]; k < chain.rows.offsets[i + 1];
                 ++k) {
                ASSERT_LT(chain.rows.indices[k], n_base + i);
                used[chain.rows.indices[k]] = true;
            }
        }
        ASSERT_EQ(chain.place.size(), 3u);
        for (int l = 1; l <= 2; ++l) {
            for (Index v = 0; v < r.topology(l).n_vertices(); ++v) {
                const Index place = chain.place[l][v];
                if (wanted[l][v]) {
                    ASSERT_NE(place, kInvalidIndex) << "vertex " << v;
                    used[place] = true;
                }
                if (place != kInvalidIndex) {
                    ASSERT_EQ(values[place], points[l][v]) << "vertex " << v;
                }
            }
        }
        for (Index i = n_base; i < values.size(); ++i)
            ASSERT_TRUE(used[i]) << "point " << i;
    });
}

TEST(StencilTable, SameInFloatAndForChannels) {
    for_each_case(1, [](const MeshData& mesh, const Refinement& r) {
        const StencilTable table = r.stencils();
        const std::vector<Point> expected = applied(table, mesh.positions);
        const std::vector<Vec3<float>> in(mesh.positions.begin(), mesh.positions.end());
        std::vector<Vec3<float>> out(table.n_rows());
        table.apply(std::span<const Vec3<float>>(in), std::span(out));
        const auto n_in = static_cast<Index>(mesh.positions.size());
        std::vector<double> channels(std::size_t(n_in + table.n_rows()) * 3);
        for (Index i = 0; i < n_in; ++i) {
            for (int c = 0; c < 3; ++c)
                channels[3 * i + c] = mesh.positions[i][c];
        }
        table.extend(n_in, 3, std::span(channels));
        // A float row of m terms errs by 3m/2 ulps at most: input, weight and sum.
        std::size_t longest = 0;
        for (Index i = 0; i < table.n_rows(); ++i)
            longest = std::max(longest, table.offsets[i + 1] - table.offsets[i]);
        const double tolerance = 1.5 * double(longest) *
                                 std::numeric_limits<float>::epsilon() *
                                 largest(mesh.positions);
        for (Index i = 0; i < table.n_rows(); ++i) {
            ASSERT_LE(glm::distance(Point(out[i]), expected[i]), tolerance);
            for (Index c = 0; c < 3; ++c)  // the same sums
                ASSERT_EQ(channels[3 * (n_in + i) + c], expected[i][int(c)]);
        }
    });
}

TEST(StencilTable, ComposeMultiplies) {
    StencilTable first, second;  // 2 rows over 3 inputs; 2 rows over those
    first.add(0, 0.25);
    first.add(2, 0.75);
    first.end_row();
    first.add(1, 1.0);
    first.end_row();
    second.add(1, 0.5);
    second.add(0, 0.5);
    second.end_row();
    second.add(1, 1.0);
    second.end_row();
    const StencilTable both = compose(second, first, 3);
    EXPECT_EQ(both.offsets, (Buffer<std::size_t>{0, 3, 4}));
    EXPECT_EQ(both.indices, (Buffer<Index>{0, 1, 2, 1}));
    EXPECT_EQ(both.weights, (Buffer<double>{0.125, 0.5, 0.375, 1.0}));
}

// Many rows of few kinds, so that slots are shared and the table grows on the way.
TEST(StencilTable, DistinctRowsAreNumberedAsTheyCome) {
    std::mt19937 random(11);
    StencilTable all;
    std::map<std::vector<std::pair<Index, double>>, Index> numbers;
    std::vector<Index> expected;
    for (int r = 0; r < 5000; ++r) {
        std::vector<std::pair<Index, double>> row(random() % 4);
        for (auto& [index, weight] : row) {
            index = static_cast<Index>(random() % 8);
            weight = 0.25 * double(random() % 8);
            all.add(index, weight);
        }
        all.end_row();
        expected.push_back(
            numbers.try_emplace(row, static_cast<Index>(numbers.size())).first->second);
    }
    detail::DistinctRows distinct;
    for (Index r = 0; r < all.n_rows(); ++r)
        ASSERT_EQ(distinct.find_or_add(all, r), expected[r]) << "row " << r;
    const auto n_rows = static_cast<Index>(numbers.size());
    ASSERT_EQ(distinct.rows().n_rows(), n_rows);
    EXPECT_GT(n_rows, 1000u);
    // The rows are those of their first uses, and after all is forgotten they come anew.
    for (const auto& [row, number] : numbers) {
        const StencilTable& rows = distinct.rows();
        ASSERT_EQ(rows.offsets[number + 1] - rows.offsets[number], row.size());
        for (std::size_t k = 0; k < row.size(); ++k) {
            EXPECT_EQ(rows.indices[rows.offsets[number] + k], row[k].first);
            EXPECT_EQ(rows.weights[rows.offsets[number] + k], row[k].second);
        }
    }
    distinct.forget();
    EXPECT_EQ(distinct.find_or_add(all, 0), n_rows);
    EXPECT_EQ(distinct.find_or_add(all, 0), n_rows);
}

TEST(Refine, WithoutLevelsIsTheMesh) {
    const MeshData mesh = test::cube();
    const Refinement r = refined(mesh, 4, 0);
    EXPECT_EQ(r.points(mesh.positions), mesh.positions);
    EXPECT_EQ(applied(r.stencils(), mesh.positions), mesh.positions);
}

// A vertex that no face uses stays where it is (odd) or has no child (even), and the others
// are refined as if it were not there.
TEST(Refine, LooseVerticesChangeNothing) {
    const MeshData mesh = test::random_displaced(test::cube(), 1, 0.1);
    MeshData loose = mesh;
    loose.positions.insert(loose.positions.begin(), {7, 8, 9});
    for (Index& v : loose.face_vertices)
        ++v;
    for (int d = kMinDegree; d <= kLastDegree; ++d) {
        SCOPED_TRACE(d);
        const std::vector<Point> expected = refined(mesh, d, 2).points(mesh.positions);
        std::vector<Point> actual = refined(loose, d, 2).points(loose.positions);
        if (d % 2 == 1) {
            ASSERT_EQ(actual.front(), loose.positions[0]);
            actual.erase(actual.begin());
        }
        EXPECT_EQ(actual, expected);
    }
}

// ---------------------------------------------------------------------- regular grids

/// One step of the uniform B-spline of degree d on a periodic row. Children 2i and 2i + 1
/// of point i lie at i and i + 1/2 for odd d, at i - 1/4 and i + 1/4 for even d.
/// Source: Lane and Riesenfeld (1980): the mask is C(d + 1, k) / 2^d.
std::vector<Point> refine_row(const std::vector<Point>& row, int d) {
    const int n = static_cast<int>(row.size());
    std::vector<double> mask = {1.0};  // Pascal's triangle, scaled
    for (int i = 0; i <= d; ++i) {
        mask.push_back(0.0);
        for (std::size_t k = mask.size() - 1; k > 0; --k)
            mask[k] += mask[k - 1];
    }
    for (double& m : mask)
        m /= std::pow(2.0, d);
    // Entry k of the mask lies k - (d + 1)/2 fine steps from the point; halves round up.
    std::vector<Point> fine(2 * n, Point(0.0));
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k <= d + 1; ++k) {
            const int child = 2 * i + k - (d + 1) / 2;
            fine[((child % (2 * n)) + 2 * n) % (2 * n)] += mask[k] * row[i];
        }
    }
    return fine;
}

/// Both directions of an m x n grid: 2m x 2n points.
std::vector<Point> refine_grid(const std::vector<Point>& grid, Index m, Index n, int d) {
    std::vector<Point> rows;  // m x 2n
    for (Index i = 0; i < m; ++i) {
        const auto row =
            refine_row({grid.begin() + i * n, grid.begin() + (i + 1) * n}, d);
        rows.insert(rows.end(), row.begin(), row.end());
    }
    std::vector<Point> fine(4 * grid.size());
    for (Index j = 0; j < 2 * n; ++j) {
        std::vector<Point> column;
        for (Index i = 0; i < m; ++i)
            column.push_back(rows[i * 2 * n + j]);
        const auto refined_column = refine_row(column, d);
        for (Index i = 0; i < 2 * m; ++i)
            fine[i * 2 * n + j] = refined_column[i];
    }
    return fine;
}

TEST(Refine, IsTheTensorProductMaskOnARegularGrid) {
    const Index m = 7, n = 12;
    const MeshData mesh = test::random_displaced(test::torus(m, n), 3, 0.2);
    const Topology t = test::topology_of(mesh);
    for (int d = kMinDegree; d <= kMaxDegree; ++d) {
        SCOPED_TRACE(d);
        const Refinement r = refined(mesh, d, 1);
        const std::vector<Point> points = r.points(mesh.positions);
        const std::vector<Point> fine = refine_grid(mesh.positions, m, n, d);
        ASSERT_EQ(points.size(), fine.size());
        const auto at = [&](int i, int j) {
            return fine[(i + 2 * m) % (2 * m) * 2 * n + (j + 2 * n) % (2 * n)];
        };
        const double tolerance = 2 * rounding(r) * largest(mesh.positions);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            // Face (i, j) lies between vertex (i, j) and (i + 1, j + 1), modulo m and n.
            const Index f = t.face(h), v = t.vertex[h];
            const int i = int(v / n), j = int(v % n);
            const int face_i = int(f / n), face_j = int(f % n);
            if (d % 2 == 0) {
                const int ahead_i = i == face_i, ahead_j = j == face_j;
                ASSERT_LE(glm::distance(points[h], at(2 * i + ahead_i, 2 * j + ahead_j)),
                          tolerance)
                    << "corner " << h;
                continue;
            }
            const int across_i = 2 * face_i + 1, across_j = 2 * face_j + 1;
            ASSERT_LE(glm::distance(points[v], at(2 * i, 2 * j)), tolerance);
            ASSERT_LE(glm::distance(points[t.n_vertices() + t.n_edges + f],
                                    at(across_i, across_j)),
                      tolerance);
            const Index to = t.to_vertex(h);
            const bool along_i = v % n == to % n;
            ASSERT_LE(glm::distance(points[t.n_vertices() + t.edge[h]],
                                    along_i ? at(across_i, 2 * j) : at(2 * i, across_j)),
                      tolerance);
        }
    }
}

// ---------------------------------------------------------------------- eigenvalues

/// Columns a = 0..m of the grid that a halfedge starts: vertex (a, b) lies a steps along it
/// and b to its left.
std::vector<std::vector<Index>> grid_from(const Topology& t, Index start, int m) {
    std::vector<std::vector<Index>> columns(m + 1);
    for (int a = 0; a <= m; ++a) {
        Index h = start;  // leaves vertex (a, b) towards (a + 1, b)
        for (int b = 0; b <= m; ++b) {
            columns[a].push_back(t.vertex[h]);
            h = t.twin[t.next(t.next(h))];
        }
        start = t.next(t.twin[t.next(start)]);
    }
    return columns;
}

/// The neighbourhood of an extraordinary vertex or face, in an order that a child level
/// repeats: from each of the n given halfedges a grid.
std::vector<Index> neighbourhood(const Topology& t, const std::vector<Index>& starts,
                                 bool at_vertex, int m) {
    std::vector<Index> vertices;
    if (at_vertex)
        vertices.push_back(t.vertex[starts[0]]);
    for (const Index h : starts) {
        const auto grid = grid_from(t, h, m);
        for (int a = at_vertex ? 1 : 0; a <= m; ++a)
            vertices.insert(vertices.end(), grid[a].begin(), grid[a].end());
    }
    return vertices;
}

/// The moduli of the three largest eigenvalues of the subdivision step around a vertex of
/// valence n (odd d) or a face of n sides (even d).
std::vector<double> largest_eigenvalues(int n, int d) {
    const bool odd = d % 2 == 1;
    // The mask is d + 2 wide, so what lies within (d + 1)/2 edges depends on nothing else.
    const int m = (d + 1) / 2;
    const Index k = Index(m + 2);
    Refinement r(test::topology_of(odd ? test::pole(n, k, k) : test::face_pole(n, k, k)),
                 d);
    r.add_level();
    const Topology& parent = r.topology(0);
    const Topology& child = r.topology(1);
    std::vector<Index> starts, child_starts;
    if (odd) {
        parent.for_each_outgoing(0, [&](Index h) { starts.push_back(h); });
        for (const Index h : starts)
            child_starts.push_back(4 * h);  // corner 0 of quad h is the vertex
    } else {
        const Index face = parent.n_vertices() + parent.n_edges;  // the child of face 0
        for (Index h = parent.face_offsets[0]; h < parent.face_offsets[1]; ++h) {
            starts.push_back(parent.ccw(parent.ccw(h)));
            Index c = child.face_offsets[face];
            while (child.vertex[c] != h)  // vertex h of the child comes from corner h
                ++c;
            child_starts.push_back(child.ccw(child.ccw(c)));
        }
    }
    const std::vector<Index> from = neighbourhood(parent, starts, odd, m);
    const std::vector<Index> to = neighbourhood(child, child_starts, odd, m);
    std::vector<Index> label(parent.n_vertices(), kInvalidIndex);
    for (Index i = 0; i < from.size(); ++i)
        label[from[i]] = i;

    StencilTable step;
    const StencilTable all = r.stencils();
    for (const Index v : to) {
        for (std::size_t e = all.offsets[v]; e < all.offsets[v + 1]; ++e) {
            EXPECT_NE(label[all.indices[e]], kInvalidIndex) << "not invariant";
            step.add(label[all.indices[e]], all.weights[e]);
        }
        step.end_row();
    }

    // Orthogonal iteration with three vectors. The fourth eigenvalue is at most 0.88 of the
    // third for every row of the table below, and 0.88^250 < 1e-13.
    std::mt19937 random(1);
    std::vector<std::vector<double>> vectors(3, std::vector<double>(from.size()));
    for (auto& vector : vectors) {
        for (double& x : vector)
            x = double(random()) / 4294967296.0 - 0.5;
    }
    std::vector<double> moduli(3);
    for (int iteration = 0; iteration < 250; ++iteration) {
        for (int i = 0; i < 3; ++i) {
            std::vector<double> next(from.size());
            for (Index row = 0; row < step.n_rows(); ++row) {
                for (std::size_t e = step.offsets[row]; e < step.offsets[row + 1]; ++e)
                    next[row] += step.weights[e] * vectors[i][step.indices[e]];
            }
            const auto dot = [](const auto& a, const auto& b) {
                double sum = 0;
                for (std::size_t j = 0; j < a.size(); ++j)
                    sum += a[j] * b[j];
                return sum;
            };
            for (int j = 0; j < i; ++j) {
                const double along = dot(next, vectors[j]);
                for (std::size_t e = 0; e < next.size(); ++e)
                    next[e] -= along * vectors[j][e];
            }
            moduli[i] = std::sqrt(dot(next, next));
            for (double& x : next)
                x /= moduli[i];
            vectors[i] = std::move(next);
        }
    }
    return moduli;
}

struct Eigenvalue {
    int n;
    double lambda[8];  ///< for d = 2..9
};

// Computed apart from this code, by block Fourier analysis; those of d = 3 are the closed
// form (A + sqrt((A - 4)(A + 4)))/16, A = 5 + cos(2 pi/n), of Catmull-Clark.
constexpr Eigenvalue kLambda[] = {
    {3, {0.3750, 0.4101, 0.3966, 0.4017, 0.3976, 0.3994, 0.3976, 0.3985}},
    {5, {0.5773, 0.5500, 0.5682, 0.5602, 0.5682, 0.5644, 0.5688, 0.5666}},
    {6, {0.6250, 0.5797, 0.6130, 0.5981, 0.6137, 0.6061, 0.6152, 0.6105}},
    {7, {0.6559, 0.5985, 0.6430, 0.6229, 0.6446, 0.6340, 0.6470, 0.6403}},
    {8, {0.6768, 0.6111, 0.6639, 0.6398, 0.6663, 0.6533, 0.6695, 0.6612}},
    {12, {0.7165, 0.6348, 0.7049, 0.6724, 0.7093, 0.6911, 0.7145, 0.7025}},
};

TEST(Refine, HasTheKnownSubdominantEigenvalue) {
    std::vector<int> degrees;
    for (int d = 2; d <= kLastDegree; ++d)
        degrees.push_back(d);
    const std::vector rows(std::begin(kLambda), std::end(kLambda));
    for (const auto& [row, d] : test::thinned(test::combinations(rows, degrees))) {
        SCOPED_TRACE("n = " + std::to_string(row.n) + ", degree " + std::to_string(d));
        const std::vector<double> found = largest_eigenvalues(row.n, d);
        const double expected = row.lambda[d - 2];
        EXPECT_NEAR(found[0], 1.0, 1e-9);
        EXPECT_NEAR(found[1], expected, 0.5001e-4);  // printed with four decimals
        EXPECT_NEAR(found[2], expected, 0.5001e-4);  // it is double
    }
}

}  // namespace
}  // namespace osdx
