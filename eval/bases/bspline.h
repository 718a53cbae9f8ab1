// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cassert>
#include <span>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The uniform B-splines of degree d that do not vanish on one knot interval [0, 1], as Taylor
/// coefficients: out[j * (order + 1) + r] = N_j^(r)(u) / r!, j = 0..d counted from the left.
///
/// u outside [0, 1] continues the polynomials.
/// Source: de Boor, A Practical Guide to Splines, ch. X: values by the recurrence
/// b[k][j] = ((u + k - j) b[k-1][j-1] + (j + 1 - u) b[k-1][j]) / k, derivatives by
/// differences of the lower degree.
/// \pre 1 <= degree <= kMaxDegree; out.size() == (degree + 1) * (order + 1)
template <class T>
void bspline_basis(int degree, T u, int order, std::span<T> out) noexcept {
    assert(degree >= 1 && degree <= kMaxDegree);
    assert(out.size() == std::size_t(degree + 1) * (order + 1));
    const int stride = order + 1;
    std::ranges::fill(out, T(0));

    T b[kMaxDegree + 1];  // the basis of degree k
    b[0] = T(1);
    for (int k = 0; k <= degree; ++k) {
        if (k > 0) {
            const T inverse = T(1) / T(k);
            b[k] = u * b[k - 1] * inverse;
            for (int j = k - 1; j >= 0; --j) {
                const T left = j > 0 ? b[j - 1] : T(0);
                b[j] = ((u + T(k - j)) * left + (T(j + 1) - u) * b[j]) * inverse;
            }
        }
        // The r-th derivative is the r-th backward difference of the basis of degree d - r.
        const int r = degree - k;
        if (r > order)
            continue;
        T d[kMaxDegree + 1];
        std::copy_n(b, k + 1, d);
        T scale = T(1);
        for (int m = 1; m <= r; ++m) {
            d[k + m] = d[k + m - 1];
            for (int j = k + m - 1; j > 0; --j)
                d[j] = d[j - 1] - d[j];
            d[0] = -d[0];
            scale /= T(m);
        }
        for (int j = 0; j <= degree; ++j)
            out[j * stride + r] = d[j] * scale;
    }
}

extern template void bspline_basis<float>(int, float, int, std::span<float>) noexcept;
extern template void bspline_basis<double>(int, double, int, std::span<double>) noexcept;

}  // namespace osdx::inline OSDX_ABI
