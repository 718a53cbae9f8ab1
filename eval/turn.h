// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <type_traits>

#include <osdx/place.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI::detail {

/// From the variables (a, b) of a patch to (u, v), which are turned and scaled:
/// d_u = cos d_a + sin d_b, d_v = cos d_b - sin d_a.
struct ChartTurn {
    double cos = 1, sin = 0;

    /// By quarters: (u, v) run along a b, b -a, -a -b, -b a.
    static constexpr ChartTurn quarters(int turns, double scale) noexcept {
        constexpr double kCos[4] = {1, 0, -1, 0}, kSin[4] = {0, 1, 0, -1};
        return {scale * kCos[turns & 3], scale * kSin[turns & 3]};
    }
};

template <class D>
constexpr D mul_add(double a, const D& b, const D& c) noexcept {
    return a * b + c;
}
template <class D>
constexpr D mul_sub(double a, const D& b, const D& c) noexcept {
    return a * b - c;
}

#define OSDX_TURN constexpr
#include "eval/turn-inl.h"
#undef OSDX_TURN

/// Calls f with std::integral_constant<int, order>. \pre 0 <= order <= 2
template <class F>
constexpr decltype(auto) with_order(int order, F&& f) {
    switch (order) {
        case 0:
            return f(std::integral_constant<int, 0>());
        case 1:
            return f(std::integral_constant<int, 1>());
        default:
            return f(std::integral_constant<int, 2>());
    }
}

}  // namespace osdx::inline OSDX_ABI::detail
