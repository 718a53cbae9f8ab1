// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/displace.h>
#include <osdx/evaluator.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/tessellate.h>
#include <osdx/texture.h>

#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using namespace test;
using Point = Vec3<double>;

/// Closed, open and creased ones; some with holes.
std::vector<NamedMesh> meshes() {
    std::vector<NamedMesh> all = closed_meshes();
    for (auto list : {open_meshes(), creased_meshes()}) {
        for (NamedMesh& m : list)
            all.push_back(std::move(m));
    }
    std::erase_if(all, [](const NamedMesh& m) { return m.data.face_sizes.size() > 150; });
    return all;
}

Surface surface_of(const MeshData& mesh) {
    auto s = Surface::build(mesh);
    EXPECT_TRUE(s) << (s ? "" : s.error().message);
    return std::move(*s);
}

RateArrays random_rates(const Topology& base, unsigned seed, int most = 16) {
    std::mt19937 random(seed);
    const auto rate = [&] { return 1 + static_cast<int>(random() % most); };
    RateArrays rates = rates_of_edges(base, [&](Index) { return rate(); });
    if (seed % 2 == 0) {
        for (Index f = 0; f < base.n_faces(); ++f)
            rates.faces.push_back(rate());
    }
    return rates;
}

/// A place in the plane: in the square, or in the regular n-gon of the unit circle.
Vec2<double> in_plane(const Topology& base, const Address& at) {
    const QuarterPoint q = to_quarter(base, at);
    const Index n = base.face_size(at.face), i = q.quarter - base.face_offsets[at.face];
    const auto corner = [&](Index k) {
        const double angle = 2 * std::numbers::pi * (k % n) / n;
        return Vec2<double>(std::cos(angle), std::sin(angle));
    };
    const auto p = corner(i), a = 0.5 * (p + corner(i + 1)),
               b = 0.5 * (p + corner(i + n - 1));
    return (1 - q.x) * (1 - q.y) * p + q.x * (1 - q.y) * a + (1 - q.x) * q.y * b;
}

double cross(const Vec2<double>& a, const Vec2<double>& b) {
    return a.x * b.y - a.y * b.x;
}

/// Each directed edge of facets once; those without a reverse are at borders, and are as many
/// as the rates there say.
void expect_closed(const Tessellation& t, const Topology& base,
                   const ResolvedFeatures& features, const TessellationRates& rates) {
    std::set<std::pair<Index, Index>> edges;
    const Index* p = t.facet_points.data();
    for (const Index n : t.facet_sizes) {
        for (Index i = 0; i < n; ++i)
            ASSERT_TRUE(edges.insert({p[i], p[(i + 1) % n]}).second) << p[i];
        p += n;
    }
    const auto is_there = [&](Index h) {
        return h != kInvalidIndex && !features.is_hole(base.face(h));
    };
    std::size_t n_border = 0, n_found = 0;
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        if (is_there(h) && !is_there(base.twin[h]))
            n_border += std::max(1, rates.edges[base.edge[h]]);
    }
    for (const auto& [a, b] : edges)
        n_found += !edges.contains({b, a});
    EXPECT_EQ(n_found, n_border);
    const std::set<Index> points(t.facet_points.begin(), t.facet_points.end());
    EXPECT_EQ(points.size(), t.positions.size());
    const std::set<Index> normals(t.facet_normals.begin(), t.facet_normals.end());
    EXPECT_EQ(normals.size(), t.normals.size());
    // No two points in the same place, so that what has equal points is joined.
    std::set<std::array<double, 3>> places;
    for (const Point& q : t.positions)
        places.insert({q.x, q.y, q.z});
    EXPECT_EQ(places.size(), t.positions.size());
}

/// Facets are convex, none is degenerate, and they cover each face once.
void expect_cover(const Tessellation& t, const Topology& base,
                  const ResolvedFeatures& features) {
    std::vector<double> area(base.n_faces(), 0);
    std::size_t c = 0;
    for (std::size_t f = 0; f < t.facet_sizes.size(); ++f) {
        const Index n = t.facet_sizes[f], face = t.facet_faces[f];
        const auto at = [&](Index i) {
            const Vec2<double> uv = t.facet_uvs[c + i % n];
            return in_plane(base, {face, uv.x, uv.y});
        };
        for (Index i = 0; i < n; ++i) {
            // Of rates to 32 the smallest is about 1/32^2.
            ASSERT_GT(cross(at(i + 1) - at(i), at(i + 2) - at(i)), 1e-5) << "facet " << f;
            area[face] += 0.5 * cross(at(i), at(i + 1));
        }
        c += n;
    }
    for (Index f = 0; f < base.n_faces(); ++f) {
        const double n = base.face_size(f);
        const double whole = 0.5 * n * std::sin(2 * std::numbers::pi / n);
        // Rounding of thousands of areas below 1.
        EXPECT_NEAR(area[f], features.is_hole(f) ? 0 : whole, 1e-12) << "face " << f;
    }
}

