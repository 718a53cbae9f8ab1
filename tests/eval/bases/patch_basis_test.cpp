// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/patch_basis.h"

#include <algorithm>
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

#include <osdx/patch_class.h>
#include <osdx/surface_jet.h>

#include "tests/support/high_orders.h"
#include "tests/support/patch_class_names.h"
#include "tests/support/reference_files.h"
#include "tests/support/thinned.h"

namespace osdx {

namespace {

using test::vector;

template <class T, int Order>
using Jets = std::vector<Jet<T, Order>>;
using Net = std::vector<Vec3<double>>;

// ------------------------------------------------------------------------ reference

/// N_k(u) = M(u + d - k), M the B-spline on the knots 0 .. d+1.
template <int Order>
Jet<long double, Order> bspline(int d, int k, const Jet<long double, Order>& u) {
    using J = Jet<long double, Order>;
    const J x = u + J(d - k);
    if (x.c[0] < 0 || x.c[0] >= d + 1)
        return {};
    Jets<long double, Order> b(d + 1);
    for (int m = 0; m <= d; ++m)
        b[m] = J(x.c[0] >= m && x.c[0] < m + 1 ? 1 : 0);
    for (int r = 1; r <= d; ++r) {
        for (int m = 0; m + r <= d; ++m)
            b[m] = 1.0L / r * ((x - J(m)) * b[m] + (J(m + r + 1) - x) * b[m + 1]);
    }
    return b[0];
}

/// The basis functions of EV and EF patches once more, in long double: the formulas as they
/// are published, each ribbon in full, without care for cancellation or speed.
/// Source: see PatchBasis.
template <int Order>
class Reference {
public:
    using T = long double;
    using J = Jet<T, Order>;

    Reference(const PatchClass& c, Vec2<double> xy)
        : class_(c), n_(c.n_sectors), d_(c.degree) {
        const T pi = std::numbers::pi_v<T>;
        std::vector<J> l, w;
        for (int k = 0; k < n_; ++k) {
            const T angle = 2 * pi * (k - T(0.5)) / n_;
            J x(T(xy.x)), y(T(xy.y));
            if constexpr (Order > 0)
                x.c[1] = y.c[2] = 1;
            l.push_back(J(std::cos(pi / n_)) - std::cos(angle) * x - std::sin(angle) * y);
        }
        J sum;
        for (int i = 0; i < n_; ++i) {
            J product(T(1));
            for (int k = 0; k < n_; ++k) {
                if (k != i && k != (i + 1) % n_)
                    product = product * l[k];
            }
            sum += product;
            w.push_back(product);
        }
        for (int i = 0; i < n_; ++i) {
            const J a = w[i] / sum, b = w[before(i)] / sum;
            s.push_back(a / (a + b));
            h.push_back(J(T(1)) - a - b);
        }
        // E_(d-1)(d-2+t) is (1-t)^d times the Taylor polynomial of degree d-1 of
        // N_(d-1)(d-2+t) / (1-t)^d.
        Jet<T, kMaxDegree> at(T(d_ - 2));
        at.c[1] = 1;
        const auto taylor = bspline(d_, d_ - 1, at);
        for (int r = 0; r < d_ && d_ > 7; ++r) {
            T x = 0;
            for (int m = 0; m <= r; ++m)
                x += taylor.c[at.index(m, 0)] * choose(d_ - 1 + r - m, r - m);
            hermite_.push_back(x);
        }
    }

    /// The control point of a ribbon in a column and a row.
    Index point(int i, int j, int k) const {
        const int d = d_, b = d - 1 - k;
        if (class_.kind == PatchKind::EF)
            return j < d ? (before(i) * d + d - 1 - j) * d + b : (i * d + b) * d + j - d;
        const auto spoke = [&](int at, int r) { return 1 + at % n_ * (d - 1) + r - 1; };
        const auto sector = [&](int at, int p, int q) {
            return 1 + n_ * (d - 1) + (at * (d - 1) + p - 1) * (d - 1) + q - 1;
        };
        const int a = std::abs(j - (d - 1));
        if (a == 0)
            return b == 0 ? 0 : spoke(i, b);
        if (b == 0)
            return j < d - 1 ? spoke(before(i), a) : spoke(i + 1, a);
        return j < d - 1 ? sector(before(i), a, b) : sector(i, b, a);
    }
    int n_columns() const { return class_.kind == PatchKind::EV ? 2 * d_ - 1 : 2 * d_; }
    T intervals() const { return class_.kind == PatchKind::EV ? d_ - 1 : d_; }

    /// The weights of all control points, over their sum f.
    Jets<T, Order> weights(J* sum = nullptr) const {
        Jets<T, Order> w(class_.n_points());
        J f;
        for (int i = 0; i < n_; ++i) {
            const int next = (i + 1) % n_;
            const J h0 = power(h[before(i)]), h1 = power(h[i]), h2 = power(h[next]);
            const J alpha = h0 / (h0 + h1), beta = h2 / (h2 + h1);
            Jets<T, Order> rows;
            for (int k = 0; k < d_; ++k)
                rows.push_back(row(k, intervals() * h[i]));
            for (int j = 0; j < n_columns(); ++j) {
                J column = N(j, intervals() * s[i]);
                if (j < d_)
                    column = column * alpha;
                if (j >= d_ || (class_.kind == PatchKind::EV && j == d_ - 1))
                    column = column * beta;
                for (int k = 0; k < d_; ++k) {
                    const J x = column * rows[k];
                    f += x;
                    w[point(i, j, k)] += x;
                }
            }
        }
        for (J& x : w)
            x = x / f;
        if (sum)
            *sum = f;
        return w;
    }

    J N(int k, const J& u) const { return bspline(d_, k, u); }

    std::vector<J> s, h;

private:
    int before(int i) const { return (i + n_ - 1) % n_; }
    J power(const J& x) const {
        J p(T(1));
        for (int k = 0; k < d_; ++k)
            p = p * x;
        return p;
    }

    J row(int k, const J& hbar) const {
        const bool extended = class_.kind == PatchKind::EV && k == d_ - 1;
        return extended && hbar.c[0] >= d_ - 2 ? last_piece(hbar - J(T(d_ - 2)))
                                               : N(k, hbar);
    }

