// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <osdx/build_patch_table.h>
#include <osdx/evaluator.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>

#include "eval/bases/patch_basis.h"
#include "tests/support/high_orders.h"
#include "tests/support/reference_files.h"
#include "tests/support/spline_reference.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

// The basis functions of patches at borders, creases, corners, darts and spikes.

namespace osdx {

/// How GoogleTest names a class of patches: "EV d3 n5 pinned".
void PrintTo(const PatchClass& c, std::ostream* out) {
    *out << (c.kind == PatchKind::EV ? "EV" : "EF") << " d" << c.degree << " n"
         << c.n_sectors
         << (c.border == PatchBorder::Smooth   ? " smooth"
             : c.border == PatchBorder::Pinned ? " pinned"
             : c.border == PatchBorder::Spike  ? " spike"
                                               : "");
}

namespace {

using test::vector;

using Net = std::vector<Vec3<double>>;
template <int Order>
using J = Jet<double, Order>;

// ------------------------------------------------------------------------ helpers

template <int Order>
std::vector<J<Order>> weights(const PatchBasis& basis, const DomainPoint& p,
                              Chart chart) {
    std::vector<J<Order>> w(basis.patch_class().n_points());
    const auto f = basis.for_each_weight<Order>(
        p, chart, [&](Index i, const J<Order>& x) { w[i] += x; });
    for (auto& x : w)
        x = x / f;
    return w;
}

template <int Order>
std::array<J<Order>, 3> surface(const PatchBasis& basis, const DomainPoint& p,
                                Chart chart, const Net& net) {
    std::array<J<Order>, 3> sum;
    const J<Order> f =
        basis.for_each_weight<Order>(p, chart, [&](Index i, const J<Order>& w) {
            for (int c = 0; c < 3; ++c)
                sum[c] += net[i][c] * w;
        });
    for (auto& x : sum)
        x = x / f;
    return sum;
}

template <int Order>
double order_max(const J<Order>& x, int m) {
    double max = 0;
    for (int j = 0; j <= m; ++j) {
        const double value = std::abs(x.c[J<Order>::index(m - j, j)]);
        if (value > max || std::isnan(value))
            max = value;
    }
    return max;
}

/// Calls f.operator()<Order>() with the order d up to 6.
template <class F>
void with_order(int d, F&& f) {
    switch (d) {
        case 2:
            return f.template operator()<2>();
        case 3:
            return f.template operator()<3>();
        case 4:
            return f.template operator()<4>();
        case 5:
            return f.template operator()<5>();
        default:
            return f.template operator()<6>();
    }
}

std::vector<PatchClass> border_classes(std::initializer_list<int> degrees,
                                       int most_sectors = 20) {
    std::vector<PatchClass> all;
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : degrees) {
            const auto add = [&](PatchBorder border, std::initializer_list<int> sectors) {
                for (const int n : sectors) {
                    if (n <= most_sectors)
                        all.push_back({kind, d, n, border});
                }
            };
            add(PatchBorder::Smooth, {1, 3, 4, 5, 6, 20});
            add(PatchBorder::Pinned, {2, 3, 5, 12});
            add(PatchBorder::Spike, {3, 5});
        }
    }
    return test::thinned(all);
}

/// Roughly regular with noise, so that every derivative is generic.
Net random_net(const PatchClass& c) {
    std::mt19937 engine(1);
    const auto random = [&] { return 2 * (double(engine()) / 4294967296.0) - 1; };
    Net net(c.n_points());
    const auto set = [&](int i, Vec2<double> p) {
        const double x = random(), y = random(), z = random();
        net[i] = Vec3<double>(p, 0.2 * p.x * p.x - 0.1 * p.y * p.y + 0.3 * p.x) +
                 0.1 * Vec3<double>(x, y, z);
    };
    const int d = c.degree;
    const auto across = [&](int side) {
        const double angle =
            (2 * side - 1) * std::numbers::pi / std::max(c.n_polygon(), 3);
        return Vec2<double>(std::cos(angle), std::sin(angle));
    };
    for (int i = 0; i < c.n_sectors; ++i) {
        for (int a = 0; a < d; ++a) {
            for (int b = 0; b < d; ++b) {
                if (c.kind == PatchKind::EF)
                    set(c.ef_point(i, a, b),
                        (a + 0.5) * across(i) + (b + 0.5) * across(i + 1));
                else
                    set(c.ev_point(i, a, b),
                        double(a) * across(i) + double(b) * across(i + 1));
            }
        }
    }
    if (c.kind == PatchKind::EF && c.is_open()) {
        for (int p = 0; p < d; ++p) {
            set(c.ef_curve(0, p), (p + 0.5) * across(0));
            set(c.ef_curve(1, p), (p + 0.5) * across(c.n_sectors));
        }
    }
    if (c.kind == PatchKind::EF && c.border != PatchBorder::Smooth)
        set(c.ef_centre(), {0, 0});
    return net;
}

/// All over a sector, its boundary included.
std::vector<DomainPoint> grid_points(int sector, int rate) {
    std::vector<DomainPoint> points;
    for (int i = 0; i <= rate; ++i) {
        for (int j = 0; j <= rate; ++j)
            points.push_back({sector, double(i) / rate, double(j) / rate});
    }
    return points;
}

std::string describe(const PatchClass& c, const DomainPoint& p) {
    return testing::PrintToString(c) + " sector " + std::to_string(p.sector) + " (" +
           std::to_string(p.a) + ", " + std::to_string(p.b) + ")";
}

