// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "osd_ext/tessellation.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <map>
#include <set>

#include "far/mesh.h"
#include "osd_ext/surface.h"
#include "tests/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

struct Case {
    const char* name;
    MeshData mesh;
};

std::vector<Case> cases() {
    std::vector<Case> all;
    all.push_back({"cube", cube()});
    all.push_back({"tetrahedron", tetrahedron()});
    all.push_back({"dodecahedron", dodecahedron()});
    all.push_back({"prism(7)", prism(7)});
    all.push_back({"prism(11)", prism(11)});
    return all;
}

Surface surface_of(const MeshData& mesh, int degree = 3) {
    auto s = Surface::build(mesh, {.degree = degree});
    EXPECT_TRUE(s) << (s ? "" : s.error().message);
    return std::move(*s);
}

std::vector<std::vector<Index>> facets(const Tessellation& t) {
    std::vector<std::vector<Index>> all;
    const Index* p = t.facet_points.data();
    for (const Index n : t.facet_sizes) {
        all.emplace_back(p, p + n);
        p += n;
    }
    return all;
}

// Closed, oriented and connected like the base mesh: every directed edge once, its reverse
// once, the same Euler number, and every point used.
TEST(Tessellation, IsWatertight) {
    for (const Case& c : cases()) {
        const Surface s = surface_of(c.mesh);
        const Topology& base = s.base();
        for (int rate = 1; rate <= 7; ++rate) {
            SCOPED_TRACE(testing::Message() << c.name << ", rate " << rate);
            const Tessellation t = s.tessellate(rate);
            std::map<std::pair<Index, Index>, int> edges;
            std::set<Index> used;
            for (const auto& f : facets(t)) {
                for (std::size_t i = 0; i < f.size(); ++i) {
                    ++edges[{f[i], f[(i + 1) % f.size()]}];
                    used.insert(f[i]);
                }
            }
            for (const auto& [edge, n] : edges) {
                ASSERT_EQ(n, 1) << edge.first << " " << edge.second;
                ASSERT_TRUE(edges.contains({edge.second, edge.first}))
                    << edge.first << " " << edge.second;
            }
            EXPECT_EQ(used.size(), t.positions.size());
            const auto euler = [](std::size_t v, std::size_t e, std::size_t f) {
                return static_cast<long>(v) - static_cast<long>(e) + static_cast<long>(f);
            };
            EXPECT_EQ(euler(t.positions.size(), edges.size() / 2, t.facet_sizes.size()),
                      euler(base.n_vertices(), base.n_edges, base.n_faces()));
        }
    }
}

// The (u, v) of a facet's corner names the stored point, whichever face it is seen from:
// equal to rounding of the evaluation, some tens of eps of the coordinates of size 1.
TEST(Tessellation, CornersNameTheirPoints) {
    for (const Case& c : cases()) {
        const Surface s = surface_of(c.mesh, 4);
        for (const int rate : {1, 2, 5, 6}) {
            SCOPED_TRACE(testing::Message() << c.name << ", rate " << rate);
            const Tessellation t = s.tessellate(rate);
            std::size_t k = 0;
            for (std::size_t f = 0; f < t.facet_sizes.size(); ++f) {
                for (Index i = 0; i < t.facet_sizes[f]; ++i, ++k) {
                    const auto p =
                        s.evaluate({t.facet_faces[f], t.facet_uvs[k].x, t.facet_uvs[k].y})
                            .p;
                    ASSERT_LT(glm::length(p - t.positions[t.facet_points[k]]), 1e-13);
                }
            }
        }
    }
}

// At even rates the corners of a facet lie in one quarter, so that its (u, v) may be
// interpolated: their spread is that of one segment.
TEST(Tessellation, FacetsOfEvenRatesStayInOneTile) {
    for (const Case& c : cases()) {
        const Surface s = surface_of(c.mesh);
        for (const int rate : {2, 4, 6}) {
            SCOPED_TRACE(testing::Message() << c.name << ", rate " << rate);
            const Tessellation t = s.tessellate(rate);
            const Vec2<double>* uv = t.facet_uvs.data();
            for (const Index n : t.facet_sizes) {
                Vec2<double> lo = uv[0], hi = uv[0];
                for (Index i = 1; i < n; ++i) {
                    lo = glm::min(lo, uv[i]);
                    hi = glm::max(hi, uv[i]);
                }
                // The differences of multiples of 1/rate err by an ulp of the tile number.
                ASSERT_LT(hi.x - lo.x, 1.0 / rate + 1e-14);
                ASSERT_LT(hi.y - lo.y, 1.0 / rate + 1e-14);
                uv += n;
            }
        }
    }
}

TEST(Tessellation, NormalsPointOutOfAConvexBody) {
    const Surface s = surface_of(cube());
    const Tessellation t = s.tessellate(4);
    for (std::size_t i = 0; i < t.positions.size(); ++i) {
        // The cube is centred at the origin.
        EXPECT_GT(glm::dot(t.normals[i], t.positions[i]), 0) << i;
        EXPECT_NEAR(glm::length(t.normals[i]), 1, 1e-15) << i;
    }
}

// The volume of the inscribed polyhedron converges with the square of the facet size: two
// halvings cut the difference to the finest by about 1/4 each.
TEST(Tessellation, VolumeConvergesAtSecondOrder) {
    const Surface s = surface_of(cube());
    const auto volume = [&](int rate) {
        const Tessellation t = s.tessellate(rate);
        double sum = 0;
        for (const auto& tri : triangles(t)) {
            sum += glm::dot(t.positions[tri[0]],
                            glm::cross(t.positions[tri[1]], t.positions[tri[2]]));
        }
        return sum / 6;
    };
    const double fine = volume(64), a = fine - volume(4), b = fine - volume(8);
    EXPECT_GT(a, 0);  // chords of a convex body lie inside
    EXPECT_NEAR(a / b, 4, 0.3);
}

TEST(Tessellation, DoesNotDependOnTheNumberOfThreads) {
    const Surface s = surface_of(dodecahedron(), 5);
    const Tessellation many = s.tessellate(9);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Tessellation single = s.tessellate(9);
    EXPECT_TRUE(many.positions == single.positions);
    EXPECT_TRUE(many.normals == single.normals);
    EXPECT_TRUE(many.facet_points == single.facet_points);
}

TEST(Tessellation, TrianglesCoverTheFacets) {
    const Surface s = surface_of(prism(5));
    for (const int rate : {3, 4}) {
        const Tessellation t = s.tessellate(rate);
        std::size_t expected = 0;
        for (const Index n : t.facet_sizes)
            expected += n - 2;
        EXPECT_EQ(triangles(t).size(), expected);
    }
}

}  // namespace
}  // namespace osdx