    /// E_(d-1) on its last interval, t in [0,1]: up to degree seven by the exact Bezier
    /// coefficients of degree 2d-1, above by Hermite interpolation.
    J last_piece(const J& t) const {
        static const std::vector<std::vector<T>> kTable = {
            {T(1) / 2, T(5) / 6},
            {T(2) / 3, T(2) / 3, T(17) / 30},
            {T(11) / 24, T(65) / 168, T(17) / 56, T(187) / 840},
            {T(13) / 60, T(23) / 135, T(139) / 1080, T(59) / 630, T(83) / 1260},
            {T(19) / 240, T(53) / 880, T(59) / 1320, T(7) / 216, T(1093) / 47520,
             T(5329) / 332640},
            {T(1) / 42, T(73) / 4095, T(43) / 3276, T(857) / 90090, T(34) / 5005,
             T(199) / 41580, T(4801) / 1441440}};
        const J u = J(T(1)) - t;
        J sum;
        if (d_ <= 7) {
            for (int i = 0; i < d_; ++i) {
                J term(kTable[d_ - 2][i] * choose(2 * d_ - 1, i));
                for (int m = 0; m < i; ++m)
                    term = term * t;
                for (int m = i; m < 2 * d_ - 1; ++m)
                    term = term * u;
                sum += term;
            }
            return sum;
        }
        J power_t(T(1));
        for (const T a : hermite_) {
            sum += a * power_t;
            power_t = power_t * t;
        }
        return sum * power(u);
    }

    static T choose(int n, int k) {
        T c = 1;
        for (int i = 0; i < k; ++i)
            c = c * T(n - i) / T(i + 1);
        return c;
    }

    PatchClass class_;
    int n_, d_;
    std::vector<T> hermite_;
};

// ------------------------------------------------------------------------ helpers

/// Weights of all control points, divided by their sum f.
template <int Order>
Jets<double, Order> weights(const PatchBasis& basis, const DomainPoint& p, Chart chart,
                            Jet<double, Order>* sum = nullptr) {
    Jets<double, Order> w(basis.patch_class().n_points());
    const auto f = basis.for_each_weight<Order>(
        p, chart, [&](Index i, const Jet<double, Order>& x) { w[i] += x; });
    for (auto& x : w)
        x = x / f;
    if (sum)
        *sum = f;
    return w;
}

template <int Order>
std::array<Jet<double, Order>, 3> surface(const PatchBasis& basis, const DomainPoint& p,
                                          Chart chart, const Net& net) {
    std::array<Jet<double, Order>, 3> sum;
    const auto w = weights<Order>(basis, p, chart);
    for (std::size_t i = 0; i < net.size(); ++i) {
        for (int c = 0; c < 3; ++c)
            sum[c] += net[i][c] * w[i];
    }
    return sum;
}

SurfaceJet<double> surface_jet(const PatchBasis& basis, const DomainPoint& p, Chart chart,
                               const Net& net) {
    const auto x = surface<2>(basis, p, chart, net);
    const auto vector = [&](int k) {
        return Vec3<double>(x[0].c[k], x[1].c[k], x[2].c[k]);
    };
    return {vector(0), vector(1), vector(2), 2.0 * vector(3), vector(4), 2.0 * vector(5)};
}

/// Raises max to value; once it is not a number it stays so.
template <class T>
void raise(T& max, T value) {
    if (value > max || std::isnan(value))
        max = value;
}

/// The largest coefficient of one order.
template <class T, int Order>
T order_max(const Jet<T, Order>& x, int m) {
    T max = 0;
    for (int j = 0; j <= m; ++j)
        raise(max, std::abs(x.c[x.index(m - j, j)]));
    return max;
}

/// Uniform in [lo, hi), the same for every standard library.
class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double operator()(double lo = -1, double hi = 1) {
        return lo + (hi - lo) * double(engine_()) / 4294967296.0;
    }

private:
    std::mt19937 engine_;
};

/// A curved net, roughly regular, with noise: every derivative and curvature is generic.
Net random_net(const PatchClass& c, unsigned seed = 1) {
    Random random(seed);
    Net net(c.n_points());
    const auto direction = [&](double turns) {
        const double angle = 2 * std::numbers::pi * turns / c.n_sectors;
        return Vec2<double>(std::cos(angle), std::sin(angle));
    };
    const auto set = [&](int i, Vec2<double> p) {
        const Vec3<double> noise{random(), random(), random()};  // braces: in this order
        net[i] =
            Vec3<double>(p, 0.2 * p.x * p.x - 0.1 * p.y * p.y + 0.3 * p.x) + 0.1 * noise;
    };
    const int d = c.degree;
    for (int i = 0; i < c.n_sectors; ++i) {
        const auto e0 = direction(i - 0.5), e1 = direction(i + 0.5);  // across sides
        for (int a = 0; a < d; ++a) {
            for (int b = 0; b < d; ++b) {
                if (c.kind == PatchKind::EF)
                    set(c.ef_point(i, a, b),
                        direction(i) + double(a) * e0 + double(b) * e1);
                else
                    set(c.ev_point(i, a, b), double(a) * e0 + double(b) * e1);
            }
        }
    }
    return net;
}

std::vector<PatchClass> classes(std::initializer_list<int> degrees,
                                std::initializer_list<int> sides) {
    std::vector<PatchClass> all;
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : degrees) {
            for (const int n : sides)
                all.push_back({kind, d, n});
        }
    }
    return test::thinned(all);
}

