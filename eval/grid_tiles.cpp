// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/grid_tiles.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI::grid {

void Tiler::add_face(Index face, ShapeSet& shapes, std::vector<Tile>& tiles) {
    const Topology& base = table_.base();
    if (!table_.has_surface(face))
        return;
    const Index whole = table_.whole_patch(face);
    if (whole != kInvalidIndex)
        return add_tile({whole, 0, {0, 0}, 2, 0}, {0, 0}, {rate_, rate_}, rate_ + 1, 0,
                        shapes, tiles);
    const Index first = base.face_offsets[face], n = base.face_size(face);
    pieces_.clear();
    for (Index corner = 0; corner < n; ++corner)
        add_quarter(first + corner, n == 4 ? static_cast<int>(corner) : 0);
    if (n == 4) {
        const bool merge =
            pieces_.size() == 4 && std::ranges::all_of(pieces_, [&](const Piece& p) {
                return p.level == 0 && p.map == pieces_[0].map;
            });
        if (merge)
            return add_tile(pieces_[0].map, {0, 0}, {rate_, rate_}, rate_ + 1, 0, shapes,
                            tiles);
    }
    const Index per_quarter = Index(rate_ / 2 + 1) * (rate_ / 2 + 1);
    for (const Piece& p : pieces_) {
        const int corner = static_cast<int>(p.quarter - first);
        // Samples of the quarter by their numbers from its corner on.
        Vec2<int> lo(first_index(p.x, p.level), first_index(p.y, p.level));
        Vec2<int> hi(last_index(p.x, p.level), last_index(p.y, p.level));
        if (n != 4) {
            add_tile(p.map, lo, hi, rate_ / 2 + 1, corner * per_quarter, shapes, tiles);
            continue;
        }
        // The middle lines of a quad belong to the lower side.
        if (2 * hi.x == rate_ && corner >= 2)
            --hi.x;
        if (2 * hi.y == rate_ && (corner == 1 || corner == 2))
            --hi.y;
        const Vec2<int> at = rate_ * square_corner<int>(corner);
        const Vec2<int> a = at + turn(lo, corner), b = at + turn(hi, corner);
        if (lo.x <= hi.x && lo.y <= hi.y)
            add_tile(p.map, glm::min(a, b), glm::max(a, b), rate_ + 1, 0, shapes, tiles);
    }
}

/// \param corner  of the quad that the quarter is at, or 0
void Tiler::add_quarter(Index quarter, int corner) {
    cells_.clear();
    table_.add_cells(quarter, cells_);
    const std::size_t begin = pieces_.size();
    for (const Cell& cell : cells_) {
        const double size = std::abs(cell.x_axis.x + cell.x_axis.y);
        const int level = -std::ilogb(size);
        const auto axis_turns = cell.x_axis.x > 0   ? 0
                                : cell.x_axis.y > 0 ? 1
                                : cell.x_axis.x < 0 ? 2
                                                    : 3;
        const Vec2<double> lo =
            glm::min(cell.origin, cell.origin + cell.x_axis + turn(cell.x_axis, 1));
        // All of these are integers.
        const double scale = std::ldexp(1.0, level);
        const int step = cell.chart_size << (level + 1);
        const int turns = cell.chart_turns - axis_turns;
        const Vec2<int> origin =
            cell.chart_origin -
            turn(Vec2<int>(scale * double(cell.chart_size) * cell.origin), turns) -
            step * turn(square_corner<int>(corner), turns - corner);
        pieces_.push_back(
            {quarter,
             level,
             static_cast<int>(scale * lo.x),
             static_cast<int>(scale * lo.y),
             {cell.patch, cell.sector, origin, step, (turns - corner) & 3}});
        while (merge_last(begin)) {
        }
    }
}

bool Tiler::merge_last(std::size_t begin) {
    if (pieces_.size() < begin + 4)
        return false;
    const Piece* p = pieces_.data() + pieces_.size() - 4;
    for (int k = 1; k < 4; ++k) {
        if (p[k].level != p[0].level || p[k].x >> 1 != p[0].x >> 1 ||
            p[k].y >> 1 != p[0].y >> 1 || !(p[k].map == p[0].map))
            return false;
    }
    if (p[0].level == 0)
        return false;
    const Piece merged{p[0].quarter, p[0].level - 1, p[0].x >> 1, p[0].y >> 1, p[0].map};
    pieces_.resize(pieces_.size() - 4);
    pieces_.push_back(merged);
    return true;
}

void Tiler::add_tile(const Map& map, Vec2<int> lo, Vec2<int> hi, int pitch, Index first,
                     ShapeSet& shapes, std::vector<Tile>& tiles) {
    if (lo.x > hi.x || lo.y > hi.y)
        return;
    using Long = Vec2<std::int64_t>;
    const PatchRef patch = table_.patch(map.patch);
    const Index patch_class = patch.patch_class;
    const PatchClass& c = table_.classes()[patch_class];
    const Index shape =
        shapes.add({patch_class, c.is_open() ? map.sector : 0,
                    std::int64_t(rate_) * Long(map.origin) +
                        std::int64_t(map.step) * Long(turn(lo, map.turns)),
                    map.step, map.turns, hi.x - lo.x + 1, hi.y - lo.y + 1, pitch});
    tiles.push_back({shape, map.patch, map.sector,
                     first + static_cast<Index>(lo.y * pitch + lo.x),
                     patch.points.data()});
}

}  // namespace osdx::inline OSDX_ABI::grid
