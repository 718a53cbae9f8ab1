// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/uniform.h"

#include <algorithm>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "far/refine/refinement.h"
#include "tests/support/refine_support.h"
#include "tests/support/test_meshes.h"

// That its meshes are those of Refinement: tests/osd_ext/subdivide_test.cpp.

namespace osdx {
namespace {

using test::base_points;

template <class V>
std::vector<V> points(const UniformRefinement& r, const std::vector<V>& base) {
    std::vector<V> out(r.n_vertices());
    r.points(std::span<const V>(base), std::span(out));
    return out;
}

/// Calls f(mesh, refinement, degree) for each engine, with two levels or none.
template <class F>
void for_each_engine(F&& f) {
    for (const auto& meshes : {test::creased_meshes(), test::semi_sharp_meshes()}) {
        for (const int d : {3, 4}) {
            for (const int n_levels : {0, 2}) {
                const auto& [name, mesh] = meshes.front();
                SCOPED_TRACE(name + ", degree " + std::to_string(d) + ", levels " +
                             std::to_string(n_levels));
                f(mesh, UniformRefinement(test::topology_of(mesh), d, n_levels,
                                          test::features_of(mesh)));
            }
        }
    }
}

// Channels do not mix: the same sums, so the same bits.
TEST(UniformRefinement, TakesTwoChannels) {
    for_each_engine([](const MeshData& mesh, const UniformRefinement& r) {
        const std::vector<Vec2<double>> flat(mesh.positions.begin(),
                                             mesh.positions.end());
        const auto two = points(r, flat);
        const auto three = points(r, mesh.positions);
        for (Index v = 0; v < r.n_vertices(); ++v)
            ASSERT_EQ(two[v], Vec2<double>(three[v]));
    });
}

TEST(UniformRefinement, TakesFloat) {
    for_each_engine([](const MeshData& mesh, const UniformRefinement& r) {
        const auto in_float = points(r, base_points<float>(mesh));
        const auto in_double = points(r, mesh.positions);
        const double tolerance =
            100 * std::numeric_limits<float>::epsilon() * test::diagonal(mesh);
        for (Index v = 0; v < r.n_vertices(); ++v)
            ASSERT_LE(glm::distance(Vec3<double>(in_float[v]), in_double[v]), tolerance);
        const auto flat = base_points<float>(mesh);
        const auto two = points(r, std::vector<Vec2<float>>(flat.begin(), flat.end()));
        for (Index v = 0; v < r.n_vertices(); ++v)
            ASSERT_EQ(two[v], Vec2<float>(in_float[v]));
    });
}

TEST(UniformRefinement, CountsItsFacesAndBorders) {
    for_each_engine([](const MeshData&, const UniformRefinement& r) {
        std::vector<Index> sizes(r.n_faces()), vertices(r.n_halfedges());
        r.faces(sizes, vertices);
        std::size_t n_corners = 0;
        std::map<std::pair<Index, Index>, int> n_faces;  // of each edge
        for (const Index n : sizes) {
            for (Index i = 0; i < n; ++i) {
                const Index a = vertices[n_corners + i],
                            b = vertices[n_corners + (i + 1) % n];
                ASSERT_LT(a, r.n_vertices());
                ++n_faces[std::minmax(a, b)];
            }
            n_corners += n;
        }
        EXPECT_EQ(n_corners, r.n_halfedges());
        Index n_border = 0;
        for (const auto& [edge, n] : n_faces)
            n_border += n == 1;
        EXPECT_EQ(r.n_border_edges(), n_border);
    });
}

}  // namespace
}  // namespace osdx