/// Inside, on no line of symmetry.
std::vector<DomainPoint> inner_points(int n) {
    return {{0, 0.31, 0.17}, {n - 1, 0.83, 0.62}, {1, 0.07, 0.92}, {n / 2, 0.55, 0.71}};
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

/// The point of side i at t in [0,1] from its start.
DomainPoint side_point(int n, int i, double t) {
    return t < 0.5 ? DomainPoint{(i + n - 1) % n, 1 - 2 * t, 1}
                   : DomainPoint{i, 1, 2 * t - 1};
}

std::string describe(const PatchClass& c, const DomainPoint& p) {
    return testing::PrintToString(c) + " sector " + std::to_string(p.sector) + " (" +
           std::to_string(p.a) + ", " + std::to_string(p.b) + ")";
}

// ------------------------------------------------------------------------ the basis

TEST(PatchBasis, EqualsThePublishedFormulas) {
    // Derivatives of order m are sums that cancel where l is small: the points lie inside,
    // where the formulas in long double keep at least double accuracy. The kernel's terms
    // are powers up to d of numbers near 1, and f of EF patches is small at large n.
    for (const auto& c : classes({2, 3, 4, 5, 6, 7, 11, 15}, {3, 4, 5, 6, 8})) {
        const PatchBasis basis(c);
        for (const auto& p : inner_points(c.n_sectors)) {
            const Reference<2> reference(c, basis.to_native(p));
            Jet<long double, 2> f;
            Jet<double, 2> f_kernel;
            const auto expected = reference.weights(&f);
            const auto actual = weights<2>(basis, p, Chart::Native, &f_kernel);
            for (int m = 0; m <= 2; ++m) {
                double scale = 0, error = 0;
                for (std::size_t i = 0; i < actual.size(); ++i) {
                    Jet<long double, 2> e = expected[i];
                    for (std::size_t k = 0; k < e.c.size(); ++k)
                        e.c[k] -= actual[i].c[k];
                    raise(error, double(order_max(e, m)));
                    scale = std::max(scale, double(order_max(expected[i], m)));
                }
                EXPECT_LE(error, 1e-13 * scale) << describe(c, p) << " order " << m;
            }
            EXPECT_NEAR(f_kernel.c[0], double(f.c[0]), 1e-12 * double(f.c[0]))
                << describe(c, p);
        }
    }
}

TEST(PatchBasis, KeepsItsDigitsAtLargeValence) {
    for (const auto& c : classes({2, 9}, {64, 360})) {
        const PatchBasis basis(c);
        for (const auto& p : inner_points(c.n_sectors)) {
            const auto expected = Reference<0>(c, basis.to_native(p)).weights();
            const auto actual = weights<0>(basis, p, Chart::Native);
            double scale = 0, error = 0;
            for (std::size_t i = 0; i < actual.size(); ++i) {
                scale = std::max(scale, double(expected[i].c[0]));
                raise(error, std::abs(actual[i].c[0] - double(expected[i].c[0])));
            }
            // h rounds to 1e-16, and d n / 2 times that of 1 - h counts in EF patches.
            EXPECT_LE(error, 1e-12 * scale) << describe(c, p);
        }
    }
}

TEST(PatchBasis, ReproducesTheReferenceVectors) {
    int n_files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(OSDX_TEST_DATA)) {
        const std::string name = entry.path().filename().string();
        if (!name.starts_with("thesis_"))
            continue;
        ++n_files;
        std::ifstream file(entry.path());
        const auto json = nlohmann::json::parse(file);
        const PatchClass c{json.at("kind") == "EV" ? PatchKind::EV : PatchKind::EF,
                           json.at("d").get<int>(), json.at("n").get<int>()};
        const PatchBasis basis(c);
        Net net;
        for (const auto& p : json.at("control"))
            net.push_back(vector(p));
        ASSERT_EQ(net.size(), std::size_t(c.n_points())) << name;

        EXPECT_EQ(json.at("samples").size(), 8u) << name;
        for (const auto& sample : json.at("samples")) {
            const auto& xy = sample.at("xy");
            const auto p =
                basis.from_native({xy.at(0).get<double>(), xy.at(1).get<double>()});
            SCOPED_TRACE(name + " " + describe(c, p));
            const auto jet = surface_jet(basis, p, Chart::Native, net);
            // The files carry 12 digits or more; 3e-13 is reached.
            const auto expect = [&](const char* key, const Vec3<double>& actual) {
                const auto expected = vector(sample.at(key));
                EXPECT_LE(glm::length(actual - expected),
                          1e-12 * (1 + glm::length(expected)))
                    << key;
            };
            expect("pos", jet.p);
            expect("dx", jet.du);
            expect("dy", jet.dv);
            if (sample.contains("dxx")) {
                expect("dxx", jet.duu);
                expect("dxy", jet.duv);
                expect("dyy", jet.dvv);
            } else {  // where knot lines meet
                EXPECT_EQ(c.degree, 2);
                EXPECT_EQ(xy, nlohmann::json({0.0, 0.0}));
            }
            const auto side = basis.ribbons()->side_parameters(p);
            for (int i = 0; i < c.n_sectors; ++i) {
                EXPECT_NEAR(side.s[i], sample.at("s").at(i).get<double>(), 1e-13);
                EXPECT_NEAR(side.h[i], sample.at("h").at(i).get<double>(), 1e-13);
            }
            Jet<double, 0> f;
            weights<0>(basis, p, Chart::Native, &f);
            EXPECT_NEAR(f.c[0], sample.at("f").get<double>(), 1e-13);
        }
    }
    EXPECT_EQ(n_files, 22);
}

TEST(PatchBasis, WeightsSumToOneAndAreNotNegative) {
    for (const auto& c : classes({2, 3, 4, 5, 7, 9, 15}, {3, 4, 5, 6, 9, 12})) {
        const PatchBasis basis(c);
        for (const auto& p : grid_points(1, 6)) {
            for (const Chart chart : {Chart::Native, Chart::BaseUV}) {
                Jet<double, 2> sum, f;
                double min = 1, sizes[3] = {};
                for (const auto& w : weights<2>(basis, p, chart, &f)) {
                    sum += w;
                    min = std::min(min, w.c[0]);
                    for (int m = 0; m <= 2; ++m)
                        sizes[m] += order_max(w, m);
                }
                SCOPED_TRACE(describe(c, p));
                EXPECT_GE(min, -1e-16);
                EXPECT_GT(f.c[0], 0);
                sum.c[0] -= 1;
                for (int m = 0; m <= 2; ++m)
                    EXPECT_LE(order_max(sum, m), 1e-14 * c.degree * sizes[m])
                        << "order " << m;
            }
        }
    }
}

struct WeightSum {
    PatchKind kind;
    int degree, n_sectors;
    double min, max, centre;
};
constexpr WeightSum kWeightSums[] = {{PatchKind::EV, 2, 3, .6944, 1, .6944},
                                     {PatchKind::EV, 2, 4, .6250, 1, .6250},
                                     {PatchKind::EV, 2, 5, .5500, 1, .5500},
                                     {PatchKind::EV, 2, 8, .3906, 1, .3906},
                                     {PatchKind::EV, 2, 12, .2778, 1, .2778},
                                     {PatchKind::EV, 3, 3, .9506, 1.0038, .9506},
                                     {PatchKind::EV, 3, 4, .9994, 1.1111, 1.1111},
                                     {PatchKind::EV, 3, 5, .9977, 1.1548, 1.1548},
                                     {PatchKind::EV, 3, 6, .9945, 1.0864, 1.0864},
                                     {PatchKind::EV, 3, 7, .9759, 1.0001, .9759},
                                     {PatchKind::EV, 3, 8, .8611, 1, .8611},
                                     {PatchKind::EV, 3, 12, .5185, 1, .5185},
                                     {PatchKind::EV, 4, 3, 1, 1.0218, 1.0070},
                                     {PatchKind::EV, 4, 5, .9998, 1.1048, 1.1048},
                                     {PatchKind::EV, 4, 6, .9987, 1.0509, 1.0508},
                                     {PatchKind::EV, 4, 8, .9106, 1.0001, .9189},
                                     {PatchKind::EV, 4, 12, .5801, 1.0001, .5801},
                                     {PatchKind::EV, 5, 3, 1, 1.0519, 1.0495},
                                     {PatchKind::EV, 5, 5, .9996, 1.0144, 1.0144},
                                     {PatchKind::EV, 5, 8, .6525, 1, .6525},
                                     {PatchKind::EV, 5, 10, .5183, 1, .5183},
                                     {PatchKind::EF, 2, 3, 1, 1.1667, 1.1667},
                                     {PatchKind::EF, 2, 4, 1, 1, 1},
                                     {PatchKind::EF, 2, 5, .8, 1, .8},
                                     {PatchKind::EF, 2, 12, .3333, 1, .3333},
                                     {PatchKind::EF, 3, 3, 1, 1.25, 1.25},
                                     {PatchKind::EF, 3, 5, .71, 1, .71},
                                     {PatchKind::EF, 3, 8, .2813, 1, .2813},
                                     {PatchKind::EF, 4, 3, 1, 1.3056, 1.3056},
                                     {PatchKind::EF, 4, 7, .2485, 1, .2485},
                                     {PatchKind::EF, 4, 12, .0494, 1, .0494},
                                     {PatchKind::EF, 5, 3, 1, 1.3475, 1.3475},
                                     {PatchKind::EF, 5, 6, .3050, 1, .3050},
                                     {PatchKind::EF, 5, 12, .0201, 1, .0201}};

