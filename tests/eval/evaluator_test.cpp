// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <gtest/gtest.h>

#include <osdx/evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx::test {
namespace {

using Point = Vec3<double>;

/// Derivative r of a jet: p, du, dv, duu, duv, dvv.
template <class T>
Vec3<T> derivative(const SurfaceJet<T>& s, int r) {
    return std::array{s.p, s.du, s.dv, s.duu, s.duv, s.dvv}[r];
}

double max_norm(std::span<const Point> points) {
    double max = 0;
    for (const Point& p : points)
        max = std::max({max, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    return max;
}

struct NamedSurface {
    std::string name;
    MeshData mesh;
    Surface surface;
};

Surface build(const MeshData& mesh, int degree) {
    auto s = Surface::build(mesh, {.degree = degree});
    if (!s)
        throw std::runtime_error(s.error().message);
    return *std::move(s);
}

/// Of meshes with all kinds of patches and degrees.
std::vector<NamedSurface> surfaces() {
    std::vector<NamedSurface> all;
    for (const auto& [name, mesh] : closed_meshes()) {
        for (const int d : {2, 3, 4, 5})
            all.push_back({name + " d" + std::to_string(d), mesh, build(mesh, d)});
    }
    return all;
}

/// A few generic places, on every kind of face, off the cells' edges.
std::vector<QuarterPoint> places(const Surface& s) {
    const Index n = s.base().n_halfedges(), step = n / 12 | 1;  // odd: all four turns
    std::vector<QuarterPoint> all;
    for (Index q = 0; q < n; q += step) {
        all.push_back({q, 0.31, 0.62});
        all.push_back({q, 0.87, 0.13});
        all.push_back({q, 0.94, 0.91});
        all.push_back({q, 0.06, 0.04});
    }
    return all;
}

std::vector<double> weights(const Evaluator& e, const PatchPoint& where, int order,
                            Chart chart) {
    const int n = e.table().class_of(where.patch).n_points();
    std::vector<double> w(n_derivatives(order) * n);
    e.weights(where, order, chart, w);
    return w;
}

// ------------------------------------------------------------------------ derivatives

// Central differences of step h err by h^2/6 of the third derivative, below 1e4, and by 1/h
// times the error of the function: 1e-8 and 1e-14 / h near corners, where derivatives magnify
// rounding. Level l makes derivatives of order m 2^(lm) times as large: h shrinks with it.
TEST(Evaluator, DerivativesMatchCentralDifferences) {
    for (const NamedSurface& named : surfaces()) {
        const Surface& s = named.surface;
        const auto at = [&](const Address& a, double du, double dv) {
            return s.evaluate({a.face, a.u + du, a.v + dv});
        };
        for (const auto& q : places(s)) {
            const Address a = to_address(s.base(), q);
            const double scale = s.patches().locate(q).scale, h = 2e-6 / scale;
            const auto mid = s.evaluate(a);
            const auto left = at(a, -h, 0), right = at(a, h, 0), below = at(a, 0, -h),
                       above = at(a, 0, h);
            SCOPED_TRACE(named.name + " face " + std::to_string(a.face) + " u " +
                         std::to_string(a.u) + " v " + std::to_string(a.v));
            const auto expect = [&](const Point& d, const Point& hi, const Point& lo,
                                    int order) {
                EXPECT_LE(glm::length(d - (hi - lo) / (2 * h)),
                          4e-8 * std::pow(scale, order));
            };
            expect(mid.du, right.p, left.p, 1);
            expect(mid.dv, above.p, below.p, 1);
            expect(mid.duu, right.du, left.du, 2);
            expect(mid.duv, right.dv, left.dv, 2);
            expect(mid.duv, above.du, below.du, 2);
            expect(mid.dvv, above.dv, below.dv, 2);
        }
    }
}

TEST(Evaluator, OrdersAgree) {
    for (const auto& [name, mesh, s] : surfaces()) {
        const Evaluator& e = s.evaluator();
        const auto points = s.points();
        for (const auto& q : places(s)) {
            for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
                const auto two = e.evaluate<double>(points, q, chart);
                const auto one = e.evaluate<double, 1>(points, q, chart);
                const auto zero = e.evaluate<double, 0>(points, q, chart);
                // The same sums up to their order.
                const double tolerance =
                    1e-14 * (1 + glm::length(two.du) + glm::length(two.dv));
                for (int r = 0; r < 6; ++r) {
                    const Point of_one = r < 3 ? derivative(two, r) : Point(0),
                                of_zero = r < 1 ? two.p : Point(0);
                    EXPECT_LE(glm::length(derivative(one, r) - of_one), tolerance)
                        << name;
                    EXPECT_LE(glm::length(derivative(zero, r) - of_zero), tolerance)
                        << name;
                }
            }
        }
    }
}

TEST(Evaluator, AddressesAndQuartersAgree) {
    for (const auto& [name, mesh, s] : surfaces()) {
        for (const auto& q : places(s)) {
            const auto a = s.evaluate(to_address(s.base(), q));
            const auto b = s.evaluator().evaluate<double>(s.points(), q);
            const auto c =
                s.evaluator().evaluate<double>(s.points(), s.patches().locate(q));
            // (u, v) of large faces reach 5, and lose as many units in the last place.
            const double scale = s.patches().locate(q).scale;
            for (int r = 0; r < 6; ++r) {
                const double size = std::pow(scale, r < 1 ? 0 : r < 3 ? 1 : 2);
                EXPECT_LE(glm::length(derivative(a, r) - derivative(b, r)),
                          1e-12 * scale * size)
                    << name << " derivative " << r;
                EXPECT_EQ(derivative(b, r), derivative(c, r)) << name;
            }
        }
    }
}

// ------------------------------------------------------------------------ precision

// Sums are formed in double, so float errs by the rounding of the points, half an ulp of the
// largest times the absolute sum of the weights, and of the result.
TEST(Evaluator, FloatMatchesDouble) {
    constexpr double ulp = std::numeric_limits<float>::epsilon();
    for (const auto& [name, mesh, s] : surfaces()) {
        const Evaluator& e = s.evaluator();
        const std::vector<Vec3<float>> floats(s.points().begin(), s.points().end());
        const double size = max_norm(s.points());
        for (const auto& q : places(s)) {
            const PatchPoint where = s.patches().locate(q);
            const auto a = e.evaluate<double>(s.points(), where);
            const auto b = e.evaluate<float>(std::span<const Vec3<float>>(floats), where);
            const auto w = weights(e, where, 2, Chart::BaseUV);
            const std::size_t n = w.size() / 6;
            for (int r = 0; r < 6; ++r) {
                double sum = 0;
                for (std::size_t i = 0; i < n; ++i)
                    sum += std::abs(w[r * n + i]);
                const Point x = derivative(a, r), y(derivative(b, r));
                for (int c = 0; c < 3; ++c)
                    EXPECT_LE(std::abs(x[c] - y[c]),
                              0.5 * ulp * (sum * size + std::abs(x[c])) * (1 + 1e-6))
                        << name << " derivative " << r;
            }
        }
    }
}

/// Both ways round in double, by 64 roundings of the sum of absolute terms: 3 (d + 1) or so
/// along each axis. In n-gons, where either way has its own axes, those are the terms of any
/// derivative of the same order; and at the distance r of a corner derivatives m of the blends
/// are of the order of r^-m. In float the result is rounded once more.
template <class T>
void expect_many_as_one(const Surface& s, int n) {
    const Evaluator& e = s.evaluator();
    const std::vector<Vec3<T>> points(s.points().begin(), s.points().end());
    const double size = max_norm(s.points());
    std::mt19937 random(1);
    for (const auto& q : places(s)) {
        std::vector<PatchPoint> where(n, s.patches().locate(q));
        for (PatchPoint& p : where) {
            p.a = 0.05 + 0.9 * double(random()) / 4294967296.0;
            p.b = 0.05 + 0.9 * double(random()) / 4294967296.0;
        }
        for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
            std::vector<SurfaceJet<T>> jets(n);
            e.evaluate_many<T>(points, where, chart, jets);
            for (int i = 0; i < n; ++i) {
                const auto one = e.evaluate<T>(points, where[i], chart);
                const auto w = weights(e, where[i], 2, chart);
                std::array<double, 6> sums{};
                for (std::size_t k = 0; k < w.size(); ++k)
                    sums[k / (w.size() / 6)] += std::abs(w[k]);
                if (!e.table().class_of(where[i].patch).is_square()) {
                    const double near = std::max(1.0, 1 / (2 - where[i].a - where[i].b));
                    sums[1] = sums[2] = near * std::max(sums[1], sums[2]);
                    sums[3] = sums[4] = sums[5] =
                        near * near * std::max({sums[3], sums[4], sums[5]});
                }
                for (int r = 0; r < 6; ++r) {
                    const double sum = sums[r];
                    const Vec3<T> x = derivative(jets[i], r), y = derivative(one, r);
                    for (int c = 0; c < 3; ++c)
                        ASSERT_NEAR(
                            x[c], y[c],
                            64 * std::numeric_limits<double>::epsilon() * sum * size +
                                std::numeric_limits<T>::epsilon() * std::abs(y[c]))
                            << "point " << i << " of " << n << ", derivative " << r;
                }
            }
        }
    }
}
TEST(Evaluator, ManyPointsOfAPatchAreAsOne) {
    for (const auto& [name, mesh, s] : surfaces()) {
        for (const int n : {0, 1, 4, 8, 21}) {
            SCOPED_TRACE(name);
            expect_many_as_one<float>(s, n);
            expect_many_as_one<double>(s, n);
        }
    }
}

// ------------------------------------------------------------------------ channels, weights

/// Values of any number of channels at all points.
template <class T>
std::vector<T> random_channels(const PatchTable& table, int n_channels) {
    std::mt19937 engine(7);
    std::vector<T> values(std::size_t(table.n_points()) * n_channels);
    for (T& x : values)
        x = T(double(engine()) / 4294967296.0 - 0.5);
    table.refresh_channels<T>(n_channels, values);
    return values;
}

TEST(PatchTable, RefreshesChannelsLikePoints) {
    for (const auto& mesh : {prism(7), bipyramid(5)}) {
        for (const int d : {2, 3, 4}) {
            const Surface s = build(mesh, d);
            const PatchTable& table = s.patches();
            ASSERT_GT(table.n_points(), table.n_base_points());
            for (const int n_channels : {1, 4, 5}) {
                const auto values = random_channels<double>(table, n_channels);
                for (int c = 0; c < n_channels; ++c) {
                    // The channel as the y of a point.
                    std::vector<Point> points(table.n_points(), Point(0));
                    for (Index i = 0; i < table.n_base_points(); ++i)
                        points[i].y = values[std::size_t(i) * n_channels + c];
                    table.refresh_points<double>(points);
                    for (Index i = 0; i < table.n_points(); ++i)
                        ASSERT_EQ(points[i].y, values[std::size_t(i) * n_channels + c])
                            << "d" << d << " point " << i << " channel " << c;
                }
            }
        }
    }
}

template <class T>
void expect_channels_match(const NamedSurface& named) {
    const auto& [name, mesh, s] = named;
    const Evaluator& e = s.evaluator();
    const Index n_points = s.patches().n_points();
    for (const int n_channels : {1, 3, 4, 5, 7}) {
        const auto values = random_channels<T>(s.patches(), n_channels);
        for (const auto& q : places(s)) {
            const PatchPoint where = s.patches().locate(q);
            for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
                for (int order = 0; order <= 2; ++order) {
                    std::vector<T> out(n_derivatives(order) * n_channels);
                    e.evaluate_channels<T>(values, n_channels, where, order, chart, out);
                    for (int c = 0; c < n_channels; ++c) {
                        // The channel as the y of a point.
                        std::vector<Vec3<T>> points(n_points, Vec3<T>(0));
                        for (const Index i : s.patches().patch(where.patch).points)
                            points[i].y = values[std::size_t(i) * n_channels + c];
                        const auto jet =
                            e.evaluate<T>(std::span<const Vec3<T>>(points), where, chart);
                        for (int r = 0; r < n_derivatives(order); ++r) {
                            const T expected = derivative(jet, r).y;
                            const double size = std::pow(where.scale, r < 1   ? 0
                                                                      : r < 3 ? 1
                                                                              : 2);
                            EXPECT_NEAR(out[r * n_channels + c], expected,
                                        8 * std::numeric_limits<T>::epsilon() * size)
                                << name << " channel " << c << " of " << n_channels
                                << " derivative " << r;
                        }
                    }
                }
            }
        }
    }
}