TEST(Adaptive, IsWatertightAndCoversEachFaceOnce) {
    for (const NamedMesh& m : meshes()) {
        const Surface s = surface_of(m.data);
        for (unsigned seed = 1; seed <= 2; ++seed) {
            SCOPED_TRACE(testing::Message() << m.name << ", seed " << seed);
            const RateArrays rates = random_rates(s.base(), seed);
            const Tessellation t = s.tessellate(rates);
            expect_closed(t, s.base(), s.features(), rates);
            expect_cover(t, s.base(), s.features());
        }
    }
}

// Few edges of many segments about a coarse inside, and the reverse.
TEST(Adaptive, AnyRateInsideMeetsAnyRateOfEdges) {
    const std::vector<int> to_8 = {1, 2, 3, 4, 5, 6, 7, 8};
    const std::vector<Index> kinds = {0, 1, 2};
    for (const MeshData& mesh : {cube(), tetrahedron(), prism(5), prism(11)}) {
        const Surface s = surface_of(mesh);
        for (const auto& c : thinned(combinations(to_8, to_8, kinds))) {
            const int inside = std::get<0>(c), edge = std::get<1>(c);
            const Index kind = std::get<2>(c);
            SCOPED_TRACE(testing::Message() << s.base().face_size(0) << " corners, "
                                            << inside << ", " << edge << ", " << kind);
            RateArrays rates = rates_of_edges(s.base(), [&](Index e) {
                return kind == 0 || e % 3 == kind ? edge : inside;
            });
            rates.faces.assign(s.base().n_faces(), inside);
            const Tessellation t = s.tessellate(rates);
            expect_closed(t, s.base(), s.features(), rates);
            expect_cover(t, s.base(), s.features());
        }
    }
}

// The (u, v) of a facet's corner names the stored point, whichever face it is seen from, and
// so does the address of the point: to rounding of the evaluation, hundreds of eps of
// coordinates up to some units. Points of an edge are at j/rate of it, to an ulp of an address.
TEST(Adaptive, PointsAreOnTheSurface) {
    for (const NamedMesh& m : meshes()) {
        SCOPED_TRACE(m.name);
        const Surface s = surface_of(m.data);
        const Topology& base = s.base();
        const RateArrays rates = random_rates(base, 6);
        const Tessellation t = s.tessellate(rates);
        std::size_t c = 0;
        std::map<Index, std::set<Index>> points_of_edge;
        for (std::size_t f = 0; f < t.facet_sizes.size(); ++f) {
            for (Index i = 0; i < t.facet_sizes[f]; ++i, ++c) {
                const Address a{t.facet_faces[f], t.facet_uvs[c].x, t.facet_uvs[c].y};
                const Index p = t.facet_points[c];
                ASSERT_LT(glm::length(s.evaluate(a).p - t.positions[p]), 1e-12);
                const QuarterPoint q = to_quarter(base, a);
                if (q.x != 0 && q.y != 0)
                    continue;
                const Index e = base.edge[q.y == 0 ? q.quarter : base.prev(q.quarter)];
                const double along = 0.5 * rates.edges[e] * (q.y == 0 ? q.x : q.y);
                ASSERT_NEAR(along, std::round(along), 1e-14);
                if (q.x != 0 || q.y != 0)
                    points_of_edge[e].insert(p);
            }
        }
        for (const auto& [e, points] : points_of_edge)
            ASSERT_EQ(points.size(), static_cast<std::size_t>(rates.edges[e] - 1));
        for (Index p = 0; p < t.positions.size(); ++p) {
            const SurfaceJet<double> jet = s.evaluate(t.addresses[p], Chart::Native);
            ASSERT_LT(glm::length(jet.p - t.positions[p]), 1e-12);
            // The stored normal and this one may be of patches on two sides of the point.
            ASSERT_LT(glm::length(normal(jet) - t.normals[p]), 1e-9);
        }
    }
}

