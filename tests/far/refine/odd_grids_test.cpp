// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/grids/odd_grids.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "far/refine/refinement.h"
#include "tests/support/refine_support.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using test::base_points;
using test::NamedMesh;

constexpr int kOddDegrees[] = {3, 5, 7};
constexpr int kLevels = 3;

template <class V>
std::vector<V> points(const OddGrids& r, const std::vector<V>& base) {
    std::vector<V> out(r.grids().n_vertices());
    r.points(std::span<const V>(base), std::span(out));
    return out;
}

/// Creases and corners of every sharpness on random edges and vertices, and a hole.
MeshData with_random_tags(MeshData mesh, unsigned seed) {
    static constexpr double kSharpness[] = {0.125, 0.5, 1,    1.5, 2,
                                            2.875, 3,   4.25, 10,  12};
    std::mt19937 random(seed);
    const Topology t = test::topology_of(mesh);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (random() % 3 == 0)
            test::add_crease(mesh, {t.vertex[h], t.to_vertex(h)},
                             kSharpness[random() % std::size(kSharpness)]);
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (random() % 8 == 0)
            test::add_corner(mesh, v, kSharpness[random() % std::size(kSharpness)]);
    }
    mesh.tags.push_back({"hole", {int(random() % t.n_faces())}, {}, {}, 0});
    mesh.tags.push_back({"interpolateboundary", {int(random() % 3)}, {}, {}, 0});
    if (seed % 2 == 0)
        mesh.tags.push_back({"creasemethod", {}, {}, {"chaikin"}, 0});
    if (seed % 3 == 0)
        mesh.tags.push_back({"smoothtriangles", {}, {}, {"smooth"}, 0});
    return mesh;
}

/// Two faces back to back: a closed mesh whose vertices have two faces each.
MeshData pillow(Index n) {
    MeshData mesh;
    std::vector<Index> face;
    for (Index i = 0; i < n; ++i) {
        mesh.positions.emplace_back(std::cos(2.0 * i), std::sin(2.0 * i), 0.1 * i);
        face.push_back(i);
    }
    for (int side = 0; side < 2; ++side) {
        mesh.face_sizes.push_back(n);
        mesh.face_vertices.insert(mesh.face_vertices.end(), face.begin(), face.end());
        std::ranges::reverse(face);
    }
    return mesh;
}

/// Of every kind: valences from 2 to 64, n-gons, borders, features of all sharpnesses, loose
/// vertices.
std::vector<NamedMesh> meshes() {
    auto all = test::closed_meshes();
    const auto add = [&](std::vector<NamedMesh> more) {
        for (auto& mesh : more)
            all.push_back(std::move(mesh));
    };
    add(test::open_meshes());
    add(test::creased_meshes());
    add(test::semi_sharp_meshes());
    for (unsigned seed = 0; seed < 12; ++seed) {
        add({{"tagged torus", with_random_tags(test::torus(4, 5), seed)},
             {"tagged pole", with_random_tags(test::pole(5, 2, 1), seed)},
             {"tagged dodecahedron", with_random_tags(test::dodecahedron(), seed)},
             {"tagged bipyramid", with_random_tags(test::bipyramid(7), seed)},
             {"tagged grid", with_random_tags(test::grid(3, 4), seed)},
             {"tagged fan", with_random_tags(test::border_fan(5), seed)}});
    }
    for (const Index n : {3u, 8u, 24u})
        add({{"pole " + std::to_string(n), test::pole(n, 1, 2)},
             {"prism " + std::to_string(n), test::prism(n)}});
    add({{"pillow of quads", pillow(4)}, {"pillow of pentagons", pillow(5)}});
    for (unsigned seed = 0; seed < 6; ++seed)
        add({{"tagged pillow", with_random_tags(pillow(4 + seed % 3), seed)}});
    MeshData loose = test::torus(3, 3);
    loose.positions.insert(loose.positions.begin() + 4, {7, 8, 9});
    for (Index& v : loose.face_vertices)
        v += v >= 4;
    add({{"torus with a loose vertex", loose}});
    return test::thinned(all);
}