// ------------------------------------------------------------------------ weights

/// How much faster than (a, b) the point beside the centre moves along the border.
double stretch(const PatchBasis& basis) {
    if (!basis.patch_class().is_open())
        return 1;
    const auto centre = basis.to_native({0, 0, 0});
    return std::max(1.0, glm::length(basis.to_native({0, 1e-6, 0}) - centre) * 1e6);
}

TEST(PatchBorderBasis, WeightsSumToOne) {
    for (const auto& c : border_classes({2, 3, 4, 5, 6, 7, 15})) {
        const PatchBasis basis(c);
        const double faster = stretch(basis);
        const bool large = c.n_sectors > 6;
        for (const int sector : {0, c.n_sectors - 1}) {
            for (const auto& p : grid_points(sector, large ? 2 : 3)) {
                for (const Chart chart : {Chart::Native, Chart::BaseUV}) {
                    J<2> sum;
                    double sizes[3] = {};
                    for (const auto& w : weights<2>(basis, p, chart)) {
                        sum += w;
                        for (int m = 0; m <= 2; ++m)
                            sizes[m] += order_max(w, m);
                    }
                    sum.c[0] -= 1;
                    // As of closed patches, and again for the curve that is put in. Where the
                    // addresses are moved, derivatives grow with the motion, and rounding
                    // with them.
                    double tolerance = 4e-14 * c.degree;
                    for (int m = 0; m <= 2; ++m) {
                        EXPECT_LE(order_max(sum, m), tolerance * (1 + sizes[m]))
                            << describe(c, p) << " order " << m;
                        if (chart == Chart::BaseUV)
                            tolerance *= faster;
                    }
                }
            }
        }
    }
}

TEST(PatchBorderBasis, CommutesWithAffineMaps) {
    const auto map = [](const Vec3<double>& p) {
        return Vec3<double>(0.3 * p.x - 1.2 * p.y + 0.4 * p.z + 2,
                            0.9 * p.x + 0.2 * p.y - 1, 0.5 * p.y - 0.7 * p.z + 0.5);
    };
    for (const auto& c : border_classes({2, 3, 4, 5, 7})) {
        const PatchBasis basis(c);
        const Net net = random_net(c);
        Net mapped;
        for (const auto& p : net)
            mapped.push_back(map(p));
        for (const auto& p : grid_points(c.n_sectors / 2, 3)) {
            const auto s = surface<0>(basis, p, Chart::Native, net),
                       m = surface<0>(basis, p, Chart::Native, mapped);
            const auto expected = map({s[0].c[0], s[1].c[0], s[2].c[0]});
            for (int x = 0; x < 3; ++x)
                EXPECT_NEAR(m[x].c[0], expected[x], 1e-12) << describe(c, p);
        }
    }
}

/// Of the control points, at distance t from the centre along the first border spoke or the
/// last one: those of the B-spline curve of the border's points alone.
std::vector<double> curve_weights(const PatchClass& c, bool last, double t) {
    const int d = c.degree;
    std::vector<double> w(c.n_points(), 0.0);
    const bool ev = c.kind == PatchKind::EV;
    const auto basis = [&](double at) {
        return test::cardinal_bspline(d, t - at + 0.5 * (d + 1));
    };
    const int spokes[2] = {0, c.n_sectors};
    for (int p = ev ? 1 : 0; p < d; ++p) {
        const double at = ev ? p : p + 0.5;
        const auto point = [&](bool end) {
            return ev ? c.ev_spoke(spokes[end], p) : c.ef_curve(end, p);
        };
        w[point(last)] += basis(at);
        if (c.border == PatchBorder::Smooth) {
            w[point(!last)] += basis(-at);
        } else {  // 2 C - P
            w[point(last)] -= basis(-at);
            w[ev ? 0 : c.ef_centre()] += 2 * basis(-at);
        }
    }
    if (ev)
        w[0] += basis(0);
    return w;
}

// Along both spokes that are a border, at equal addresses whatever the patch.
TEST(PatchBorderBasis, TheBorderIsTheBSplineCurveOfItsPoints) {
    auto all = border_classes({2, 3, 4, 5, 6, 7, 15});
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : {2, 3, 5}) {
            all.push_back({kind, d, 360, PatchBorder::Smooth});
            all.push_back({kind, d, 180, PatchBorder::Pinned});
            all.push_back({kind, d, 1, PatchBorder::Pinned});  // a dart at one face
            all.push_back({kind, d, 2, PatchBorder::Smooth});
        }
    }
    for (const auto& c : all) {
        if (!c.is_open())
            continue;
        const PatchBasis basis(c);
        std::vector<bool> on_border(c.n_points(), false);
        for (int p = 0; p < c.degree; ++p) {
            for (const bool end : {false, true})
                on_border[c.kind == PatchKind::EV ? c.ev_spoke(end ? c.n_sectors : 0, p)
                                                  : c.ef_curve(end, p)] = true;
        }
        if (c.kind == PatchKind::EF && c.border == PatchBorder::Pinned)
            on_border[c.ef_centre()] = true;
        for (const bool last : {false, true}) {
            for (const double a : {0.0, 1e-9, 0.1, 0.25, 0.37, 0.5, 0.8, 0.99, 1.0}) {
                const DomainPoint p{last ? c.n_sectors - 1 : 0, last ? 0 : a,
                                    last ? a : 0};
                const auto actual = weights<0>(basis, p, Chart::BaseUV);
                const auto expected = curve_weights(c, last, a * c.extent() / 2);
                // tau rounds by some ulps, at the ends of the border n times as much.
                const double tolerance = std::max(1e-12, 3e-15 * c.n_polygon());
                for (int i = 0; i < c.n_points(); ++i) {
                    EXPECT_NEAR(actual[i].c[0], expected[i], tolerance)
                        << describe(c, p) << " point " << i;
                    if (!on_border[i]) {
                        // Mirror images of one ribbon and another's cancel up to rounding.
                        const bool pinned = c.border == PatchBorder::Pinned;
                        EXPECT_NEAR(actual[i].c[0], 0,
                                    pinned || c.degree == 15 ? 4e-15 : 1e-15)
                            << describe(c, p) << " point " << i;
                    }
                }
            }
        }
    }
}