TEST(PatchBasis, SumOfWeightsMatchesTheTable) {
    constexpr double digits = 5.1e-5;  // the table has four decimals
    for (const auto& row : kWeightSums) {
        const PatchClass c{row.kind, row.degree, row.n_sectors};
        const PatchBasis basis(c);
        Jet<double, 0> f;
        weights<0>(basis, {0, 0, 0}, Chart::Native, &f);
        EXPECT_NEAR(f.c[0], row.centre, digits) << testing::PrintToString(c);
        double min = f.c[0], max = f.c[0];
        for (const auto& p : grid_points(0, 24)) {
            weights<0>(basis, p, Chart::Native, &f);
            min = std::min(min, f.c[0]);
            max = std::max(max, f.c[0]);
        }
        // Both extremes, ours and the table's, are those of a grid.
        EXPECT_NEAR(min, row.min, 1e-3) << testing::PrintToString(c);
        EXPECT_NEAR(max, row.max, 1e-3) << testing::PrintToString(c);
    }
}

TEST(PatchBasis, SumOfWeightsAtTheCentreOfAFace) {
    // Every ribbon has h = 1 - 2/n there and alpha = beta = 1/2: f = n/2 sum of N_k(d h).
    for (int d = kMinDegree; d <= kMaxDegree; ++d) {
        for (const int n : {3, 4, 5, 7, 12, 64}) {
            const PatchClass c{PatchKind::EF, d, n};
            Jet<double, 0> f;
            weights<0>(PatchBasis(c), {0, 0, 0}, Chart::Native, &f);
            const Reference<0> reference(c, {0, 0});
            long double expected = 0;
            const long double hbar = d * (1 - 2.0L / n);
            for (int k = 0; k < d; ++k)
                expected += n / 2.0L * reference.N(k, hbar).c[0];
            // Rounding of h is magnified d (1 - h)^-1 = d n / 2 times.
            EXPECT_NEAR(f.c[0], double(expected), 1e-15 * d * n * double(expected))
                << testing::PrintToString(c);
        }
    }
}

TEST(PatchBasis, FourSidedFacePatchIsATensorProduct) {
    for (int d = kMinDegree; d <= 9; ++d) {
        const PatchClass c{PatchKind::EF, d, 4};
        const PatchBasis basis(c);
        for (const auto& p : inner_points(4)) {
            // s_0 and h_0 are affine; rows d.. 2d-1 are those of ribbon 2, the other way.
            const Reference<2> reference(c, basis.to_native(p));
            Jets<long double, 2> expected(c.n_points());
            for (int j = 0; j < 2 * d; ++j) {
                for (int k = 0; k < 2 * d; ++k) {
                    const Index i =
                        k < d ? reference.point(0, j, k)
                              : reference.point(2, 2 * d - 1 - j, 2 * d - 1 - k);
                    const long double width = d;
                    expected[i] += reference.N(j, width * reference.s[0]) *
                                   reference.N(k, width * reference.h[0]);
                }
            }
            Jet<double, 2> f;
            const auto actual = weights<2>(basis, p, Chart::Native, &f);
            EXPECT_NEAR(f.c[0], 1, 1e-14) << describe(c, p);
            // Order m is d^m / m! times larger, and rounding with it.
            for (std::size_t i = 0; i < actual.size(); ++i) {
                for (std::size_t k = 0; k < 6; ++k)
                    EXPECT_NEAR(actual[i].c[k], double(expected[i].c[k]), 1e-14 * d * d)
                        << describe(c, p) << " point " << i << " coefficient " << k;
            }
        }
    }
}

TEST(PatchBasis, RegularPatchIsATensorProduct) {
    const double s = 0.3, t = 0.8;
    for (int d = kMinDegree; d <= kMaxDegree; ++d) {
        const PatchClass c{PatchKind::Regular, d, 4};
        const PatchBasis basis(c);
        ASSERT_EQ(c.n_points(), (d + 1) * (d + 1));
        std::vector<double> bs(3 * (d + 1)), bt(3 * (d + 1));
        bspline_basis<double>(d, s, 2, bs);
        bspline_basis<double>(d, t, 2, bt);
        for (const Chart chart : {Chart::Native, Chart::BaseUV}) {
            const auto w = weights<2>(basis, {0, s, t}, chart);
            for (int k = 0; k <= d; ++k) {
                for (int j = 0; j <= d; ++j) {
                    const auto& x = w[k * (d + 1) + j];
                    for (int q = 0; q <= 2; ++q) {
                        for (int p = 0; p + q <= 2; ++p)
                            EXPECT_EQ(x.c[x.index(p, q)], bs[3 * j + p] * bt[3 * k + q]);
                    }
                }
            }
        }
        EXPECT_EQ(basis.to_native({0, s, t}), Vec2<double>(s, t));
        const auto clamped = basis.from_native({-0.5, 1.5});
        EXPECT_EQ(clamped.a, 0);
        EXPECT_EQ(clamped.b, 1);
    }
}

/// Control point i after a turn of the patch by one corner.
int turned(const PatchClass& c, int i) {
    const int d = c.degree;
    if (c.kind == PatchKind::EF)
        return (i + d * d) % (c.n_sectors * d * d);
    const int n_spokes = c.n_sectors * (d - 1), n_inner = n_spokes * (d - 1);
    if (i == 0)
        return 0;
    return i <= n_spokes
               ? 1 + (i - 1 + d - 1) % n_spokes
               : 1 + n_spokes + (i - 1 - n_spokes + (d - 1) * (d - 1)) % n_inner;
}