TEST(Evaluator, ChannelsMatchPoints) {
    for (const auto& mesh : {prism(7), bipyramid(5)}) {
        for (const int d : {2, 3}) {
            const NamedSurface s{std::to_string(d), mesh, build(mesh, d)};
            expect_channels_match<double>(s);
            expect_channels_match<float>(s);
        }
    }
}

TEST(Evaluator, WeightsTimesPointsAreTheSurface) {
    for (const auto& [name, mesh, s] : surfaces()) {
        for (const auto& q : places(s)) {
            const PatchPoint where = s.patches().locate(q);
            const auto points = s.patches().patch(where.patch).points;
            for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
                const auto jet = s.evaluator().evaluate<double>(s.points(), where, chart);
                for (int order = 0; order <= 2; ++order) {
                    const auto w = weights(s.evaluator(), where, order, chart);
                    const std::size_t n = points.size();
                    ASSERT_EQ(w.size(), n_derivatives(order) * n);
                    for (int r = 0; r < n_derivatives(order); ++r) {
                        Point sum(0);
                        double size = 0;
                        for (std::size_t i = 0; i < n; ++i) {
                            sum += w[r * n + i] * s.points()[points[i]];
                            size += std::abs(w[r * n + i]);
                        }
                        // Divided by f before or after the sum: rounding differs, and second
                        // derivatives near a corner of a patch magnify it.
                        EXPECT_LE(glm::length(sum - derivative(jet, r)),
                                  1e-12 * (1 + size))
                            << name << " derivative " << r;
                    }
                }
            }
        }
    }
}

