// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <osdx/patch_table.h>
#include <osdx/types.h>

/// How GridEvaluator cuts the samples of faces into tiles that share tables of weights.
namespace osdx::inline OSDX_ABI::grid {

/// What decides the weights of a rectangle of samples: their places in the chart of a class.
/// Lengths are integers: in half-edges of the control mesh, divided by the rate.
struct Shape {
    Index patch_class;
    Index sector;  // 0 in closed patches, which are turned
    Vec2<std::int64_t> origin;
    std::int64_t step;   // from one sample to the next
    std::int32_t turns;  // from (u, v) to the chart
    std::int32_t nx, ny;
    std::int32_t pitch;  // from one row of samples to the next

    bool operator==(const Shape&) const = default;
};

struct HashShape {
    std::size_t operator()(const Shape& s) const noexcept {
        std::uint64_t h = 0;
        for (const std::uint64_t x :
             {std::uint64_t(s.patch_class), std::uint64_t(s.sector),
              std::uint64_t(s.origin.x), std::uint64_t(s.origin.y), std::uint64_t(s.step),
              std::uint64_t(s.turns), std::uint64_t(s.nx), std::uint64_t(s.ny),
              std::uint64_t(s.pitch)}) {
            h = (h ^ x) * 0x9e3779b97f4a7c15u;
            h ^= h >> 29;
        }
        return h;
    }
};

/// Samples of a unit that share a table, or are evaluated one by one.
struct Tile {
    Index shape;
    Index patch;
    Index sector;
    Index first_sample;   // in the unit, then in the block
    const Index* points;  // of the patch
};

/// Numbers different shapes in the order of their coming.
class ShapeSet {
public:
    Index add(const Shape& shape) {
        if (!shapes_.empty() && shapes_[last_] == shape)
            return last_;
        const auto [it, is_new] =
            index_.try_emplace(shape, static_cast<Index>(shapes_.size()));
        if (is_new)
            shapes_.push_back(shape);
        return last_ = it->second;
    }
    const std::vector<Shape>& shapes() const noexcept { return shapes_; }

private:
    std::unordered_map<Shape, Index, HashShape> index_;
    std::vector<Shape> shapes_;
    Index last_ = 0;
};

/// Cuts the samples of faces into tiles.
class Tiler {
public:
    Tiler(const PatchTable& table, int rate) : table_(table), rate_(rate) {}

    void add_face(Index face, ShapeSet& shapes, std::vector<Tile>& tiles);

private:
    /// Where a point lies in the chart of a patch, in half-edges:
    /// origin + step turn(w, turns), for w = (u, v) in a quad, half of a QuarterPoint in others.
    struct Map {
        Index patch, sector;
        Vec2<int> origin;
        int step, turns;
        bool operator==(const Map&) const = default;
    };
    /// A square of a quarter: [x, x + 1] x [y, y + 1] over 2^level.
    struct Piece {
        Index quarter;
        int level, x, y;
        Map map;
    };

    int first_index(int x, int level) const {
        return x == 0 ? 0
                      : static_cast<int>((std::int64_t(x) * rate_) >> (level + 1)) + 1;
    }
    int last_index(int x, int level) const {
        return static_cast<int>((std::int64_t(x + 1) * rate_) >> (level + 1));
    }

    /// \param corner  of the quad that the quarter is at, or 0
    void add_quarter(Index quarter, int corner);

    /// Four squares that are one square of one map become that.
    bool merge_last(std::size_t begin);

    void add_tile(const Map& map, Vec2<int> lo, Vec2<int> hi, int pitch, Index first,
                  ShapeSet& shapes, std::vector<Tile>& tiles);

    const PatchTable& table_;
    int rate_;
    std::vector<Cell> cells_;
    std::vector<Piece> pieces_;
};

}  // namespace osdx::inline OSDX_ABI::grid