TEST(PatchBasis, IsCyclicAndMirrored) {
    for (const auto& c : classes({2, 3, 4, 6}, {3, 5, 6, 8})) {
        const int n = c.n_sectors, d = c.degree;
        const PatchBasis basis(c);
        // In a mirror side i becomes side 1-i, and with it spoke i.
        std::vector<int> mirrored(c.n_points(), 0);
        for (int i = 0; i < n; ++i) {
            for (int a = 0; a < d; ++a) {
                for (int b = 0; b < d; ++b) {
                    const int m = (n - i) % n;
                    if (c.kind == PatchKind::EF)
                        mirrored[c.ef_point(i, a, b)] = c.ef_point(m, b, a);
                    else
                        mirrored[c.ev_point(i, a, b)] = c.ev_point(m, b, a);
                }
            }
        }
        for (const auto& p : inner_points(n)) {
            const auto w = weights<2>(basis, p, Chart::BaseUV);
            const auto next =
                weights<2>(basis, {(p.sector + 1) % n, p.a, p.b}, Chart::BaseUV);
            const auto mirror =
                weights<2>(basis, {(n - p.sector) % n, p.b, p.a}, Chart::BaseUV);
            double scale = 0;
            for (const auto& x : w)
                scale = std::max({scale, order_max(x, 1), order_max(x, 2)});
            for (int i = 0; i < c.n_points(); ++i) {
                const auto &x = w[i], &y = next[turned(c, i)], &z = mirror[mirrored[i]];
                for (std::size_t k = 0; k < 6; ++k)
                    EXPECT_NEAR(x.c[k], y.c[k], 1e-13 * scale)
                        << describe(c, p) << " point " << i << " coefficient " << k;
                constexpr std::size_t kSwapped[] = {0, 2, 1, 5, 4, 3};
                for (std::size_t k = 0; k < 6; ++k)
                    EXPECT_NEAR(x.c[k], z.c[kSwapped[k]], 1e-13 * scale)
                        << describe(c, p) << " mirrored point " << i << " coefficient "
                        << k;
            }
        }
    }
}

// ------------------------------------------------------------------------ the domain

TEST(PatchBasis, NativeChartGoesThereAndBack) {
    for (const int n : {3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 64, 360}) {
        const PatchBasis basis({PatchKind::EF, 3, n});
        const double width = std::sin(std::numbers::pi / n);
        for (const int sector : {0, 1, n / 2, n - 1}) {
            for (const auto& p : grid_points(sector, 8)) {
                const auto xy = basis.to_native(p);
                const auto q = basis.from_native(xy);
                const auto back = basis.to_native(q);
                EXPECT_LE(glm::length(back - xy), 1e-14) << "n " << n;
                // Inside of the sector the coordinates return as well. The map shrinks by
                // sin(pi/n) across and by its square along the diagonal at the corner.
                if (p.a > 0 && p.b > 0 && p.a < 1 && p.b < 1) {
                    EXPECT_EQ(q.sector, p.sector) << "n " << n;
                    EXPECT_NEAR(q.a, p.a, 2e-15 / (width * width)) << "n " << n;
                    EXPECT_NEAR(q.b, p.b, 2e-15 / (width * width)) << "n " << n;
                }
            }
        }
        // The corners, middles of sides and centre are where they are said to be.
        for (int i = 0; i < n; ++i) {
            const double angle = 2 * std::numbers::pi / n;
            const Vec2<double> corner(std::cos(i * angle), std::sin(i * angle)),
                next(std::cos((i + 1) * angle), std::sin((i + 1) * angle));
            EXPECT_LE(glm::length(basis.to_native({i, 1, 1}) - corner), 1e-15);
            EXPECT_LE(glm::length(basis.to_native({i, 0, 1}) - 0.5 * (corner + next)),
                      1e-15);
            EXPECT_LE(glm::length(basis.to_native({i, 0, 0})), 1e-15);
        }
        // Points outside come to the boundary.
        for (const double radius : {1.001, 1.5, 10.0}) {
            for (int i = 0; i < 7; ++i) {
                const auto p = basis.from_native(
                    {radius * std::cos(1.0 * i), radius * std::sin(1.0 * i)});
                EXPECT_EQ(std::max(p.a, p.b), 1) << "n " << n;
                EXPECT_GE(std::min(p.a, p.b), 0) << "n " << n;
            }
        }
    }
}

TEST(PatchBasis, SideParametersOnTheSides) {
    for (const int n : {3, 4, 5, 6, 8, 12, 64, 360}) {
        const PatchBasis basis({PatchKind::EV, 3, n});
        for (const int i : {0, 1, n / 2, n - 1}) {
            for (const double t : {0.05, 0.3, 0.5, 0.75, 0.99}) {
                const auto side = basis.ribbons()->side_parameters(side_point(n, i, t));
                const int before = (i + n - 1) % n, after = (i + 1) % n;
                EXPECT_EQ(side.h[i], 0) << "n " << n;
                EXPECT_NEAR(side.s[i], t, 1e-15);
                EXPECT_NEAR(side.h[before], side.s[i], 1e-15);
                EXPECT_NEAR(side.h[after], 1 - side.s[i], 1e-15);
                EXPECT_EQ(side.s[after], 0);
                EXPECT_NEAR(side.s[before], 1, 1e-15);
                for (int k = 0; k < n; ++k) {
                    if (k == i || k == before || k == after)
                        continue;
                    EXPECT_NEAR(side.h[k], 1, 1e-15) << "n " << n << " side " << k;
                }
            }
            // At the corner at the end of side i.
            const auto corner = basis.ribbons()->side_parameters({i, 1, 1});
            EXPECT_NEAR(corner.s[i], 1, 1e-15);
            EXPECT_EQ(corner.s[(i + 1) % n], 0);
            EXPECT_EQ(corner.h[i], 0);
            EXPECT_EQ(corner.h[(i + 1) % n], 0);
        }
        const auto centre = basis.ribbons()->side_parameters({0, 0, 0});
        for (int i = 0; i < n; ++i) {
            EXPECT_NEAR(centre.s[i], 0.5, 1e-15);
            EXPECT_NEAR(centre.h[i], 1 - 2.0 / n, 1e-15);
        }
    }
}

TEST(PatchBasis, SideParametersInside) {
    for (const int n : {3, 4, 5, 6, 8, 12, 64, 360}) {
        const PatchClass c{PatchKind::EV, 3, n};
        const PatchBasis basis(c);
        for (const auto& p : inner_points(n)) {
            const auto side = basis.ribbons()->side_parameters(p);
            const Reference<0> reference(c, basis.to_native(p));
            double sum = 0;
            for (int i = 0; i < n; ++i) {
                // to_native() rounds the point, to 1e-16 of 1 where l may be pi^2 / 2n^2.
                EXPECT_NEAR(side.s[i], double(reference.s[i].c[0]), 1e-16 * n * n + 1e-15)
                    << describe(c, p) << " side " << i;
                EXPECT_NEAR(side.h[i], double(reference.h[i].c[0]), 1e-16 * n * n + 1e-15)
                    << describe(c, p) << " side " << i;
                sum += 1 - side.h[i];
            }
            EXPECT_NEAR(sum, 2, 1e-15 * n) << describe(c, p);  // every phi twice
        }
    }
}

// ------------------------------------------------------------------------ derivatives

