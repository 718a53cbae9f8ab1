// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/jet.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace osdx {
namespace {

constexpr int kOrder = 6;

template <class T>
using J = Jet<T, kOrder>;

template <class T, int Order = kOrder>
constexpr Jet<T, Order> variable(int k, T value) {
    Jet<T, Order> x(value);
    if constexpr (Order > 0)
        x.c[k + 1] = T(1);
    return x;
}

long double factorial(int n) {
    return std::tgamma(static_cast<long double>(n) + 1);
}
long double binomial(int n, int k) {
    return std::round(factorial(n) / (factorial(k) * factorial(n - k)));
}

// Places and exact arithmetic, at compile time: (2 + x)(3 + y) and its quotient by 3 + y.
constexpr Jet<double, 2> kX = variable<double, 2>(0, 2.0),
                         kY = variable<double, 2>(1, 3.0);
static_assert(Jet<double, 2>::index(0, 0) == 0 && Jet<double, 2>::index(1, 0) == 1);
static_assert(Jet<double, 2>::index(0, 1) == 2 && Jet<double, 2>::index(2, 0) == 3);
static_assert(Jet<double, 2>::index(1, 1) == 4 && Jet<double, 2>::index(0, 2) == 5);
static_assert((kX * kY).c == std::array{6.0, 3.0, 2.0, 0.0, 1.0, 0.0});
static_assert((kX * kX).c == std::array{4.0, 4.0, 0.0, 1.0, 0.0, 0.0});
static_assert((kX * kY / kX).c == kY.c);
static_assert((kX + kY - 2.0 * kX).c == (kY - kX).c);

template <class T>
class JetOf : public testing::Test {
protected:
    /// Compares all coefficients with expected(i, j), that of x^i y^j.
    ///
    /// A coefficient of order m is a sum of up to 2^m products, each of which rounds a few
    /// times; the largest coefficient bounds the terms that cancel.
    template <int Order, class F>
    static void expect(const Jet<T, Order>& actual, F&& expected, int rounds = 32) {
        long double scale = 0;
        for (int m = 0; m <= Order; ++m) {
            for (int j = 0; j <= m; ++j)
                scale = std::max(scale,
                                 std::abs(static_cast<long double>(expected(m - j, j))));
        }
        const long double tolerance = rounds * scale * std::numeric_limits<T>::epsilon();
        for (int m = 0; m <= Order; ++m) {
            for (int j = 0; j <= m; ++j) {
                const auto k = static_cast<std::size_t>(actual.index(m - j, j));
                EXPECT_NEAR(static_cast<double>(actual.c[k]),
                            static_cast<double>(expected(m - j, j)),
                            static_cast<double>(tolerance))
                    << "x^" << m - j << " y^" << j;
            }
        }
    }
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(JetOf, Scalars);

TYPED_TEST(JetOf, MultipliesPolynomials) {
    using T = TypeParam;
    // p(x, y) = sum of a_ij x^i y^j, by Horner; degree 5 in each variable.
    constexpr int n = 6;
    const T x0 = T(0.75), y0 = T(-0.5);
    const auto a = [](int i, int j) { return (i * 7 + j * 11 + i * j * 5) % 13 - 6; };
    const J<T> x = variable(0, x0), y = variable(1, y0);
    J<T> p;
    for (int i = n - 1; i >= 0; --i) {
        J<T> row;
        for (int j = n - 1; j >= 0; --j)
            row = row * y + J<T>(T(a(i, j)));
        p = p * x + row;
    }
    this->expect(p, [&](int i, int j) {
        long double sum = 0;
        for (int r = i; r < n; ++r) {
            for (int s = j; s < n; ++s)
                sum += a(r, s) * binomial(r, i) * binomial(s, j) *
                       std::pow(static_cast<long double>(x0), r - i) *
                       std::pow(static_cast<long double>(y0), s - j);
        }
        return sum;
    });
}

TYPED_TEST(JetOf, DividesByALinearFunction) {
    using T = TypeParam;
    const T a = T(0.5), b = T(-0.75), x0 = T(0.25), y0 = T(0.5);
    const J<T> d = J<T>(T(2)) + a * variable(0, x0) + b * variable(1, y0);
    const long double d0 = 2 + a * x0 + b * y0;
    // 1/d: (-1)^(i+j) C(i+j, i) a^i b^j / d^(i+j+1).
    this->expect(J<T>(T(1)) / d, [&](int i, int j) {
        return std::pow(-1.0L, i + j) * binomial(i + j, i) *
               std::pow(static_cast<long double>(a), i) *
               std::pow(static_cast<long double>(b), j) / std::pow(d0, i + j + 1);
    });
}

TYPED_TEST(JetOf, DividesByAProduct) {
    using T = TypeParam;
    // x^2 / ((1 + x)(2 + y)): x^2 / (1 + x) = x - 1 + 1 / (1 + x).
    const T x0 = T(0.5), y0 = T(0.25);
    const J<T> x = variable(0, x0), y = variable(1, y0);
    const J<T> f = x * x / ((J<T>(T(1)) + x) * (J<T>(T(2)) + y));
    this->expect(f, [&](int i, int j) {
        const long double u = 1 / (1.0L + x0), v = 1 / (2.0L + y0);
        const long double along_x =
            std::pow(-1.0L, i) * std::pow(u, i + 1) + (i == 0   ? x0 - 1.0L
                                                       : i == 1 ? 1.0L
                                                                : 0);
        return along_x * std::pow(-1.0L, j) * std::pow(v, j + 1);
    });
}

TYPED_TEST(JetOf, QuotientTimesDivisorIsDividend) {
    using T = TypeParam;
    J<T> a, b;
    for (std::size_t k = 0; k < J<T>::kSize; ++k) {
        a.c[k] = T(std::sin(1.0 + double(k)));
        b.c[k] = T(std::cos(2.0 * double(k)));  // b(0, 0) = 1
    }
    const J<T> q = a / b;
    const J<T> back = q * b;
    // Coefficients of the quotient grow with the order; they bound the terms that cancel.
    T scale = 0;
    for (const T c : q.c)
        scale = std::max(scale, std::abs(c));
    for (std::size_t k = 0; k < J<T>::kSize; ++k)
        EXPECT_NEAR(back.c[k], a.c[k], 32 * scale * std::numeric_limits<T>::epsilon());
}

TYPED_TEST(JetOf, ComposesWithTheExponential) {
    using T = TypeParam;
    // exp(x y): the inner function has products of both variables.
    const T x0 = T(0.75), y0 = T(-0.5);
    const J<T> xy = variable(0, x0) * variable(1, y0);
    std::array<T, kOrder + 1> taylor;
    for (int k = 0; k <= kOrder; ++k)
        taylor[static_cast<std::size_t>(k)] = T(std::exp(double(x0 * y0)) / factorial(k));
    const JetPowers<T, kOrder> powers(xy);
    this->expect(powers.compose(taylor), [&](int i, int j) {
        // exp((x0 + x)(y0 + y)) = exp(x0 y0) exp(y0 x) exp(x0 y) exp(x y)
        long double sum = 0;
        for (int k = 0; k <= std::min(i, j); ++k)
            sum += std::pow(static_cast<long double>(y0), i - k) *
                   std::pow(static_cast<long double>(x0), j - k) /
                   (factorial(i - k) * factorial(j - k) * factorial(k));
        return std::exp(static_cast<long double>(x0) * y0) * sum;
    });
}

TYPED_TEST(JetOf, ComposesWithARoot) {
    using T = TypeParam;
    // sqrt(1 + a x + b y): the value of the inner jet must not enter its powers.
    const T a = T(0.5), b = T(-0.25), x0 = T(0.5), y0 = T(1);
    const J<T> d = J<T>(T(1)) + a * variable(0, x0) + b * variable(1, y0);
    const long double d0 = 1 + a * x0 + b * y0;
    const auto root = [&](int k) {  // of sqrt at d0: C(1/2, k) d0^(1/2 - k)
        long double c = std::sqrt(d0);
        for (int m = 0; m < k; ++m)
            c *= (0.5L - m) / (m + 1) / d0;
        return c;
    };
    std::array<T, kOrder + 1> taylor;
    for (int k = 0; k <= kOrder; ++k)
        taylor[static_cast<std::size_t>(k)] = T(root(k));
    this->expect(JetPowers<T, kOrder>(d).compose(taylor), [&](int i, int j) {
        return root(i + j) * binomial(i + j, i) *
               std::pow(static_cast<long double>(a), i) *
               std::pow(static_cast<long double>(b), j);
    });
}

/// A rational function and its square's exponential series, to any order.
template <class T, int Order>
Jet<T, Order> sample() {
    using K = Jet<T, Order>;
    const K x = variable<T, Order>(0, T(0.25)), y = variable<T, Order>(1, T(0.75));
    const K q = (x * y + K(T(1))) / (K(T(2)) + x - y * y);
    std::array<T, kOrder + 1> taylor;
    for (int k = 0; k <= kOrder; ++k)
        taylor[static_cast<std::size_t>(k)] = T(1 / factorial(k));
    return JetPowers<T, Order>(q).compose(taylor);
}

template <class T, int Order>
void expect_truncation(const J<T>& full) {
    const auto low = sample<T, Order>();
    for (std::size_t k = 0; k < Jet<T, Order>::kSize; ++k)
        EXPECT_NEAR(low.c[k], full.c[k],
                    4 * std::numeric_limits<T>::epsilon() * (1 + std::abs(full.c[k])))
            << "order " << Order << " coefficient " << k;
}

TYPED_TEST(JetOf, LowerOrdersAreTruncations) {
    using T = TypeParam;
    const J<T> full = sample<T, kOrder>();
    expect_truncation<T, 0>(full);
    expect_truncation<T, 1>(full);
    expect_truncation<T, 2>(full);
    expect_truncation<T, 3>(full);
    expect_truncation<T, 5>(full);
}

}  // namespace
}  // namespace osdx