TEST(Surface, BaseWeightsTimesPositionsAreTheSurface) {
    for (const auto& [name, mesh, s] : surfaces()) {
        for (const auto& q : places(s)) {
            const Address a = to_address(s.base(), q);
            const auto jet = s.evaluate(a);
            for (int r = 0; r < 6; ++r) {
                std::vector<double> w(s.base().n_vertices(), 0.0);
                s.add_base_weights(a, r, 1, w);
                Point sum(0);
                double total = 0, size = 0;
                for (std::size_t v = 0; v < w.size(); ++v) {
                    sum += w[v] * mesh.positions[v];
                    total += w[v];
                    size += std::abs(w[v]);
                }
                // Second derivatives near a corner of a patch magnify rounding.
                EXPECT_LE(glm::length(sum - derivative(jet, r)), 1e-12 * (1 + size))
                    << name << " derivative " << r;
                EXPECT_NEAR(total, r == 0 ? 1 : 0, 1e-12 * (1 + size)) << name;
                // What was there stays, and the scale counts.
                auto twice = w;
                s.add_base_weights(a, r, -0.5, twice);
                for (std::size_t v = 0; v < w.size(); ++v)
                    EXPECT_NEAR(twice[v], 0.5 * w[v], 1e-14 * (1 + size)) << name;
            }
        }
    }
}