TEST(PatchBasis, BaseChartIsTheNativeOneByTheChainRule) {
    for (const auto& c : classes({2, 3, 5}, {3, 5, 6, 8, 12})) {
        const PatchBasis basis(c);
        const Net net = random_net(c);
        const double turn = 2 * std::numbers::pi / c.n_sectors;
        const auto corner = [&](double i) {
            return Vec2<double>(std::cos(i * turn), std::sin(i * turn));
        };
        for (const auto& p : inner_points(c.n_sectors)) {
            const auto v = corner(p.sector);
            const auto left = 0.5 * (v + corner(p.sector - 1)),
                       right = 0.5 * (v + corner(p.sector + 1));
            // x = a left + b right + a b (v - left - right)
            const Vec2<double> twist = v - left - right, xa = left + p.b * twist,
                               xb = right + p.a * twist;
            const auto f = surface_jet(basis, p, Chart::Native, net),
                       g = surface_jet(basis, p, Chart::BaseUV, net);
            const auto first = [&](Vec2<double> d) { return d.x * f.du + d.y * f.dv; };
            const auto second = [&](Vec2<double> d, Vec2<double> e) {
                return d.x * e.x * f.duu + (d.x * e.y + d.y * e.x) * f.duv +
                       d.y * e.y * f.dvv;
            };
            // The derivatives are about as large as the net, 1 to 10.
            EXPECT_LE(glm::length(g.p - f.p), 1e-13) << describe(c, p);
            EXPECT_LE(glm::length(g.du - first(xa)), 1e-13) << describe(c, p);
            EXPECT_LE(glm::length(g.dv - first(xb)), 1e-13) << describe(c, p);
            EXPECT_LE(glm::length(g.duu - second(xa, xa)), 1e-12) << describe(c, p);
            EXPECT_LE(glm::length(g.duv - second(xa, xb) - first(twist)), 1e-12)
                << describe(c, p);
            EXPECT_LE(glm::length(g.dvv - second(xb, xb)), 1e-12) << describe(c, p);
        }
    }
}

// Central differences of step h err by h^2/6 of the third derivative, below 2e4 here, and by
// eps/h of derivatives of size 100: 1.3e-8 each for h = 2e-6.
TEST(PatchBasis, DerivativesMatchCentralDifferences) {
    constexpr double h = 2e-6;
    for (const auto& c : classes({2, 3, 4, 5, 7}, {3, 5, 6, 8})) {
        const PatchBasis basis(c);
        const Net net = random_net(c);
        for (const auto& p : inner_points(c.n_sectors)) {
            for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
                const auto at = [&](double du, double dv) {
                    if (chart == Chart::BaseUV)
                        return surface_jet(basis, {p.sector, p.a + du, p.b + dv}, chart,
                                           net);
                    const auto xy = basis.to_native(p) + Vec2<double>(du, dv);
                    return surface_jet(basis, basis.from_native(xy), chart, net);
                };
                const auto mid = at(0, 0), left = at(-h, 0), right = at(h, 0),
                           below = at(0, -h), above = at(0, h);
                const auto expect = [&](const Vec3<double>& d, const Vec3<double>& hi,
                                        const Vec3<double>& lo, const char* what) {
                    EXPECT_LE(glm::length(d - (hi - lo) / (2 * h)), 3e-8)
                        << describe(c, p) << " " << what;
                };
                expect(mid.du, right.p, left.p, "du");
                expect(mid.dv, above.p, below.p, "dv");
                expect(mid.duu, right.du, left.du, "duu");
                expect(mid.duv, right.dv, left.dv, "duv");
                expect(mid.duv, above.du, below.du, "dvu");
                expect(mid.dvv, above.dv, below.dv, "dvv");
            }
        }
    }
}

TEST(PatchBasis, OrdersAgree) {
    for (const auto& c : classes({2, 3, 6}, {3, 5})) {
        const PatchBasis basis(c);
        const Net net = random_net(c);
        for (const auto& p : {DomainPoint{0, 0.3, 0.8}, DomainPoint{1, 1, 0.4},
                              DomainPoint{2, 1, 1}, DomainPoint{1, 0, 0}}) {
            const auto full = surface<6>(basis, p, Chart::Native, net);
            const auto two = surface<2>(basis, p, Chart::Native, net);
            const auto one = surface<1>(basis, p, Chart::Native, net);
            const auto zero = surface<0>(basis, p, Chart::Native, net);
            for (int x = 0; x < 3; ++x) {
                EXPECT_NEAR(zero[x].c[0], full[x].c[0], 1e-14) << describe(c, p);
                for (std::size_t k = 0; k < 3; ++k)
                    EXPECT_NEAR(one[x].c[k], full[x].c[k], 1e-13) << describe(c, p);
                for (std::size_t k = 0; k < 6; ++k)
                    EXPECT_NEAR(two[x].c[k], full[x].c[k], 1e-12) << describe(c, p);
            }
        }
    }
}

// ------------------------------------------------------------------------ continuity

TEST(PatchBasis, JoinsTheNeighbouringBSplineWithOrderDMinusOne) {
    constexpr int kOrder = 6;
    using J = Jet<long double, kOrder>;
    for (const auto& c : classes({2, 3, 4, 5, 6, 7}, {3, 5, 6, 8})) {
        const int d = c.degree, n = c.n_sectors;
        const PatchBasis basis(c);
        const Net net = random_net(c);
        double order_d = 0;
        for (const int side : {0, n - 1}) {
            Random random(static_cast<unsigned>(side));
            for (const double t : {0.04, 0.3, 0.5, 0.87}) {
                const auto p = side_point(n, side, t);
                const auto actual = surface<kOrder>(basis, p, Chart::Native, net);

                // The neighbour's last piece before the side is that of hbar in [-1, 0]:
                // rows -1 .. d-1, of which row -1 is not the patch's.
                const Reference<kOrder> reference(c, basis.to_native(p));
                const J sbar = reference.intervals() * reference.s[side];
                J hbar = reference.intervals() * reference.h[side];
                hbar.c[0] = -1e-20L;
                std::array<J, 3> expected;
                for (int k = -1; k < d; ++k) {
                    const J row = reference.N(k, hbar);
                    for (int j = 0; j < reference.n_columns(); ++j) {
                        const J w = reference.N(j, sbar) * row;
                        for (int x = 0; x < 3; ++x)
                            expected[x] += (k < 0 ? 10 * random()
                                                  : net[reference.point(side, j, k)][x]) *
                                           w;
                    }
                }
                for (int x = 0; x < 3; ++x) {
                    J e = expected[x];
                    for (std::size_t k = 0; k < e.c.size(); ++k)
                        e.c[k] -= actual[x].c[k];
                    for (int m = 0; m < d; ++m) {
                        const double scale = 1 + double(order_max(expected[x], m));
                        // Order m sums products of up to m derivatives of s and h.
                        EXPECT_LE(double(order_max(e, m)), 1e-12 * scale)
                            << describe(c, p) << " side " << side << " order " << m;
                    }
                    if (d <= kOrder)
                        order_d = std::max(order_d, double(order_max(e, d)));
                }
            }
        }
        // The next order differs, so that the comparison can fail.
        if (d <= kOrder) {
            EXPECT_GT(order_d, 1e-2) << testing::PrintToString(c);
        }
    }
}