// Derivatives along the border too: the parameter is linear.
TEST(PatchBorderBasis, TheBorderIsPassedAtAnEvenPace) {
    constexpr double h = 1e-3;
    for (const auto& c : border_classes({3, 4, 5, 7})) {
        if (!c.is_open())
            continue;
        const PatchBasis basis(c);
        for (const double a : {0.3, 0.62}) {
            const auto actual = weights<2>(basis, {0, a, 0}, Chart::BaseUV);
            const double scale = c.extent() / 2.0;
            const auto at = [&](double x) { return curve_weights(c, false, x * scale); };
            const auto mid = at(a), p1 = at(a + h), m1 = at(a - h), p2 = at(a + 2 * h),
                       m2 = at(a - 2 * h);
            for (int i = 0; i < c.n_points(); ++i) {
                // Differences of fourth order of pieces of degree d: h^4/30 of the fifth
                // derivative, and eps/h^2.
                const double d1 = (8 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12 * h);
                const double d2 =
                    (16 * (p1[i] + m1[i]) - (p2[i] + m2[i]) - 30 * mid[i]) / (12 * h * h);
                EXPECT_NEAR(actual[i].c[1], d1, 1e-9)
                    << describe(c, {0, a, 0}) << " point " << i;
                EXPECT_NEAR(2 * actual[i].c[3], d2, 1e-7)
                    << describe(c, {0, a, 0}) << " point " << i;
            }
        }
    }
}

TEST(PatchBorderBasis, ASpikeIsItsPoint) {
    for (const auto& c : border_classes({2, 3, 4, 5, 6, 7, 15})) {
        if (c.border != PatchBorder::Spike)
            continue;
        const PatchBasis basis(c);
        const int pin = c.kind == PatchKind::EV ? 0 : c.ef_centre();
        for (int sector = 0; sector < c.n_sectors; ++sector) {
            const auto w = weights<0>(basis, {sector, 0, 0}, Chart::Native);
            for (int i = 0; i < c.n_points(); ++i) {
                EXPECT_NEAR(w[i].c[0], i == pin ? 1 : 0, 1e-14)
                    << testing::PrintToString(c) << " point " << i;
            }
        }
    }
}

TEST(PatchBorderBasis, PinnedCornersReproduceTheReferenceVectors) {
    int n_files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(OSDX_TEST_DATA)) {
        const std::string name = entry.path().filename().string();
        if (!name.starts_with("corner_"))
            continue;
        ++n_files;
        std::ifstream file(entry.path());
        const auto json = nlohmann::json::parse(file);
        const PatchClass c{json.at("kind") == "EV" ? PatchKind::EV : PatchKind::EF,
                           json.at("d").get<int>(), json.at("n_sectors").get<int>(),
                           PatchBorder::Pinned};
        const PatchBasis basis(c);
        Net net;
        for (const auto& p : json.at("control"))
            net.push_back(vector(p));
        ASSERT_EQ(net.size(), std::size_t(c.n_points())) << name;
        EXPECT_GE(json.at("samples").size(), 7u) << name;
        for (const auto& sample : json.at("samples")) {
            const auto& xy = sample.at("xy");
            const auto p =
                basis.from_native({xy.at(0).get<double>(), xy.at(1).get<double>()});
            const auto jet = surface<2>(basis, p, Chart::Native, net);
            constexpr std::array kNames = {"pos", "dx", "dy", "dxx", "dxy", "dyy"};
            constexpr std::array kFactorials = {1, 1, 1, 2, 1, 2};
            // Given to 1e-9, 1e-8, 1e-7; 1e-13 is reached.
            for (std::size_t r = 0; r < kNames.size(); ++r) {
                const auto expected = vector(sample.at(kNames[r]));
                for (int x = 0; x < 3; ++x)
                    EXPECT_NEAR(kFactorials[r] * jet[x].c[r], expected[x],
                                1e-12 * (1 + std::abs(expected[x])))
                        << name << " " << describe(c, p) << " " << kNames[r];
            }
        }
        // At the vertex the surface is a cone; its derivatives are those along the sector's middle.
        for (int sector = 0; sector < c.n_sectors && json.contains("vertex"); ++sector) {
            const auto jet = surface<1>(basis, {sector, 0, 0}, Chart::Native, net);
            Vec3<double> u, v;
            for (int x = 0; x < 3; ++x) {
                u[x] = jet[x].c[1];
                v[x] = jet[x].c[2];
            }
            const auto expected = vector(json["vertex"].at("sector_normals")[sector]);
            EXPECT_LE(glm::length(glm::normalize(glm::cross(u, v)) - expected), 1e-8)
                << name << " sector " << sector;
        }
    }
    EXPECT_EQ(n_files, 6);
}

