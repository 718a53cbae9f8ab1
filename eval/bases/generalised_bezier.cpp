// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/generalised_bezier.h"

#include <cassert>

namespace osdx {

GeneralisedBezierBasis::GeneralisedBezierBasis(int n, int degree, CentrePoint centre)
    : polygon_(n), d_(degree), l_((degree + 1) / 2), centre_(centre) {
    assert(n >= 3 && degree >= kMinBezierDegree && degree <= kMaxDegree);
}

Vec2<double> GeneralisedBezierBasis::from_corner(const DomainPoint& p,
                                                 Chart chart) const noexcept {
    const double a = 1 - p.a, b = 1 - p.b;
    if (chart == Chart::BaseUV)
        return {-a, -b};
    // Differences of the corners of the sector's quad: no cancellation.
    const Vec2<double> corner = polygon_.sector_point({p.sector, 1, 1}),
                       left = polygon_.sector_point({p.sector, 1, 0}),
                       right = polygon_.sector_point({p.sector, 0, 1});
    return p.a * b * (left - corner) + a * p.b * (right - corner) - a * b * corner;
}

}  // namespace osdx