// At even rates no facet leaves its quarter, so that its (u, v) may be interpolated.
TEST(Adaptive, FacetsOfEvenRatesStayInOneTile) {
    for (const MeshData& mesh : {cube(), tetrahedron(), prism(5), prism(11)}) {
        const Surface s = surface_of(mesh);
        RateArrays rates = random_rates(s.base(), 8, 8);
        for (auto* all : {&rates.edges, &rates.faces}) {
            for (int& r : *all)
                r *= 2;
        }
        const Tessellation t = s.tessellate(rates);
        std::size_t c = 0;
        for (std::size_t f = 0; f < t.facet_sizes.size(); ++f) {
            const Index n = t.facet_sizes[f];
            Vec2<double> lo = t.facet_uvs[c], hi = lo;
            for (Index i = 0; i < n; ++i, ++c) {
                lo = glm::min(lo, t.facet_uvs[c]);
                hi = glm::max(hi, t.facet_uvs[c]);
            }
            // Rounding of tile numbers.
            ASSERT_LT(hi.x - lo.x, 0.5 + 1e-14);
            ASSERT_LT(hi.y - lo.y, 0.5 + 1e-14);
        }
    }
}

void expect_same(const Tessellation& a, const Tessellation& b) {
    EXPECT_TRUE(a.positions == b.positions);
    EXPECT_TRUE(a.normals == b.normals);
    EXPECT_TRUE(a.facet_sizes == b.facet_sizes);
    EXPECT_TRUE(a.facet_faces == b.facet_faces);
    EXPECT_TRUE(a.facet_points == b.facet_points);
    EXPECT_TRUE(a.facet_normals == b.facet_normals);
    EXPECT_TRUE(a.facet_uvs == b.facet_uvs);
    EXPECT_TRUE(std::ranges::equal(
        a.addresses, b.addresses, [](const Address& x, const Address& y) {
            return x.face == y.face && x.u == y.u && x.v == y.v;
        }));
}

TEST(Adaptive, EqualRatesAreThoseOfOneNumber) {
    for (const NamedMesh& m : meshes()) {
        const Surface s = surface_of(m.data);
        for (int rate = 1; rate <= 5; ++rate) {
            SCOPED_TRACE(testing::Message() << m.name << ", rate " << rate);
            RateArrays rates = rates_of_edges(s.base(), [&](Index) { return rate; });
            expect_same(s.tessellate(rates), s.tessellate(rate));
            rates.faces.assign(s.base().n_faces(), rate);
            expect_same(s.tessellate(rates), s.tessellate(rate));
        }
    }
}

// One edge more finely: the other faces are as before, though evaluated one by one.
TEST(Adaptive, ARateOfOneEdgeChangesItsFacesAlone) {
    const Surface s = surface_of(random_displaced(torus(5, 6), 3, 0.1));
    RateArrays rates = rates_of_edges(s.base(), [](Index e) { return e == 7 ? 9 : 4; });
    rates.faces.assign(s.base().n_faces(), 4);
    const Tessellation all = s.tessellate(4), t = s.tessellate(rates);
    const auto corners = [&](const Tessellation& of, Index face) {
        std::vector<Point> points;
        std::size_t c = 0;
        for (std::size_t f = 0; f < of.facet_sizes.size(); ++f) {
            for (Index i = 0; i < of.facet_sizes[f]; ++i, ++c) {
                if (of.facet_faces[f] == face)
                    points.push_back(of.positions[of.facet_points[c]]);
            }
        }
        return points;
    };
    int n_changed = 0;
    for (Index f = 0; f < s.base().n_faces(); ++f) {
        const auto a = corners(all, f), b = corners(t, f);
        n_changed += a.size() != b.size();
        for (std::size_t i = 0; i < a.size() && a.size() == b.size(); ++i)
            ASSERT_LT(glm::distance(a[i], b[i]), 1e-14);
    }
    EXPECT_EQ(n_changed, 2);
    for (Index p = 0; p < t.positions.size(); ++p)
        ASSERT_LT(glm::distance(t.positions[p], s.evaluate(t.addresses[p]).p), 1e-14);
}

TEST(Adaptive, RatesBelowOneCountAsOne) {
    const Surface s = surface_of(prism(5));
    const RateArrays rates = rates_of_edges(
        s.base(), [](Index e) { return e % 2 ? std::numeric_limits<int>::min() : 0; });
    expect_same(s.tessellate(rates), s.tessellate(1));
    expect_same(s.tessellate(-3), s.tessellate(1));
    expect_same(s.tessellate(TessellationRates{}), s.tessellate(1));
}

