// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/generalised_bezier.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/thinned.h"

namespace osdx {
namespace {

double binomial(int n, int k) {
    double b = 1;
    for (int i = 1; i <= k; ++i)
        b = b * (n + 1 - i) / i;
    return b;
}

/// C(d,j) u^j (1-u)^(d-j).
template <class J>
J bernstein(int d, int j, const J& u) {
    J b(static_cast<long double>(binomial(d, j)));
    for (int m = 0; m < d; ++m)
        b = b * (m < j ? u : J(1) - u);
    return b;
}

TEST(BernsteinBasis, EqualsItsClosedFormWithDerivatives) {
    constexpr int kOrder = 4;
    for (int d = 1; d <= kMaxDegree; ++d) {
        for (const double u : {0.0, 1e-9, 0.3, 0.5, 0.875, 1.0}) {
            std::vector<double> actual((d + 1) * (kOrder + 1));
            bernstein_basis<double>(d, u, kOrder, actual);
            Jet<long double, kOrder> x(u);
            x.c[1] = 1;
            for (int j = 0; j <= d; ++j) {
                const auto b = bernstein(d, j, x);
                for (int r = 0; r <= kOrder; ++r) {
                    // Differences of order r of numbers of size C(d,r).
                    EXPECT_NEAR(actual[j * (kOrder + 1) + r], double(b.c[b.index(r, 0)]),
                                1e-15 * std::pow(2, r) * binomial(d, std::min(r, d)))
                        << d << ' ' << j << ' ' << r << " u " << u;
                }
            }
        }
    }
}

using Net = std::vector<double>;

/// Ribbons with the same corner points, from random numbers.
Net random_net(const GeneralisedBezierBasis& basis, unsigned seed = 1) {
    std::mt19937 engine(seed);
    Net net(basis.n_points());
    for (double& x : net)
        x = double(engine()) / 4294967296.0 - 0.5;
    const int n = basis.n(), d = basis.degree();
    for (int i = 0; i < n; ++i) {
        for (int a = 0; a < basis.n_rows(); ++a) {
            for (int b = 0; b < basis.n_rows(); ++b)
                net[basis.ribbon_point(i, d - a, b)] =
                    net[basis.ribbon_point((i + 1) % n, b, a)];
        }
    }
    return net;
}

template <int Order>
Jet<double, Order> surface(const GeneralisedBezierBasis& basis, const DomainPoint& p,
                           Chart chart, const Net& net) {
    Jet<double, Order> sum;
    const auto f = basis.for_each_weight<Order>(
        p, chart, [&](Index i, const Jet<double, Order>& w) { sum += net[i] * w; });
    return sum / f;
}

/// The formulas as they are published, in long double.
/// Source: see GeneralisedBezierBasis.
template <int Order>
struct Reference {
    using J = Jet<long double, Order>;
    std::vector<J> s, h;

    Reference(const Polygon& polygon, Vec2<long double> xy) {
        const int n = polygon.n();
        const long double pi = std::numbers::pi_v<long double>;
        J x(xy.x), y(xy.y), sum;
        x.c[1] = 1;
        y.c[2] = 1;
        std::vector<J> l, w;
        for (int k = 0; k < n; ++k) {
            const long double angle = 2 * pi * (k - 0.5L) / n;
            l.push_back(J(std::cos(pi / n)) - std::cos(angle) * x - std::sin(angle) * y);
        }
        for (int i = 0; i < n; ++i) {
            J product(1);
            for (int k = 0; k < n; ++k) {
                if (k != i && k != (i + 1) % n)
                    product = product * l[k];
            }
            w.push_back(product);
            sum += product;
        }
        for (int i = 0; i < n; ++i) {
            const int before = (i + n - 1) % n;
            s.push_back(l[before] / (l[before] + l[(i + 1) % n]));
            J others;
            for (int j = 0; j < n; ++j) {
                if (j != i && j != before)
                    others += w[j];
            }
            h.push_back(others / sum);
        }
    }

