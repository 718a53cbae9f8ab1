// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI::detail {

/// A step down a quadtree, without branches: the quarter of the unit square that a point lies in.
/// On a middle line `towards`, a direction, decides.
struct Quadrant {
    bool right, upper;

    Quadrant(Vec2<double> p, Vec2<double> towards) noexcept
        : right(p.x > limit(towards.x)), upper(p.y > limit(towards.y)) {}
    /// \param corner  of the square, counter-clockwise from (0, 0)
    explicit Quadrant(int corner) noexcept
        : right(corner == 1 || corner == 2), upper(corner >= 2) {}

    int corner() const noexcept { return int(right != upper) + 2 * int(upper); }
    /// A point in the quadrant's frame: its corner at (0, 0), x along the side that leaves it, unit
    /// side. Differences are exact, so that the cells' edges fit together exactly.
    Vec2<double> point(Vec2<double> p) const noexcept {
        return turned(2 * std::min(p.x, 1 - p.x), 2 * std::min(p.y, 1 - p.y));
    }
    /// A direction, likewise.
    Vec2<double> direction(Vec2<double> d) const noexcept {
        return turned(right ? -d.x : d.x, upper ? -d.y : d.y);
    }

    /// What is above belongs to the upper half.
    static double limit(double towards) noexcept {
        constexpr double kBelowHalf = 0.5 - 0x1p-54;  // the number before a half
        return towards > 0 ? kBelowHalf : 0.5;
    }

private:
    Vec2<double> turned(double x, double y) const noexcept {
        const double p[] = {x, y};
        const bool odd = right != upper;
        return {p[odd], p[!odd]};
    }
};

}  // namespace osdx::inline OSDX_ABI::detail
