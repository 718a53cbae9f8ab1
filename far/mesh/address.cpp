// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include <osdx/address.h>
#include <osdx/topology.h>

#include "far/mesh/quadrant.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// Tiles in a row of the parameterisation of a face that is no quad.
int tiles_per_row(Index n) noexcept {
    return n == 3 ? 2 : n <= 9 ? 3 : 1 + static_cast<int>(std::sqrt(double(n - 1)));
}

/// The nearer one: an address that rounding left just below a tile belongs to it. Of any number.
int tile_of(double x, int n_tiles) noexcept {
    const double tile = std::ceil(x - 0.75);
    return tile > 0 ? static_cast<int>(std::min(tile, n_tiles - 1.0)) : 0;
}

}  // namespace

QuarterPoint to_quarter(const Topology& base, const Address& address) noexcept {
    const Index first = base.face_offsets[address.face];
    const Index n = base.face_size(address.face);
    if (n == 4) {
        const Vec2<double> p(std::clamp(address.u, 0.0, 1.0),
                             std::clamp(address.v, 0.0, 1.0));
        const detail::Quadrant quadrant(p, {-1, -1});
        const auto q = quadrant.point(p);
        return {first + quadrant.corner(), q.x, q.y};
    }
    const int row = tiles_per_row(n);
    const int i = tile_of(address.u, row), j = tile_of(address.v, row);
    const int corner = std::min(j * row + i, static_cast<int>(n) - 1);
    const Vec2<double> tile(corner % row, corner / row);
    return {first + corner, 2.0 * std::clamp(address.u - tile.x, 0.0, 0.5),
            2.0 * std::clamp(address.v - tile.y, 0.0, 0.5)};
}

Address to_address(const Topology& base, const QuarterPoint& point) noexcept {
    const Index face = base.face(point.quarter);
    const int corner = static_cast<int>(point.quarter - base.face_offsets[face]);
    const Vec2<double> half = 0.5 * Vec2<double>(point.x, point.y);
    const Index n = base.face_size(face);
    if (n == 4) {
        const Vec2<double> p = square_corner<double>(corner) + turn(half, corner);
        return {face, p.x, p.y};
    }
    const int row = tiles_per_row(n);
    return {face, corner % row + half.x, corner / row + half.y};
}

int quarter_turns(const Topology& base, Index quarter) noexcept {
    const Index face = base.face(quarter);
    const auto corner = static_cast<int>(quarter - base.face_offsets[face]);
    return base.face_size(face) == 4 ? -corner & 3 : 0;
}

QuarterPoint cross_side(const Topology& base, const QuarterPoint& p, int side) noexcept {
    switch (side) {
        case 0: {
            const Index twin = base.twin[p.quarter];
            return {twin == kInvalidIndex ? twin : base.next(twin), 0, p.x};
        }
        case 1:
            return {base.next(p.quarter), p.y, 1};
        case 2:
            return {base.prev(p.quarter), 1, p.x};
        default:
            return {base.ccw(p.quarter), p.y, 0};
    }
}

Index halfedge_of_side(const Topology& base, Index quarter, int side) noexcept {
    return side == 0 ? quarter : side == 3 ? base.prev(quarter) : kInvalidIndex;
}

QuarterPoint edge_point(const Topology& base, Index halfedge, double t) noexcept {
    if (t <= 0.5)
        return {halfedge, 2 * t, 0};
    return {base.next(halfedge), 0, 2 * (1 - t)};
}

}  // namespace osdx::inline OSDX_ABI
