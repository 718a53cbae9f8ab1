// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/build_topology.h>
#include <osdx/face_varying.h>
#include <osdx/face_varying_surface.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/tessellation.h>
#include <osdx/tessellation_rates.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

constexpr int kN = 5;  // channels
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr FaceVaryingRule kSmoothRules[] = {
    FaceVaryingRule::None, FaceVaryingRule::CornersOnly, FaceVaryingRule::CornersPlus1,
    FaceVaryingRule::CornersPlus2, FaceVaryingRule::Boundaries};

/// Random channels from 0 to 1; corners at a vertex agree about every other time.
FaceVaryingChannels random_channels(const MeshData& mesh, unsigned seed,
                                    FaceVaryingRule rule = FaceVaryingRule::All,
                                    int n = kN) {
    std::mt19937 random(seed);
    FaceVaryingChannels c;
    c.name = "paint";
    c.n = n;
    c.rule = rule;
    for (std::size_t i = 0; i < 2 * mesh.positions.size() * static_cast<unsigned>(n); ++i)
        c.values.push_back(double(random()) / 0x1p32);
    for (const Index v : mesh.face_vertices)
        c.corner_values.push_back(2 * v + static_cast<Index>(random() % 4 == 0));
    return c;
}

std::vector<float> floats(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

Surface surface_of(const MeshData& mesh, const PatchTableOptions& options = {}) {
    auto s = Surface::build(mesh, options);
    EXPECT_TRUE(s) << (s ? "" : s.error().message);
    return std::move(*s);
}

FaceVaryingSurface face_varying_of(const Surface& s, const FaceVaryingChannels& c) {
    auto f = FaceVaryingSurface::build(s, c.corners());
    EXPECT_TRUE(f) << (f ? "" : f.error().message);
    return std::move(*f);
}

/// Two points in each quarter, no corner and no middle.
std::vector<Address> addresses(const Topology& base) {
    std::vector<Address> all;
    for (Index q = 0; q < base.n_halfedges(); ++q) {
        all.push_back(to_address(base, {q, 0.25, 0.625}));
        all.push_back(to_address(base, {q, 0.8125, 0.125}));
    }
    return all;
}

std::vector<NamedMesh> meshes() {
    auto all = closed_meshes();
    for (auto& mesh : open_meshes())
        all.push_back(std::move(mesh));
    return all;
}

using Jet = std::array<double, 6 * kN>;
Jet jet_at(const FaceVaryingSurface& f, const Buffer<double>& points, const Address& a) {
    Jet jet;
    f.evaluate(points, kN, a, 2, jet);
    return jet;
}

// ---- Linear ----

// In a quad, against the bilinear form; in other polygons, against the quad that a quarter is. Of
// numbers up to 1 and some ulps, times 4 where each derivative doubles them.
TEST(FaceVaryingLinear, IsBilinear) {
    for (const NamedMesh& m : meshes()) {
        SCOPED_TRACE(m.name);
        const FaceVaryingChannels c = random_channels(m.data, 1);
        const Surface s = surface_of(m.data);
        const FaceVaryingSurface f = face_varying_of(s, c);
        const Buffer<double> points = f.values(c.view());
        const Topology& base = s.base();
        for (const Address& a : addresses(base)) {
            if (!s.patches().has_surface(a.face))
                continue;
            const Jet jet = jet_at(f, points, a);
            const Index first = base.face_offsets[a.face], n = base.face_size(a.face);
            const QuarterPoint q = to_quarter(base, a);
            for (int k = 0; k < kN; ++k) {
                const auto at = [&](Index h) { return c.view()[c.corner_values[h]][k]; };
                double mean = 0;
                for (Index h = first; h < first + n; ++h)
                    mean += at(h) / double(n);
                std::array<double, 4> p = {at(first), at(first + 1), at(first + 2), 0};
                double x = a.u, y = a.v, scale = 1;
                if (n == 4) {
                    p[3] = at(first + 3);
                } else {
                    const double corner = at(q.quarter);
                    p = {corner, (corner + at(base.next(q.quarter))) / 2, mean,
                         (corner + at(base.prev(q.quarter))) / 2};
                    x = q.x, y = q.y, scale = 2;
                }
                const double b = p[1] - p[0], d = p[3] - p[0],
                             e = p[0] - p[1] + p[2] - p[3];
                const double expected[] = {p[0] + b * x + d * y + e * x * y,
                                           scale * (b + e * y),
                                           scale * (d + e * x),
                                           0,
                                           scale * scale * e,
                                           0};
                for (int r = 0; r < 6; ++r)
                    ASSERT_NEAR(jet[r * kN + k], expected[r], 1e-14)
                        << "derivative " << r;
            }
        }
    }
}

// Steps within a quarter, exact for bilinear functions but for rounding, eps / h^2.
TEST(FaceVaryingLinear, DerivativesAreDifferences) {
    constexpr double h = 0x1p-5;
    const MeshData mesh = prism(5);
    const FaceVaryingChannels c = random_channels(mesh, 2);
    const Surface s = surface_of(mesh);
    const FaceVaryingSurface f = face_varying_of(s, c);
    const Buffer<double> points = f.values(c.view());
    for (const Address& a : addresses(s.base())) {
        const auto at = [&](double u, double v) {
            return jet_at(f, points, {a.face, a.u + u, a.v + v});
        };
        const Jet p = at(0, 0), pu = at(h, 0), pv = at(0, h), puv = at(h, h);
        for (int k = 0; k < kN; ++k) {
            ASSERT_NEAR((pu[k] - p[k]) / h, p[kN + k], 1e-13);
            ASSERT_NEAR((pv[k] - p[k]) / h, p[2 * kN + k], 1e-13);
            ASSERT_NEAR((puv[k] - pu[k] - pv[k] + p[k]) / (h * h), p[4 * kN + k], 4e-12);
            ASSERT_EQ(p[3 * kN + k], 0);
            ASSERT_EQ(p[5 * kN + k], 0);
        }
    }
}

// ---- Smooth ----

// Against a Surface over the cut mesh, its creases and corners as tags, with three of the
// channels as positions: the same sums in blocks of other channels.
TEST(FaceVaryingSmooth, IsTheSurfaceOverTheCutMesh) {
    int degree = 2;
    for (const NamedMesh& m : meshes()) {
        for (const FaceVaryingRule rule : kSmoothRules) {
            degree = degree == 4 ? 2 : degree + 1;  // each of them beside each rule
            SCOPED_TRACE(testing::Message()
                         << m.name << ", degree " << degree << ", " << int(rule));
            const FaceVaryingChannels c = random_channels(m.data, 3, rule);
            const Surface s = surface_of(m.data, {.degree = degree});
            const FaceVaryingSurface f = face_varying_of(s, c);
            const FaceVarying& cut = f.channel();
            MeshData mesh = to_mesh_data(
                cut.topology,
                std::vector<Vec3<double>>(cut.topology.n_vertices(), {0, 0, 0}));
            for (Index v = 0; v < cut.values.size(); ++v) {
                for (int k = 0; k < 3; ++k)
                    mesh.positions[v][k] = c.view()[cut.values[v]][k + 1];
            }
            mesh.tags = to_tags(cut.topology, cut.features);
            const Surface expected = surface_of(
                mesh, {.degree = degree,
                       .multisided = {.crease_end_level = 4, .isolate_corners = true}});
            const Buffer<double> points = f.values(c.view());
            // Also where the patches of the last level lie.
            std::vector<Address> where = addresses(s.base());
            for (Index q = 0; q < s.base().n_halfedges(); ++q)
                where.push_back(to_address(s.base(), {q, 0.03, 0.05}));
            for (const Address& a : where) {
                const auto e = expected.evaluate(a);
                const Jet jet = jet_at(f, points, a);
                const Vec3<double>* d[] = {&e.p, &e.du, &e.dv, &e.duu, &e.duv, &e.dvv};
                for (int r = 0; r < 6; ++r) {
                    for (int k = 0; k < 3; ++k) {
                        // Some ulps of numbers up to 1, by 2^4 more with each order.
                        const double tolerance = 1e-14 * (r == 0 ? 1 : r < 3 ? 16 : 256);
                        ASSERT_NEAR(jet[r * kN + k + 1], (*d[r])[k], tolerance)
                            << "derivative " << r;
                    }
                }
            }
        }
    }
}

// Without seams, those of the surface's own vertices.
TEST(FaceVaryingSmooth, WithoutSeamsAreChannelsOfVertices) {
    for (const NamedMesh& m : closed_meshes()) {
        SCOPED_TRACE(m.name);
        FaceVaryingChannels c = random_channels(m.data, 4, FaceVaryingRule::CornersPlus1);
        c.corner_values = m.data.face_vertices;
        const Surface s = surface_of(m.data);
        const FaceVaryingSurface f = face_varying_of(s, c);
        const auto where = addresses(s.base());
        std::vector<double> ours(kN * where.size()), theirs(kN * where.size());
        f.evaluate(f.values(c.view()), kN, where, 0, channels(ours.data(), kN));
        s.evaluate(s.values(c.view()), kN, where, 0, channels(theirs.data(), kN));
        // The same sums, of patches at other levels perhaps.
        for (std::size_t i = 0; i < ours.size(); ++i)
            ASSERT_NEAR(ours[i], theirs[i], 1e-13);
    }
}

// ---- Both ----

constexpr FaceVaryingRule kBoth[] = {FaceVaryingRule::All, FaceVaryingRule::CornersOnly};

TEST(FaceVaryingSurface, GivesAtManyAddressesWhatItGivesAtEach) {
    MeshData mesh = random_displaced(prism(6), 1, 0.05);
    mesh.tags = {{"hole", {1, 4}, {}, {}, 0}};
    const Surface s = surface_of(mesh);
    std::vector<Address> where = addresses(s.base());
    const std::size_t n_inside = where.size();
    where.insert(where.end(), {{0, kNaN, 0.5},
                               {2, 0.5, kNaN},
                               {8, 0.5, 0.5},  // not there
                               {kInvalidIndex, 0, 0},
                               {3, -0.5, 0.25},
                               {3, 0.25, 1.5},
                               {0, 7, 0.25}});
    for (const FaceVaryingRule rule : kBoth) {
        SCOPED_TRACE(int(rule));
        const FaceVaryingChannels c = random_channels(mesh, 5, rule);
        const FaceVaryingSurface f = face_varying_of(s, c);
        const Buffer<double> points = f.values(c.view());
        const std::vector<float> values = floats(c.values);
        const Buffer<float> float_points = f.values(channels(values.data(), kN));
        for (int order = 0; order <= 2; ++order) {
            const int n = n_derivatives(order) * kN;
            const auto size = static_cast<std::size_t>(n);
            std::vector<double> many(size * where.size());
            std::vector<float> float_many(many.size());
            const AddressReport report =
                f.evaluate(points, kN, where, order, channels(many.data(), n));
            f.evaluate(float_points, kN, where, order, channels(float_many.data(), n));
            std::vector<double> one(size);
            std::vector<float> float_one(size);
            std::size_t n_without = 0, first_without = SIZE_MAX;
            for (std::size_t i = 0; i < where.size(); ++i) {
                const Address& a = where[i];
                f.evaluate(points, kN, a, order, one);
                f.evaluate(float_points, kN, a, order, float_one);
                const bool none =
                    a.face == 1 || a.face == 4 || a.face >= 8 || a.u != a.u || a.v != a.v;
                n_without += none;
                if (none)
                    first_without = std::min(first_without, i);
                for (std::size_t k = 0; k < size; ++k) {
                    const double x = many[i * size + k];
                    ASSERT_EQ(std::isnan(x), none) << i;
                    ASSERT_EQ(std::isnan(one[k]), none) << i;
                    ASSERT_EQ(std::isnan(float_one[k]), none) << i;
                    ASSERT_EQ(std::isnan(float_many[i * size + k]), none) << i;
                    if (none)
                        continue;
                    // Second derivatives of up to some hundreds, relative to them.
                    const double scale = std::max(1.0, std::abs(x));
                    ASSERT_NEAR(one[k], x, 1e-12 * scale) << i;
                    ASSERT_NEAR(float_one[k], x, 5e-4 * scale) << i;
                    ASSERT_NEAR(float_many[i * size + k], x, 5e-4 * scale) << i;
                }
            }
            EXPECT_EQ(report.n_without_point, n_without);
            EXPECT_EQ(report.first_without_point, first_without);
            EXPECT_EQ(report.n_clamped, 3u);
            // Clamped to the side of the face.
            Jet jet = jet_at(f, points, {3, 0, 0.25});
            EXPECT_EQ(jet, jet_at(f, points, where[n_inside + 4]));
        }
    }
}

// With the surface gone, and from arrays: only what is linked already is asked for.
TEST(FaceVaryingSurface, SharesTheTopologyOfASurface) {
    const MeshData mesh = random_displaced(prism(5), 2, 0.05);
    for (const FaceVaryingRule rule : kBoth) {
        const FaceVaryingChannels c = random_channels(mesh, 6, rule);
        const FaceVaryingView corners[] = {c.corners()};
        MeshView view = mesh.view();
        view.face_varying = corners;
        std::optional<FaceVaryingSurface> f;
        Jet before;
        {
            const auto s = Surface::build(view, channels(mesh.positions.data()));
            ASSERT_TRUE(s);
            auto built = FaceVaryingSurface::build(*s, view.face_varying[0]);
            ASSERT_TRUE(built);
            EXPECT_EQ(built->channel().topology.face_offsets, s->base().face_offsets);
            EXPECT_EQ(built->channel().features.hole, s->features().hole);
            before = jet_at(*built, built->values(c.view()), {2, 0.25, 0.5});
            f.emplace(std::move(*built));
        }
        EXPECT_EQ(jet_at(*f, f->values(c.view()), {2, 0.25, 0.5}), before);
        EXPECT_EQ(f->n_values(), c.n_values());
        EXPECT_EQ(f->values(c.view()).size(), std::size_t(f->n_points()) * kN);
    }
}

// Moving some values gives the bits of all of them, and nothing changes on other faces.
TEST(FaceVaryingSurface, RefreshesWhatDependsOnSomeValues) {
    for (const MeshData& mesh : {random_displaced(prism(6), 3, 0.05), torus(5, 6)}) {
        const Surface s = surface_of(mesh);
        for (const FaceVaryingRule rule : kBoth) {
            FaceVaryingChannels c = random_channels(mesh, 7, rule);
            FaceVaryingSurface f = face_varying_of(s, c);
            Buffer<double> points = f.values(c.view());
            const Buffer<double> before = points;
            std::vector<float> values = floats(c.values);
            Buffer<float> float_points = f.values(channels(values.data(), kN));
            const std::vector<Index> moved = {9, 4, 5};
            for (const Index i : moved) {
                for (int k = 0; k < kN; ++k) {
                    c.values[i * kN + static_cast<Index>(k)] += 1 + k;
                    values[i * kN + static_cast<Index>(k)] += float(1 + k);
                }
            }
            const auto change = f.dependents(moved);
            ASSERT_TRUE(change);
            f.refresh(c.view(), *change, moved, points);
            EXPECT_TRUE(points == f.values(c.view()));
            f.refresh(channels<const float>(values.data(), kN), *change, moved,
                      float_points);
            EXPECT_TRUE(float_points ==
                        f.values(channels<const float>(values.data(), kN)));
            EXPECT_TRUE(std::ranges::is_sorted(change->faces));
            std::set<Index> changed;
            for (const Address& a : addresses(s.base())) {
                if (jet_at(f, points, a) != jet_at(f, before, a))
                    changed.insert(a.face);
            }
            EXPECT_TRUE(std::ranges::includes(change->faces, changed));
            EXPECT_FALSE(changed.empty());
            if (rule == FaceVaryingRule::All) {
                EXPECT_TRUE(std::ranges::equal(change->faces, changed));
            }
        }
    }
}

TEST(FaceVaryingSurface, GoesIntoTessellations) {
    MeshData mesh = random_displaced(prism(5), 4, 0.05);
    mesh.tags = {{"hole", {3}, {}, {}, 0}};
    const Surface s = surface_of(mesh);
    const RateArrays rates =
        rates_of_edges(s.base(), [](Index e) { return 1 + static_cast<int>(e * 7 % 4); });
    for (const FaceVaryingRule rule : kBoth) {
        SCOPED_TRACE(int(rule));
        FaceVaryingChannels c = random_channels(mesh, 8, rule);
        const FaceVaryingSurface f = face_varying_of(s, c);
        const Buffer<double> points = f.values(c.view());
        const std::vector<float> values = floats(c.values);
        const Buffer<float> float_points = f.values(channels(values.data(), kN));
        Tessellation equal = s.tessellate(3), different = s.tessellate(rates);
        f.add_to(equal, "paint", points, kN, 3);
        f.add_to(equal, "float", float_points, kN, 3);
        f.add_to(different, "paint", points, kN, rates);
        for (const Tessellation* t : {&equal, &different}) {
            const FaceVaryingChannels& own = t->face_varying.front();
            EXPECT_EQ(own.name, "paint");
            ASSERT_EQ(own.n, kN);
            ASSERT_EQ(own.corner_values.size(), t->facet_points.size());
            const std::set<Index> used(own.corner_values.begin(),
                                       own.corner_values.end());
            EXPECT_EQ(used.size(), own.n_values());
            EXPECT_GT(own.n_values(), t->positions.size());  // there are seams
            for (std::size_t i = 0, corner = 0; i < t->facet_sizes.size(); ++i) {
                for (Index j = 0; j < t->facet_sizes[i]; ++j, ++corner) {
                    const Jet jet = jet_at(f, points,
                                           {t->facet_faces[i], t->facet_uvs[corner].x,
                                            t->facet_uvs[corner].y});
                    for (int k = 0; k < kN; ++k) {
                        // From the face on the other side, perhaps.
                        ASSERT_NEAR(own.view()[own.corner_values[corner]][k], jet[k],
                                    1e-13);
                    }
                }
            }
        }
        const FaceVaryingChannels &a = equal.face_varying[0], &b = equal.face_varying[1];
        EXPECT_EQ(a.corner_values, b.corner_values);
        for (std::size_t i = 0; i < a.values.size(); ++i)
            ASSERT_NEAR(a.values[i], b.values[i], 1e-5);  // some ulps of float
    }
}

// Two channels are the texture, to the bit; one more does not matter to the linear ones.
TEST(FaceVaryingSurface, IsTheTexture) {
    MeshData mesh = random_displaced(prism(5), 5, 0.05);
    for (const FaceVaryingRule rule : kBoth) {
        const FaceVaryingChannels c = random_channels(mesh, 9, rule, 2);
        mesh.face_uvs = c.corner_values;
        mesh.uvs.clear();
        for (Index i = 0; i < c.n_values(); ++i)
            mesh.uvs.emplace_back(c.view()[i][0], c.view()[i][1]);
        const Surface s = surface_of(mesh);
        const auto texture = TextureSurface::build(s, mesh, {}, rule);
        ASSERT_TRUE(texture);
        const FaceVaryingSurface f = face_varying_of(s, c);
        const Buffer<double> points = f.values(c.view());
        for (const Address& a : addresses(s.base())) {
            std::array<double, 6> d;
            f.evaluate(points, 2, a, 1, d);
            const TextureJet jet = texture->evaluate(a);
            ASSERT_EQ(jet.p, Vec2<double>(d[0], d[1]));
            ASSERT_EQ(jet.du, Vec2<double>(d[2], d[3]));
            ASSERT_EQ(jet.dv, Vec2<double>(d[4], d[5]));
        }
        Tessellation t = s.tessellate(4);
        texture->add_to(t, 4);
        EXPECT_TRUE(t.face_varying.empty());
        f.add_to(t, "uv", points, 2, 4);
        const FaceVaryingChannels& own = t.face_varying.front();
        EXPECT_TRUE(std::ranges::equal(own.corner_values, t.facet_texcoords));
        ASSERT_EQ(own.n_values(), t.texcoords.size());
        for (Index i = 0; i < own.n_values(); ++i)
            ASSERT_EQ(t.texcoords[i], Vec2<double>(own.view()[i][0], own.view()[i][1]));
    }
}

TEST(FaceVaryingSurface, DoesNotDependOnTheNumberOfThreads) {
    const MeshData mesh = random_displaced(torus(20, 20), 6, 0.01);
    const Surface s = surface_of(mesh);
    for (const FaceVaryingRule rule : kBoth) {
        const FaceVaryingChannels c = random_channels(mesh, 10, rule);
        const auto all = [&] {
            const FaceVaryingSurface f = face_varying_of(s, c);
            const Buffer<double> points = f.values(c.view());
            const auto where = addresses(s.base());
            std::vector<double> out(kN * where.size());
            f.evaluate(points, kN, where, 0, channels(out.data(), kN));
            Tessellation t = s.tessellate(2);
            f.add_to(t, "paint", points, kN, 2);
            out.insert(out.end(), t.face_varying[0].values.begin(),
                       t.face_varying[0].values.end());
            return out;
        };
        const auto many = all();
        const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
        EXPECT_EQ(many, all());
    }
}

// ---- Errors ----

TEST(FaceVaryingRefuses, WhatDoesNotFit) {
    const MeshData mesh = prism(5);
    const Surface s = surface_of(mesh);
    const FaceVaryingChannels good = random_channels(mesh, 11);
    const auto refuse = [&](const FaceVaryingView& corners, ErrorCode code, Index element,
                            const std::string& words) {
        const auto expect = [&](const auto& result) {
            ASSERT_FALSE(result);
            EXPECT_EQ(result.error().code, code) << result.error().message;
            EXPECT_EQ(result.error().element, element);
            EXPECT_NE(result.error().message.find(words), std::string::npos)
                << result.error().message;
        };
        expect(FaceVaryingSurface::build(s, corners));
        const FaceVaryingView all[] = {good.corners(), corners};
        MeshView view = mesh.view();
        view.face_varying = all;
        expect(Surface::build(view, channels(mesh.positions.data())));
    };
    using enum ErrorCode;
    const std::vector<Index>& of = good.corner_values;
    refuse({"empty", {}, 20}, SizeMismatch, kInvalidIndex, "empty");
    refuse({"short", std::span(of).first(3), 20}, SizeMismatch, kInvalidIndex, "short");
    refuse({"no values", of, 0}, IndexOutOfRange, 0, "no values");
    FaceVaryingChannels bad = good;
    bad.corner_values[5 + 5 + 4 * 2 + 1] = 20;  // of the third quad
    refuse(bad.corners(), IndexOutOfRange, 4, "face 4 names value 20");

    MeshData data = mesh;
    data.face_varying = {good};
    EXPECT_TRUE(Surface::build(data));
    const auto refuse_data = [&](ErrorCode code, Index element) {
        const auto built = Surface::build(data);
        ASSERT_FALSE(built);
        EXPECT_EQ(built.error().code, code) << built.error().message;
        EXPECT_EQ(built.error().element, element);
    };
    data.face_varying = {bad};
    refuse_data(IndexOutOfRange, 4);
    data.face_varying = {good, good};
    data.face_varying[1].values.pop_back();
    refuse_data(SizeMismatch, kInvalidIndex);
    data.face_varying[1] = good;
    data.face_varying[1].n = 0;
    refuse_data(SizeMismatch, kInvalidIndex);
    data.face_varying[1] = good;
    data.face_varying[1].values[3 * kN + 1] = kNaN;
    refuse_data(NonFinitePoint, 3);

    FaceVaryingSurface f = face_varying_of(s, good);
    const std::vector<Index> moved = {3, good.n_values()};
    const auto change = f.dependents(moved);
    ASSERT_FALSE(change);
    EXPECT_EQ(change.error().code, IndexOutOfRange);
    EXPECT_EQ(change.error().element, good.n_values());
}

// Gregory patches take an interior vertex of two faces; smooth rules name it by the mesh.
TEST(FaceVaryingRefuses, VerticesOfTwoFacesByTheirNumberInTheMesh) {
    // Faces 0 and 1 share both edges at vertex 4; no face uses vertex 0.
    MeshData mesh;
    mesh.positions = {{9, 9, 9}, {0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 1, 1}, {0, 2, 0}};
    mesh.face_sizes = {4, 4};
    mesh.face_vertices = {1, 2, 3, 4, 1, 4, 3, 5};
    const auto s = Surface::build(mesh, {.family = PatchFamily::Gregory});
    ASSERT_TRUE(s) << s.error().message;
    FaceVaryingChannels c = random_channels(mesh, 12, FaceVaryingRule::CornersOnly);
    c.corner_values = mesh.face_vertices;
    const auto f = FaceVaryingSurface::build(*s, c.corners());
    ASSERT_FALSE(f);
    EXPECT_EQ(f.error().code, ErrorCode::ValenceTwo);
    EXPECT_EQ(f.error().element, 4u);
    EXPECT_NE(f.error().message.find("vertex 4 "), std::string::npos);
    c.rule = FaceVaryingRule::All;
    EXPECT_TRUE(FaceVaryingSurface::build(*s, c.corners()));
}

}  // namespace
}  // namespace osdx