/// Sectors of equal widths in a plane, each an affine grid: with its edges' length for a unit.
Net fan_net(const PatchClass& c, double opening) {
    Net net(c.n_points());
    const auto point = [&](int spoke, double a, double b) {
        const auto unit = [&](int i) {
            const double angle = opening * i / c.n_sectors;
            return Vec3<double>(std::cos(angle), std::sin(angle), 0);
        };
        return a * unit(spoke) + b * unit(spoke + 1);
    };
    const int d = c.degree;
    for (int s = 0; s < c.n_sectors; ++s) {
        for (int a = 0; a < d; ++a) {
            for (int b = 0; b < d; ++b) {
                if (c.kind == PatchKind::EV)
                    net[c.ev_point(s, a, b)] = point(s, a, b);
                else
                    net[c.ef_point(s, a, b)] = point(s, a + 0.5, b + 0.5);
            }
        }
    }
    for (int p = 0; p < d && c.kind == PatchKind::EF; ++p) {
        net[c.ef_curve(0, p)] = point(0, p + 0.5, 0);
        net[c.ef_curve(1, p)] = point(c.n_sectors, p + 0.5, 0);
    }
    return net;
}

// Flat, and so regular at straight and re-entrant corners too.
TEST(PatchBorderBasis, PinnedFansDoNotFold) {
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : {2, 3, 4, 5}) {
            for (const int k : test::thinned<int>({2, 3, 4, 5, 6, 8})) {
                const PatchBasis basis({kind, d, k, PatchBorder::Pinned});
                for (const int degrees : {30, 90, 180, 240, 270, 330}) {
                    // Two sectors of even degree 2 around a face fold from 270 degrees on.
                    if (degrees > 150 * k ||
                        (degrees >= 270 && kind == PatchKind::EF && d == 2 && k == 2))
                        continue;
                    const Net net =
                        fan_net(basis.patch_class(), degrees * std::numbers::pi / 180);
                    for (int s = 0; s < k; ++s) {
                        for (const auto& p : grid_points(s, 4)) {
                            const auto jet = surface<1>(basis, p, Chart::Native, net);
                            EXPECT_GT(
                                jet[0].c[1] * jet[1].c[2] - jet[0].c[2] * jet[1].c[1], 0)
                                << describe(basis.patch_class(), p) << ", " << degrees;
                        }
                    }
                }
            }
        }
    }
}

// A dart is a pinned patch both of whose borders are the same crease.
TEST(PatchBorderBasis, BothSidesOfADartAreOneCurve) {
    for (const auto& c : border_classes({2, 3, 4, 5, 6, 7, 15})) {
        if (c.border != PatchBorder::Pinned)
            continue;
        const PatchBasis basis(c);
        Net net = random_net(c);
        for (int p = 1; p < c.degree; ++p) {
            if (c.kind == PatchKind::EV)
                net[c.ev_spoke(c.n_sectors, p)] = net[c.ev_spoke(0, p)];
        }
        for (int p = 0; p < c.degree && c.kind == PatchKind::EF; ++p)
            net[c.ef_curve(1, p)] = net[c.ef_curve(0, p)];
        for (const double a : {0.0, 0.2, 0.45, 0.7, 1.0}) {
            const auto first = surface<0>(basis, {0, a, 0}, Chart::BaseUV, net),
                       last =
                           surface<0>(basis, {c.n_sectors - 1, 0, a}, Chart::BaseUV, net);
            for (int x = 0; x < 3; ++x)
                EXPECT_NEAR(first[x].c[0], last[x].c[0],
                            1e-13 * (1 + std::abs(first[x].c[0])))
                    << testing::PrintToString(c) << " a " << a;
        }
    }
}

// ------------------------------------------------------------------------ the sides

/// The points of the whole n-gon: those of the sectors, then their mirror images 2 F - P. The
/// foot F of a sector beside the border is the border point that it sits over, of others the
/// centre.
Net mirrored_net(const PatchClass& c, const Net& net) {
    const PatchClass whole{c.kind, c.degree, c.n_polygon()};
    const int d = c.degree, k = c.n_sectors, n = whole.n_sectors;
    const bool ev = c.kind == PatchKind::EV;
    Net result(whole.n_points());
    if (c.border ==
        PatchBorder::Spike) {  // nothing to mirror; an EF's centre is left out
        std::copy_n(net.begin(), result.size(), result.begin());
        return result;
    }
    const auto at = [&](int sector, int a, int b) -> Vec3<double>& {
        return result[ev ? whole.ev_point(sector, a, b) : whole.ef_point(sector, a, b)];
    };
    // Border points by their distance from the centre, on the spokes 0 and k.
    std::vector<Vec3<double>> first(d), last(d);
    const Vec3<double> centre =
        ev ? net[0]
        : c.border == PatchBorder::Pinned
            ? net[c.ef_centre()]
            : 0.5 * (net[c.ef_curve(0, 0)] + net[c.ef_curve(1, 0)]);
    for (int p = 0; p < d; ++p) {
        first[p] = net[ev ? c.ev_spoke(0, p) : c.ef_curve(0, p)];
        last[p] = net[ev ? c.ev_spoke(k, p) : c.ef_curve(1, p)];
    }
    for (int s = 0; s < k; ++s) {
        for (int a = 0; a < d; ++a) {
            for (int b = 0; b < d; ++b)
                at(s, a, b) = net[ev ? c.ev_point(s, a, b) : c.ef_point(s, a, b)];
        }
    }
    const int lo = ev ? 1 : 0;  // an EV's points with a or b = 0 lie on spokes
    for (int s = k; s < n; ++s) {
        for (int a = lo; a < d; ++a) {
            for (int b = lo; b < d; ++b) {
                const Vec3<double> foot = s == n - 1 ? first[b]
                                          : s == k   ? last[a]
                                                     : centre;
                at(s, a, b) = 2.0 * foot - at(n - 1 - s, b, a);
            }
        }
    }
    for (int s = k + 1; s < n && ev; ++s) {
        for (int b = 1; b < d; ++b)
            result[whole.ev_spoke(s, b)] =
                2.0 * centre - result[whole.ev_spoke(n - s, b)];
    }
    return result;
}