// The centre and the lines from it to the middles of the sides lie in several sectors.
TEST(PatchBasis, SectorsAgreeWhereTheyMeet) {
    for (const auto& c : classes({2, 3, 4, 5, 9}, {3, 4, 5, 8, 12})) {
        const int n = c.n_sectors;
        const PatchBasis basis(c);
        const Net net = random_net(c);
        // In even degrees and at the centre these are knots: order d may jump.
        const int order = std::min(c.degree - 1, 2);
        const auto compare = [&](const DomainPoint& p, const DomainPoint& q) {
            const auto f = surface<2>(basis, p, Chart::Native, net),
                       g = surface<2>(basis, q, Chart::Native, net);
            for (int x = 0; x < 3; ++x) {
                // The sum f is small at large n and d, and magnifies rounding.
                for (int m = 0; m <= order; ++m)
                    EXPECT_LE(order_max(f[x] - g[x], m), 1e-12 * (1 + order_max(f[x], m)))
                        << describe(c, p) << " order " << m;
            }
        };
        for (int i = 0; i < n; ++i) {
            for (const double r : {0.0, 0.2, 0.7, 1.0})
                compare({i, r, 0}, {(i + n - 1) % n, 0, r});
            compare({i, 0, 0}, {0, 0, 0});
        }
    }
}

/// The parameters t in [0,1], from below, at which value(t) passes through 1 .. last.
template <class Value>
std::vector<double> knots_on_line(Value&& value, int last) {
    std::vector<double> knots;
    constexpr int kSteps = 200;
    for (int k = 0; k < kSteps; ++k) {
        double lo = double(k) / kSteps, hi = double(k + 1) / kSteps;
        const double knot = std::floor(std::max(value(lo), value(hi)));
        const bool rises = value(lo) < knot;
        if (knot < 1 || knot > last || rises == (value(hi) < knot))
            continue;
        while (hi - lo > 1e-14) {
            const double mid = 0.5 * (lo + hi);
            ((value(mid) < knot) == rises ? lo : hi) = mid;
        }
        knots.push_back(lo);
    }
    return knots;
}

TEST(PatchBasis, IsContinuousOfOrderDMinusOneAcrossItsKnots) {
    constexpr double step = 1e-9;
    for (const auto& c : classes({2, 3, 4, 5, 6}, {3, 5, 8})) {
        const int d = c.degree, n = c.n_sectors;
        const int width = c.kind == PatchKind::EV ? d - 1 : d;
        const PatchBasis basis(c);
        const Net net = random_net(c);
        std::size_t n_knots = 0;
        double order_d = 0;
        // Largest jump of each order at t on the line `at`.
        const auto compare = [&](const auto& at, double t) {
            const auto before = surface<6>(basis, at(t - step), Chart::Native, net),
                       after = surface<6>(basis, at(t + step), Chart::Native, net);
            for (int x = 0; x < 3; ++x) {
                const auto jump = after[x] - before[x];
                for (int m = 0; m < d; ++m) {
                    // Without a jump they differ by the step times order m + 1.
                    const double slope =
                        order_max(before[x], m + 1) + order_max(after[x], m + 1);
                    EXPECT_LE(order_max(jump, m),
                              4 * (m + 1) * step * slope +
                                  1e-11 * (1 + order_max(before[x], m)))
                        << describe(c, at(t)) << " order " << m;
                }
                order_d = std::max(order_d, order_max(jump, d));
            }
        };
        for (const DomainPoint& end :
             {DomainPoint{1, 0.83, 1}, {0, 1, 0.4}, {n - 1, 1, 0.9}}) {
            const Vec2<double> from(-0.01, 0.02), to = 0.99 * basis.to_native(end);
            const auto at = [&](double t) {
                return basis.from_native((1 - t) * from + t * to);
            };
            for (int i = 0; i < n; ++i) {
                const auto s = [&](double t) {
                    return width * basis.ribbons()->side_parameters(at(t)).s[i];
                };
                const auto h = [&](double t) {
                    return width * basis.ribbons()->side_parameters(at(t)).h[i];
                };
                for (const auto& knots :
                     {knots_on_line(s, width - 1), knots_on_line(h, width - 1)}) {
                    n_knots += knots.size();
                    for (const double t : knots)
                        compare(at, t);
                }
            }
        }
        if (width == 1) {
            EXPECT_EQ(n_knots, 0u);
            continue;
        }
        EXPECT_GE(n_knots, 6u) << testing::PrintToString(c);
        EXPECT_GT(order_d, 1e-2) << testing::PrintToString(c);
    }
}

TEST(PatchBasis, CornersHaveTheLimitOfTheBSpline) {
    for (const auto& c : classes({2, 3, 4, 5, 7}, {3, 5, 6, 8, 12})) {
        const int d = c.degree, n = c.n_sectors;
        const PatchBasis basis(c);
        const Net net = random_net(c);
        for (const int q : {0, 1, n - 1}) {
            const DomainPoint corner{q, 1, 1};
            const Reference<1> reference(c, basis.to_native(corner));
            const auto actual = surface<1>(basis, corner, Chart::Native, net);
            // The ribbon that starts there and the one that ends there.
            for (const int i : {(q + 1) % n, q}) {
                auto sbar = reference.intervals() * reference.s[i];
                auto hbar = reference.intervals() * reference.h[i];
                const long double end = std::round(sbar.c[0]);
                sbar.c[0] = end > 0 ? end - 1e-19L : 0;
                hbar.c[0] = 0;
                for (int x = 0; x < 3; ++x) {
                    Jet<long double, 1> expected;
                    for (int j = 0; j < reference.n_columns(); ++j) {
                        for (int k = 0; k < d; ++k)
                            expected += static_cast<long double>(
                                            net[reference.point(i, j, k)][x]) *
                                        (reference.N(j, sbar) * reference.N(k, hbar));
                    }
                    for (std::size_t k = 0; k < 3; ++k)
                        EXPECT_NEAR(actual[x].c[k], double(expected.c[k]), 1e-13)
                            << describe(c, corner) << " ribbon " << i << " coefficient "
                            << k;
                }
            }
            // First derivatives tend to those of the corner from every direction.
            for (const double r : {1e-3, 1e-5, 1e-7, 2e-8, 1e-9, 1e-12}) {
                for (int k = 0; k <= 6; ++k) {
                    const double phi = k * std::numbers::pi / 12;
                    const DomainPoint p{q, 1 - r * std::cos(phi), 1 - r * std::sin(phi)};
                    const auto beside = surface<1>(basis, p, Chart::Native, net);
                    for (int x = 0; x < 3; ++x) {
                        // Second derivatives are bounded, below 1e3; rounding eps / r of
                        // blends that differ by O(r).
                        EXPECT_NEAR(beside[x].c[0], actual[x].c[0], 100 * r + 1e-13);
                        EXPECT_NEAR(beside[x].c[1], actual[x].c[1], 1000 * r + 1e-12)
                            << describe(c, p) << " r " << r;
                        EXPECT_NEAR(beside[x].c[2], actual[x].c[2], 1000 * r + 1e-12)
                            << describe(c, p) << " r " << r;
                    }
                }
            }
        }
    }
}

