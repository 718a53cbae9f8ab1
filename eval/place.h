// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include <osdx/types.h>

namespace osdx {

/// The variables that derivatives are taken in.
enum class Chart : std::uint8_t {
    BaseUV,  ///< (u, v) of the base face; of the bilinear sector (a, b) for n-sided patches
    Native,  ///< (x, y) of the regular n-gon; (s, t) of [0,1]^2 for patches of four sides
};

/// A point of the domain of a patch; see PatchPoint.
template <class T>
struct DomainPointOf {
    int sector = 0;
    T a = T(0), b = T(0);
};
using DomainPoint = DomainPointOf<double>;

/// Number of values up to an order: 1, 3 or 6, in the order p, du, dv, duu, duv, dvv.
constexpr int n_derivatives(int order) noexcept {
    return (order + 1) * (order + 2) / 2;
}

}  // namespace osdx