/// Points on the sides that the patch shares with its neighbours.
std::vector<DomainPoint> shared_side_points(const PatchClass& c) {
    std::vector<DomainPoint> points;
    const int n = c.n_sectors;
    for (const int sector : {0, n / 2, n - 1}) {
        points.push_back({sector, 1, 0.87});
        points.push_back({sector, 1, 0.35});
        points.push_back({sector, 0.35, 1});
        if (c.n_polygon() > 12)
            continue;
        points.push_back({sector, 1, 0.04});
        points.push_back({sector, 0.62, 1});
        points.push_back({sector, 0.04, 1});
    }
    return points;
}

TEST(PatchBorderBasis, HasTheDerivativesOfTheMirroredPatchOnItsSides) {
    for (const auto& c : border_classes({2, 3, 4, 5, 6, 7})) {
        if (c.n_sectors == 1)
            continue;
        const int d = c.degree;
        if (d > 5 && c.n_sectors > 6)
            continue;  // for the time that it takes
        const PatchBasis basis(c), whole({c.kind, d, c.n_polygon()});
        const Net net = random_net(c), mirrored = mirrored_net(c, net);
        double order_d = 0, inside = 0;
        with_order(d, [&]<int Order>() {
            for (const auto& p : shared_side_points(c)) {
                const auto q = whole.from_native(basis.to_native(p));
                const auto actual = surface<Order>(basis, p, Chart::Native, net),
                           expected = surface<Order>(whole, q, Chart::Native, mirrored);
                for (int x = 0; x < 3; ++x) {
                    const auto e = actual[x] - expected[x];
                    for (int m = 0; m < d; ++m) {
                        // On the sides across the border C - S cancels to an ulp or so,
                        // times the derivatives of the correction's blends of d-th powers:
                        // up to (4 d)^m, since they turn within a fraction 1/d of the patch.
                        EXPECT_LE(order_max(e, m),
                                  1e-11 * (1 + order_max(expected[x], m)) +
                                      1e-15 * std::pow(4.0 * d, m))
                            << describe(c, p) << " order " << m;
                    }
                    if (d <= Order)
                        order_d = std::max(order_d, order_max(e, d));
                }
            }
        });
        // Inside they differ, so that the comparison can fail. Between four and eight sides
        // mirror images give the curve already.
        const DomainPoint p{0, 0.4, 0};
        const auto a = surface<0>(basis, p, Chart::Native, net),
                   b = surface<0>(whole, whole.from_native(basis.to_native(p)),
                                  Chart::Native, mirrored);
        for (int x = 0; x < 3; ++x)
            inside = std::max(inside, std::abs(a[x].c[0] - b[x].c[0]));
        EXPECT_GT(std::max(inside, order_d), 1e-6) << testing::PrintToString(c);
    }
}

/// N_k(u) = M(u + d - k), M the B-spline on the knots 0 .. d+1.
template <int Order>
J<Order> bspline(int d, int k, const J<Order>& u) {
    const J<Order> x = u + J<Order>(d - k);
    if (x.c[0] < 0 || x.c[0] >= d + 1)
        return {};
    std::vector<J<Order>> b(d + 1);
    for (int m = 0; m <= d; ++m)
        b[m] = J<Order>(x.c[0] >= m && x.c[0] < m + 1 ? 1 : 0);
    for (int r = 1; r <= d; ++r) {
        for (int m = 0; m + r <= d; ++m)
            b[m] = 1.0 / r *
                   ((x - J<Order>(m)) * b[m] + (J<Order>(m + r + 1) - x) * b[m + 1]);
    }
    return b[0];
}

