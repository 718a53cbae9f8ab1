// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cassert>
#include <span>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The Bernstein polynomials of degree d as Taylor coefficients:
/// out[j * (order + 1) + r] = B_j^(r)(u) / r!, j = 0..d.
///
/// Values by de Casteljau's recurrence b[k][j] = u b[k-1][j-1] + (1 - u) b[k-1][j]; the r-th
/// derivative is d!/(d-r)! times the r-th difference of the basis of degree d - r.
/// \pre 1 <= degree <= kMaxDegree; out.size() == (degree + 1) * (order + 1)
template <class T>
constexpr void bernstein_basis(int degree, T u, int order, std::span<T> out) noexcept {
    assert(degree >= 1 && degree <= kMaxDegree);
    assert(out.size() == std::size_t(degree + 1) * (order + 1));
    const int stride = order + 1;
    for (T& x : out)
        x = T(0);
    std::array<T, kMaxDegree + 1> b{T(1)};  // the basis of degree k
    for (int k = 0; k <= degree; ++k) {
        if (k > 0) {
            b[k] = u * b[k - 1];
            for (int j = k - 1; j > 0; --j)
                b[j] = u * b[j - 1] + (T(1) - u) * b[j];
            b[0] *= T(1) - u;
        }
        const int r = degree - k;
        if (r > order)
            continue;
        std::array<T, kMaxDegree + 1> d = b;
        T scale = T(1);  // d! / (d - r)! / r!
        for (int m = 1; m <= r; ++m) {
            d[k + m] = d[k + m - 1];
            for (int j = k + m - 1; j > 0; --j)
                d[j] = d[j - 1] - d[j];
            d[0] = -d[0];
            scale = scale * T(degree + 1 - m) / T(m);
        }
        for (int j = 0; j <= degree; ++j)
            out[j * stride + r] = d[j] * scale;
    }
}

}  // namespace osdx::inline OSDX_ABI
