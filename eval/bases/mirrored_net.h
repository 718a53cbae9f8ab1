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
///
/// On the border what counts of a point and its image is their foot. A border that runs through
/// is one curve; two that end at the centre V are each continued by 2 V - P, and the surface
/// there is taken apart into half of their difference (part 0) and half of their sum (part 1).
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
    int n_parts() const noexcept;
    /// What stands for a ribbon's point on the border, of a part: of two curves the foot.
    Terms foot_point(int part, int ribbon, int column, int row) const;
    /// Point j of the polygon of the border curve, of a part, from side 0 on; as many as a ribbon
    /// has columns.
    Terms curve_point(int part, int j) const;

private:
    int cyclic(int i) const noexcept { return i < 0 ? i + n_ : i >= n_ ? i - n_ : i; }

    /// The point's place: b steps from the centre along the border on side 0 or n/2, or the centre.
    struct Foot {
        bool at_centre, at_end;
        int b;
    };
    static Terms sum(const Terms& a, double scale_a, const Terms& b, double scale_b);
    static Terms mirror(const Terms& foot, const Terms& point);
    Terms border_terms(const Foot& foot) const;
    Terms part_terms(int part, const Foot& foot) const;
    Foot sector_foot(int sector, int a, int b) const;
    Foot corner_foot(int corner, int p, int q) const;
    Terms spoke_terms(int spoke, int b) const;
    Terms sector_terms(int sector, int a, int b) const;
    Terms corner_terms(int corner, int p, int q) const;

    PatchClass class_;
    int n_, d_, columns_;
};

}  // namespace osdx::inline OSDX_ABI