template <class F>
void for_each_case(const std::vector<int>& levels, F&& f) {
    for (const auto& [name, mesh] : meshes()) {
        for (const int d : kOddDegrees) {
            for (const int n_levels : levels) {
                SCOPED_TRACE(name + ", degree " + std::to_string(d) + ", levels " +
                             std::to_string(n_levels));
                f(mesh, d, n_levels);
                if (testing::Test::HasFatalFailure())
                    return;
            }
        }
    }
}

OddGrids refined(const MeshData& mesh, int degree, int n_levels) {
    return {test::topology_of(mesh), degree, n_levels, test::features_of(mesh)};
}

Refinement reference(const MeshData& mesh, int degree, int n_levels) {
    Refinement r(test::topology_of(mesh), degree, test::features_of(mesh));
    for (int l = 0; l < n_levels; ++l)
        r.add_level();
    return r;
}

/// Of a row of m weights that sum to one a sum errs by at most m eps of the largest point: m/2
/// roundings of the weights and as many of the sum. Signs may differ in the rows of valence
/// two, whose weights are then below two. The factors of the levels add up, and both sides err.
template <class T>
double rounding(const Refinement& r, const MeshData& mesh) {
    double largest = 0;
    for (const auto& p : mesh.positions)
        largest = std::max(largest, glm::length(p));
    return 2 * double(test::sum_of_longest_rows(r)) *
           double(std::numeric_limits<T>::epsilon()) * largest;
}

template <class T>
void expect_points_of_refinement(const MeshData& mesh, int degree, int n_levels) {
    const OddGrids ours = refined(mesh, degree, n_levels);
    const Refinement theirs = reference(mesh, degree, n_levels);
    const Topology& t = theirs.topology(n_levels);
    const auto expected = theirs.points(mesh.positions);
    const auto actual = points(ours, base_points<T>(mesh));
    ASSERT_EQ(actual.size(), expected.size());
    std::vector<Index> vertices(ours.grids().n_halfedges());
    face_vertices(ours.grids(), vertices);
    const double tolerance = rounding<T>(theirs, mesh);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        const Index v = vertices[ours.from_split(h)];
        ASSERT_LE(glm::distance(Vec3<double>(actual[v]), expected[t.vertex[h]]),
                  tolerance)
            << "vertex " << v << ", there " << t.vertex[h];
    }
    for (Index v = 0; v < test::topology_of(mesh).n_vertices(); ++v) {
        ASSERT_LE(glm::distance(Vec3<double>(actual[v]), expected[v]), tolerance)
            << "base vertex " << v;  // the same numbers in both; also loose ones
    }
}

TEST(OddGrids, GivesThePointsOfRefinementInDouble) {
    for_each_case({0, 1, kLevels}, expect_points_of_refinement<double>);
}

TEST(OddGrids, GivesThePointsOfRefinementInFloat) {
    for_each_case({kLevels}, expect_points_of_refinement<float>);
}

