// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

struct Topology;

/// A point of the surface, whatever patches lie underneath: a face of the base mesh and
/// its (u, v).
///
/// Quads: corners (0,0), (1,0), (1,1), (0,1). Other polygons of N sides: the sub-face at
/// corner i fills [0,.5]^2 of the tile (i mod D, i div D), D = 2 for N = 3, 3 for N = 5..9,
/// else 1 + floor(sqrt(N-1)); corner i is at the tile's integer corner, u runs towards
/// corner i + 1, and the face centre is the (.5,.5) of any tile. This is the
/// parameterisation QUAD_SUBFACES of OpenSubdiv's Bfr.
struct Address {
    Index face = 0;
    double u = 0, v = 0;
};

/// What many addresses were, of which a surface has no point or another one.
struct AddressReport {
    std::size_t n_clamped =
        0;  ///< outside of their face: moved to the nearest point there
    /// Of a face that is not there or has no surface, or with NaN: they have no results.
    std::size_t n_without_point = 0;
    std::size_t first_without_point = SIZE_MAX;
};

/// A quarter of a base face, at one of its corners: corner at (0,0), middle of the edge that
/// leaves it at (1,0), face centre at (1,1), middle of the edge that enters it at (0,1).
/// Quarters are numbered like halfedges of the base mesh.
struct QuarterPoint {
    Index quarter = 0;
    double x = 0, y = 0;
};

/// Outside [0,1]^2 of a quad, or the sub-faces of another face, the point is clamped to the
/// nearest one along u and v.
/// \pre address.face < base.n_faces()
OSDX_API QuarterPoint to_quarter(const Topology& base, const Address& address) noexcept;
OSDX_API Address to_address(const Topology& base, const QuarterPoint& point) noexcept;

/// d(x, y)/d(u, v) of to_quarter() is 2 times the rotation by this many quarter turns.
OSDX_API int quarter_turns(const Topology& base, Index quarter) noexcept;

/// The same point, on a side of its quarter, in the quarter across that side; its quarter is
/// kInvalidIndex where nothing lies there, beyond the border.
/// \param side  0: y = 0, 1: x = 1, 2: y = 1, 3: x = 0; 0 and 3 lie on edges of the mesh
OSDX_API QuarterPoint cross_side(const Topology& base, const QuarterPoint& point,
                                 int side) noexcept;

/// The halfedge of the quarter's face on whose edge a side lies; kInvalidIndex for sides
/// inside the face.
OSDX_API Index halfedge_of_side(const Topology& base, Index quarter, int side) noexcept;

/// The point of a base edge at t in [0, 1] from the start of a halfedge, in its face.
OSDX_API QuarterPoint edge_point(const Topology& base, Index halfedge, double t) noexcept;

/// (x, y) turned by k times 90 degrees.
template <class T>
constexpr Vec2<T> turn(Vec2<T> p, int k) noexcept {
    switch (k & 3) {
        case 1:
            return {-p.y, p.x};
        case 2:
            return {-p.x, -p.y};
        case 3:
            return {p.y, -p.x};
        default:
            return p;
    }
}

/// Corner k of the unit square, counter-clockwise from the origin.
template <class T>
constexpr Vec2<T> square_corner(int k) noexcept {
    return {T(k == 1 || k == 2), T(k >= 2)};
}

}  // namespace osdx::inline OSDX_ABI