TEST(Adaptive, OfHolesOnlyIsEmpty) {
    const MeshData mesh = cube();
    const Topology base = topology_of(mesh);
    ResolvedFeatures features;
    features.hole.assign(6, true);
    Tessellation t = tessellate(base, features, random_rates(base, 1),
                                [](const QuarterPoint&) { return SurfaceJet<double>(); });
    EXPECT_TRUE(t.positions.empty());
    EXPECT_TRUE(t.facet_points.empty());
    displace(t, [](const Address&, const Point&, const Point&) { return 1.0; });
    EXPECT_TRUE(t.normals.empty());
}

TEST(Adaptive, DoesNotDependOnTheNumberOfThreads) {
    const Surface s = surface_of(truncated_icosahedron());
    const RateArrays rates = random_rates(s.base(), 2);
    const Tessellation many = s.tessellate(rates);
    const RateArrays of_error = rates_from_error(s.evaluator(), s.points(), 1e-3);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    expect_same(s.tessellate(rates), many);
    const RateArrays again = rates_from_error(s.evaluator(), s.points(), 1e-3);
    EXPECT_EQ(again.edges, of_error.edges);
    EXPECT_EQ(again.faces, of_error.faces);
}

// ---- Rates that are measured ----

/// The greatest distance of the middles of triangles and of their sides from the surface,
/// along its normal.
double distance(const Surface& s, const Tessellation& t) {
    double greatest = 0;
    std::size_t c = 0;
    for (std::size_t f = 0; f < t.facet_sizes.size(); ++f) {
        const Index n = t.facet_sizes[f];
        for (Index k = 2; k < n; ++k) {
            const std::array<std::size_t, 3> triangle = {c, c + k - 1, c + k};
            const std::array<std::array<double, 3>, 4> weights = {
                {{1 / 3.0, 1 / 3.0, 1 / 3.0},
                 {0.5, 0.5, 0},
                 {0, 0.5, 0.5},
                 {0.5, 0, 0.5}}};
            for (const auto& w : weights) {
                Point p(0);
                Vec2<double> uv(0);
                for (int i = 0; i < 3; ++i) {
                    p += w[i] * t.positions[t.facet_points[triangle[i]]];
                    uv += w[i] * t.facet_uvs[triangle[i]];
                }
                const auto jet =
                    s.evaluate({t.facet_faces[f], uv.x, uv.y}, Chart::Native);
                greatest = std::max(greatest, std::abs(glm::dot(jet.p - p, normal(jet))));
            }
        }
        c += n;
    }
    return greatest;
}

// The estimate is that of the leading term along the sides of cells, met but for a factor, where
// the surface does not bend within an eighth of a face as it does at sharp corners of borders.
TEST(Adaptive, RatesFromErrorComeNearIt) {
    for (const NamedMesh& m : closed_meshes()) {
        // (u, v) of facets of odd rates may not be interpolated in other polygons.
        if (m.data.face_sizes.size() > 150 ||
            std::ranges::any_of(m.data.face_sizes, [](Index n) { return n != 4; }))
            continue;
        SCOPED_TRACE(m.name);
        const Surface s = surface_of(m.data);
        for (const double error : {1e-2, 1e-3}) {
            const RateArrays rates =
                rates_from_error(s.evaluator(), s.points(), error, 200);
            const double found = distance(s, s.tessellate(rates));
            EXPECT_LT(found, 1.5 * error);
            // With half of the rates it would be four times as much: none is wasted.
            EXPECT_GT(found, 0.25 * error);
        }
    }
}

TEST(Adaptive, AFlatMeshNeedsOneSegmentButAlongItsBorder) {
    MeshData mesh = grid(6, 6);
    const Surface s = surface_of(mesh);
    const RateArrays rates = rates_from_error(s.evaluator(), s.points(), 1e-4);
    for (const int r : rates.faces)
        EXPECT_EQ(r, 1);
    for (Index h = 0; h < s.base().n_halfedges(); ++h) {
        const bool at_border = s.base().is_border(h);
        if (!at_border) {
            EXPECT_EQ(rates.edges[s.base().edge[h]], 1);
        }
    }
    // The corners of the border are rounded.
    EXPECT_GT(std::ranges::max(rates.edges), 4);
}