// The same connectivity under the map of halfedges, and the same features.
TEST(OddGrids, HasTheGraphOfRefinement) {
    for (const auto& [name, mesh] : meshes()) {
        for (const int n_levels : {0, 1, kLevels}) {
            SCOPED_TRACE(name + ", levels " + std::to_string(n_levels));
            const OddGrids ours = refined(mesh, 3, n_levels);
            const Refinement theirs = reference(mesh, 3, n_levels);
            const Topology a = to_topology(ours.grids()), &b = theirs.topology(n_levels);
            ASSERT_EQ(a.n_vertices(), b.n_vertices());
            ASSERT_EQ(a.n_edges, b.n_edges);
            ASSERT_EQ(a.n_faces(), b.n_faces());
            ASSERT_EQ(a.n_vertices(), ours.grids().n_vertices());
            ASSERT_EQ(a.n_edges, ours.grids().n_edges());
            ASSERT_EQ(a.n_faces(), ours.grids().n_faces());
            const Features f = ours.features(), &g = theirs.level(n_levels).features;
            EXPECT_EQ(f.boundary, g.boundary);
            EXPECT_EQ(f.creases, g.creases);
            EXPECT_EQ(f.smooth_triangles, g.smooth_triangles);
            std::vector<Index> vertex(a.n_vertices(), kInvalidIndex),
                edge(a.n_edges, kInvalidIndex);
            std::set<Index> halfedges;
            for (Index h = 0; h < b.n_halfedges(); ++h) {
                const Index m = ours.from_split(h);
                ASSERT_LT(m, a.n_halfedges());
                halfedges.insert(m);
                ASSERT_EQ(a.next(m), ours.from_split(b.next(h)));
                ASSERT_EQ(a.twin[m],
                          b.is_border(h) ? kInvalidIndex : ours.from_split(b.twin[h]));
                const auto same = [](Index& known, Index number) {
                    if (known == kInvalidIndex)
                        known = number;
                    return known == number;
                };
                ASSERT_TRUE(same(vertex[a.vertex[m]], b.vertex[h]));
                ASSERT_TRUE(same(edge[a.edge[m]], b.edge[h]));
                ASSERT_EQ(f.edge(a.edge[m]), g.edge(b.edge[h]));
                ASSERT_EQ(f.vertex(a.vertex[m]), g.vertex(b.vertex[h]));
                ASSERT_EQ(f.hole.empty(), g.hole.empty());
                ASSERT_TRUE(f.hole.empty() || f.hole[a.face(m)] == g.hole[b.face(h)]);
            }
            ASSERT_EQ(halfedges.size(), a.n_halfedges());
        }
    }
}

// As build_topology makes it of the faces alone, which checks that every edge has two sides at most
// and that faces are turned alike.
TEST(QuadGrids, AreManifold) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        const OddGrids r = refined(mesh, 3, 2);
        const Topology t = to_topology(r.grids());
        const MeshData data = to_mesh_data(t, points(r, mesh.positions));
        const Result<Topology> built = build_topology(data);
        ASSERT_TRUE(built) << built.error().message;
        const Topology again = *built;
        EXPECT_EQ(again.vertex, t.vertex);
        EXPECT_EQ(again.twin, t.twin);
        EXPECT_EQ(again.n_edges, t.n_edges);
        const Topology base = test::topology_of(mesh);
        EXPECT_EQ(int(t.n_vertices()) - int(t.n_edges) + int(t.n_faces()),
                  int(base.n_vertices()) - int(base.n_edges) + int(base.n_faces()));
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            const Index other = t.is_border(h) ? h : t.twin[h];
            ASSERT_LT(t.edge[h], t.n_edges);
            ASSERT_EQ(t.edge[h], t.edge[other]);
            ASSERT_EQ(t.face(h), h / 4);
        }
    }
}

TEST(QuadGrids, FaceVerticesFollowTheFormula) {
    const OddGrids r = refined(test::dodecahedron(), 3, 4);
    const QuadGrids g = r.grids();
    EXPECT_EQ(g.size, 8u);
    std::vector<Index> vertices(g.n_halfedges());
    face_vertices(g, vertices);
    std::vector<bool> used(g.n_vertices(), false);
    for (Index root = 0; root < g.roots.n_faces(); ++root) {
        for (Index j = 0; j < g.size; ++j) {
            for (Index i = 0; i < g.size; ++i) {
                const Index* cell = vertices.data() + 4 * g.face(root, i, j);
                ASSERT_EQ(cell[0], g.vertex(root, i, j));
                ASSERT_EQ(cell[1], g.vertex(root, i + 1, j));
                ASSERT_EQ(cell[2], g.vertex(root, i + 1, j + 1));
                ASSERT_EQ(cell[3], g.vertex(root, i, j + 1));
                for (int k = 0; k < 4; ++k)
                    used[cell[k]] = true;
            }
        }
    }
    EXPECT_EQ(std::ranges::count(used, true), g.n_vertices());
}

