// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include <osdx/channels.h>
#include <osdx/result.h>
#include <osdx/types.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI::detail {

/// Squares of larger coordinates are infinite, those of smaller ones zero; so would lengths,
/// areas and curvatures be.
inline constexpr double kMaxCoordinate = 1e150, kMinCoordinate = 1e-150;

/// The largest coordinate of a position; NaN if one is.
template <class T>
double largest_coordinate(const T* p) noexcept {
    const double sum = double(p[0]) + double(p[1]) + double(p[2]);
    if (std::isnan(sum) && !std::isinf(p[0]) && !std::isinf(p[1]) && !std::isinf(p[2]))
        return sum;
    return std::max(
        {std::abs(double(p[0])), std::abs(double(p[1])), std::abs(double(p[2]))});
}

/// Positions that are numbers with squares.
/// \param vertex  vertex(i): that of position i
/// \param line  line(v): of the file, or 0
/// \return NonFinitePoint
template <class T, class Vertex, class Line>
Status check_range(Channels<const T> positions, std::size_t n, Vertex&& vertex,
                   Line&& line) {
    const Index outside = first_index(n, [&](Index i) {
        return !(largest_coordinate(positions[i]) <= kMaxCoordinate);
    });
    const auto named = [&](Index i) {
        const T* p = positions[i];
        return fmt::format("vertex {} has the position ({}, {}, {})", vertex(i), p[0],
                           p[1], p[2]);
    };
    if (outside != kInvalidIndex) {
        const double size = largest_coordinate(positions[outside]);
        return fail(ErrorCode::NonFinitePoint,
                    std::isfinite(size)
                        ? fmt::format("{}, but squares of coordinates above {} are no "
                                      "finite numbers; scale the mesh down",
                                      named(outside), kMaxCoordinate)
                        : named(outside),
                    vertex(outside), line(vertex(outside)));
    }
    const auto first_above = [&](double limit) {
        return first_index(
            n, [&](Index i) { return largest_coordinate(positions[i]) > limit; });
    };
    if (first_above(kMinCoordinate) != kInvalidIndex)
        return ok();
    const Index i = first_above(0);
    if (i == kInvalidIndex)
        return ok();
    return fail(
        ErrorCode::NonFinitePoint,
        fmt::format("{}, and no coordinate of the mesh is above {}, but squares of "
                    "smaller ones are zero; scale the mesh up",
                    named(i), kMinCoordinate),
        vertex(i), line(vertex(i)));
}

}  // namespace osdx::inline OSDX_ABI::detail
