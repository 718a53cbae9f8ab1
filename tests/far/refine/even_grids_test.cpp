// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/grids/even_grids.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/topology.h>

#include "far/refine/refinement.h"
#include "tests/support/refine_support.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using test::base_points;
using test::NamedMesh;

constexpr int kEvenDegrees[] = {2, 4, 6};

template <class V>
std::vector<V> points(const EvenGrids& r, const std::vector<V>& base) {
    std::vector<V> out(r.n_vertices());
    r.points(std::span<const V>(base), std::span(out));
    return out;
}

/// Infinitely sharp creases and corners on random edges and vertices.
MeshData with_random_tags(MeshData mesh, unsigned seed) {
    std::mt19937 random(seed);
    mesh = test::random_displaced(std::move(mesh), seed, 0.05);
    const Topology t = test::topology_of(mesh);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (random() % 4 == 0)
            test::add_crease(mesh, {t.vertex[h], t.to_vertex(h)});
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (random() % 8 == 0)
            test::add_corner(mesh, v);
    }
    mesh.tags.push_back({"interpolateboundary", {int(random() % 3)}, {}, {}, 0});
    return mesh;
}

std::vector<NamedMesh> meshes() {
    auto all = test::closed_meshes();
    const auto add = [&](std::vector<NamedMesh> more) {
        for (auto& mesh : more)
            all.push_back(std::move(mesh));
    };
    add(test::open_meshes());
    add(test::creased_meshes());
    for (unsigned seed = 0; seed < 6; ++seed) {
        add({{"tagged torus", with_random_tags(test::torus(4, 5), seed)},
             {"tagged pole", with_random_tags(test::pole(5, 2, 1), seed)},
             {"tagged dodecahedron", with_random_tags(test::dodecahedron(), seed)},
             {"tagged bipyramid", with_random_tags(test::bipyramid(7), seed)},
             {"tagged grid", with_random_tags(test::grid(3, 4), seed)},
             {"tagged fan", with_random_tags(test::border_fan(5), seed)}});
    }
    return test::thinned(all);
}

EvenGrids refined(const MeshData& mesh, int degree, int n_levels) {
    return {test::topology_of(mesh), degree, n_levels, test::features_of(mesh)};
}

/// The faces of a mesh by the vertices, each from its lowest vertex on.
std::multiset<std::vector<Index>> face_set(const std::vector<Index>& sizes,
                                           const std::vector<Index>& vertices) {
    std::multiset<std::vector<Index>> faces;
    auto first = vertices.begin();
    for (const Index n : sizes) {
        std::vector<Index> face(first, first + n);
        std::rotate(face.begin(), std::ranges::min_element(face), face.end());
        faces.insert(std::move(face));
        first += n;
    }
    return faces;
}

/// As in the tests of OddGrids. The point beyond an extraordinary vertex of n faces
/// has weights whose absolute values sum to 7; it has a sixteenth of the weight, or less.
template <class T>
double rounding(const Refinement& r, const MeshData& mesh) {
    double largest = 0;
    for (const auto& p : mesh.positions)
        largest = std::max(largest, glm::length(p));
    return 2 * double(test::sum_of_longest_rows(r, 9)) *
           double(std::numeric_limits<T>::epsilon()) * largest;
}

/// Edges with one face.
std::size_t n_border_edges(const std::vector<Index>& sizes,
                           const std::vector<Index>& vertices) {
    std::set<std::pair<Index, Index>> edges;
    auto first = vertices.begin();
    for (const Index n : sizes) {
        for (Index k = 0; k < n; ++k) {
            // No two faces run the same way along an edge.
            EXPECT_TRUE(edges.insert({first[k], first[(k + 1) % n]}).second);
        }
        first += n;
    }
    return std::ranges::count_if(edges, [&](const auto& e) {
        return !edges.contains({e.second, e.first});
    });
}

