// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "far/types.h"

namespace osdx {

enum class PatchKind : std::uint8_t {
    Regular,  ///< uniform B-spline of bi-degree d on [0,1]^2
    EV,       ///< n-sided, around an extraordinary vertex
    EF,       ///< n-sided, around a face that is no quad
};

/// What decides the basis functions of a patch: they depend on nothing else.
///
/// Order of the control points:
/// Regular: row-major, (d+1) points along s in each of d+1 rows along t.
/// EV: the extraordinary vertex; then spoke i at distance b = 1..d-1; then for each sector
/// the points (a, b), a steps along spoke i and b along spoke i+1, 1 <= a,b <= d-1, b fastest.
/// EF: for each corner i the points (p, q), p steps away from the face across side i, q
/// across side i+1, 0 <= p,q <= d-1, q fastest; (0, 0) is the corner.
struct PatchClass {
    PatchKind kind = PatchKind::Regular;
    int degree = 3;
    int n_sides = 4;

    int n_points() const noexcept {
        const int d = degree;
        switch (kind) {
            case PatchKind::Regular:
                return (d + 1) * (d + 1);
            case PatchKind::EV:
                return 1 + n_sides * (d - 1) * d;
            case PatchKind::EF:
                return n_sides * d * d;
        }
        return 0;
    }

    /// Width of the chart in half-edges of the control mesh: of [0,1]^2 for regular patches,
    /// of each sector for the others.
    int extent() const noexcept {
        switch (kind) {
            case PatchKind::Regular:
                return 2;
            case PatchKind::EV:
                return degree - 1;
            case PatchKind::EF:
                return degree;
        }
        return 0;
    }

    /// Index of EV's point a steps along spoke `sector` and b along the next one.
    int ev_point(int sector, int a, int b) const noexcept {
        const int d1 = degree - 1;
        if (a == 0 && b == 0)
            return 0;
        if (b == 0)
            return 1 + sector * d1 + (a - 1);
        if (a == 0)
            return 1 + (sector + 1) % n_sides * d1 + (b - 1);
        return 1 + n_sides * d1 + sector * d1 * d1 + (a - 1) * d1 + (b - 1);
    }
    /// Index of EF's point (p, q) of `corner`.
    int ef_point(int corner, int p, int q) const noexcept {
        return (corner * degree + p) * degree + q;
    }

    bool operator==(const PatchClass&) const = default;
    auto operator<=>(const PatchClass&) const = default;
};

}  // namespace osdx
