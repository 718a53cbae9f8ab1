// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

enum class PatchKind : std::uint8_t {
    Regular,  ///< uniform B-spline of bi-degree d on [0,1]^2
    EV,       ///< n-sided, around an extraordinary vertex
    EF,       ///< n-sided, around a face that is no quad
    Gregory,  ///< over a face of n corners; of degree 3
};

/// How the border of the surface, or a sharp edge, meets a patch of kind EV or EF.
enum class PatchBorder : std::uint8_t {
    None,    ///< the patch lies inside
    Smooth,  ///< a border curve runs through the centre
    Pinned,  ///< two border curves, or both sides of one, end at the centre
    Spike,   ///< the patch lies inside, but its centre is pinned to a point
};

/// What decides the basis functions of a patch: they depend on nothing else.
///
/// Order of the control points:
/// Regular: row-major, (d+1) points along s in each of d+1 rows along t.
/// EV: the extraordinary vertex; then spoke i at distance b = 1..d-1; then for each sector
/// the points (a, b), a steps along spoke i and b along spoke i+1, 1 <= a,b <= d-1, b fastest.
/// EF: for each corner i the points (p, q), p steps away from the face across side i, q
/// across side i+1, 0 <= p,q <= d-1, q fastest; (0, 0) is the corner.
/// At a border an EV has one spoke more than sectors; the first and the last are the border.
/// An EF has then, after all corners, the points of the border curve 0..d-1 steps away
/// across side 0, and those across side n. Pinned and spiked EF end with the centre.
/// Gregory: see GregoryBasis; faces that are no quads have a centre point or are normalised.
struct PatchClass {
    PatchKind kind = PatchKind::Regular;
    int degree = 3;
    int n_sectors = 4;  ///< faces around the vertex, or corners of the face
    PatchBorder border = PatchBorder::None;
    /// Gregory, n_sectors != 4: the weights are divided by their sum; there is no centre point.
    bool normalised = false;

    bool is_open() const noexcept {
        return border == PatchBorder::Smooth || border == PatchBorder::Pinned;
    }

    /// One sector at a border, whose domain is a triangle.
    bool is_single() const noexcept { return is_open() && n_sectors == 1; }

    /// Sides of the regular polygon that the sectors are a part of: a half at borders. One
    /// sector there has a domain of its own; see PatchBasis.
    int n_polygon() const noexcept { return is_open() ? 2 * n_sectors : n_sectors; }

    int n_points() const noexcept {
        const int d = degree;
        switch (kind) {
            case PatchKind::Regular:
                return (d + 1) * (d + 1);
            case PatchKind::EV:
                return 1 + n_spokes() * (d - 1) + n_sectors * (d - 1) * (d - 1);
            case PatchKind::EF:
                return ef_centre() +
                       (border == PatchBorder::Pinned || border == PatchBorder::Spike);
            case PatchKind::Gregory:
                return 5 * n_sectors + (n_sectors != 4 && !normalised);
        }
        return 0;
    }

    /// The domain is [0,1]^2, not an n-gon.
    bool is_square() const noexcept {
        return kind == PatchKind::Regular ||
               (kind == PatchKind::Gregory && n_sectors == 4);
    }

    /// Width of the chart in half-edges of the control mesh: of [0,1]^2 for square patches,
    /// of each sector for the others.
    int extent() const noexcept {
        switch (kind) {
            case PatchKind::Regular:
                return 2;
            case PatchKind::EV:
                return degree - 1;
            case PatchKind::EF:
                return degree;
            case PatchKind::Gregory:
                return is_square() ? 2 : 1;
        }
        return 0;
    }

    int n_spokes() const noexcept { return n_sectors + is_open(); }

    /// Index of EV's point at distance b on a spoke; b = 0 is the vertex.
    int ev_spoke(int spoke, int b) const noexcept {
        return b == 0 ? 0 : spoke * (degree - 1) + b;
    }
    /// Index of EV's point a steps along spoke `sector` and b along the next one.
    int ev_point(int sector, int a, int b) const noexcept {
        const int d1 = degree - 1;
        if (b == 0)
            return ev_spoke(sector, a);
        if (a == 0)
            return ev_spoke((sector + 1) % n_spokes(), b);
        return 1 + n_spokes() * d1 + sector * d1 * d1 + (a - 1) * d1 + (b - 1);
    }
    /// Index of EF's point (p, q) of `corner`.
    int ef_point(int corner, int p, int q) const noexcept {
        return (corner * degree + p) * degree + q;
    }
    /// Index of the point p steps away on the border curve across the first side of an open
    /// EF patch (end = 0) or its last (end = 1).
    int ef_curve(int end, int p) const noexcept {
        return n_sectors * degree * degree + end * degree + p;
    }
    int ef_centre() const noexcept { return ef_curve(is_open() ? 2 : 0, 0); }

    bool operator==(const PatchClass&) const = default;
    auto operator<=>(const PatchClass&) const = default;
};

}  // namespace osdx::inline OSDX_ABI
