// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/mirrored_net.h"

namespace osdx::inline OSDX_ABI {

MirroredNet::MirroredNet(const PatchClass& patch_class)
    : class_(patch_class),
      n_(patch_class.n_polygon()),
      d_(patch_class.degree),
      columns_(patch_class.kind == PatchKind::EV ? 2 * d_ - 1 : 2 * d_) {}

MirroredNet::Terms MirroredNet::mirror(const Terms& foot, const Terms& point) {
    Terms sum;
    const auto add = [&](const Term& t, double scale) {
        for (Term& s : sum) {
            if (s.point == t.point) {
                s.weight += scale * t.weight;
                return;
            }
        }
        sum.push_back({t.point, scale * t.weight});
    };
    for (const Term& t : foot)
        add(t, 2);
    for (const Term& t : point)
        add(t, -1);
    std::erase_if(sum, [](const Term& t) { return t.weight == 0; });
    return sum;
}

// Axis 0 runs along spokes 0 and n/2, axis 1 of pinned patches along spokes k and n/2 + k.
// What lies beyond axis 0 is the mirror image of the half before it, and what lies there
// beyond axis 1 that of the sectors themselves.

MirroredNet::Terms MirroredNet::spoke_terms(int spoke, int b) const {
    const int k = class_.n_sectors;
    int of = spoke;
    if (class_.is_open() && b > 0) {
        if (spoke > n_ / 2)
            of = n_ - spoke;
        else if (class_.border == PatchBorder::Pinned && spoke > k)
            of = 2 * k - spoke;
    }
    if (of != spoke)
        return mirror({{0, 1.0}}, spoke_terms(of, b));
    return {{static_cast<Index>(class_.ev_spoke(spoke, b)), 1.0}};
}

MirroredNet::Terms MirroredNet::sector_terms(int sector, int a, int b) const {
    const int k = class_.n_sectors, half = n_ / 2;
    if (a == 0 || b == 0)
        return b == 0 ? spoke_terms(sector, a) : spoke_terms(cyclic(sector + 1), b);
    if (class_.is_open() && sector >= half) {
        const int of = n_ - 1 - sector;  // whose point is b steps along its first spoke
        return mirror(of == 0          ? spoke_terms(0, b)
                      : of == half - 1 ? spoke_terms(half, a)
                                       : spoke_terms(0, 0),
                      sector_terms(of, b, a));
    }
    if (class_.border == PatchBorder::Pinned && sector >= k) {
        const int of = 2 * k - 1 - sector;
        return mirror(of == k - 1 ? spoke_terms(k, a) : spoke_terms(0, 0),
                      sector_terms(of, b, a));
    }
    return {{static_cast<Index>(class_.ev_point(sector, a, b)), 1.0}};
}

MirroredNet::Terms MirroredNet::centre_terms() const {
    if (class_.border == PatchBorder::Pinned)
        return {{static_cast<Index>(class_.ef_centre()), 1.0}};
    return {{static_cast<Index>(class_.ef_curve(0, 0)), 0.5},
            {static_cast<Index>(class_.ef_curve(1, 0)), 0.5}};
}

/// The border curve's point p steps away across a side that an axis meets.
MirroredNet::Terms MirroredNet::curve_terms(int side, int p) const {
    if (side == 0 || side == class_.n_sectors)
        return {{static_cast<Index>(class_.ef_curve(side != 0, p)), 1.0}};
    return mirror(centre_terms(), curve_terms(side - n_ / 2, p));
}

MirroredNet::Terms MirroredNet::corner_terms(int corner, int p, int q) const {
    const int k = class_.n_sectors, half = n_ / 2;
    if (class_.is_open() && corner >= half) {
        const int of = n_ - 1 - corner;
        return mirror(of == 0          ? curve_terms(0, q)
                      : of == half - 1 ? curve_terms(half, p)
                                       : centre_terms(),
                      corner_terms(of, q, p));
    }
    if (class_.border == PatchBorder::Pinned && corner >= k) {
        const int of = 2 * k - 1 - corner;
        return mirror(of == k - 1 ? curve_terms(k, p) : centre_terms(),
                      corner_terms(of, q, p));
    }
    return {{static_cast<Index>(class_.ef_point(corner, p, q)), 1.0}};
}

MirroredNet::Terms MirroredNet::ribbon_point(int ribbon, int column, int row) const {
    const bool ev = class_.kind == PatchKind::EV;
    const int m = d_ - 1, b = m - row;
    if (class_.is_single()) {
        // The halves that the sector has; the other halves are their mirror images.
        const int last = columns_ - 1;
        const bool missing = ribbon == 0 ? 2 * column < last : 2 * column > last;
        if (missing) {
            return mirror(ev ? spoke_terms(ribbon, b) : curve_terms(ribbon, b),
                          ribbon_point(ribbon, last - column, row));
        }
        if (ev && column == m)
            return spoke_terms(ribbon, b);
        return {
            {static_cast<Index>(ev ? (ribbon == 0 ? class_.ev_point(0, b, column - m)
                                                  : class_.ev_point(0, m - column, b))
                                   : (ribbon == 0 ? class_.ef_point(0, b, column - d_)
                                                  : class_.ef_point(0, m - column, b))),
             1.0}};
    }
    const int before = cyclic(ribbon - 1);
    if (ev) {
        return column <= m ? sector_terms(before, m - column, b)
                           : sector_terms(ribbon, b, column - m);
    }
    return column < d_ ? corner_terms(before, m - column, b)
                       : corner_terms(ribbon, b, column - d_);
}

MirroredNet::Terms MirroredNet::axis_point(int axis, int j) const {
    const int i = axis * class_.n_sectors, o = i + n_ / 2;
    if (class_.kind == PatchKind::EV)
        return j < d_ ? spoke_terms(i, d_ - 1 - j) : spoke_terms(o, j - (d_ - 1));
    return j < d_ ? curve_terms(i, d_ - 1 - j) : curve_terms(o, j - d_);
}

}  // namespace osdx::inline OSDX_ABI