// ------------------------------------------------------------------------ the surface

TEST(Surface, CommutesWithAffineMaps) {
    const glm::dmat3 linear(1.2, 0.3, -0.4, -0.7, 0.9, 0.2, 0.1, 0.5, -1.1);
    const Point shift(3, -2, 1);
    for (auto& [name, mesh, s] : surfaces()) {
        std::vector<SurfaceJet<double>> before;
        for (const auto& q : places(s))
            before.push_back(s.evaluate(to_address(s.base(), q)));
        std::vector<Point> moved;
        for (const Point& p : mesh.positions)
            moved.push_back(linear * p + shift);
        ASSERT_TRUE(s.set_positions(moved));
        std::size_t i = 0;
        for (const auto& q : places(s)) {
            const auto after = s.evaluate(to_address(s.base(), q));
            const double scale = s.patches().locate(q).scale;
            for (int r = 0; r < 6; ++r) {
                const Point expected =
                    linear * derivative(before[i], r) + (r == 0 ? shift : Point(0));
                const double size = std::pow(scale, r < 1 ? 0 : r < 3 ? 1 : 2);
                // Second derivatives near a corner of a patch magnify rounding.
                EXPECT_LE(glm::length(derivative(after, r) - expected), 1e-11 * size)
                    << name << " derivative " << r;
            }
            ++i;
        }
    }
}

