// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/patches/patch_nets.h"

#include <algorithm>

#include "far/patches/gregory_net.h"

namespace osdx::inline OSDX_ABI::detail {

using Begin = ControlGrid::Begin;

namespace {

PatchLeaf leaf(int sector, Vec2<int> origin, int turns, int size) {
    return {kInvalidIndex,
            static_cast<Index>(sector),
            static_cast<std::int8_t>(origin.x),
            static_cast<std::int8_t>(origin.y),
            static_cast<std::uint8_t>(size),
            static_cast<std::uint8_t>(turns & 3)};
}

bool same_extent(const ControlGrid& a, int axis_a, const ControlGrid& b, int axis_b) {
    const auto n = [](const ControlGrid& g, int axis) {
        return axis == 0 ? g.n_x() : g.n_y();
    };
    return n(a, axis_a) == n(b, axis_b) &&
           a.ends_at_border(axis_a) == b.ends_at_border(axis_b);
}

}  // namespace

Index PatchLevel::regular_start(Index cell) const noexcept {
    const Topology& t = topology();
    if (odd())
        return t.face_offsets[cell];
    // From level 1 on the cell's frame starts in the face of its first corner: opposite.
    return index == 0 ? t.vertex_halfedge[cell] : t.ccw(t.ccw(frame_halfedge(cell)));
}

void PatchNets::add_vertex_patch(const IrregularFan& fan) {
    // Even degrees: from level 1 on irregular vertices have become faces.
    if (!level_.odd() && level_.index > 0)
        return;
    const bool waits = !fan.exact || (level_.options.multisided.isolate_corners &&
                                      fan.border == PatchBorder::Pinned);
    if (waits && level_.index < level_.options.multisided.crease_end_level)
        return;
    if (level_.cells[level_.cell_of(fan.start)] == Cover::Covered)
        return;
    const Topology& t = topology();
    const PatchClass c{PatchKind::EV, degree_, fan.n_faces, fan.border};
    const int n = fan.n_faces, width = degree_ - 1;
    grids_.resize(std::size_t(n));
    Index h = fan.start;
    for (int i = 0; i < n; ++i, h = t.ccw(h)) {
        ControlGrid& grid = grids_[i];
        const bool first = c.is_open() && i == 0, last = c.is_open() && i == n - 1;
        if (!grid.walk(level_.mesh, h, width, width, last ? Begin::Border : Begin::Inside,
                       first ? Begin::Border : Begin::Inside) ||
            !grid.is_regular(level_.mesh, true))
            return;
        // A border must not come closer than the patch reaches.
        if ((grid.ends_at_border(0) && 2 * grid.n_x() < width) ||
            (grid.ends_at_border(1) && 2 * grid.n_y() < width))
            return;
    }
    for (int i = c.is_open() ? 1 : 0; i < n; ++i) {
        if (!same_extent(grids_[i], 0, grids_[(i + n - 1) % n], 1))
            return;
    }
    begin(c);
    for (int i = 0; i < n; ++i) {
        for (int a = 0; a < degree_; ++a) {
            for (int b = 0; b < degree_; ++b) {
                if (!set_point(c.ev_point(i, a, b), grids_[i], a, b))
                    return drop();
            }
        }
        cover_sector(c, i);
    }
}

void PatchNets::add_face_patch(Index f) {
    const Topology& t = topology();
    const RefinedLevel& level = level_.level;
    const FaceKind kind = level.face_kind(f);
    if (kind == FaceKind::Plain && level_.mesh.is_quad(f))
        return;
    if (level_.index == 0 && t.face_size(f) == 3 && level.features.smooth_triangles)
        return;  // refinement treats them in a way of its own
    const bool exact = kind != FaceKind::Dart && kind != FaceKind::Spike;
    const bool waits =
        !exact || (level_.options.multisided.isolate_corners && kind == FaceKind::Pinned);
    if (waits && level_.index < level_.options.multisided.crease_end_level)
        return;
    PatchClass c{PatchKind::EF, degree_, 0, PatchBorder::None};
    if (kind == FaceKind::Border)
        c.border = PatchBorder::Smooth;
    else if (kind == FaceKind::Pinned || kind == FaceKind::Dart)
        c.border = PatchBorder::Pinned;
    else if (kind == FaceKind::Spike)
        c.border = PatchBorder::Spike;

    // The corners from the first that follows the border on.
    corners_.clear();
    Index centre = kInvalidIndex;
    for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
        if (!c.is_open() || level.even->point_kinds[t.vertex[h]] == PointKind::Inner)
            corners_.push_back(h);
        else if (level.even->point_kinds[t.vertex[h]] == PointKind::Pinned)
            centre = t.vertex[h];
    }
    if (c.is_open()) {
        const auto first = std::ranges::find_if(corners_, [&](Index h) {
            return level.even->point_kinds[t.vertex[t.prev(h)]] == PointKind::Curve;
        });
        std::rotate(corners_.begin(), first, corners_.end());
    }
    const int n = c.n_sectors = static_cast<int>(corners_.size());
    if ((c.border == PatchBorder::Smooth && n == 2) ||
        (c.border == PatchBorder::Pinned && n == 1 && exact))
        return;  // regular
    if (level_.cells[level_.cell_of(corners_[0])] == Cover::Covered)
        return;