// As many vertices, points at the places of the general refinement, and faces between the same
// places. Both sides of a crease have the same places, so the borders are counted besides.
template <class T>
void expect_mesh_of_refinement(const MeshData& mesh, int degree, int n_levels) {
    const EvenGrids ours = refined(mesh, degree, n_levels);
    Refinement theirs(test::topology_of(mesh), degree, test::features_of(mesh));
    for (int l = 0; l < n_levels; ++l)
        theirs.add_level();
    const Topology& t = theirs.topology(n_levels);
    const auto expected = theirs.points(mesh.positions);
    const auto actual = points(ours, base_points<T>(mesh));
    const double tolerance = rounding<T>(theirs, mesh);

    // Vertices without faces there are points of creases. Places are vertices there.
    std::vector<Index> order;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (t.vertex_halfedge[v] != kInvalidIndex)
            order.push_back(v);
    }
    ASSERT_EQ(order.size(), actual.size());
    ASSERT_EQ(ours.n_vertices(), actual.size());
    std::ranges::sort(order, {}, [&](Index v) { return expected[v].x; });
    const auto place = [&](const Vec3<double>& p) {
        Index best = kInvalidIndex;  // the lowest: the same for both sides of a crease
        for (auto v = std::ranges::lower_bound(order, p.x - tolerance, {},
                                               [&](Index u) { return expected[u].x; });
             v != order.end() && expected[*v].x <= p.x + tolerance; ++v) {
            if (glm::distance(p, expected[*v]) <= tolerance)
                best = std::min(*v, best);
        }
        return best;
    };
    std::vector<Index> sizes(ours.n_faces()), vertices(ours.n_halfedges());
    ours.faces(sizes, vertices);
    MeshData other = to_mesh_data(t, expected);
    ASSERT_EQ(std::accumulate(sizes.begin(), sizes.end(), Index(0)), vertices.size());
    ASSERT_EQ(vertices.size(), other.face_vertices.size());
    ASSERT_EQ(n_border_edges(sizes, vertices), ours.n_border_edges());
    ASSERT_EQ(n_border_edges(sizes, vertices),
              n_border_edges(other.face_sizes, other.face_vertices));
    for (Index& v : vertices) {
        ASSERT_NE(place(Vec3<double>(actual[v])), kInvalidIndex) << "vertex " << v;
        v = place(Vec3<double>(actual[v]));
    }
    for (Index& v : other.face_vertices)
        v = place(expected[v]);
    ASSERT_EQ(face_set(sizes, vertices), face_set(other.face_sizes, other.face_vertices));
}

template <class F>
void for_each_case(const std::vector<int>& levels, F&& f) {
    for (const auto& [name, mesh] : meshes()) {
        for (const int d : kEvenDegrees) {
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

TEST(EvenGrids, GivesTheMeshOfRefinementInDouble) {
    for_each_case({1, 3}, expect_mesh_of_refinement<double>);
}

TEST(EvenGrids, GivesTheMeshOfRefinementInFloat) {
    for_each_case({2}, expect_mesh_of_refinement<float>);
}

TEST(EvenGrids, TakesWhatIsNotSemiSharp) {
    EXPECT_TRUE(EvenGrids::takes({}));
    for (const auto& [name, mesh] : test::creased_meshes())
        EXPECT_TRUE(EvenGrids::takes(test::features_of(mesh))) << name;
    Features f;
    f.edge_sharpness = {0, kInfinitelySharp, 0};
    f.vertex_sharpness = {kInfinitelySharp, 0};
    EXPECT_TRUE(EvenGrids::takes(f));
    f.edge_sharpness[2] = 0.5;
    EXPECT_FALSE(EvenGrids::takes(f));
    f.edge_sharpness.clear();
    f.vertex_sharpness[1] = 9;
    EXPECT_FALSE(EvenGrids::takes(f));
}

TEST(EvenGrids, DoesNotDependOnThreads) {
    const MeshData mesh = with_random_tags(test::pole(7, 6, 9), 1);
    for (const int d : kEvenDegrees) {
        const EvenGrids r = refined(mesh, d, 4);
        const auto run = [&](int n_threads) {
            std::pair<std::vector<Vec3<float>>, std::vector<Index>> result;
            test::with_threads(n_threads, [&] {
                result.first = points(r, base_points<float>(mesh));
                std::vector<Index> sizes(r.n_faces());
                result.second.resize(r.n_halfedges());
                r.faces(sizes, result.second);
            });
            return result;
        };
        const auto one = run(1), two = run(2), four = run(4);
        EXPECT_EQ(one, two);
        EXPECT_EQ(one, four);
    }
}

// Channels do not mix: the same sums, so the same bits.
TEST(EvenGrids, TakesTwoChannels) {
    const MeshData mesh = with_random_tags(test::pole(5, 2, 1), 2);
    for (const int d : kEvenDegrees) {
        const EvenGrids r = refined(mesh, d, 3);
        const auto three = base_points<double>(mesh);
        const std::vector<Vec2<double>> two(three.begin(), three.end());
        const auto a = points(r, two);
        const auto b = points(r, three);
        for (Index v = 0; v < b.size(); ++v)
            ASSERT_EQ(a[v], Vec2<double>(b[v]));
    }
}

TEST(EvenGrids, KeepsCoincidentPointsTogether) {
    MeshData mesh = test::pole(5, 2, 1);
    std::ranges::fill(mesh.positions, Vec3<double>(1, 2, 4));
    for (const int d : kEvenDegrees) {
        for (const auto& p : points(refined(mesh, d, 3), mesh.positions))
            ASSERT_LE(glm::distance(p, {1, 2, 4}), 1e-13);
    }
}

TEST(EvenGrids, TakesAnEmptyMesh) {
    const EvenGrids r(Topology{}, 4, 2);
    EXPECT_EQ(r.n_vertices(), 0u);
    EXPECT_EQ(r.n_faces(), 0u);
    std::vector<Vec3<double>> none;
    r.points(std::span<const Vec3<double>>(none), std::span(none));
    r.faces({}, {});
}

}  // namespace
}  // namespace osdx
