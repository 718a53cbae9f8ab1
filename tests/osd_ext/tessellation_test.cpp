// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <atomic>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/openmesh.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/tessellate.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

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

/// Directed edges of the facets, each with the number of its facets.
std::map<std::pair<Index, Index>, int> directed_edges(const Tessellation& t) {
    std::map<std::pair<Index, Index>, int> edges;
    for (const auto& f : facets(t)) {
        for (std::size_t i = 0; i < f.size(); ++i)
            ++edges[{f[i], f[(i + 1) % f.size()]}];
    }
    return edges;
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
            const auto edges = directed_edges(t);
            const std::set<Index> used(t.facet_points.begin(), t.facet_points.end());
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

// ---- Borders, holes and sharp edges ----

/// The faces of a mesh as they are: bilinear in each quarter.
struct Facets {
    const MeshData& mesh;
    const Topology& base;

    SurfaceJet<double> operator()(const QuarterPoint& q) const {
        const auto corner = [&](Index h) { return mesh.positions[base.vertex[h]]; };
        const Index f = base.face(q.quarter);
        Vec3<double> centre(0);
        for (Index h = base.face_offsets[f]; h < base.face_offsets[f + 1]; ++h)
            centre += corner(h) / double(base.face_size(f));
        const auto p = corner(q.quarter);
        const auto a = 0.5 * (p + corner(base.next(q.quarter))),
                   b = 0.5 * (p + corner(base.prev(q.quarter)));
        SurfaceJet<double> s;
        s.p = (1 - q.x) * (1 - q.y) * p + q.x * (1 - q.y) * a + q.x * q.y * centre +
              (1 - q.x) * q.y * b;
        s.du = (1 - q.y) * (a - p) + q.y * (centre - b);
        s.dv = (1 - q.x) * (b - p) + q.x * (centre - a);
        return s;
    }
};

/// The faces without holes are an oriented surface whose border is that of the faces: `rate`
/// segments for each edge with one face.
void expect_border(const Tessellation& t, const Topology& base,
                   const ResolvedFeatures& features, int rate) {
    const auto is_there = [&](Index h) {
        return h != kInvalidIndex && !features.is_hole(base.face(h));
    };
    std::size_t n_border = 0;
    for (Index h = 0; h < base.n_halfedges(); ++h)
        n_border += is_there(h) && !is_there(base.twin[h]);
    std::size_t n_found = 0;
    const auto edges = directed_edges(t);
    for (const auto& [edge, n] : edges) {
        ASSERT_EQ(n, 1) << edge.first << " " << edge.second;
        n_found += !edges.contains({edge.second, edge.first});
    }
    EXPECT_EQ(n_found, n_border * rate);
    std::set<Index> used(t.facet_points.begin(), t.facet_points.end());
    EXPECT_EQ(used.size(), t.positions.size());
    std::set<Index> used_normals(t.facet_normals.begin(), t.facet_normals.end());
    EXPECT_EQ(used_normals.size(), t.normals.size());
}

TEST(Tessellation, KeepsTheBordersOfOpenMeshes) {
    for (const NamedMesh& m : open_meshes()) {
        if (m.data.face_sizes.size() > 100)
            continue;
        const Topology base = topology_of(m.data);
        for (int rate = 1; rate <= 4; ++rate) {
            SCOPED_TRACE(testing::Message() << m.name << ", rate " << rate);
            const ResolvedFeatures features = resolve(base, {});
            const Tessellation t = tessellate(base, features, rate, Facets{m.data, base});
            expect_border(t, base, features, rate);
            // All sharp edges are at the border.
            EXPECT_TRUE(t.facet_normals == t.facet_points);
        }
    }
}

TEST(Tessellation, LeavesHolesOut) {
    for (const NamedMesh& m : closed_meshes()) {
        const Topology base = topology_of(m.data);
        ResolvedFeatures features;
        features.hole.resize(base.n_faces());
        for (Index f = 0; f < base.n_faces(); ++f)
            features.hole[f] = f % 3 == 0 || f == 1;
        std::atomic<bool> inside_hole = false;
        const auto surface = [&](const QuarterPoint& q) {
            if (features.hole[base.face(q.quarter)])
                inside_hole = true;
            return Facets{m.data, base}(q);
        };
        for (int rate = 1; rate <= 4; ++rate) {
            SCOPED_TRACE(testing::Message() << m.name << ", rate " << rate);
            const Tessellation t = tessellate(base, features, rate, surface);
            for (const Index f : t.facet_faces)
                ASSERT_FALSE(features.hole[f]);
            expect_border(t, base, features, rate);
            EXPECT_FALSE(inside_hole);
        }
    }
}

TEST(Tessellation, OfHolesOnlyIsEmpty) {
    const MeshData mesh = cube();
    const Topology base = topology_of(mesh);
    ResolvedFeatures features;
    features.hole.assign(6, true);
    const Tessellation t = tessellate(base, features, 3, Facets{mesh, base});
    EXPECT_TRUE(t.positions.empty());
    EXPECT_TRUE(t.normals.empty());
    EXPECT_TRUE(t.facet_points.empty());
    EXPECT_TRUE(triangles(t).empty());
}

/// A number that tells the place in a face.
double tag_of(const Facets& facets, const QuarterPoint& q) {
    return glm::dot(facets(q).p, Vec3<double>(0.3, 0.2, 0.1));
}

/// A jet whose normal, in the upper half space, tells the face and the place in it.
SurfaceJet<double> tagged_jet(const Facets& facets, const QuarterPoint& q) {
    const double x = 0.001 * (facets.base.face(q.quarter) + 1);
    return {{}, {1, 0, x}, {0, 1, tag_of(facets, q)}, {}, {}, {}};
}
Index tagged_face(const Vec3<double>& normal) {
    return static_cast<Index>(std::lround(-1000 * normal.x / normal.z) - 1);
}

// Against a search that knows no order about a vertex: two faces at a vertex are on one side
// if a walk over faces with it, through edges with it that are not sharp, joins them.
TEST(Tessellation, HasANormalForEachSideOfSharpEdges) {
    auto meshes = closed_meshes();
    for (auto& m : open_meshes())
        meshes.push_back(std::move(m));
    std::mt19937 random(7);
    int n_split = 0;
    for (const NamedMesh& m : meshes) {
        const Topology base = topology_of(m.data);
        const Facets faces{m.data, base};
        for (const Index sparsity : {1u, 2u, 4u, 9u}) {
            Features given;
            given.edge_sharpness.resize(base.n_edges);
            for (double& s : given.edge_sharpness)
                s = random() % sparsity == 0 ? kInfinitelySharp : 9.5;
            given.hole.resize(base.n_faces());
            for (Index f = 0; f < base.n_faces(); ++f)
                given.hole[f] = random() % 8 == 0;
            const ResolvedFeatures features = resolve(base, std::move(given));
            const RateArrays rates = rates_of_edges(
                base, [&](Index) { return 1 + static_cast<int>(random() % 4); });
            SCOPED_TRACE(testing::Message() << m.name << ", sparsity " << sparsity);
            const Tessellation t =
                tessellate(base, features, rates,
                           [&](const QuarterPoint& q) { return tagged_jet(faces, q); });

            // By vertex, the least corner that a walk from each corner reaches.
            std::vector<Index> side(base.n_halfedges());
            std::iota(side.begin(), side.end(), Index(0));
            for (bool changed = true; changed;) {
                changed = false;
                for (Index h = 0; h < base.n_halfedges(); ++h) {
                    if (base.is_border(h) ||
                        features.edge(base.edge[h]) >= kInfinitelySharp)
                        continue;
                    const Index there = base.twin[h];
                    for (const auto& [a, b] :
                         {std::pair(h, base.next(there)), {base.next(h), there}}) {
                        const Index least = std::min(side[a], side[b]);
                        changed = changed || side[a] != side[b];
                        side[a] = side[b] = least;
                    }
                }
            }
            const auto is_side_of = [&](Index normal_face, Index face, Index vertex) {
                const auto at = [&](Index f) {
                    for (Index h = base.face_offsets[f]; h < base.face_offsets[f + 1];
                         ++h) {
                        if (base.vertex[h] == vertex)
                            return side[h];
                    }
                    return kInvalidIndex;
                };
                return at(normal_face) == at(face);
            };

            std::map<Index, std::set<Index>> normals_of_point;
            std::map<std::pair<Index, Index>, std::set<Index>> normals_of_side;
            for (std::size_t f = 0, c = 0; f < t.facet_sizes.size(); ++f) {
                for (Index i = 0; i < t.facet_sizes[f]; ++i, ++c) {
                    const Index face = t.facet_faces[f];
                    const Index normal = t.facet_normals[c];
                    const Index from = tagged_face(t.normals[normal]);
                    ASSERT_FALSE(features.hole[from]);
                    normals_of_point[t.facet_points[c]].insert(normal);
                    const QuarterPoint q =
                        to_quarter(base, {face, t.facet_uvs[c].x, t.facet_uvs[c].y});
                    if (from == face) {
                        const auto& n = t.normals[normal];
                        // Some ulps of tags below 1.
                        ASSERT_NEAR(-n.y / n.z, tag_of(faces, q), 1e-14);
                    }
                    const bool at_vertex = q.x == 0 && q.y == 0;
                    if (at_vertex) {
                        const Index v = base.vertex[q.quarter];
                        ASSERT_TRUE(is_side_of(from, face, v));
                        normals_of_side[{v, side[q.quarter]}].insert(normal);
                    } else if (from != face) {
                        // Only over a smooth edge, of a point on it.
                        ASSERT_TRUE(q.x == 0 || q.y == 0);
                        const Index h = q.y == 0 ? q.quarter : base.prev(q.quarter);
                        ASSERT_FALSE(base.is_border(h));
                        ASSERT_EQ(from, base.face(base.twin[h]));
                        ASSERT_LT(features.edge(base.edge[h]), kInfinitelySharp);
                    }
                }
            }
            for (const auto& [key, normals] : normals_of_side)
                ASSERT_EQ(normals.size(), 1u) << "vertex " << key.first;
            // As many normals at a vertex as sides with faces.
            std::map<Index, std::size_t> n_sides;
            for (const auto& [key, normals] : normals_of_side)
                ++n_sides[key.first];
            for (Index p = 0; p < t.positions.size(); ++p) {
                const QuarterPoint q = to_quarter(base, t.addresses[p]);
                if (q.x == 0 && q.y == 0) {
                    ASSERT_EQ(normals_of_point[p].size(),
                              n_sides[base.vertex[q.quarter]]);
                } else if (q.x == 0 || q.y == 0) {
                    const Index h = q.y == 0 ? q.quarter : base.prev(q.quarter);
                    const bool two = !base.is_border(h) &&
                                     features.edge(base.edge[h]) >= kInfinitelySharp &&
                                     !features.hole[base.face(h)] &&
                                     !features.hole[base.face(base.twin[h])];
                    ASSERT_EQ(normals_of_point[p].size(), two ? 2u : 1u);
                } else {
                    ASSERT_EQ(normals_of_point[p].size(), 1u);
                }
                n_split += normals_of_point[p].size() > 1;
            }
        }
    }
    EXPECT_GT(n_split, test::fewest(1000));
}

// All edges of a cube sharp: each facet has the normal of its face at all corners.
TEST(Tessellation, FacetsOfASharpCubeAreFlat) {
    const MeshData mesh = cube();
    const Topology base = topology_of(mesh);
    ResolvedFeatures features;
    features.edge_sharpness.assign(base.n_edges, kInfinitelySharp);
    const Tessellation t = tessellate(base, features, 3, Facets{mesh, base});
    EXPECT_EQ(t.positions.size(), 8u + 12 * 2 + 6 * 4);
    EXPECT_EQ(t.normals.size(), 6u * 16);
    std::size_t c = 0;
    for (const Index n : t.facet_sizes) {
        const auto p = [&](std::size_t i) { return t.positions[t.facet_points[c + i]]; };
        const auto flat = glm::normalize(glm::cross(p(1) - p(0), p(2) - p(0)));
        for (Index i = 0; i < n; ++i) {
            // Exact up to the rounding of a cross product.
            EXPECT_LT(glm::length(t.normals[t.facet_normals[c + i]] - flat), 1e-15);
        }
        c += n;
    }
}

TEST(Tessellation, ASharpEdgeThatEndsHasOneNormalThere) {
    const MeshData mesh = torus(4, 5);
    const Topology base = topology_of(mesh);
    ResolvedFeatures features;
    features.edge_sharpness.assign(base.n_edges, 0.0);
    features.edge_sharpness[7] = kInfinitelySharp;
    const Tessellation t = tessellate(base, features, 4, Facets{mesh, base});
    EXPECT_EQ(t.normals.size(), t.positions.size() + 3);
}

TEST(Tessellation, DoesNotDependOnTheNumberOfThreads) {
    const Surface s = surface_of(dodecahedron(), 5);
    const Tessellation many = s.tessellate(9);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Tessellation single = s.tessellate(9);
    EXPECT_TRUE(many.positions == single.positions);
    EXPECT_TRUE(many.facet_normals == many.facet_points);
    EXPECT_TRUE(many.normals == single.normals);
    EXPECT_TRUE(many.facet_points == single.facet_points);
    EXPECT_TRUE(many.facet_normals == single.facet_normals);
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