    const int width = degree_ - 1, n_sides = c.is_open() ? n + 1 : n;
    grids_.resize(std::size_t(n));
    strips_.resize(std::size_t(n_sides));
    for (int i = 0; i < n_sides; ++i) {
        const Index side = i < n ? t.prev(corners_[i]) : corners_[n - 1];
        if (t.is_border(side))
            return;
        const bool first = c.is_open() && i == 0, last = i == n;
        ControlGrid& strip = strips_[i];
        if (!strip.walk(level_.mesh, t.next(t.twin[side]), width, 1, Begin::Inside,
                        first ? Begin::Border : Begin::Outer) ||
            !strip.is_regular(level_.mesh) || (last && !strip.ends_at_border(1)))
            return;
    }
    for (int i = 0; i < n; ++i) {
        if (level_.mesh.fan(corners_[i]) != Fan::Inside)
            return;
        ControlGrid& grid = grids_[i];
        if (!grid.walk(level_.mesh, t.ccw(t.ccw(corners_[i])), width, width,
                       Begin::Inside, Begin::Inside) ||
            !grid.is_regular(level_.mesh) || !same_extent(grid, 0, strips_[i], 0) ||
            !same_extent(grid, 1, strips_[(i + 1) % n_sides], 0))
            return;
    }
    begin(c);
    for (int i = 0; i < n; ++i) {
        for (int p = 0; p < degree_; ++p) {
            for (int q = 0; q < degree_; ++q) {
                if (!set_point(c.ef_point(i, p, q), grids_[i], p, q))
                    return drop();
            }
        }
        cover_sector(c, i);
    }
    for (int p = 0; p < degree_ && c.is_open(); ++p) {
        // The strips are one quad wide; the border is the row on its outer side, between the
        // rows of the grid: mirrored at its ends alone.
        for (const int end : {0, 1}) {
            if (!strips_[end * n].row_point(p, end, terms_))
                return drop();
            set_terms(c.ef_curve(end, p), terms_);
        }
    }
    terms_.clear();
    if (kind == FaceKind::Pinned) {
        terms_ = {{centre, 1.0}};
    } else if (kind == FaceKind::Spike) {
        const auto spike = std::ranges::find(level.even->junctions, f, &Junction::face);
        terms_ = {{spike->point, 1.0}};
    } else if (kind == FaceKind::Dart) {
        for (const Index h : corners_)
            terms_.emplace_back(t.vertex[h], 1.0 / n);
    }
    if (!terms_.empty())
        set_terms(c.ef_centre(), terms_);
}

bool PatchNets::add_regular_patch(Index cell) {
    const int lo = -(degree_ / 2), hi = lo + degree_;
    grids_.resize(1);
    ControlGrid& grid = grids_[0];
    if (!grid.walk_around(level_.mesh, level_.regular_start(cell), lo, hi) ||
        !grid.is_regular(level_.mesh))
        return false;
    begin({PatchKind::Regular, degree_, 4});
    int i = 0;
    for (int y = lo; y <= hi; ++y) {
        for (int x = lo; x <= hi; ++x) {
            if (!set_point(i++, grid, x, y)) {
                drop();
                return false;
            }
        }
    }
    cover(cell, kInvalidIndex, {});
    return true;
}

void PatchNets::add_gregory_patch(Index face) {
    const int n = static_cast<int>(topology().face_size(face));
    const bool normalised = n != 4 && level_.options.gregory.normalised;
    const StencilTable rows = gregory_points(
        topology(), level_.level.features, face,
        {.tangents =
             level_.options.gregory.paper_tangents ? paper_tangents : tuned_tangents,
         .centre = !normalised});
    const PatchClass c{PatchKind::Gregory, degree_, n, PatchBorder::None, normalised};
    begin(c);
    for (Index r = 0; r < rows.n_rows(); ++r) {
        terms_.clear();
        for (std::size_t k = rows.offsets[r]; k < rows.offsets[r + 1]; ++k)
            terms_.emplace_back(rows.indices[k], rows.weights[k]);
        set_terms(static_cast<int>(r), terms_);
    }
    // All of the face by one patch in its frame.
    if (level_.index > 0)
        return cover(face, level_.nodes[face], leaf(0, {0, 0}, 0, 2));
    const Index first = topology().face_offsets[face];
    for (int k = 0; k < n; ++k) {
        cover(face, first + k,
              c.is_square() ? leaf(0, 2 * square_corner<int>(k), k, 1)
                            : leaf(k, {1, 1}, 2, 1));
    }
}

