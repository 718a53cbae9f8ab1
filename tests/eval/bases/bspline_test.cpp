// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/bspline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace osdx {
namespace {

/// Rows of bspline_basis(): at(j, r) is the r-th Taylor coefficient of function j.
template <class T>
struct Basis {
    Basis(int degree, T u, int order_) : order(order_), c((degree + 1) * (order_ + 1)) {
        bspline_basis<T>(degree, u, order, c);
    }
    T at(int j, int r) const { return c[j * (order + 1) + r]; }

    int order;
    std::vector<T> c;
};

long double factorial(int n) {
    return std::tgamma(static_cast<long double>(n) + 1);
}

/// The r-th Taylor coefficient of N_j at u = p / 8, by the sum of truncated powers that are
/// active on [0, 1]:
///
///     N_j(u) = 1/d! sum of (-1)^k C(d+1, k) (u + d - j - k)^d  over k <= d - j
///
/// in integers, hence exact up to the last division. p beyond 0..8 continues the polynomial.
long double exact(int d, int j, int p, int r) {
    if (r > d)
        return 0;
    __int128 sum = 0, binomial = 1;
    for (int k = 0; k <= d - j; ++k) {
        __int128 term = binomial;
        for (int m = 0; m < d - r; ++m)
            term *= p + 8 * (d - j - k);
        sum += term;
        binomial = -binomial * (d + 1 - k) / (k + 1);
    }
    return static_cast<long double>(sum) / std::pow(8.0L, d - r) /
           (factorial(d - r) * factorial(r));
}

template <class T>
class BSplineBasis : public testing::Test {
protected:
    static constexpr T kEps = std::numeric_limits<T>::epsilon();