// Where the surface is a plane with parameter lines at equal distances, a point lies at its
// address.
TEST(OddGrids, AddressesLieWhereThePointsAre) {
    MeshData torus = test::torus(6, 7);  // as a plane: far from where it closes
    for (Index i = 0; i < 6; ++i) {
        for (Index j = 0; j < 7; ++j)
            torus.positions[i * 7 + j] = {i, j, 0};
    }
    const OddGrids r = refined(torus, 5, 3);
    const auto p = points(r, torus.positions);
    const QuadGrids g = r.grids();
    const Topology base = test::topology_of(torus);
    const Index root = 2 * 7 + 3;  // two quads from every seam
    const Index corner = base.vertex[4 * root];
    ASSERT_EQ(corner, 2u * 7 + 3);
    for (Index j = 0; j <= g.size; ++j) {
        for (Index i = 0; i <= g.size; ++i) {
            const Address a = r.address(root, double(i) / g.size, double(j) / g.size);
            EXPECT_EQ(a.face, root);
            EXPECT_LE(glm::distance(p[g.vertex(root, i, j)], {2 + a.u, 3 + a.v, 0}),
                      1e-14);
        }
    }
    // Elsewhere by quarters: the corner and the centre of each root.
    const MeshData prism = test::prism(5);
    const OddGrids s = refined(prism, 3, 2);
    const Topology t = test::topology_of(prism);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        const QuarterPoint q = to_quarter(t, s.address(h, 0.25, 0.5));
        EXPECT_EQ(q.quarter, h);
        EXPECT_DOUBLE_EQ(q.x, 0.25);
        EXPECT_DOUBLE_EQ(q.y, 0.5);
        EXPECT_EQ(s.grids().vertex(h, 0, 0), t.vertex[h]);
    }
}

TEST(OddGrids, DoesNotDependOnThreads) {
    const MeshData mesh = with_random_tags(test::pole(7, 6, 9), 1);
    for (const int d : kOddDegrees) {
        const OddGrids r = refined(mesh, d, 4);
        const auto base = base_points<float>(mesh);
        const auto run = [&](int n_threads) {
            std::pair<std::vector<Vec3<float>>, std::vector<Index>> result;
            test::with_threads(n_threads, [&] {
                result.first = points(r, base);
                result.second.resize(r.grids().n_halfedges());
                face_vertices(r.grids(), result.second);
            });
            return result;
        };
        const auto one = run(1), two = run(2), four = run(4);
        EXPECT_EQ(one, two);
        EXPECT_EQ(one, four);
    }
}

// Channels do not mix: the same sums, so the same bits.
TEST(OddGrids, TakesTwoChannels) {
    const MeshData mesh = with_random_tags(test::pole(5, 2, 1), 2);
    for (const int d : kOddDegrees) {
        const OddGrids r = refined(mesh, d, 3);
        const auto three = base_points<float>(mesh);
        const std::vector<Vec2<float>> two(three.begin(), three.end());
        const auto a = points(r, two);
        const auto b = points(r, three);
        for (Index v = 0; v < b.size(); ++v)
            ASSERT_EQ(a[v], Vec2<float>(b[v]));
    }
}

TEST(OddGrids, KeepsCoincidentPointsTogether) {
    MeshData mesh = test::pole(5, 2, 1);
    std::ranges::fill(mesh.positions, Vec3<double>(1, 2, 4));
    for (const int d : kOddDegrees) {
        for (const auto& p : points(refined(mesh, d, 3), mesh.positions))
            ASSERT_LE(glm::distance(p, {1, 2, 4}), 1e-14);
    }
}

TEST(OddGrids, TakesAnEmptyMesh) {
    const OddGrids r(Topology{}, 3, 2);
    EXPECT_EQ(r.grids().n_vertices(), 0u);
    std::vector<Vec3<double>> none;
    r.points(std::span<const Vec3<double>>(none), std::span(none));
    face_vertices(r.grids(), {});
    EXPECT_EQ(to_topology(r.grids()).n_faces(), 0u);
}

}  // namespace
}  // namespace osdx
