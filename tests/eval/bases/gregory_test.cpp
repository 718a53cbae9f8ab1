// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/gregory.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/reference_files.h"

namespace osdx {
namespace {

using test::vector;

using Json = nlohmann::json;

template <class T>
using Net = std::vector<Vec3<T>>;

Net<double> random_net(const GregoryBasis& basis, unsigned seed = 1) {
    std::mt19937 engine(seed);
    const auto next = [&] { return double(engine()) / 4294967296.0 - 0.5; };
    Net<double> net(basis.n_points());
    for (auto& p : net)
        p = {next(), next(), next()};
    return net;
}

template <int Order, class T>
std::array<Jet<T, Order>, 3> surface(const GregoryBasis& basis, const DomainPoint& p,
                                     Chart chart, const Net<T>& net) {
    std::array<Jet<T, Order>, 3> sums;
    const auto f =
        basis.for_each_weight<Order>(p, chart, [&](Index i, const Jet<double, Order>& w) {
            for (std::size_t k = 0; k < w.c.size(); ++k) {
                for (int x = 0; x < 3; ++x)
                    sums[x].c[k] += T(w.c[k]) * net[i][x];
            }
        });
    Jet<T, Order> g;
    for (std::size_t k = 0; k < f.c.size(); ++k)
        g.c[k] = T(f.c[k]);
    for (auto& s : sums)
        s = s / g;
    return sums;
}

template <int Order>
std::vector<Jet<double, Order>> weights(const GregoryBasis& basis, const DomainPoint& p,
                                        Chart chart) {
    std::vector<Jet<double, Order>> w(basis.n_points());
    basis.for_each_weight<Order>(
        p, chart, [&](Index i, const Jet<double, Order>& x) { w[i] += x; });
    return w;
}

/// \return the number of samples
std::size_t compare_with_reference(const Json& patch) {
    const GregoryBasis basis(patch.at("n").get<int>());
    const bool has_centre = patch.contains("centre_point");
    Net<double> net;
    for (const Json& corner : patch.at("control")) {
        for (const Json& p : corner)
            net.push_back(vector(p));
    }
    if (basis.has_centre()) {
        if (!has_centre)
            return 0;  // files with a border leave it out: gregory_points_test
        net.push_back(vector(patch.at("centre_point")));
    }
    for (std::size_t s = 0; s < patch.at("domain").size(); ++s) {
        const Json& xy = patch.at("domain")[s];
        const DomainPoint at =
            basis.from_native({xy.at(0).get<double>(), xy.at(1).get<double>()});
        const auto jet = surface<2, double>(basis, at, Chart::Native, net);
        constexpr std::array kNames = {"pos", "d1", "d2", "d11", "d12", "d22"};
        constexpr std::array kFactorials = {1, 1, 1, 2, 1, 2};
        for (std::size_t r = 0; r < kNames.size(); ++r) {
            const Vec3<double> expected = vector(patch.at(kNames[r])[s]);
            for (int x = 0; x < 3; ++x) {
                // Printed with 13 digits.
                EXPECT_NEAR(kFactorials[r] * jet[x].c[r], expected[x],
                            1e-10 * (1 + std::abs(expected[x])))
                    << kNames[r] << " of sample " << s;
            }
        }
        if (basis.has_centre()) {
            EXPECT_NEAR(weights<0>(basis, at, Chart::Native)[basis.centre_index()].c[0],
                        patch.at("centre_weight")[s].get<double>(), 1e-12);
            const auto normalised = surface<0, double>(
                GregoryBasis(basis.n(), CentrePoint::None), at, Chart::Native, net);
            const Vec3<double> expected = vector(patch.at("pos_normalised")[s]);
            for (int x = 0; x < 3; ++x)
                EXPECT_NEAR(normalised[x].c[0], expected[x], 1e-11);
        }
    }
    return patch.at("domain").size();
}

TEST(GregoryBasis, ReproducesTheReferenceVectors) {
    std::size_t n_samples = 0;
    int n_files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(OSDX_TEST_DATA)) {
        const std::string name = entry.path().filename().string();
        if (!name.starts_with("acc2_"))
            continue;
        ++n_files;
        SCOPED_TRACE(name);
        std::ifstream file(entry.path());
        const Json json = Json::parse(file);
        for (const auto& [key, value] : json.items()) {
            if (!key.ends_with("paper") && !key.ends_with("tuned"))
                continue;
            SCOPED_TRACE(key);
            for (const Json& patch : value.is_array() ? value : Json::array({value}))
                n_samples += compare_with_reference(patch);
        }
    }
    EXPECT_EQ(n_files, 6);
    EXPECT_GE(n_samples, 300u);
}

TEST(GregoryBasis, QuadIsTheRibbonPatchOfFourSides) {
    const GregoryBasis quad(4);
    const GeneralisedBezierBasis ribbons(4, 3);
    using G = GregoryBasis;
    for (const double u : {0.0, 0.1, 0.5, 0.83, 1.0}) {
        for (const double v : {0.0, 0.02, 0.5, 0.9, 1.0}) {
            std::vector<Jet<double, 2>> expected(ribbons.n_points());
            // The n-gon is turned by 135 degrees, and sqrt(2) wide.
            const Vec2<double> xy(1 - u - v, u - v);
            ribbons.for_each_weight<2>(
                ribbons.from_native(xy), Chart::Native,
                [&](Index i, const Jet<double, 2>& w) { expected[i] += w; });
            const auto actual = weights<2>(quad, {0, u, v}, Chart::Native);
            std::vector<Jet<double, 2>> sums(quad.n_points());
            for (int i = 0; i < 4; ++i) {
                const int before = (i + 3) % 4;
                constexpr G::Point kRows[4][2] = {{G::P, G::EMinus},
                                                  {G::EPlus, G::FPlus},
                                                  {G::EMinus, G::FMinus},
                                                  {G::P, G::EPlus}};
                for (int j = 0; j < 4; ++j) {
                    for (int k = 0; k < 2; ++k)
                        sums[quad.point(j < 2 ? before : i, kRows[j][k])] +=
                            expected[ribbons.ribbon_point(i, j, k)];
                }
            }
            for (Index i = 0; i < quad.n_points(); ++i) {
                // By the chain rule: d/du = -d/dx + d/dy, d/dv = -d/dx - d/dy.
                const auto& e = sums[i].c;
                const double chain[6] = {e[0],
                                         -e[1] + e[2],
                                         -e[1] - e[2],
                                         e[3] - e[4] + e[5],
                                         2 * e[3] - 2 * e[5],
                                         e[3] + e[4] + e[5]};
                for (int k = 0; k < 6; ++k)
                    EXPECT_NEAR(actual[i].c[k], chain[k], k == 0 ? 2e-15 : 2e-12)
                        << "u " << u << " v " << v << " point " << i << " coefficient "
                        << k;
            }
            EXPECT_NEAR(expected.back().c[0], 0, 1e-15);  // no centre is needed
        }
    }
}

// The formulas of the quad as they are published, in long double.
TEST(GregoryBasis, QuadEqualsThePublishedFormulasNextToCorners) {
    using J = Jet<long double, 3>;
    const GregoryBasis basis(4);
    const auto net = random_net(basis);
    const J one(1);
    for (double r = 0.7; r > 1e-5; r *= 0.1) {
        for (const double phi : {0.0, 0.3, 1.0, 1.5}) {
            for (int corner = 0; corner < 4; ++corner) {
                const double x = r * std::cos(phi), y = r * std::sin(phi);
                const double u = corner == 0 || corner == 3 ? x : 1 - x,
                             v = corner < 2 ? y : 1 - y;
                J ju(u), jv(v);
                ju.c[1] = 1;
                jv.c[2] = 1;
                const J mu = one - ju, mv = one - jv;
                const auto cubic = [&](const J& t, int j) {
                    const J s = one - t;
                    return j == 0   ? s * s * s
                           : j == 1 ? 3.0L * (t * s * s)
                           : j == 2 ? 3.0L * (t * t * s)
                                    : t * t * t;
                };
                for (int c = 0; c < 3; ++c) {
                    const auto p = [&](int i, int k) {
                        return J(static_cast<long double>(net[5 * i + k][c]));
                    };
                    const auto mix = [&](int i, const J& a, const J& b) {
                        return (a * p(i, 3) + b * p(i, 4)) / (a + b);
                    };
                    const J f0 = mix(0, ju, jv), f1 = mix(1, jv, mu), f2 = mix(2, mu, mv),
                            f3 = mix(3, mv, ju);
                    const J rows[4][4] = {{p(0, 0), p(0, 1), p(1, 2), p(1, 0)},
                                          {p(0, 2), f0, f1, p(1, 1)},
                                          {p(3, 1), f3, f2, p(2, 2)},
                                          {p(3, 0), p(3, 2), p(2, 1), p(2, 0)}};
                    J expected;
                    for (int k = 0; k < 4; ++k) {
                        for (int j = 0; j < 4; ++j)
                            expected += rows[k][j] * (cubic(ju, j) * cubic(jv, k));
                    }
                    const auto actual =
                        surface<3, double>(basis, {0, u, v}, Chart::Native, net)[c];
                    for (int k = 0; k < J::kSize; ++k) {
                        // 1 - u is known to the ulp of 1 only; derivative m then to r^(1-m).
                        const int m = k == 0 ? 0 : k < 3 ? 1 : k < 6 ? 2 : 3;
                        EXPECT_NEAR(actual.c[k], double(expected.c[k]),
                                    1e-13 * std::pow(r, std::min(0, 1 - m)))
                            << u << ' ' << v << " coefficient " << k;
                    }
                }
            }
        }
    }
}

TEST(GregoryBasis, WithEqualTwistsAQuadIsBicubic) {
    const GregoryBasis basis(4);
    for (const double u : {0.0, 0.2, 0.9, 1.0}) {
        for (const double v : {0.0, 0.4, 1.0}) {
            const auto w = weights<2>(basis, {0, u, v}, Chart::Native);
            Jet<double, 2> x(u), y(v), one(1.0);
            x.c[1] = y.c[2] = 1;
            const auto inner =
                9.0 * (x * (one - x) * (one - x) * y * (one - y) * (one - y));
            for (int k = 0; k < 6; ++k)
                EXPECT_NEAR(w[3].c[k] + w[4].c[k], inner.c[k], 1e-14);
        }
    }
}

TEST(GregoryBasis, CornersHaveTheStatedLimits) {
    for (const int n : {3, 4, 5, 6, 9, 30}) {
        const GregoryBasis basis(n);
        const auto net = random_net(basis, unsigned(n));
        using G = GregoryBasis;
        for (int i = 0; i < n; ++i) {
            const int next = (i + 1) % n, before = (i + n - 1) % n;
            const auto point = [&](int corner, G::Point kind) {
                return net[basis.point(corner, kind)];
            };
            const auto native = [&](int corner) {
                const double angle = 2 * std::numbers::pi * corner / n;
                constexpr double kQuad[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
                return n == 4 ? Vec2<double>(kQuad[corner][0], kQuad[corner][1])
                              : Vec2<double>(std::cos(angle), std::sin(angle));
            };
            const DomainPoint at =
                n == 4 ? DomainPoint{0, native(i).x, native(i).y} : DomainPoint{i, 1, 1};
            const auto s = surface<2, double>(basis, at, Chart::Native, net);
            const Vec2<double> a = native(next) - native(i),
                               b = native(before) - native(i);
            for (int x = 0; x < 3; ++x) {
                EXPECT_EQ(s[x].c[0], point(i, G::P)[x]);
                EXPECT_NEAR(s[x].c[1] * a.x + s[x].c[2] * a.y,
                            3 * (point(i, G::EPlus) - point(i, G::P))[x], 1e-12);
                EXPECT_NEAR(s[x].c[1] * b.x + s[x].c[2] * b.y,
                            3 * (point(i, G::EMinus) - point(i, G::P))[x], 1e-12);
                if (n != 4)
                    continue;
                // Along the bisector; in the directions a, b of the corner.
                const auto second = [&](const Vec2<double>& e, const Vec2<double>& f) {
                    return 2 * s[x].c[3] * e.x * f.x +
                           s[x].c[4] * (e.x * f.y + e.y * f.x) +
                           2 * s[x].c[5] * e.y * f.y;
                };
                const double d = (point(i, G::FPlus) - point(i, G::FMinus))[x],
                             p = point(i, G::P)[x], ep = point(i, G::EPlus)[x],
                             em = point(i, G::EMinus)[x];
                EXPECT_NEAR(second(a, a),
                            6 * (p - 2 * ep + point(next, G::EMinus)[x]) + 18.0 / 8 * d,
                            1e-12);
                EXPECT_NEAR(second(b, b),
                            6 * (p - 2 * em + point(before, G::EPlus)[x]) - 18.0 / 8 * d,
                            1e-12);
                EXPECT_NEAR(second(a, b),
                            9 * (p - ep - em + point(i, G::FMinus)[x]) + 9.0 / 2 * d,
                            1e-12);
            }
        }
    }
}

TEST(GregoryBasis, TurningTheCornersTurnsTheDomain) {
    for (const int n : {3, 5, 8, 13}) {
        const GregoryBasis basis(n);
        for (const DomainPoint& p :
             {DomainPoint{0, 0.3, 0.8}, {0, 0.999, 0.9995}, {0, 1, 0.5}, {0, 1, 1}}) {
            const auto w = weights<2>(basis, p, Chart::BaseUV);
            for (int turn = 1; turn < n; ++turn) {
                const auto v =
                    weights<2>(basis, {p.sector + turn, p.a, p.b}, Chart::BaseUV);
                for (int i = 0; i < n; ++i) {
                    for (int k = 0; k < 5; ++k) {
                        for (int c = 0; c < 6; ++c)
                            EXPECT_NEAR(v[5 * ((i + turn) % n) + k].c[c],
                                        w[5 * i + k].c[c], 1e-11);
                    }
                }
            }
        }
    }
    const GregoryBasis quad(4);
    const auto w = weights<0>(quad, {0, 0.3, 0.8}, Chart::Native),
               v = weights<0>(quad, {0, 1 - 0.8, 0.3}, Chart::Native);
    for (int i = 0; i < 20; ++i)
        EXPECT_NEAR(v[(i + 5) % 20].c[0], w[i].c[0], 1e-15);
}

TEST(GregoryBasis, SumsToOneAndCommutesWithAffineMaps) {
    for (const int n : {3, 4, 5, 7, 12, 50}) {
        for (const CentrePoint centre : {CentrePoint::Given, CentrePoint::None}) {
            const GregoryBasis basis(n, centre);
            auto net = random_net(basis);
            for (const DomainPoint& p : {DomainPoint{0, 0, 0},
                                         {0, 0.4, 0.7},
                                         {0, 1, 0.3},
                                         {0, 0.9999, 0.9998},
                                         {0, 1, 1}}) {
                const auto s = surface<2, double>(basis, p, Chart::Native, net);
                // z = 1 + 2 x - y.
                auto mapped = net;
                for (auto& q : mapped)
                    q.z = 1 + 2 * q.x - q.y;
                const auto t = surface<2, double>(basis, p, Chart::Native, mapped);
                for (int k = 0; k < 6; ++k)
                    EXPECT_NEAR(t[2].c[k], (k == 0) + 2 * s[0].c[k] - s[1].c[k],
                                1e-10 * n * n);
            }
        }
    }
}

TEST(GregoryBasis, FloatPointsAgreeWithDouble) {
    for (const int n : {3, 4, 5, 8, 40}) {
        const GregoryBasis basis(n);
        const auto net = random_net(basis);
        const Net<float> floats(net.begin(), net.end());
        const Net<double> rounded(floats.begin(), floats.end());
        for (const DomainPoint& p :
             {DomainPoint{0, 0.1, 0.6}, {0, 0.99, 0.98}, {0, 1, 1}}) {
            const auto f = surface<2, float>(basis, p, Chart::BaseUV, floats);
            const auto d = surface<2, double>(basis, p, Chart::BaseUV, rounded);
            double sizes[6] = {};
            basis.for_each_weight<2>(p, Chart::BaseUV,
                                     [&](Index, const Jet<double, 2>& w) {
                                         for (int k = 0; k < 6; ++k)
                                             sizes[k] += std::abs(w.c[k]);
                                     });
            // Each term rounds twice, and each of the sums, of points below 1/2, once.
            for (int k = 0; k < 6; ++k) {
                for (int x = 0; x < 3; ++x)
                    EXPECT_NEAR(f[x].c[k], d[x].c[k], 8 * 6e-8 * sizes[k]);
            }
        }
    }
}

TEST(GregoryBasis, CollapsedControlPointsGiveFiniteJets) {
    for (const int n : {3, 4, 5, 8}) {
        const GregoryBasis basis(n);
        auto net = random_net(basis);
        // Side 0 -> 1 has no length, and corner 2 no tangents.
        for (const auto kind : {GregoryBasis::P, GregoryBasis::EMinus})
            net[basis.point(1, kind)] = net[basis.point(0, GregoryBasis::P)];
        net[basis.point(0, GregoryBasis::EPlus)] = net[basis.point(0, GregoryBasis::P)];
        for (int k = 1; k < 5; ++k)
            net[10 + k] = net[10];
        for (const double e : {0.0, 5e-324, 1e-200, 1e-16, 1e-8, 1e-3, 0.5, 1.0}) {
            for (const DomainPoint& p : {DomainPoint{0, e, e},
                                         {0, 1 - e, 1 - e},
                                         {0, e, 0},
                                         {0, 0, e},
                                         {0, 1, 1 - e},
                                         {0, 1 - e, 0}}) {
                const auto s = surface<3, double>(basis, p, Chart::Native, net);
                for (int x = 0; x < 3; ++x) {
                    for (const double c : s[x].c)
                        EXPECT_TRUE(std::isfinite(c)) << "n " << n << " e " << e;
                }
            }
        }
    }
}

}  // namespace
}  // namespace osdx