    /// Each of d levels of the recurrence rounds about six times, and adds positive terms on
    /// [0, 1]; the r-th differences add 2^r of the results.
    static T tolerance(int d, int r) {
        return T(6 * d * std::pow(2.0L, r) / factorial(r)) * kEps;
    }
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(BSplineBasis, Scalars);

TYPED_TEST(BSplineBasis, EqualsTruncatedPowers) {
    using T = TypeParam;
    for (int d = 1; d <= kMaxDegree; ++d) {
        const int order = d + 1;
        for (int p = 0; p <= 8; ++p) {
            const Basis<T> b(d, T(p) / 8, order);
            for (int j = 0; j <= d; ++j) {
                // Values keep their relative accuracy, however small they are.
                const auto value = static_cast<T>(exact(d, j, p, 0));
                EXPECT_NEAR(b.at(j, 0), value, this->tolerance(d, 0) * value)
                    << "degree " << d << " u " << p << "/8 function " << j;
                for (int r = 1; r <= order; ++r) {
                    EXPECT_NEAR(b.at(j, r), static_cast<T>(exact(d, j, p, r)),
                                this->tolerance(d, r))
                        << "degree " << d << " u " << p << "/8 function " << j
                        << " order " << r;
                }
            }
        }
    }
}

TYPED_TEST(BSplineBasis, ContinuesThePolynomialsOutside) {
    using T = TypeParam;
    for (int d = 1; d <= kMaxDegree; ++d) {
        for (const int p : {-8, -3, -1, 9, 12}) {
            const T u = T(p) / 8;
            const Basis<T> b(d, u, 2);
            for (int r = 0; r <= 2; ++r) {
                // Terms of both signs: the sum of their sizes grows by at most 1 + 2 |u|
                // a level.
                const T growth = std::pow(1 + 2 * std::abs(u), T(d));
                for (int j = 0; j <= d; ++j)
                    EXPECT_NEAR(b.at(j, r), static_cast<T>(exact(d, j, p, r)),
                                this->tolerance(d, r) * growth)
                        << "degree " << d << " u " << u << " function " << j << " order "
                        << r;
            }
        }
    }
}

TYPED_TEST(BSplineBasis, SumsToOneAndDerivativesToZero) {
    using T = TypeParam;
    for (int d = 1; d <= kMaxDegree; ++d) {
        for (int i = 0; i <= 32; ++i) {
            const T u = T(i) / 32;
            const Basis<T> b(d, u, d);
            for (int r = 0; r <= d; ++r) {
                T sum = 0;
                for (int j = 0; j <= d; ++j)
                    sum += b.at(j, r);
                EXPECT_NEAR(sum, r == 0 ? T(1) : T(0), this->tolerance(d, r))
                    << "degree " << d << " u " << u << " order " << r;
            }
        }
    }
}

TYPED_TEST(BSplineBasis, ReproducesLinearFunctions) {
    using T = TypeParam;
    for (int d = 1; d <= kMaxDegree; ++d) {
        for (int i = 0; i <= 32; ++i) {
            const T u = T(i) / 32;
            const Basis<T> b(d, u, 1);
            // Function j is centred at j - (d-1)/2.
            T value = 0, slope = 0;
            for (int j = 0; j <= d; ++j) {
                value += (T(j) - T(d - 1) / 2) * b.at(j, 0);
                slope += (T(j) - T(d - 1) / 2) * b.at(j, 1);
            }
            EXPECT_NEAR(value, u, T(d) * this->tolerance(d, 0)) << "degree " << d;
            EXPECT_NEAR(slope, T(1), T(d) * this->tolerance(d, 1)) << "degree " << d;
        }
    }
}

TYPED_TEST(BSplineBasis, IsSymmetric) {
    using T = TypeParam;
    for (int d = 1; d <= kMaxDegree; ++d) {
        for (int i = 0; i <= 16; ++i) {
            const Basis<T> left(d, T(i) / 32, d), right(d, T(1) - T(i) / 32, d);
            for (int j = 0; j <= d; ++j) {
                for (int r = 0; r <= d; ++r) {
                    const T sign = r % 2 == 0 ? T(1) : T(-1);
                    EXPECT_NEAR(left.at(j, r), sign * right.at(d - j, r),
                                2 * this->tolerance(d, r))
                        << "degree " << d << " function " << j << " order " << r;
                }
            }
        }
    }
}

// Eulerian numbers over d!; the function that starts or ends at the knot is 0 exactly, so
// that a point on a knot does not feel the rows beyond it.
TYPED_TEST(BSplineBasis, HasEulerianNumbersAtKnots) {
    using T = TypeParam;
    const std::array<std::vector<double>, 5> rows = {
        {{1}, {1, 1}, {1, 4, 1}, {1, 11, 11, 1}, {1, 26, 66, 26, 1}}};
    for (int d = 1; d <= 5; ++d) {
        const Basis<T> start(d, T(0), 0), end(d, T(1), 0);
        for (int j = 0; j < d; ++j) {
            const T expected = T(rows[d - 1][j] / double(factorial(d)));
            EXPECT_NEAR(start.at(j, 0), expected, 4 * this->kEps);
            EXPECT_NEAR(end.at(j + 1, 0), expected, 4 * this->kEps);
        }
    }
    for (int d = 1; d <= kMaxDegree; ++d) {
        EXPECT_EQ(Basis<T>(d, T(0), 0).at(d, 0), T(0)) << "degree " << d;
        EXPECT_EQ(Basis<T>(d, T(1), 0).at(0, 0), T(0)) << "degree " << d;
    }
}

TYPED_TEST(BSplineBasis, JoinsTheNextIntervalWithOrderDMinusOne) {
    using T = TypeParam;
    for (int d = 1; d <= kMaxDegree; ++d) {
        const Basis<T> end(d, T(1), d), start(d, T(0), d);
        T jump = 0;
        for (int j = 0; j <= d + 1;
             ++j) {  // function j of this interval is j-1 of the next
            for (int r = 0; r < d; ++r) {
                EXPECT_NEAR(j <= d ? end.at(j, r) : T(0),
                            j > 0 ? start.at(j - 1, r) : T(0), 2 * this->tolerance(d, r))
                    << "degree " << d << " function " << j << " order " << r;
            }
            jump = std::max(jump, std::abs((j <= d ? end.at(j, d) : T(0)) -
                                           (j > 0 ? start.at(j - 1, d) : T(0))));
        }
        // The d-th derivative jumps by C(d+1, k), at most by the middle one.
        const long double middle =
            factorial(d + 1) / (factorial((d + 1) / 2) * factorial(d + 1 - (d + 1) / 2));
        EXPECT_NEAR(jump, T(middle / factorial(d)), 2 * this->tolerance(d, d));
    }
}

// Central differences of step h err by h^2/6 of the third derivative, below 20 here, and by
// eps/h of the function: 3e-10 and 1e-11 for h = 1e-5.
TEST(BSplineBasisDouble, DerivativesMatchCentralDifferences) {
    constexpr double h = 1e-5, u = 0.3;
    for (int d = 1; d <= kMaxDegree; ++d) {
        const int order = std::min(d, 4);
        const Basis<double> lo(d, u - h, order), mid(d, u, order), hi(d, u + h, order);
        for (int j = 0; j <= d; ++j) {
            for (int r = 0; r < order; ++r)
                EXPECT_NEAR((r + 1) * mid.at(j, r + 1),
                            (hi.at(j, r) - lo.at(j, r)) / (2 * h), 1e-9)
                    << "degree " << d << " function " << j << " order " << r + 1;
        }
    }
}

TEST(BSplineBasisDouble, OrdersAgree) {
    for (int d = 1; d <= kMaxDegree; ++d) {
        const Basis<double> full(d, 0.375, 6);
        for (int order = 0; order < 6; ++order) {
            const Basis<double> low(d, 0.375, order);
            for (int j = 0; j <= d; ++j) {
                for (int r = 0; r <= order; ++r)
                    EXPECT_EQ(low.at(j, r), full.at(j, r)) << "degree " << d;
            }
        }
    }
}

}  // namespace
}  // namespace osdx