// One sector at a smooth border: on its two sides it is the tensor-product B-spline whose other
// half is mirrored at the border, in the parameters of the triangle.
TEST(PatchBorderBasis, OneSectorJoinsTheBSplineOfItsRibbon) {
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (int d = 2; d <= 7; ++d) {
            const PatchClass c{kind, d, 1, PatchBorder::Smooth};
            const PatchBasis basis(c);
            const Net net = random_net(c);
            const bool ev = kind == PatchKind::EV;
            const int n_columns = ev ? 2 * d - 1 : 2 * d;
            const double intervals = ev ? d - 1 : d;
            double order_d = 0;
            with_order(d, [&]<int Order>() {
                for (const int side : {0, 1}) {
                    // Rows run away from the neighbour, columns along the side.
                    const auto point = [&](int j, int k) {
                        const int b = d - 1 - k;
                        const auto own = [&](int a) {  // steps away from the border
                            if (ev)
                                return net[side == 0 ? c.ev_point(0, b, a)
                                                     : c.ev_point(0, a, b)];
                            return net[side == 0 ? c.ef_point(0, b, a)
                                                 : c.ef_point(0, a, b)];
                        };
                        const auto foot =
                            net[ev ? c.ev_spoke(side, b) : c.ef_curve(side, b)];
                        // Ribbon 0 runs away from the border, ribbon 1 towards it.
                        const int a = side == 0 ? j - (ev ? d - 1 : d) : d - 1 - j;
                        if (a >= 0)
                            return own(a);
                        return 2.0 * foot - own(ev ? -a : -a - 1);
                    };
                    for (const double t : {0.04, 0.3, 0.77, 0.98}) {
                        const DomainPoint p =
                            side == 0 ? DomainPoint{0, 1, t} : DomainPoint{0, t, 1};
                        const auto xy = basis.to_native(p);
                        J<Order> x(xy.x), y(xy.y);
                        x.c[1] = y.c[2] = 1;
                        // Barycentric in (1,0), (0,1), (-1,0).
                        const J<Order> one(1.0), corner = y, first = 0.5 * (one + x - y),
                                                 last = 0.5 * (one - x - y);
                        const J<Order> half =
                            0.5 * corner / (corner + (side == 0 ? first : last));
                        const J<Order> s =
                            side == 0 ? J<Order>(0.5) + half : J<Order>(0.5) - half;
                        const J<Order> sbar = intervals * s;
                        J<Order> hbar = intervals * (0.5 * (side == 0 ? last : first));
                        EXPECT_NEAR(hbar.c[0], 0, 1e-15);
                        hbar.c[0] = 0;
                        const auto actual = surface<Order>(basis, p, Chart::Native, net);
                        std::array<J<Order>, 3> expected;
                        for (int k = 0; k < d; ++k) {
                            const auto row = bspline(d, k, hbar);
                            for (int j = 0; j < n_columns; ++j) {
                                const auto w = bspline(d, j, sbar) * row;
                                for (int z = 0; z < 3; ++z)
                                    expected[z] += point(j, k)[z] * w;
                            }
                        }
                        for (int z = 0; z < 3; ++z) {
                            const auto e = actual[z] - expected[z];
                            for (int m = 0; m < d; ++m) {
                                EXPECT_LE(order_max(e, m),
                                          1e-12 * (1 + order_max(expected[z], m)))
                                    << describe(c, p) << " order " << m;
                            }
                            if (d <= Order)
                                order_d = std::max(order_d, order_max(e, d));
                        }
                    }
                }
            });
            if (d <= 6) {
                EXPECT_GT(order_d, 1e-2) << testing::PrintToString(c);
            }
        }
    }
}

// ------------------------------------------------------------------------ inside

// The middle lines of the sectors lie in two of them.
TEST(PatchBorderBasis, SectorsAgreeWhereTheyMeet) {
    for (const auto& c : border_classes({2, 3, 4, 5, 7})) {
        const PatchBasis basis(c);
        const Net net = random_net(c);
        const int order = std::min(c.degree - 1, 2);
        const bool closed = !c.is_open();
        for (int i = closed ? 0 : 1; i < c.n_sectors; ++i) {
            const int before = (i + c.n_sectors - 1) % c.n_sectors;
            for (const double r : {0.0, 0.2, 0.7, 1.0}) {
                const auto f = surface<2>(basis, {i, r, 0}, Chart::Native, net),
                           g = surface<2>(basis, {before, 0, r}, Chart::Native, net);
                for (int x = 0; x < 3; ++x) {
                    // At a pinned centre the surface is a cone.
                    const bool cone = r == 0 && c.border == PatchBorder::Pinned;
                    for (int m = 0; m <= (cone ? 0 : order); ++m) {
                        EXPECT_LE(order_max(f[x] - g[x], m),
                                  1e-11 * (1 + order_max(f[x], m)))
                            << describe(c, {i, r, 0}) << " order " << m;
                    }
                }
            }
        }
    }
}

/// The parameters t in [0,1] at which one of the values at t passes through a whole number.
template <class Values>
std::vector<double> knots_on_line(Values&& values) {
    constexpr int kSteps = 60;
    std::vector<double> knots;
    std::vector<double> at_lo = values(0.0);
    for (int k = 0; k < kSteps; ++k) {
        const std::vector<double> at_hi = values(double(k + 1) / kSteps);
        for (std::size_t i = 0; i < at_lo.size(); ++i) {
            const double knot = std::floor(std::max(at_lo[i], at_hi[i]));
            const bool rises = at_lo[i] < knot;
            if (rises == (at_hi[i] < knot) || knot < 0.5)
                continue;
            double lo = double(k) / kSteps, hi = double(k + 1) / kSteps;
            while (hi - lo > 1e-13) {
                const double mid = 0.5 * (lo + hi);
                ((values(mid)[i] < knot) == rises ? lo : hi) = mid;
            }
            knots.push_back(lo);
        }
        at_lo = at_hi;
    }
    return knots;
}