TEST(Surface, StaysInThePlaneOfItsPoints) {
    for (auto& [name, mesh, s] : surfaces()) {
        auto positions = mesh.positions;
        for (Point& p : positions)
            p.z = 0.25;
        ASSERT_TRUE(s.set_positions(positions));
        for (const auto& q : places(s)) {
            const auto jet = s.evaluator().evaluate<double>(s.points(), q);
            const double scale = s.patches().locate(q).scale;
            EXPECT_NEAR(jet.p.z, 0.25, 1e-15) << name;
            EXPECT_NEAR(jet.du.z, 0, 1e-14 * scale) << name;
            EXPECT_NEAR(jet.dvv.z, 0, 1e-13 * scale * scale) << name;
        }
    }
}

TEST(Surface, MovedPositionsAreAFreshBuild) {
    for (const int d : {2, 3, 6}) {
        const MeshData mesh = dodecahedron();
        const MeshData moved = random_displaced(mesh, 3, 0.3);
        Surface s = build(mesh, d);
        const Surface fresh = build(moved, d);
        ASSERT_TRUE(s.set_positions(moved.positions));
        ASSERT_EQ(s.points().size(), fresh.points().size());
        for (std::size_t i = 0; i < s.points().size(); ++i)
            EXPECT_EQ(s.points()[i], fresh.points()[i]) << "point " << i;
        for (const auto& q : places(s)) {
            const Address a = to_address(s.base(), q);
            for (int r = 0; r < 6; ++r)
                EXPECT_EQ(derivative(s.evaluate(a), r), derivative(fresh.evaluate(a), r));
        }
    }
}

TEST(Surface, RefusesPositionsAndKeepsItsOwn) {
    const MeshData mesh = cube();
    Surface s = build(mesh, 3);
    const std::vector<Point> before(s.points().begin(), s.points().end());
    auto positions = mesh.positions;
    for (Point& p : positions)
        p *= 2.0;

    const auto size = s.set_positions(std::span(positions).first(7));
    ASSERT_FALSE(size);
    EXPECT_EQ(size.error().code, ErrorCode::SizeMismatch);

    for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity()}) {
        for (int c = 0; c < 3; ++c) {
            auto wrong = positions;
            wrong[5][c] = bad;
            const auto status = s.set_positions(wrong);
            ASSERT_FALSE(status);
            EXPECT_EQ(status.error().code, ErrorCode::NonFinitePoint);
            EXPECT_EQ(status.error().element, 5u);
        }
    }
    for (std::size_t i = 0; i < before.size(); ++i)
        EXPECT_EQ(s.points()[i], before[i]);
}

TEST(Surface, RefusesDegreesOutOfRange) {
    for (const int d : {-1, 0, 1, 16, 100}) {
        const auto s = Surface::build(cube(), {.degree = d});
        ASSERT_FALSE(s) << d;
        EXPECT_EQ(s.error().code, ErrorCode::InvalidOption);
    }
    EXPECT_TRUE(Surface::build(cube(), {.degree = kMinDegree}));
    EXPECT_TRUE(Surface::build(cube(), {.degree = kMaxDegree}));
}