    J surface(const GeneralisedBezierBasis& basis, const Net& net) const {
        const int n = basis.n(), d = basis.degree(), l = (d + 1) / 2;
        J sum, f;
        for (int i = 0; i < n; ++i) {
            J h0(1), h1(1), h2(1);
            for (int m = 1; m < l; ++m) {
                h0 = h0 * h[(i + n - 1) % n];
                h1 = h1 * h[i];
                h2 = h2 * h[(i + 1) % n];
            }
            for (int j = 0; j <= d; ++j) {
                const J mu = j < l ? h0 / (h0 + h1) : j > d - l ? h2 / (h2 + h1) : J(1);
                for (int k = 0; k < l; ++k) {
                    const J b = mu * bernstein(d, j, s[i]) * bernstein(d, k, h[i]);
                    f += b;
                    sum += static_cast<long double>(net[(i * (d + 1) + j) * l + k]) * b;
                }
            }
        }
        if (basis.centre() == CentrePoint::None)
            return sum / f;
        return sum + static_cast<long double>(net.back()) * (J(1) - f);
    }
};

/// The point of the n-gon under (a, b) of sector 0 .. n-1, from the corner, without rounding.
Vec2<long double> native(int n, int sector, long double a, long double b) {
    const long double pi = std::numbers::pi_v<long double>, c = std::cos(pi / n);
    const auto at = [&](int turns, long double r) {
        return Vec2<long double>(r * std::cos(turns * pi / n),
                                 r * std::sin(turns * pi / n));
    };
    return a * (1 - b) * at(2 * sector - 1, c) + a * b * at(2 * sector, 1) +
           (1 - a) * b * at(2 * sector + 1, c);
}

const std::vector<DomainPoint> kPoints = {
    {0, 0, 0},    {1, 0.3, 0.6},   {2, 0.9, 0.2},  {0, 1, 0.37},
    {1, 0.55, 1}, {2, 0.97, 0.98}, {1, 0.02, 0.9}, {0, 0.999, 0.51}};

template <class F>
void for_each_basis(F&& f) {
    const std::vector<int> sides = {3, 4, 5, 6, 8, 12}, degrees = {3, 4, 5, 6, 9};
    const std::vector<CentrePoint> centres = {CentrePoint::Given, CentrePoint::None};
    for (const auto& [n, d, centre] :
         test::thinned(test::combinations(sides, degrees, centres))) {
        SCOPED_TRACE(testing::Message() << "n " << n << " d " << d);
        f(GeneralisedBezierBasis(n, d, centre));
    }
}

TEST(GeneralisedBezier, EqualsThePublishedFormulas) {
    for_each_basis([](const GeneralisedBezierBasis& basis) {
        const Net net = random_net(basis);
        for (const DomainPoint& p : kPoints) {
            const auto expected =
                Reference<3>(basis.polygon(), native(basis.n(), p.sector, p.a, p.b))
                    .surface(basis, net);
            const auto actual = surface<3>(basis, p, Chart::Native, net);
            for (int k = 0; k < 10; ++k) {
                // The blends turn in a width of about 1/r next to a corner, and the n-gon's
                // sides are about 1/n long.
                const double scale = 1 + std::abs(double(expected.c[k]));
                EXPECT_NEAR(actual.c[k], double(expected.c[k]), 1e-10 * scale)
                    << p.sector << ' ' << p.a << ' ' << p.b << " coefficient " << k;
            }
        }
    });
}

TEST(GeneralisedBezier, DerivativesKeepTheirDigitsNextToCorners) {
    for_each_basis([](const GeneralisedBezierBasis& basis) {
        const Net net = random_net(basis);
        for (double r = 0.02; r > 1e-7; r *= 0.3) {
            for (const double phi : {0.0, 0.2, 0.7, 1.5, 0.5 * std::numbers::pi}) {
                const DomainPoint p{1, 1 - r * std::max(0.0, std::cos(phi)),
                                    1 - r * std::sin(phi)};
                const auto expected =
                    Reference<2>(basis.polygon(), native(basis.n(), 1, p.a, p.b))
                        .surface(basis, net);
                const auto actual = surface<2>(basis, p, Chart::Native, net);
                double size[3] = {};
                for (int k = 0; k < 6; ++k) {
                    const int m = k == 0 ? 0 : k < 3 ? 1 : 2;
                    size[m] = std::max(size[m], std::abs(double(expected.c[k])));
                }
                const double width = std::pow(std::sin(std::numbers::pi / basis.n()), 2);
                for (int k = 0; k < 6; ++k) {
                    const int m = k == 0 ? 0 : k < 3 ? 1 : 2;
                    // What remains of the noise of the blends at the distance where the
                    // Taylor polynomials take over, and that of the reference.
                    const double noise = 2e-15 * std::pow(std::max(r, 1e-3) * width, -m) +
                                         1e-18 * std::pow(r * width, -m);
                    EXPECT_NEAR(actual.c[k], double(expected.c[k]),
                                1e-14 + noise + 1e-10 * size[m] * (m > 0))
                        << "r " << r << " phi " << phi << " coefficient " << k;
                }
            }
        }
    });
}

TEST(GeneralisedBezier, IsTheTensorProductForFourSides) {
    for (const int d : {3, 4, 5, 6, 7, 8, 11}) {
        const GeneralisedBezierBasis basis(4, d);
        const Net net = random_net(basis);
        const int l = basis.n_rows();
        // Point (x, y) counted from v_3, x towards v_0 along side 0 and y along side 3.
        const auto point = [&](int x, int y) {
            if (y < l)
                return net[basis.ribbon_point(0, x, y)];
            if (d - x < l)
                return net[basis.ribbon_point(1, y, d - x)];
            if (d - y < l)
                return net[basis.ribbon_point(2, d - x, d - y)];
            if (x < l)
                return net[basis.ribbon_point(3, d - y, x)];
            return net[basis.centre_index()];
        };
        for (const DomainPoint& p : kPoints) {
            const Vec2<double> xy = basis.to_native(p);
            const double side = std::sqrt(2.0);
            Jet<long double, 2> s(0.5 + (xy.x + xy.y) / 2), t(0.5 + (xy.y - xy.x) / 2);
            // From v_3 = (0, -1): side 0 goes in direction (1, 1), side 3 in (-1, 1).
            s.c[1] = s.c[2] = 0.5;
            t.c[1] = -0.5;
            t.c[2] = 0.5;
            Jet<long double, 2> expected;
            for (int x = 0; x <= d; ++x) {
                for (int y = 0; y <= d; ++y)
                    expected += static_cast<long double>(point(x, y)) *
                                (bernstein(d, x, s) * bernstein(d, y, t));
            }
            const auto actual = surface<2>(basis, p, Chart::Native, net);
            for (int k = 0; k < 6; ++k)
                EXPECT_NEAR(actual.c[k], double(expected.c[k]), 1e-11 * side)
                    << "d " << d << " at " << xy.x << ' ' << xy.y << " coefficient " << k;
        }
    }
}

// Position and the derivatives below l across and along each side are those of the ribbon.
TEST(GeneralisedBezier, InterpolatesItsRibbons) {
    for_each_basis([](const GeneralisedBezierBasis& basis) {
        const Net net = random_net(basis);
        const int d = basis.degree(), l = basis.n_rows(), n = basis.n();
        double next_order = 0;
        for (int i = 0; i < n; ++i) {
            for (const double along : {0.02, 0.2, 0.5, 0.77, 1.0}) {
                for (const bool first : {false, true}) {
                    const DomainPoint p = first ? DomainPoint{(i + n - 1) % n, along, 1}
                                                : DomainPoint{i, 1, along};
                    if (along == 1)
                        continue;  // corners have a test of their own
                    const Reference<5> at(basis.polygon(), native(n, p.sector, p.a, p.b));
                    Jet<long double, 5> expected;
                    for (int j = 0; j <= d; ++j) {
                        for (int k = 0; k <= d; ++k) {
                            // Rows that are not there do not count below order l.
                            const double b =
                                k < l ? net[basis.ribbon_point(i, j, k)] : 7.0 * j;
                            expected +=
                                static_cast<long double>(b) *
                                (bernstein(d, j, at.s[i]) * bernstein(d, k, at.h[i]));
                        }
                    }
                    const auto actual = surface<5>(basis, p, Chart::Native, net);
                    for (int m = 0, k = 0; m <= 5 && m <= l; ++m) {
                        double size = 1, error = 0;
                        for (const int end = k + m; k <= end; ++k) {
                            size = std::max(size, std::abs(double(expected.c[k])));
                            error = std::max(
                                error, std::abs(actual.c[k] - double(expected.c[k])));
                        }
                        if (m < l)
                            EXPECT_LE(error, 1e-11 * size)
                                << "side " << i << " at " << along << " order " << m;
                        else
                            next_order = std::max(next_order, error);
                    }
                }
            }
        }
        if (l <= 5) {
            EXPECT_GT(next_order, 1e-2);  // so that the comparison can fail
        }
    });
}

TEST(GeneralisedBezier, CornersHaveTheLimitOnTheBisector) {
    for_each_basis([](const GeneralisedBezierBasis& basis) {
        const Net net = random_net(basis);
        for (const Chart chart : {Chart::Native, Chart::BaseUV}) {
            const auto corner = surface<2>(basis, {1, 1, 1}, chart, net);
            EXPECT_EQ(corner.c[0], net[basis.ribbon_point(1, basis.degree(), 0)]);
            double previous = 0;
            for (const double r : {1e-3, 1e-4, 1e-5, 1e-6, 1e-9, 1e-14}) {
                const auto beside =
                    surface<2>(basis, {1, 1 - r / 2, 1 - r / 2}, chart, net);
                double error = 0;
                for (int k = 0; k < 6; ++k)
                    error = std::max(error, std::abs(beside.c[k] - corner.c[k]));
                if (r < 1e-3 && r > 1e-7) {
                    EXPECT_LE(error, 0.2 * previous) << "r " << r;  // linear in r
                }
                if (r <= 1e-9) {
                    EXPECT_LE(error, 1e-4);
                }
                previous = error;
            }
        }
    });
}

TEST(GeneralisedBezier, IsFiniteAndSumsToOneEverywhere) {
    const auto check = [](const GeneralisedBezierBasis& basis) {
        for (const double e :
             {0.0, 5e-324, 1e-300, 1e-160, 1e-16, 1e-12, 1e-6, 1e-3, 0.2}) {
            for (const DomainPoint& p : {DomainPoint{1, 1 - e, 1 - e},
                                         {0, 1, 1 - e},
                                         {2, 1 - e, 1},
                                         {1, e, e},
                                         {1, 1 - e, 0.5},
                                         {0, 0.4, 1 - e},
                                         {0, 0.3, e}}) {
                for (const Chart chart : {Chart::Native, Chart::BaseUV}) {
                    std::map<Index, int> count;
                    Jet<double, 2> sum;
                    Jet<double, 0> value;
                    const auto f = basis.for_each_weight<2>(
                        p, chart, [&](Index i, const Jet<double, 2>& w) {
                            ++count[i];
                            ASSERT_LT(i, basis.n_points());
                            for (const double x : w.c)
                                ASSERT_TRUE(std::isfinite(x));
                            sum += w;
                        });
                    for (const auto& [i, n] : count)
                        EXPECT_EQ(n, 1);
                    const auto f0 = basis.for_each_weight<0>(
                        p, chart, [&](Index, const Jet<double, 0>& w) { value += w; });
                    EXPECT_EQ(f0.c[0], f.c[0]);
                    EXPECT_EQ(value.c[0], sum.c[0]);  // of any order, in any chart
                    for (std::size_t k = 0; k < sum.c.size(); ++k) {
                        EXPECT_NEAR(sum.c[k], f.c[k], 1e-10 * (1 + std::abs(f.c[k])));
                    }
                }
            }
        }
    };
    for_each_basis(check);
    check(GeneralisedBezierBasis(200, 3));
    check(GeneralisedBezierBasis(3, kMaxDegree));
}

}  // namespace
}  // namespace osdx
