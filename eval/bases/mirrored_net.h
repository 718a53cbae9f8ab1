// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/patch_class.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The control net of the whole n-gon of which an EV or EF patch at a border is a part: points
/// beyond a border are mirror images, 2 P(foot) - P, and so combinations of control points.
///
/// The foot of a point in a sector next to the border is the border point that it sits over, of
/// others the centre. Patches inside have the n-gon's points for their own.
class MirroredNet {
public:
    struct Term {
        Index point;  ///< control point of the patch
        double weight;
    };
    using Terms = std::vector<Term>;

    explicit MirroredNet(const PatchClass& patch_class);

    int n_columns() const noexcept { return columns_; }

    /// The point of a ribbon in a column and a row; see PatchBasis.
    Terms ribbon_point(int ribbon, int column, int row) const;
    /// Point j of the polygon of the border curve along an axis, from the side axis * n_sectors
    /// on; as many as a ribbon has columns.
    Terms axis_point(int axis, int j) const;

private:
    int cyclic(int i) const noexcept { return i < 0 ? i + n_ : i >= n_ ? i - n_ : i; }

    static Terms mirror(const Terms& foot, const Terms& point);
    Terms spoke_terms(int spoke, int b) const;
    Terms sector_terms(int sector, int a, int b) const;
    Terms curve_terms(int side, int p) const;
    Terms centre_terms() const;
    Terms corner_terms(int corner, int p, int q) const;

    PatchClass class_;
    int n_, d_, columns_;
};

}  // namespace osdx::inline OSDX_ABI