TEST(Surface, KeepsUnusedVerticesWithoutInfluence) {
    MeshData mesh = cube();
    mesh.positions.insert(mesh.positions.begin() + 2, Point(50));
    mesh.positions.push_back(Point(100));
    for (Index& v : mesh.face_vertices)
        v += v >= 2 ? 1 : 0;
    for (const int d : {2, 3}) {
        const Surface s = build(mesh, d), plain = build(cube(), d);
        ASSERT_EQ(s.unused_vertices().size(), 2u);
        EXPECT_EQ(s.unused_vertices()[0], 2u);
        EXPECT_EQ(s.unused_vertices()[1], 9u);
        for (const auto& q : places(s)) {
            const Address a = to_address(s.base(), q);
            EXPECT_EQ(s.evaluate(a).p, plain.evaluate(a).p);
            std::vector<double> w(10, 0.0);
            s.add_base_weights(a, 0, 1, w);
            EXPECT_EQ(w[2], 0);
            EXPECT_EQ(w[9], 0);
        }
    }
}

TEST(Surface, MovesWithItsTables) {
    Surface a = build(prism(5), 3);
    const Address at{0, 0.2, 0.3};
    const auto before = a.evaluate(at);
    const Surface b = std::move(a);
    EXPECT_EQ(b.evaluate(at).p, before.p);
    EXPECT_EQ(&b.evaluator().table(), &b.patches());
}

// ------------------------------------------------------------------------ degenerate input

TEST(Surface, APointHasNoDerivativesAndNoNormal) {
    for (auto& [name, mesh, s] : surfaces()) {
        for (const Point at : {Point(0), Point(1, -2, 3)}) {
            ASSERT_TRUE(s.set_positions(std::vector<Point>(mesh.positions.size(), at)));
            for (const auto& q : places(s)) {
                const auto jet = s.evaluator().evaluate<double>(s.points(), q);
                const double scale = s.patches().locate(q).scale;
                EXPECT_LE(glm::length(jet.p - at), 1e-14) << name;
                // Near a corner of a patch they magnify rounding.
                for (int r = 1; r < 6; ++r)
                    EXPECT_LE(glm::length(derivative(jet, r)), 1e-11 * scale * scale)
                        << name;
                // At the origin nothing is left but zero; elsewhere rounding is.
                const double length = glm::length(normal(jet));
                EXPECT_TRUE(length == 0 ||
                            (at != Point(0) && std::abs(length - 1) < 1e-12))
                    << name << " " << length;
                const auto c = curvature(jet);
                EXPECT_TRUE(std::isfinite(c.mean) && std::isfinite(c.gauss)) << name;
            }
        }
    }
}

TEST(Surface, ALineHasNoNormal) {
    for (auto& [name, mesh, s] : surfaces()) {
        auto positions = mesh.positions;
        for (Point& p : positions)
            p = {p.x, 0, 0};
        ASSERT_TRUE(s.set_positions(positions));
        for (const auto& q : places(s)) {
            const auto jet = s.evaluator().evaluate<double>(s.points(), q);
            EXPECT_GT(glm::length(jet.du) + glm::length(jet.dv), 0) << name;
            EXPECT_EQ(normal(jet), Point(0)) << name;
            EXPECT_EQ(curvature(jet).mean, 0) << name;
            EXPECT_EQ(curvature(jet).gauss, 0) << name;
        }
    }
}

// ------------------------------------------------------------------------ normal, curvature