// Knots are the lines where s_i or h_i of any side is a whole number of intervals, those beyond
// the border too, and those where the parameter of the border's curve is one.
TEST(PatchBorderBasis, IsOfOrderDMinusOneAcrossItsKnots) {
    constexpr double step = 1e-9;
    for (const auto& c : border_classes({2, 3, 4}, 4)) {
        const int d = c.degree, n = c.n_sectors;
        const double intervals = c.kind == PatchKind::EV ? d - 1 : d;
        if (n == 1)
            continue;  // its triangle has other parameters
        const PatchBasis basis(c);
        const Net net = random_net(c);
        double order_d = 0;
        std::size_t n_knots = 0;
        for (const auto& [from_p, to_p] :
             {std::pair(DomainPoint{0, 0.13, 0.2}, DomainPoint{n - 1, 0.9, 0.83}),
              std::pair(DomainPoint{n - 1, 0.21, 0.07}, DomainPoint{0, 0.93, 0.71})}) {
            const auto from = basis.to_native(from_p), to = basis.to_native(to_p);
            const auto at = [&](double t) {
                return basis.from_native((1 - t) * from + t * to);
            };
            // tau is linear in the address along the border: a knot's foot is known there.
            const auto end = basis.to_native({0, 1, 0});
            const auto tau = [&](double foot) {
                const auto p = basis.from_native(foot * end);
                return (1 - p.a) * intervals / 2;
            };
            std::vector<double> knots = knots_on_line([&](double t) {
                const auto side = basis.ribbons()->side_parameters(at(t));
                std::vector<double> values = side.s;
                values.insert(values.end(), side.h.begin(), side.h.end());
                for (double& x : values)
                    x *= intervals;
                if (!c.is_open())
                    return values;
                const auto xy = basis.to_native(at(t));
                double x = glm::dot(xy, end), y = end.x * xy.y - end.y * xy.x;
                if (c.n_sectors == 1) {
                    x /= 1 - y;
                } else {
                    x /= glm::dot(end, end);
                    y /= glm::dot(end, end);
                }
                values.push_back(tau(std::abs(x)));
                if (c.border == PatchBorder::Pinned) {
                    const double eps = c.n_sectors == 2 ? 0.7 : 0.5;
                    values.push_back(
                        tau(std::sqrt(x * x + eps * eps * y * y * (1 - x * x))));
                }
                return values;
            });
            n_knots += knots.size();
            with_order(d, [&]<int Order>() {
                for (const double t : knots) {
                    const auto before = surface<Order>(basis, at(t - step), Chart::Native,
                                                       net),
                               after = surface<Order>(basis, at(t + step), Chart::Native,
                                                      net);
                    for (int x = 0; x < 3; ++x) {
                        const auto jump = after[x] - before[x];
                        for (int m = 0; m < d; ++m) {
                            // Without a jump they differ by the step times order m + 1.
                            const double slope =
                                order_max(before[x], m + 1) + order_max(after[x], m + 1);
                            EXPECT_LE(order_max(jump, m),
                                      4 * (m + 1) * step * slope +
                                          1e-10 * (1 + order_max(before[x], m)))
                                << describe(c, at(t)) << " order " << m;
                        }
                        order_d = std::max(order_d, order_max(jump, d));
                    }
                }
            });
        }
        if (intervals > 1) {
            EXPECT_GE(n_knots, 4u) << testing::PrintToString(c);
            EXPECT_GT(order_d, 1e-2) << testing::PrintToString(c);
        }
    }
}

// ------------------------------------------------------------------------ the domain

TEST(PatchBorderBasis, NativeChartGoesThereAndBack) {
    auto all = border_classes({2, 3, 7});
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        all.push_back({kind, 3, 360, PatchBorder::Smooth});
        all.push_back({kind, 5, 180, PatchBorder::Pinned});
    }
    for (const auto& c : test::thinned(all)) {
        const PatchBasis basis(c);
        const double width = std::sin(std::numbers::pi / std::max(c.n_polygon(), 4));
        for (const int sector : {0, c.n_sectors - 1}) {
            for (const auto& p : grid_points(sector, c.n_polygon() > 30 ? 3 : 5)) {
                const auto xy = basis.to_native(p);
                const auto q = basis.from_native(xy);
                EXPECT_LE(glm::length(basis.to_native(q) - xy), 1e-13) << describe(c, p);
                if (p.a > 0 && p.b > 0 && p.a < 1 && p.b < 1) {
                    // The map shrinks by sin(pi/n) across the sector and by its square
                    // along the diagonal at the corner.
                    EXPECT_EQ(q.sector, p.sector) << describe(c, p);
                    EXPECT_NEAR(q.a, p.a, 2e-14 / (width * width)) << describe(c, p);
                    EXPECT_NEAR(q.b, p.b, 2e-14 / (width * width)) << describe(c, p);
                }
            }
        }
    }
}