TEST(Adaptive, RatesFromLengthAreThoseOfTheCurve) {
    // The curves bend little: eight chords have nearly all of their length.
    const Surface s = surface_of(random_displaced(prism(7), 5, 0.2));
    const double length = 0.05;
    const RateArrays rates = rates_from_length(s.evaluator(), s.points(), length);
    for (Index h = 0; h < s.base().n_halfedges(); ++h) {
        double sum = 0;
        for (int i = 0; i < 512; ++i) {
            const auto at = [&](double x) {
                return s.evaluator()
                    .evaluate<double>(s.points(), edge_point(s.base(), h, x))
                    .p;
            };
            sum += glm::distance(at(i / 512.0), at((i + 1) / 512.0));
        }
        EXPECT_NEAR(rates.edges[s.base().edge[h]], sum / length + 0.5, 0.55);
    }
    EXPECT_TRUE(rates.faces.empty());
}

TEST(Adaptive, AnErrorOrALengthOfZeroGivesTheGreatestRate) {
    const Surface s = surface_of(cube());
    for (const double zero : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        const RateArrays a = rates_from_error(s.evaluator(), s.points(), zero, 5),
                         b = rates_from_length(s.evaluator(), s.points(), zero, 5);
        for (const auto* all : {&a.edges, &a.faces, &b.edges}) {
            for (const int r : *all)
                EXPECT_EQ(r, 5);
        }
    }
    const double all = std::numeric_limits<double>::infinity();
    for (const int r : rates_from_error(s.evaluator(), s.points(), all).edges)
        EXPECT_EQ(r, 1);
}

// ---- Displacement ----

double waves(const Address&, const Point& p, const Point&) {
    return 0.03 * std::sin(9 * p.x) * std::cos(7 * p.y + 5 * p.z);
}

TEST(Displace, StaysClosed) {
    for (const NamedMesh& m : meshes()) {
        SCOPED_TRACE(m.name);
        const Surface s = surface_of(m.data);
        const RateArrays rates = random_rates(s.base(), 3);
        Tessellation t = s.tessellate(rates);
        const Tessellation before = t;
        displace(t, waves);
        expect_closed(t, s.base(), s.features(), rates);
        EXPECT_TRUE(t.facet_points == before.facet_points);
        for (Index p = 0; p < t.positions.size(); ++p) {
            const double moved = glm::distance(t.positions[p], before.positions[p]);
            const double height =
                std::abs(waves(t.addresses[p], before.positions[p], before.normals[p]));
            // Along a unit normal; some ulps of the position. At some points there is none.
            ASSERT_TRUE(std::abs(moved - height) < 1e-14 ||
                        (moved == 0 && before.normals[p] == Point(0)))
                << moved << " " << height;
        }
        for (const Point& n : t.normals)
            ASSERT_NEAR(glm::length(n), 1, 1e-14);
    }
}

/// The faces of the cube, bilinear, all edges sharp.
TEST(Displace, CornersOfASharpCubeMoveAlongTheirDiagonal) {
    const MeshData mesh = cube();
    const Topology base = topology_of(mesh);
    ResolvedFeatures features;
    features.edge_sharpness.assign(base.n_edges, kInfinitelySharp);
    const RateArrays rates = random_rates(base, 5, 4);
    Tessellation t = tessellate(base, features, rates, [&](const QuarterPoint& q) {
        const Address a = to_address(base, q);
        const Index first = base.face_offsets[a.face];
        const auto at = [&](Index c) { return mesh.positions[base.vertex[first + c]]; };
        SurfaceJet<double> jet;
        jet.du = at(1) - at(0);
        jet.dv = at(3) - at(0);
        jet.p = at(0) + a.u * jet.du + a.v * jet.dv;
        return jet;
    });
    const Tessellation before = t;
    displace(t, [](const Address&, const Point&, const Point&) { return 0.1; });
    expect_closed(t, base, features, rates);
    const double side = std::abs(mesh.positions[0].x);  // half of it
    for (std::size_t p = 0; p < t.positions.size(); ++p) {
        Point outwards(0);
        for (int k = 0; k < 3; ++k) {
            const double x = before.positions[p][k];
            if (std::abs(std::abs(x) - side) < 1e-12)
                outwards[k] = x > 0 ? 1 : -1;
        }
        const Point expected = before.positions[p] + 0.1 * glm::normalize(outwards);
        ASSERT_LT(glm::distance(t.positions[p], expected), 1e-14);
    }
    EXPECT_EQ(t.normals.size(), before.normals.size());

    // Kept on request; and of flat facets those of the facets are the same.
    Tessellation kept = before, same = before;
    displace(
        kept, [](const Address&, const Point&, const Point&) { return 0.1; },
        DisplacedNormals::Keep);
    EXPECT_TRUE(kept.normals == before.normals);
    EXPECT_TRUE(kept.positions == t.positions);
    displace(same, [](const Address&, const Point&, const Point&) { return 0.0; });
    for (std::size_t i = 0; i < same.normals.size(); ++i)
        ASSERT_LT(glm::distance(same.normals[i], before.normals[i]), 1e-14);
}

