// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <span>
#include <utility>
#include <vector>

#include <osdx/address.h>
#include <osdx/patch_table.h>
#include <osdx/patch_table_view.h>
#include <osdx/topology.h>
#include <osdx/types.h>

#include "far/mesh/address_counts.h"
#include "far/mesh/quadrant.h"

namespace osdx::inline OSDX_ABI::detail {

/// Puts elements in the order of keys; those of a key stay in their order.
/// \param each  calls what it is given with each element, the same twice
/// \param key  of an element, below ends.size()
/// \param ends  becomes where those of each key end in `sorted`
template <class T, class Each, class Key>
void counting_sort(Each&& each, Key&& key, std::span<Index> ends, T* sorted) {
    std::ranges::fill(ends, Index(0));
    each([&](const T& x) { ++ends[key(x)]; });
    Index sum = 0;
    for (Index& e : ends)
        sum += std::exchange(e, sum);
    each([&](const T& x) { sorted[ends[key(x)]++] = x; });
}

/// PatchTable::locate() for many points of a face: sends them down its quadtrees together, so that
/// those of a leaf come out at once.
class LeafRuns {
public:
    /// \param most  points at a time
    /// \pre the table outlives this
    LeafRuns(const PatchTable& table, std::size_t most)
        : table_(table),
          view_(table.view()),
          from_(most),
          to_(most),
          a_(most),
          b_(most),
          numbers_(most) {}

    std::size_t most() const { return from_.size(); }

    /// Starts with a face, of any number: what is added, if anything is, lies in its surface.
    void start(Index face) {
        n_ = 0;
        if (face >= table_.base().n_faces())
            return;
        face_ = face;
        first_ = table_.base().face_offsets[face];
        size_ = table_.base().face_size(face);
    }
    /// Adds a point of the face, of a number that comes back.
    /// \return whether it was clamped
    /// \pre less than most() are there; no NaN
    bool add(const Address& at, Index number) {
        assert(n_ < most());
        Point& p = from_[n_++];
        p.number = number;
        if (size_ == 4) {
            p.at = {std::clamp(at.u, 0.0, 1.0), std::clamp(at.v, 0.0, 1.0)};
            return p.at != Vec2<double>(at.u, at.v) && was_clamped(table_.base(), at, {});
        }
        const QuarterPoint q = to_quarter(table_.base(), at);
        p.at = {q.x, q.y};
        p.corner = q.quarter - first_;
        return was_clamped(table_.base(), at, q);
    }

    struct Run {
        PatchPlaces places;
        std::span<const Index> numbers;
    };

    /// Those of each leaf that has points, as locate() with its default direction finds them.
    /// Valid until the next start().
    std::span<const Run> runs() {
        runs_.clear();
        n_placed_ = 0;
        if (n_ == 0)
            return runs_;
        if (const Index patch = table_.whole_patch(face_); patch != kInvalidIndex) {
            for (const Point& p : std::span(from_).first(n_))
                place(p.at, p.number);
            add_run({patch, 0, 0, 1, {}, {}}, n_);
            return runs_;
        }
        const bool quad = size_ == 4;
        if (quad) {
            for (Point& p : std::span(from_).first(n_))
                p.step({-1, -1});
        }
        ends_.resize(size_);
        sort(from_.data(), to_.data(), n_, ends_);
        for (Index c = 0, begin = 0; c < size_; begin = ends_[c++]) {
            if (ends_[c] > begin)
                descend(view_.nodes[first_ + c], {{-1, -1}, quad ? -int(c) : 0, 2},
                        to_.data() + begin, from_.data() + begin, ends_[c] - begin);
        }
        return runs_;
    }

private:
    struct Point {
        Vec2<double> at;
        Index number, corner;

        void step(Vec2<double> towards) {
            const Quadrant q(at, towards);
            corner = static_cast<Index>(q.corner());
            at = q.point(at);
        }
    };
    /// A square of a quarter: its frame.
    struct Square {
        Vec2<double> towards;
        int turns;
        double scale;
    };

    /// By corners.
    static void sort(const Point* from, Point* to, std::size_t n, std::span<Index> ends) {
        counting_sort(
            [&](auto&& f) {
                for (std::size_t i = 0; i < n; ++i)
                    f(from[i]);
            },
            [](const Point& p) { return p.corner; }, ends, to);
    }

    /// \param points, other  n apiece; what is in them is lost
    void descend(Index node, Square s, Point* points, Point* other, std::size_t n) {
        while (!(node & PatchTableView::kLeafBit)) {
            for (std::size_t i = 0; i < n; ++i)
                points[i].step(s.towards);
            const auto child = [&](Index corner) -> Square {
                return {Quadrant(int(corner)).direction(s.towards), s.turns - int(corner),
                        2 * s.scale};
            };
            if (n == 1) {
                const Index corner = points->corner;
                s = child(corner);
                node = view_.nodes[node + corner];
                continue;
            }
            std::array<Index, 4> ends;
            sort(points, other, n, ends);
            for (Index c = 0, begin = 0; c < 4; begin = ends[c++]) {
                if (ends[c] > begin)
                    descend(view_.nodes[node + c], child(c), other + begin,
                            points + begin, ends[c] - begin);
            }
            return;
        }
        const PatchLeaf leaf = view_.leaf(node);
        const int extent = table_.class_of(leaf.patch).extent();
        const double size = leaf.size;
        const auto x_axis = turn(Vec2<double>(1, 0), leaf.turns),
                   y_axis = turn(Vec2<double>(0, 1), leaf.turns);
        for (const Point& point : std::span(points, n)) {
            const Vec2<double> p = point.at.x * x_axis + point.at.y * y_axis;
            place(Vec2<double>((leaf.x + size * p.x) / extent,
                               (leaf.y + size * p.y) / extent),
                  point.number);
        }
        add_run({leaf.patch,
                 leaf.sector,
                 (s.turns + leaf.turns) & 3,
                 s.scale * size / extent,
                 {},
                 {}},
                n);
    }

    void place(Vec2<double> at, Index number) {
        a_[n_placed_] = at.x;
        b_[n_placed_] = at.y;
        numbers_[n_placed_++] = number;
    }
    /// Of the last n that were placed.
    void add_run(PatchPlaces places, std::size_t n) {
        const std::size_t first = n_placed_ - n;
        places.a = std::span(a_).subspan(first, n);
        places.b = std::span(b_).subspan(first, n);
        runs_.push_back({places, std::span(numbers_).subspan(first, n)});
    }

    const PatchTable& table_;
    PatchTableView view_;
    Index face_ = 0, first_ = 0, size_ = 0;
    std::size_t n_ = 0;
    std::vector<Point> from_, to_;
    std::vector<Index> ends_;
    // One leaf after the other.
    std::size_t n_placed_ = 0;
    std::vector<double> a_, b_;
    std::vector<Index> numbers_;
    std::vector<Run> runs_;
};

}  // namespace osdx::inline OSDX_ABI::detail