/// f(x(u, v), y(u, v)) where x = u + v/3 + u v, y = 2v - u^2 at (0, 0): a chart that is
/// skewed and curved, with the orientation of (x, y).
template <class T>
SurfaceJet<T> skewed(const SurfaceJet<T>& f) {
    const T third = T(1) / T(3);
    SurfaceJet<T> s;
    s.p = f.p;
    s.du = f.du;
    s.dv = third * f.du + T(2) * f.dv;
    s.duu = f.duu - T(2) * f.dv;
    s.duv = third * f.duu + T(2) * f.duv + f.du;
    s.dvv = third * third * f.duu + T(4) * third * f.duv + T(4) * f.dvv;
    return s;
}

/// A sphere of radius r at longitude x and latitude y; du x dv points outwards.
template <class T>
SurfaceJet<T> sphere(T r, double x, double y) {
    const double cx = std::cos(x), sx = std::sin(x), cy = std::cos(y), sy = std::sin(y);
    const auto vector = [&](double a, double b, double c) {
        return r * Vec3<T>(Point(a, b, c));
    };
    return {vector(cx * cy, sx * cy, sy),   vector(-sx * cy, cx * cy, 0),
            vector(-cx * sy, -sx * sy, cy), vector(-cx * cy, -sx * cy, 0),
            vector(sx * sy, -cx * sy, 0),   vector(-cx * cy, -sx * cy, -sy)};
}

/// A cylinder of radius r about the z axis; du x dv points outwards.
template <class T>
SurfaceJet<T> cylinder(T r, double x) {
    const auto cx = T(std::cos(x)), sx = T(std::sin(x));
    return {{r * cx, r * sx, 0},   {-r * sx, r * cx, 0}, {0, 0, r},
            {-r * cx, -r * sx, 0}, Vec3<T>(0),           Vec3<T>(0)};
}

/// du and dv change places: the other orientation.
template <class T>
SurfaceJet<T> flipped(const SurfaceJet<T>& s) {
    return {s.p, s.dv, s.du, s.dvv, s.duv, s.duu};
}