// Next to a corner one ribbon stands for all: where it does, they differ by rounding only.
TEST(PatchBasis, EqualsThePublishedFormulasNextToCorners) {
    for (const auto& c : classes({2, 3, 5}, {3, 5, 8})) {
        const PatchBasis basis(c);
        const Net net = random_net(c);
        for (const double r : {1e-3, 1e-5, 3e-6, 1e-6, 1e-7, 2e-8, 5e-9, 1e-10}) {
            for (const double phi : {0.2, 0.7, 1.4}) {
                const DomainPoint p{1, 1 - r * std::cos(phi), 1 - r * std::sin(phi)};
                const auto actual = surface<1>(basis, p, Chart::Native, net);
                std::array<Jet<long double, 1>, 3> expected;
                const auto w = Reference<1>(c, basis.to_native(p)).weights();
                for (std::size_t i = 0; i < net.size(); ++i) {
                    for (int x = 0; x < 3; ++x)
                        expected[x] += static_cast<long double>(net[i][x]) * w[i];
                }
                // Derivatives of the blends are about 1 / r, and so is their rounding; the
                // ribbons differ by r^2, their derivatives by r.
                for (int x = 0; x < 3; ++x) {
                    EXPECT_NEAR(actual[x].c[0], double(expected[x].c[0]), 1e-14)
                        << describe(c, p) << " r " << r;
                    for (std::size_t k = 1; k < 3; ++k)
                        EXPECT_NEAR(actual[x].c[k], double(expected[x].c[k]),
                                    1e-14 / std::max(r, 1e-8))
                            << describe(c, p) << " r " << r;
                }
            }
        }
    }
}

/// Largest difference of the mean curvatures at distance r of a corner from that at it.
double curvature_spread(const PatchBasis& basis, const Net& net, double r) {
    const double at_corner =
        curvature(surface_jet(basis, {1, 1, 1}, Chart::Native, net)).mean;
    double spread = 0;
    for (int k = 0; k <= 12; ++k) {
        const double phi = k * std::numbers::pi / 24;
        const DomainPoint p{1, 1 - r * std::cos(phi), 1 - r * std::sin(phi)};
        const double mean = curvature(surface_jet(basis, p, Chart::Native, net)).mean;
        raise(spread, std::abs(mean - at_corner));
    }
    return spread;
}

TEST(PatchBasis, CurvatureIsContinuousAtCorners) {
    for (const auto& c : classes({3, 4, 5, 7}, {3, 5, 6, 8})) {
        const PatchBasis basis(c);
        const Net net = random_net(c);
        const double wide = curvature_spread(basis, net, 1e-2),
                     middle = curvature_spread(basis, net, 1e-3),
                     close = curvature_spread(basis, net, 1e-4);
        EXPECT_GT(wide, 1e-5) << testing::PrintToString(c);
        // Linear in r, give or take the next order.
        EXPECT_LE(middle, 0.15 * wide) << testing::PrintToString(c);
        EXPECT_LE(close, 0.15 * middle) << testing::PrintToString(c);
        // Nearer, the second derivatives of the blends magnify rounding by r^-2, until the
        // kernel takes one ribbon alone.
        for (const double r : {1e-6, 1e-7, 2e-8}) {
            EXPECT_LE(curvature_spread(basis, net, r), 1e-3 * r + 1e-15 / (r * r))
                << testing::PrintToString(c) << " r " << r;
        }
        EXPECT_LE(curvature_spread(basis, net, 1e-9), 1e-6) << testing::PrintToString(c);
    }
    // Degree two is smooth of order one only.
    for (const auto& c : classes({2}, {3, 5, 8}))
        EXPECT_GT(curvature_spread(PatchBasis(c), random_net(c), 1e-5), 1e-4)
            << testing::PrintToString(c);
}

TEST(PatchBasis, HasNoSingularityAnywhere) {
    for (const auto& c : test::thinned<PatchClass>({{PatchKind::EV, 2, 360},
                                                    {PatchKind::EF, 2, 360},
                                                    {PatchKind::EV, 3, 360},
                                                    {PatchKind::EF, 3, 360},
                                                    {PatchKind::EV, 9, 360},
                                                    {PatchKind::EF, 9, 360},
                                                    {PatchKind::EV, 15, 3},
                                                    {PatchKind::EF, 15, 3},
                                                    {PatchKind::EV, 15, 12},
                                                    {PatchKind::EF, 15, 12},
                                                    {PatchKind::EV, 3, 3},
                                                    {PatchKind::EF, 2, 3}})) {
        const PatchBasis basis(c);
        std::vector<DomainPoint> points;
        for (const int q : {0, c.n_sectors / 2, c.n_sectors - 1}) {
            for (const double e : {0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3}) {
                points.push_back({q, 1 - e, 1 - e});  // to the corner
                points.push_back({q, 1, 1 - e});
                points.push_back({q, 1 - e, 0.4});  // to a side
                points.push_back({q, e, 0});        // to the centre
            }
            points.push_back({q, 0.4, 0.9});
        }
        for (const auto& p : test::thinned(points)) {
            for (const Chart chart : {Chart::Native, Chart::BaseUV}) {
                Jet<double, 2> sum;
                double sizes[3] = {}, max = 0;
                bool finite = true;
                for (const auto& w : weights<2>(basis, p, chart)) {
                    for (const double x : w.c)
                        finite = finite && std::isfinite(x);
                    for (int m = 0; m <= 2; ++m)
                        sizes[m] += order_max(w, m);
                    max = std::max(max, w.c[0]);
                    sum += w;
                }
                ASSERT_TRUE(finite) << describe(c, p);
                EXPECT_LE(max, 1 + 1e-12) << describe(c, p);
                // Near a corner derivative m of the blends magnifies rounding by r^-m. In the
                // native chart r shrinks by up to sin(pi/n)^2.
                const double width =
                    chart == Chart::BaseUV
                        ? 1
                        : std::pow(std::sin(std::numbers::pi / c.n_sectors), 2);
                const double r = std::max(2 - p.a - p.b, 1e-8) * width;
                sum.c[0] -= 1;
                for (int m = 0; m <= 2; ++m) {
                    EXPECT_LE(order_max(sum, m),
                              c.degree * (1e-13 * sizes[m] + 1e-14 * std::pow(r, -m)))
                        << describe(c, p) << " order " << m;
                }
            }
        }
    }
}

}  // namespace
}  // namespace osdx
