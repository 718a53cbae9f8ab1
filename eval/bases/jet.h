// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cmath>
#include <concepts>

#include <osdx/version.h>

namespace osdx::inline OSDX_ABI {

/// The number by which code chooses between formulas that agree where they meet: the scalar
/// itself. Other scalars, intervals for instance, have a function of this name of their own, and
/// sqrt(), in their namespace.
template <std::floating_point T>
constexpr double representative(T x) noexcept {
    return static_cast<double>(x);
}

/// A function of two variables near a point: its Taylor polynomial of total degree Order.
///
/// Coefficients are stored by total degree, then by the power of the second variable:
/// f, f_x, f_y, f_xx/2, f_xy, f_yy/2, f_xxx/6, ... Arithmetic is that of truncated
/// polynomials, so derivatives of whatever is computed with jets are exact up to rounding.
template <class T, int Order>
struct Jet {
    static constexpr int kSize = (Order + 1) * (Order + 2) / 2;
    std::array<T, kSize> c{};

    /// Place of the coefficient of x^i y^j.
    static constexpr int index(int i, int j) noexcept {
        return (i + j) * (i + j + 1) / 2 + j;
    }

    constexpr Jet() = default;
    constexpr Jet(T value) { c[0] = value; }

    constexpr Jet& operator+=(const Jet& o) noexcept {
        for (int k = 0; k < kSize; ++k)
            c[k] += o.c[k];
        return *this;
    }
    constexpr Jet& operator-=(const Jet& o) noexcept {
        for (int k = 0; k < kSize; ++k)
            c[k] -= o.c[k];
        return *this;
    }
    constexpr Jet& operator*=(T s) noexcept {
        for (int k = 0; k < kSize; ++k)
            c[k] *= s;
        return *this;
    }
    friend constexpr Jet operator+(Jet a, const Jet& b) noexcept { return a += b; }
    friend constexpr Jet operator-(Jet a, const Jet& b) noexcept { return a -= b; }
    friend constexpr Jet operator*(Jet a, T s) noexcept { return a *= s; }
    friend constexpr Jet operator*(T s, Jet a) noexcept { return a *= s; }

    friend constexpr Jet operator*(const Jet& a, const Jet& b) noexcept {
        Jet r;
        for (int m = 0; m <= Order; ++m) {
            for (int j = 0; j <= m; ++j) {
                const T x = a.c[index(m - j, j)];
                for (int n = 0; m + n <= Order; ++n) {
                    for (int k = 0; k <= n; ++k)
                        r.c[index(m - j + n - k, j + k)] += x * b.c[index(n - k, k)];
                }
            }
        }
        return r;
    }

    /// \pre b.c[0] != 0
    friend constexpr Jet operator/(const Jet& a, const Jet& b) noexcept {
        // From r b = a: each coefficient of r by those of lower degree.
        Jet r;
        const T inverse = T(1) / b.c[0];
        for (int m = 0; m <= Order; ++m) {
            for (int j = 0; j <= m; ++j) {
                T sum = a.c[index(m - j, j)];
                for (int p = 0; p <= m - j; ++p) {
                    for (int q = 0; q <= j; ++q) {
                        if (p + q > 0)
                            sum -= b.c[index(p, q)] * r.c[index(m - j - p, j - q)];
                    }
                }
                r.c[index(m - j, j)] = sum * inverse;
            }
        }
        return r;
    }

    /// \pre x.c[0] > 0
    friend Jet sqrt(const Jet& x) noexcept {
        using std::sqrt;
        // From r r = x, likewise.
        Jet r;
        r.c[0] = sqrt(x.c[0]);
        const T inverse = T(0.5) / r.c[0];
        for (int m = 1; m <= Order; ++m) {
            for (int j = 0; j <= m; ++j) {
                T sum = x.c[index(m - j, j)];
                for (int p = 0; p <= m - j; ++p) {
                    for (int q = 0; q <= j; ++q) {
                        if (p + q > 0 && p + q < m)
                            sum -= r.c[index(p, q)] * r.c[index(m - j - p, j - q)];
                    }
                }
                r.c[index(m - j, j)] = sum * inverse;
            }
        }
        return r;
    }
};

/// The powers 0..Order of a jet without its value, to put it into functions of one variable.
template <class T, int Order>
struct JetPowers {
    std::array<Jet<T, Order>, Order + 1> power;

    explicit constexpr JetPowers(const Jet<T, Order>& x) noexcept {
        power[0] = T(1);
        if constexpr (Order > 0) {
            power[1] = x;
            power[1].c[0] = T(0);
            for (int k = 2; k <= Order; ++k)
                power[k] = power[k - 1] * power[1];
        }
    }

    /// f(x), where taylor[k] = f^(k) / k! at the value of x.
    template <class Coefficients>
    constexpr Jet<T, Order> compose(const Coefficients& taylor) const noexcept {
        Jet<T, Order> r(taylor[0]);
        for (int k = 1; k <= Order; ++k)
            r += taylor[k] * power[k];
        return r;
    }
};

}  // namespace osdx::inline OSDX_ABI