template <class T>
class SurfaceJetOf : public testing::Test {
protected:
    // A handful of products of numbers that are right to a few ulps.
    static constexpr T kTol = 32 * std::numeric_limits<T>::epsilon();
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(SurfaceJetOf, Scalars);

TYPED_TEST(SurfaceJetOf, OfASphere) {
    using T = TypeParam;
    // From tiny to huge, as far as the Gauss curvature can be told in T.
    for (const T r : {T(1e-15), T(1e-3), T(1), T(2.5), T(1e6), T(1e15)}) {
        const auto s = sphere<T>(r, 0.7, 0.4);
        for (const auto& jet : {s, skewed(s)}) {
            const Vec3<T> n = normal(jet);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(n[c], s.p[c] / r, this->kTol);
            // The sphere bends away from its outer normal.
            const auto k = curvature(jet);
            EXPECT_NEAR(k.mean * r, T(-1), this->kTol) << "r " << r;
            EXPECT_NEAR(k.gauss * r * r, T(1), this->kTol) << "r " << r;
            const auto inner = curvature(flipped(jet));
            EXPECT_NEAR(inner.mean * r, T(1), this->kTol) << "r " << r;
            EXPECT_NEAR(inner.gauss * r * r, T(1), this->kTol) << "r " << r;
            EXPECT_LE(glm::length(normal(flipped(jet)) + n), this->kTol);
        }
    }
}

TYPED_TEST(SurfaceJetOf, OfACylinderAndAPlane) {
    using T = TypeParam;
    for (const T r : {T(0.25), T(1), T(3)}) {
        const auto s = cylinder<T>(r, 0.7);
        for (const auto& jet : {s, skewed(s)}) {
            EXPECT_NEAR(curvature(jet).mean * r, T(-0.5), this->kTol);
            EXPECT_NEAR(curvature(jet).gauss * r * r, T(0), this->kTol);
            EXPECT_NEAR(normal(jet).z, T(0), this->kTol);
        }
    }
    const SurfaceJet<T> plane{{1, 2, 3}, {1, 2, 0}, {0, 1, 1}};
    for (const auto& jet : {plane, skewed(plane)}) {
        EXPECT_NEAR(curvature(jet).mean, T(0), this->kTol);
        EXPECT_NEAR(curvature(jet).gauss, T(0), this->kTol);
        EXPECT_LE(glm::length(normal(jet) - glm::normalize(Vec3<T>(2, -1, 1))),
                  this->kTol);
    }
}

TYPED_TEST(SurfaceJetOf, OfASaddle) {
    using T = TypeParam;
    // z = (x^2 - 3 y^2) / 2 at the origin: principal curvatures 1 and -3.
    const SurfaceJet<T> s{{0, 0, 0}, {1, 0, 0}, {0, 1, 0},
                          {0, 0, 1}, {0, 0, 0}, {0, 0, -3}};
    for (const auto& jet : {s, skewed(s)}) {
        EXPECT_NEAR(curvature(jet).mean, T(-1), this->kTol);
        EXPECT_NEAR(curvature(jet).gauss, T(-3), this->kTol);
    }
}

TYPED_TEST(SurfaceJetOf, WithoutANormal) {
    using T = TypeParam;
    SurfaceJet<T> s = sphere<T>(1, 0.7, 0.4);
    const auto expect_none = [](const SurfaceJet<T>& jet) {
        EXPECT_EQ(normal(jet), Vec3<T>(0));
        EXPECT_EQ(curvature(jet).mean, T(0));
        EXPECT_EQ(curvature(jet).gauss, T(0));
    };
    auto collapsed = s;
    collapsed.du = Vec3<T>(0);
    expect_none(collapsed);
    expect_none(flipped(collapsed));
    auto parallel = s;
    parallel.dv = T(-2) * s.du;
    expect_none(parallel);
    parallel.dv = T(1) / T(3) * s.du;
    if (sizeof(T) == sizeof(double))  // a third of a float is not parallel in double
        expect_none(parallel);
    expect_none(SurfaceJet<T>{});
}

// The squares of these numbers are no floats.
TEST(SurfaceJet, OfATinyFloatModel) {
    const auto s = sphere<float>(1e-20f, 0.7, 0.4);
    const Vec3<float> n = normal(s), expected = normal(sphere<float>(1, 0.7, 0.4));
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(n[c], expected[c], 1e-6);
    EXPECT_NEAR(curvature(s).mean * 1e-20f, -1, 1e-5);
    const auto flat = sphere<float>(1e20f, 0.7, 0.4);
    EXPECT_NEAR(curvature(flat).mean * 1e20f, -1, 1e-5);
}

// Fourth powers of lengths are no doubles.
TEST(SurfaceJet, HasCurvatureAtAnyScale) {
    const auto one = sphere<double>(1, 0.7, 0.4);
    for (const int power : {-450, -300, 300, 450}) {
        const double scale = std::ldexp(1, power);
        const auto s = sphere<double>(scale, 0.7, 0.4);
        EXPECT_LT(glm::length(normal(s) - normal(one)), 1e-15) << power;  // some ulps
        EXPECT_NEAR(curvature(s).mean * scale, -1, 1e-14) << power;
        EXPECT_NEAR(curvature(s).gauss * scale * scale, 1, 1e-14) << power;
    }
    EXPECT_TRUE(std::isfinite(curvature(sphere<double>(1e-160, 0.7, 0.4)).gauss));
}

// What rounding leaves of the derivatives of a point.
TEST(SurfaceJet, HasNoNormalOutOfRounding) {
    const SurfaceJet<double> point{{1, 2, 3}, {4e-16, 0, 1e-16}, {0, 2e-16, 1e-16}};
    EXPECT_EQ(normal(point), Vec3<double>(0));
    const SurfaceJet<double> line{{0, 0, 0}, {1, 0, 0}, {1, 6e-14, 0}};
    EXPECT_EQ(normal(line), Vec3<double>(0));
    const SurfaceJet<double> small{{0, 0, 0}, {4e-16, 0, 1e-16}, {0, 2e-16, 1e-16}};
    EXPECT_NE(normal(small), Vec3<double>(0));
}

}  // namespace
}  // namespace osdx::test