void PatchNets::cover_sector(const PatchClass& c, int sector) {
    if (level_.index == 0)
        cover_quarters(c, sector);
    else
        cover_cells(c, sector);
}

/// Base level: the quarters of the faces of a sector, as far as they lie in the patch. An
/// EF's sector has the face itself and the strips beside its sides as well.
void PatchNets::cover_quarters(const PatchClass& c, int sector) {
    const Topology& t = topology();
    const ControlGrid& grid = grids_[sector];
    const bool at_face = c.kind == PatchKind::EF;
    const int extent = c.extent();
    // The quad to the upper right of grid point (a, b), from its corner at `h`.
    const auto cover_quad = [&](int a, int b, Index h, int corner) {
        for (int k = 0; k < 4; ++k, h = t.next(h), corner = (corner + 1) & 3) {
            const Vec2<int> p =
                2 * (Vec2<int>(a, b) + square_corner<int>(corner)) + int(at_face);
            const Vec2<int> q = p + turn(Vec2<int>(1, 1), corner);
            if (std::min({p.x, p.y, q.x, q.y}) < 0 ||
                std::max({p.x, p.y, q.x, q.y}) > extent)
                continue;
            cover(level_.cell_of(h), h, leaf(sector, p, corner, 1));
        }
    };
    for (int a = 0; a < grid.n_x(); ++a) {
        for (int b = 0; b < grid.n_y(); ++b)
            cover_quad(a, b, grid.halfedge(a, b), 0);
    }
    if (!at_face)
        return;
    for (int a = 0; a < grid.n_x(); ++a)
        cover_quad(a, -1, t.twin[grid.halfedge(a, 0)], 2);
    for (int b = 0; b < grid.n_y(); ++b)
        cover_quad(-1, b, t.twin[t.prev(grid.halfedge(0, b))], 1);
    cover(level_.cell_of(corners_[sector]), corners_[sector], leaf(sector, {1, 1}, 2, 1));
}

/// Later levels: whole cells, of faces (a, b) for odd and of vertices for even degrees.
void PatchNets::cover_cells(const PatchClass& c, int sector) {
    const Topology& t = topology();
    const ControlGrid& grid = grids_[sector];
    const int width = c.extent() / 2;
    for (int a = 0; a < width; ++a) {
        for (int b = 0; b < width; ++b) {
            const Index h = grid.halfedge(a, b), cell = level_.cell_of(h);
            const Vec2<int> p = 2 * Vec2<int>(a, b);
            if (level_.odd()) {
                const int turns = static_cast<int>(t.face_offsets[cell] + 4 - h) & 3;
                cover(cell, level_.nodes[cell],
                      leaf(sector, p + 2 * square_corner<int>(turns), turns, 2));
            } else {
                const Index frame = level_.frame_halfedge(cell);
                int k = 0;
                for (Index g = h; g != frame; g = t.ccw(g))
                    ++k;
                cover(cell, level_.nodes[cell],
                      leaf(sector, p + 1 + turn(Vec2<int>(1, 1), k), k + 2, 2));
            }
        }
    }
}

void PatchNets::begin(const PatchClass& c) {
    batch_.patches.push_back({c, batch_.points.size(), batch_.covered.size()});
    batch_.points.resize(batch_.points.size() + c.n_points(), kInvalidIndex);
}

/// Takes back what was begun; the rows of its mirror images stay without use.
void PatchNets::drop() {
    const PatchBatch::Patch& last = batch_.patches.back();
    batch_.points.resize(last.first_point);
    batch_.covered.resize(last.first_covered);
    batch_.patches.pop_back();
}

bool PatchNets::set_point(int i, const ControlGrid& grid, int x, int y) {
    Index& point = batch_.points[batch_.patches.back().first_point + i];
    if (point != kInvalidIndex)
        return true;
    point = grid.point(x, y);
    if (point != kInvalidIndex)
        return true;
    if (!grid.point(x, y, terms_))
        return false;
    set_terms(i, terms_);
    return true;
}

void PatchNets::set_terms(int i, const PointTerms& terms) {
    Index& point = batch_.points[batch_.patches.back().first_point + i];
    if (terms.size() == 1 && terms[0].second == 1) {
        point = terms[0].first;
        return;
    }
    point = PatchBatch::kMirrored | batch_.mirrored.n_rows();
    for (const auto& [vertex, weight] : terms)
        batch_.mirrored.add(vertex, weight);
    batch_.mirrored.end_row();
}

}  // namespace osdx::inline OSDX_ABI::detail