// Addresses along the border never turn back, whatever the number of sides and the degree.
TEST(PatchBorderBasis, AddressesAlongTheBorderRise) {
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : {2, 3, 4, 5, 6, 7, 9, 12, 15}) {
            std::vector<PatchClass> all;
            for (const int n : {1, 2, 3, 5, 6, 10, 20, 90})
                all.push_back({kind, d, n, PatchBorder::Smooth});
            for (const int n : {1, 2, 3, 5, 12})
                all.push_back({kind, d, n, PatchBorder::Pinned});
            if (d == 3 || d == 9) {
                all.push_back({kind, d, 360, PatchBorder::Smooth});
                all.push_back({kind, d, 180, PatchBorder::Pinned});
            }
            for (const auto& c : test::thinned(all)) {
                const PatchBasis basis(c);
                const int last = c.n_sectors - 1;
                const auto end = basis.to_native({0, 1, 0}),
                           other_end = basis.to_native({last, 0, 1});
                const auto middle = basis.to_native({0, 0, 0});
                double before = -1, other_before = -1;
                const int n_steps = c.n_polygon() > 100 ? 12 : 30;
                for (int i = 0; i <= n_steps; ++i) {
                    const double a = double(i) / n_steps;
                    const double at = glm::dot(basis.to_native({0, a, 0}) - middle,
                                               end - middle),
                                 other = glm::dot(basis.to_native({last, 0, a}) - middle,
                                                  other_end - middle);
                    ASSERT_GT(at, before) << testing::PrintToString(c) << " a " << a;
                    ASSERT_GT(other, other_before) << testing::PrintToString(c);
                    ASSERT_NEAR(at / glm::dot(end - middle, end - middle),
                                other / glm::dot(other_end - middle, other_end - middle),
                                1e-13);
                    before = at;
                    other_before = other;
                }
            }
        }
    }
}

TEST(PatchBorderBasis, HasNoSingularityAnywhere) {
    std::vector<PatchClass> all;
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : {2, 3, 9}) {
            all.push_back({kind, d, 1, PatchBorder::Smooth});
            all.push_back({kind, d, 5, PatchBorder::Smooth});
            all.push_back({kind, d, 2, PatchBorder::Pinned});
            all.push_back({kind, d, 3, PatchBorder::Spike});
            if (d == 3 && kind == PatchKind::EV)
                all.push_back({kind, d, 360, PatchBorder::Smooth});
            if (d == 3 && kind == PatchKind::EF)
                all.push_back({kind, d, 180, PatchBorder::Pinned});
        }
    }
    for (const auto& c : test::thinned(all)) {
        const PatchBasis basis(c);
        for (const int q : {0, c.n_sectors - 1}) {
            std::vector<DomainPoint> points = {{q, 0.4, 0.9}, {q, 0.3, 0}, {q, 0, 0.3}};
            for (const double e : {0.0, 1e-300, 1e-16, 1e-9, 1e-4}) {
                points.push_back({q, 1 - e, 1 - e});  // to the corner
                points.push_back({q, 1, 1 - e});
                points.push_back({q, 1 - e, 0.4});  // to a side
                points.push_back({q, 1 - e, 0});    // to the ends of the border
                points.push_back({q, 0, 1 - e});
                points.push_back({q, e, 0});  // to the centre
                points.push_back({q, e, e});
                points.push_back({q, 0.4, e});  // to the border
            }
            for (const auto& p : test::thinned(points)) {
                const int n_charts = c.n_polygon() > 100 && p.a * p.b > 0 ? 1 : 2;
                for (int chart = 0; chart < n_charts; ++chart) {
                    double sum = 0;
                    for (const auto& w : weights<2>(basis, p, Chart(chart))) {
                        for (const double x : w.c)
                            ASSERT_TRUE(std::isfinite(x)) << describe(c, p);
                        sum += w.c[0];
                    }
                    // f of large faces is small, and so is what a rounding of h keeps.
                    EXPECT_NEAR(sum, 1, 1e-12 * c.degree) << describe(c, p);
                }
            }
        }
    }
}

// ------------------------------------------------------------------------ precision

TEST(PatchBorderBasis, FloatIsDoubleRounded) {
    for (const auto& [name, mesh] : test::creased_meshes()) {
        for (int d = 2; d <= 5; ++d) {
            const auto table = build_patch_table(test::topology_of(mesh),
                                                 test::features_of(mesh), {.degree = d});
            ASSERT_TRUE(table) << name;
            const Evaluator evaluator(*table);
            std::vector<Vec3<double>> points(mesh.positions);
            points.resize(table->n_points());
            table->refresh_points<double>(points);
            const std::vector<Vec3<float>> rounded(points.begin(), points.end());
            std::vector<bool> seen(table->classes().size(), false);
            for (const Cell& cell : table->cells()) {
                const Index patch_class = table->patch(cell.patch).patch_class;
                if (seen[patch_class])
                    continue;
                seen[patch_class] = true;
                for (const double t : {0.0, 0.3, 1.0}) {
                    const auto q =
                        cell.origin + t * cell.x_axis + 0.4 * turn(cell.x_axis, 1);
                    const QuarterPoint at{cell.quarter, q.x, q.y};
                    const auto a = evaluator.evaluate<double>(points, at, Chart::Native);
                    const auto b = evaluator.evaluate<float>(rounded, at, Chart::Native);
                    // Points of about 1 are rounded to half an ulp, and so are the results;
                    // weights and their derivatives sum to less than 10, 100, 1000.
                    constexpr double eps = std::numeric_limits<float>::epsilon();
                    EXPECT_LE(glm::length(a.p - Vec3<double>(b.p)), 10 * eps) << name;
                    EXPECT_LE(glm::length(a.du - Vec3<double>(b.du)), 100 * eps) << name;
                    EXPECT_LE(glm::length(a.dv - Vec3<double>(b.dv)), 100 * eps) << name;
                    EXPECT_LE(glm::length(a.duu - Vec3<double>(b.duu)), 1000 * eps)
                        << name;
                    EXPECT_LE(glm::length(a.dvv - Vec3<double>(b.dvv)), 1000 * eps)
                        << name;
                }
            }
        }
    }
}

}  // namespace
}  // namespace osdx
