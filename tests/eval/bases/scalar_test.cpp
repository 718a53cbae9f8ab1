// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/patch_class.h>
#include <osdx/place.h>

#include "eval/bases/jet.h"
#include "eval/bases/patch_basis.h"
#include "tests/support/patch_class_names.h"

// The bases over scalars other than double, and jets of higher orders.

namespace osdx {
namespace test {

/// A closed interval whose arithmetic rounds outwards.
struct Interval {
    double lo = 0, hi = 0;

    Interval() = default;
    Interval(double x) : lo(x), hi(x) {}
    Interval(double l, double h) : lo(l), hi(h) {}

    bool contains(double x) const { return lo <= x && x <= hi; }

    static Interval outwards(double l, double h) {
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        return {std::nextafter(l, -kInfinity), std::nextafter(h, kInfinity)};
    }
    friend Interval operator-(const Interval& a) { return {-a.hi, -a.lo}; }
    friend Interval operator+(const Interval& a, const Interval& b) {
        return outwards(a.lo + b.lo, a.hi + b.hi);
    }
    friend Interval operator-(const Interval& a, const Interval& b) {
        return outwards(a.lo - b.hi, a.hi - b.lo);
    }
    friend Interval operator*(const Interval& a, const Interval& b) {
        const auto [l, h] =
            std::minmax({a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi});
        return outwards(l, h);
    }
    /// \pre b does not contain 0
    friend Interval operator/(const Interval& a, const Interval& b) {
        return a * outwards(1 / b.hi, 1 / b.lo);
    }
    /// \pre a.lo >= 0
    friend Interval sqrt(const Interval& a) {
        return outwards(std::sqrt(a.lo), std::sqrt(a.hi));
    }
    Interval& operator+=(const Interval& b) { return *this = *this + b; }
    Interval& operator-=(const Interval& b) { return *this = *this - b; }
    Interval& operator*=(const Interval& b) { return *this = *this * b; }
    Interval& operator/=(const Interval& b) { return *this = *this / b; }
};

double representative(const Interval& x) {
    return 0.5 * (x.lo + x.hi);
}

}  // namespace test

namespace {

using test::Interval;

/// The weights of all control points, divided by their sum.
template <int Order, class T>
std::vector<Jet<T, Order>> weights(const PatchBasis& basis, const DomainPointOf<T>& p,
                                   Chart chart) {
    std::vector<Jet<T, Order>> w(
        static_cast<std::size_t>(basis.patch_class().n_points()));
    const auto f = basis.for_each_weight<Order, T>(
        p, chart, [&](Index i, const Jet<T, Order>& x) { w[i] += x; });
    for (auto& x : w)
        x = x / f;
    return w;
}

std::vector<PatchClass> inner_classes() {
    std::vector<PatchClass> all = {{PatchKind::Regular, 2, 4},
                                   {PatchKind::Regular, 5, 4},
                                   {PatchKind::Gregory, 3, 4},
                                   {PatchKind::Gregory, 3, 5}};
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int n : {3, 5, 8}) {
            for (const int d : {2, 3, 4})
                all.push_back({kind, d, n});
        }
    }
    return all;
}

/// Inside a sector, off its sides and the diagonal, where knots are.
DomainPoint random_point(const PatchClass& c, std::mt19937& engine) {
    const auto random = [&] { return 0.05 + 0.9 * double(engine()) / 4294967296.0; };
    const int sector =
        c.is_square() ? 0
                      : static_cast<int>(engine() % static_cast<unsigned>(c.n_sectors));
    return {sector, random(), random()};
}

