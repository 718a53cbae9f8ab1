// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include <osdx/types.h>

namespace osdx {

/// The uniform B-splines of degree d that do not vanish on one knot interval [0, 1], as Taylor
/// coefficients: out[j * (order + 1) + r] = N_j^(r)(u) / r!, j = 0..d counted from the left.
///
/// u outside [0, 1] continues the polynomials.
/// Source: de Boor, A Practical Guide to Splines, ch. X: values by the recurrence
/// b[k][j] = ((u + k - j) b[k-1][j-1] + (j + 1 - u) b[k-1][j]) / k, derivatives by
/// differences of the lower degree.
/// \pre 1 <= degree <= kMaxDegree; out.size() == (degree + 1) * (order + 1)
template <class T>
void bspline_basis(int degree, T u, int order, std::span<T> out) noexcept;

extern template void bspline_basis<float>(int, float, int, std::span<float>) noexcept;
extern template void bspline_basis<double>(int, double, int, std::span<double>) noexcept;

}  // namespace osdx