// Of all triangles of each facet, whose areas add up to its own.
TEST(Displace, NormalsOfFacetsAreMeansByArea) {
    const Surface s = surface_of(random_displaced(cube(), 4, 0.2));
    const RateArrays rates = random_rates(s.base(), 1, 5);
    Tessellation t = s.tessellate(rates);
    displace(t, waves);
    std::vector<Point> sums(t.normals.size(), Point(0));
    std::size_t c = 0;
    for (const Index n : t.facet_sizes) {
        const auto at = [&](Index i) { return t.positions[t.facet_points[c + i]]; };
        Point area(0);
        for (Index i = 2; i < n; ++i)
            area += glm::cross(at(i - 1) - at(0), at(i) - at(0));
        for (Index i = 0; i < n; ++i)
            sums[t.facet_normals[c + i]] += area;
        c += n;
    }
    for (std::size_t i = 0; i < sums.size(); ++i)
        ASSERT_LT(glm::distance(glm::normalize(sums[i]), t.normals[i]), 1e-13);
}

// They converge to those of the surface.
TEST(Displace, NormalsOfFacetsAreNearlyThoseOfTheSurface) {
    const Surface s = surface_of(cube());
    Tessellation t = s.tessellate(32);
    const auto exact = t.normals;
    set_facet_normals(t);
    for (std::size_t i = 0; i < exact.size(); ++i)
        ASSERT_LT(glm::distance(t.normals[i], exact[i]), 0.02);
}

/// Random texture coordinates of each corner: every edge is a seam, with other heights on both
/// sides.
MeshData with_uvs_of_each_face(MeshData mesh) {
    std::mt19937 random(1);
    mesh.uvs.clear();
    mesh.face_uvs.clear();
    for (std::size_t i = 0; i < mesh.face_vertices.size(); ++i) {
        mesh.face_uvs.push_back(static_cast<Index>(mesh.uvs.size()));
        mesh.uvs.push_back(
            {double(random() % 1000) / 1000, double(random() % 1000) / 1000});
    }
    return mesh;
}

TEST(Displace, ByATextureHasNoCracksAtSeams) {
    for (const MeshData& plain : {cube(), prism(5), torus(4, 5)}) {
        const MeshData mesh = with_uvs_of_each_face(random_displaced(plain, 2, 0.1));
        const Surface s = surface_of(mesh);
        const auto texture = TextureSurface::build(s, mesh);
        ASSERT_TRUE(texture);
        const RateArrays rates = random_rates(s.base(), 4);
        Tessellation t = s.tessellate(rates);
        texture->add_to(t, rates);
        const Tessellation before = t;
        displace(t, [&](const Address& a, const Point&, const Point&) {
            const Vec2<double> uv = texture->evaluate(a).p;
            return 0.05 * std::sin(20 * uv.x) * std::sin(20 * uv.y);
        });
        expect_closed(t, s.base(), s.features(), rates);
        EXPECT_FALSE(t.positions == before.positions);
        // The texture coordinates are those of each corner's side, the heights of one.
        ASSERT_EQ(t.facet_texcoords.size(), t.facet_points.size());
        for (std::size_t f = 0, c = 0; f < t.facet_sizes.size(); ++f) {
            for (Index i = 0; i < t.facet_sizes[f]; ++i, ++c) {
                const auto uv = texture->evaluate(
                    Address{t.facet_faces[f], t.facet_uvs[c].x, t.facet_uvs[c].y});
                // From the face on the other side, perhaps: some ulps.
                ASSERT_LT(glm::length(uv.p - t.texcoords[t.facet_texcoords[c]]), 1e-14);
            }
        }
        EXPECT_GT(t.texcoords.size(), t.positions.size());
    }
}

}  // namespace
}  // namespace osdx