// What long double says has 11 bits more: the double weights are right to rounding, which is
// some hundred ulps of the largest derivatives, (2 d n)^m for order m.
TEST(Scalars, LongDoubleConfirmsDouble) {
    std::vector<PatchClass> classes = inner_classes();
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : {2, 3, 5}) {
            classes.push_back({kind, d, 1, PatchBorder::Smooth});
            classes.push_back({kind, d, 3, PatchBorder::Smooth});
            classes.push_back({kind, d, 2, PatchBorder::Pinned});
            classes.push_back({kind, d, 5, PatchBorder::Spike});
        }
    }
    std::mt19937 engine(1);
    for (const PatchClass& c : classes) {
        const PatchBasis basis(c);
        for (int k = 0; k < 10; ++k) {
            const DomainPoint p = random_point(c, engine);
            for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
                const auto w = weights<2>(basis, p, chart);
                const auto fine = weights<2>(
                    basis, DomainPointOf<long double>{p.sector, p.a, p.b}, chart);
                for (std::size_t i = 0; i < w.size(); ++i) {
                    for (int r = 0; r < Jet<double, 2>::kSize; ++r) {
                        const int m = r > 2 ? 2 : r > 0;
                        const double size =
                            std::pow(2.0 * c.degree * std::max(3, c.n_polygon()), m);
                        EXPECT_NEAR(w[i].c[r], double(fine[i].c[r]),
                                    500 * std::numeric_limits<double>::epsilon() * size)
                            << testing::PrintToString(c) << " point " << i
                            << " derivative " << r;
                    }
                }
            }
        }
    }
}

// Jets of order 3 are those of order 2 with more behind them, and that is the derivative of what
// is before: by central differences of step h, right to h^2 times two orders more.
TEST(Scalars, HigherOrdersContinueLowerOnes) {
    std::mt19937 engine(2);
    for (const PatchClass& c : inner_classes()) {
        const PatchBasis basis(c);
        const DomainPoint p = random_point(c, engine);
        const auto at = [&](double a) {
            return weights<2>(basis, DomainPoint{p.sector, a, p.b}, Chart::BaseUV);
        };
        constexpr double h = 1e-4;
        const auto high = weights<3>(basis, p, Chart::BaseUV);
        const auto low = at(p.a), left = at(p.a - h), right = at(p.a + h);
        using J2 = Jet<double, 2>;
        using J3 = Jet<double, 3>;
        for (std::size_t i = 0; i < high.size(); ++i) {
            for (int r = 0; r < J2::kSize; ++r)
                EXPECT_NEAR(high[i].c[r], low[i].c[r],
                            1e-13 * (1 + std::abs(low[i].c[r])));
            // x^2 y: the derivative of x y over 2.
            const double expected =
                (right[i].c[J2::index(1, 1)] - left[i].c[J2::index(1, 1)]) / (2 * h * 2);
            const double size = std::pow(2.0 * c.degree * std::max(3, c.n_sectors), 3);
            EXPECT_NEAR(high[i].c[J3::index(2, 1)], expected, 1e-5 * size)
                << testing::PrintToString(c) << " point " << i;
        }
    }
}

// Intervals enclose the weights at all points of a small square.
TEST(Scalars, IntervalsEnclose) {
    std::mt19937 engine(3);
    constexpr double kWidth = 1e-6;
    for (const PatchClass& c : inner_classes()) {
        const PatchBasis basis(c);
        for (int k = 0; k < 5; ++k) {
            const DomainPoint p = random_point(c, engine);
            const auto box =
                weights<1>(basis,
                           DomainPointOf<Interval>{
                               p.sector, {p.a, p.a + kWidth}, {p.b, p.b + kWidth}},
                           Chart::BaseUV);
            for (const double s : {0.0, 0.3, 1.0}) {
                for (const double t : {0.0, 0.6, 1.0}) {
                    const auto w = weights<1>(
                        basis,
                        DomainPointOf<long double>{
                            p.sector, static_cast<long double>(p.a + s * kWidth),
                            static_cast<long double>(p.b + t * kWidth)},
                        Chart::BaseUV);
                    for (std::size_t i = 0; i < w.size(); ++i) {
                        for (int r = 0; r < 3; ++r) {
                            EXPECT_TRUE(box[i].c[r].contains(double(w[i].c[r])))
                                << testing::PrintToString(c) << " point " << i << ": "
                                << double(w[i].c[r]) << " in [" << box[i].c[r].lo << ", "
                                << box[i].c[r].hi << "]";
                            // Not by being everywhere.
                            EXPECT_LT(box[i].c[r].hi - box[i].c[r].lo, 1);
                        }
                    }
                }
            }
        }
    }
}

}  // namespace
}  // namespace osdx
