// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/mirrored_net.h"

namespace osdx::inline OSDX_ABI {

MirroredNet::MirroredNet(const PatchClass& patch_class)
    : class_(patch_class),
      n_(patch_class.n_polygon()),
      d_(patch_class.degree),
      columns_(patch_class.kind == PatchKind::EV ? 2 * d_ - 1 : 2 * d_) {}

MirroredNet::Terms MirroredNet::sum(const Terms& a, double scale_a, const Terms& b,
                                    double scale_b) {
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
    for (const Term& t : a)
        add(t, scale_a);
    for (const Term& t : b)
        add(t, scale_b);
    std::erase_if(sum, [](const Term& t) { return t.weight == 0; });
    return sum;
}

MirroredNet::Terms MirroredNet::mirror(const Terms& foot, const Terms& point) {
    return sum(foot, 2, point, -1);
}

// The border runs along spokes 0 and n/2, or across the middles of sides 0 and n/2.

MirroredNet::Terms MirroredNet::border_terms(const Foot& foot) const {
    const int k = class_.n_sectors;
    if (class_.kind == PatchKind::EV)
        return {{static_cast<Index>(
                     class_.ev_spoke(foot.at_end ? k : 0, foot.at_centre ? 0 : foot.b)),
                 1.0}};
    const auto curve = [&](bool end) {
        return static_cast<Index>(class_.ef_curve(end, foot.b));
    };
    if (!foot.at_centre)
        return {{curve(foot.at_end), 1.0}};
    if (class_.border == PatchBorder::Pinned)
        return {{static_cast<Index>(class_.ef_centre()), 1.0}};
    return {{curve(false), 0.5}, {curve(true), 0.5}};
}

int MirroredNet::n_parts() const noexcept {
    return class_.border == PatchBorder::Pinned ? 2 : int(class_.is_open());
}

MirroredNet::Terms MirroredNet::part_terms(int part, const Foot& foot) const {
    if (class_.border != PatchBorder::Pinned)
        return border_terms(foot);
    if (foot.at_centre)
        return part == 0 ? Terms() : border_terms(foot);
    const double sign = part == 1 ? 0.5 : foot.at_end ? -0.5 : 0.5;
    return sum(border_terms({false, false, foot.b}), sign,
               border_terms({false, true, foot.b}), part == 1 ? 0.5 : -sign);
}

MirroredNet::Foot MirroredNet::sector_foot(int sector, int a, int b) const {
    const int k = class_.n_sectors;
    if (b == 0 || (a == 0 && sector == n_ - 1))
        return {(b == 0 ? sector : 0) % k != 0, b == 0 && sector == k, a + b};
    if (a == 0)
        return {sector + 1 != k, true, b};
    if (sector == 0 || sector == n_ - 1)
        return {false, false, sector == 0 ? a : b};
    return {sector != k - 1 && sector != k, true, sector == k ? a : b};
}

MirroredNet::Foot MirroredNet::corner_foot(int corner, int p, int q) const {
    const int k = class_.n_sectors;
    if (corner == 0 || corner == n_ - 1)
        return {false, false, corner == 0 ? p : q};
    if (corner == k - 1 || corner == k)
        return {false, true, corner == k ? p : q};
    return {true, false, 0};
}

MirroredNet::Terms MirroredNet::spoke_terms(int spoke, int b) const {
    if (class_.is_open() && b > 0 && spoke > n_ / 2)
        return mirror({{0, 1.0}}, spoke_terms(n_ - spoke, b));
    return {{static_cast<Index>(class_.ev_spoke(spoke, b)), 1.0}};
}

MirroredNet::Terms MirroredNet::sector_terms(int sector, int a, int b) const {
    if (a == 0 || b == 0)
        return b == 0 ? spoke_terms(sector, a) : spoke_terms(cyclic(sector + 1), b);
    if (class_.is_open() && sector >= n_ / 2) {
        // The image of the point b steps along the first spoke of the sector beyond the border.
        return mirror(border_terms(sector_foot(sector, a, b)),
                      sector_terms(n_ - 1 - sector, b, a));
    }
    return {{static_cast<Index>(class_.ev_point(sector, a, b)), 1.0}};
}

MirroredNet::Terms MirroredNet::corner_terms(int corner, int p, int q) const {
    if (class_.is_open() && corner >= n_ / 2) {
        return mirror(border_terms(corner_foot(corner, p, q)),
                      corner_terms(n_ - 1 - corner, q, p));
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
            return mirror(border_terms({false, ribbon == 1, b}),
                          ribbon_point(ribbon, last - column, row));
        }
        if (ev && column == m)
            return border_terms({false, ribbon == 1, b});
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

MirroredNet::Terms MirroredNet::foot_point(int part, int ribbon, int column,
                                           int row) const {
    if (class_.border != PatchBorder::Pinned)
        return ribbon_point(ribbon, column, row);
    const int m = d_ - 1, b = m - row;
    if (class_.is_single())
        return part_terms(part, {false, ribbon == 1, b});
    const int before = cyclic(ribbon - 1);
    if (class_.kind == PatchKind::EV) {
        return part_terms(part, column <= m ? sector_foot(before, m - column, b)
                                            : sector_foot(ribbon, b, column - m));
    }
    return part_terms(part, column < d_ ? corner_foot(before, m - column, b)
                                        : corner_foot(ribbon, b, column - d_));
}

MirroredNet::Terms MirroredNet::curve_point(int part, int j) const {
    const int second = class_.kind == PatchKind::EV ? d_ - 1 : d_;
    if (j < d_)
        return part_terms(part, {false, false, d_ - 1 - j});
    const int b = j - second;
    if (class_.border != PatchBorder::Pinned)
        return part_terms(part, {false, true, b});
    return mirror(part_terms(part, {true, false, 0}),
                  part_terms(part, {false, false, b}));
}

}  // namespace osdx::inline OSDX_ABI
