// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/grids/even_grids.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include <osdx/buffer.h>

#include "far/refine/even.h"
#include "far/refine/grids/point_rows.h"

namespace osdx::inline OSDX_ABI {

bool EvenGrids::takes(const Features& f) {
    return std::ranges::none_of(f.edge_sharpness, is_semi_sharp) &&
           std::ranges::none_of(f.vertex_sharpness, is_semi_sharp);
}

EvenGrids::EvenGrids(Topology base, int degree, int n_levels, const Features& features)
    : degree_(degree),
      n_levels_(n_levels),
      boundary_(features.boundary),
      creases_(features.creases),
      n_base_points_(base.n_vertices()) {
    assert(degree % 2 == 0 && degree >= kMinDegree && degree <= kMaxDegree);
    assert(n_levels >= 1 && takes(features));
    size_ = Index(1) << (n_levels - 1);
    const ResolvedFeatures with = resolve(base, features);
    RefinedLevel cut = detail::even_base(std::move(base), with);
    base_ = std::move(cut.topology);
    base_vertices_ = std::move(cut.even->base_vertices);
    kinds_ = std::move(cut.even->point_kinds);

    border_number_.assign(base_.n_halfedges(), kInvalidIndex);
    for (Index h = 0; h < base_.n_halfedges(); ++h) {
        if (base_.is_border(h)) {
            border_number_[h] = n_borders();
            borders_.push_back(h);
        }
    }
    border_before_.resize(borders_.size());
    for (Index b = 0; b < n_borders(); ++b)
        border_before_[border_out(base_.to_vertex(borders_[b]))] = b;
    pinned_number_.assign(base_.n_vertices(), kInvalidIndex);
    for (Index v = 0; v < base_.n_vertices(); ++v) {
        if (kinds_[v] == PointKind::Pinned) {
            pinned_number_[v] = static_cast<Index>(pinned_.size());
            pinned_.push_back(v);
        }
        n_polygons_ += is_used(v);
    }
    n_polygons_ += base_.n_faces() + base_.n_edges;
    n_polygon_corners_ = 2 * base_.n_halfedges() + 4 * base_.n_edges + 2 * n_borders() +
                         static_cast<Index>(pinned_.size());
}

Features EvenGrids::features() const {
    Features f;
    f.boundary = boundary_;
    f.creases = creases_;
    return f;
}

// ------------------------------------------------------------------------------- faces

void EvenGrids::faces(std::span<Index> sizes, std::span<Index> vertices) const {
    assert(sizes.size() == n_faces() && vertices.size() == n_halfedges());
    const Topology& t = base_;
    const Index s = size_, m = s - 1, n = t.n_halfedges();
    std::ranges::fill(sizes.first(n_quads()), 4);
    const auto quad = [&](Index face, Index a, Index b, Index c, Index d) {
        Index* out = vertices.data() + std::size_t(4) * face;
        out[0] = a;
        out[1] = b;
        out[2] = c;
        out[3] = d;
    };
    const auto curve = [&](Index halfedge, bool second_half) {
        return first_curve(s) + (2 * border_number_[halfedge] + second_half) * s;
    };
    const Index first_spoke = m * m * n, first_half = first_spoke + m * n,
                first_border = first_half + m * n;
    detail::for_ranges(n, std::size_t(s) * s, [&](std::size_t begin, std::size_t end) {
        for (auto h = Index(begin); h != end; ++h) {
            for (Index j = 0; j < m; ++j) {
                const Index first = cell(h, 0, j), face = m * (m * h + j);
                for (Index i = 0; i < m; ++i)
                    quad(face + i, first + i, first + i + 1, first + s + i + 1,
                         first + s + i);
            }
            const Index next = t.next(h);
            for (Index k = 0; k < m; ++k) {
                quad(first_spoke + m * h + k, cell(h, m, k), cell(next, k, m),
                     cell(next, k + 1, m), cell(h, m, k + 1));
            }
            // Beyond the side y = 0: a column of the quarter there, or a curve.
            const bool border = t.is_border(h);
            const Index below = border ? curve(h, false) : cell(t.next(t.twin[h]), 0, 0);
            const Index step = border ? 1 : s;
            for (Index k = 0; k < m; ++k) {
                quad(first_half + m * h + k, below + step * k, below + step * (k + 1),
                     cell(h, k + 1, 0), cell(h, k, 0));
            }
            for (Index k = 0; k < m && border; ++k) {
                const Index beside = curve(h, true) + k;
                quad(first_border + m * border_number_[h] + k, beside, cell(next, 0, k),
                     cell(next, 0, k + 1), beside + 1);
            }
        }
    });

    std::size_t face = n_quads(), corner = 4 * std::size_t(n_quads()), first = corner;
    const auto add = [&](Index v) { vertices[corner++] = v; };
    const auto end_face = [&] {
        sizes[face++] = static_cast<Index>(corner - first);
        first = corner;
    };
    for (Index f = 0; f < t.n_faces(); ++f) {
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
            add(cell(h, m, m));
        end_face();
    }
    std::vector<Index> halfedge(t.n_edges);
    for (Index h = n; h-- > 0;)
        halfedge[t.edge[h]] = h;
    for (const Index h : halfedge) {
        const Index twin = t.twin[h];
        add(t.is_border(h) ? curve(h, false) + m : cell(t.next(twin), 0, m));
        add(t.is_border(h) ? curve(h, true) + m : cell(twin, m, 0));
        add(cell(t.next(h), 0, m));
        add(cell(h, m, 0));
        end_face();
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (!is_used(v))
            continue;
        const bool border = t.is_border(t.vertex_halfedge[v]);
        if (border)
            add(curve(t.vertex_halfedge[v], false));
        t.for_each_outgoing(v, [&](Index h) { add(cell(h, 0, 0)); });
        if (border)
            add(curve(borders_[border_in(v)], true));
        if (pinned_number_[v] != kInvalidIndex)
            add(first_curve(s) + 2 * s * n_borders() + pinned_number_[v]);
        end_face();
    }
    assert(face == n_faces() && corner == n_halfedges());
}

// ------------------------------------------------------------------------------ points

/// The points of a level, without those that are pinned.
template <class T, int C>
class EvenGrids::Level {
public:
    Level(const EvenGrids& r, Index cells_per_side, T* points)
        : size(cells_per_side),
          cells_(points),
          curves_(points + C * std::size_t(r.first_curve(size))) {}

    T* cells(Index quarter) const {
        return cells_ + C * std::size_t(size) * size * quarter;
    }
    T* cell(Index quarter, Index i, Index j) const {
        return cells(quarter) + C * (std::size_t(size) * j + i);
    }
    /// Half an edge of a border, from the vertex on.
    T* curve(Index border, bool second) const {
        return curves_ + C * std::size_t(size) * (2 * border + second);
    }

    const Index size;

private:
    T *cells_, *curves_;
};

/// A step from a level to the next, or a further smoothing. Every row of points is continued
/// at both ends by what lies there: beyond a curve by mirror images, beyond an extraordinary
/// vertex of the roots by the point that makes the centroid of four that of the polygon. Then
/// all rules are those of the uniform B-spline.
template <class T, int C, bool kRefines>
class EvenGrids::Step {
public:
    /// \param base  the points of base()
    Step(const EvenGrids& r, const T* base, const Level<const T, C>& in,
         const Level<T, C>& out)
        : r_(r), t_(r.base_), base_(base), in_(in), out_(out) {}

    void run() {
        vertex_centres_.resize(C * std::size_t(t_.n_vertices()));
        face_centres_.resize(C * std::size_t(t_.n_faces()));
        detail::for_ranges(t_.n_vertices(), 8, [&](std::size_t begin, std::size_t end) {
            for (auto v = Index(begin); v != end; ++v)
                find_vertex_centre(v);
        });
        detail::for_ranges(t_.n_faces(), 8, [&](std::size_t begin, std::size_t end) {
            for (auto f = Index(begin); f != end; ++f)
                find_face_centre(f);
        });
        detail::for_ranges(t_.n_halfedges(), std::size_t(out_.size) * out_.size,
                           [&](std::size_t begin, std::size_t end) {
                               Room room(in_.size, out_.size);
                               for (auto h = Index(begin); h != end; ++h)
                                   quarter(h, room);
                           });
        detail::for_ranges(r_.n_borders(), out_.size,
                           [&](std::size_t begin, std::size_t end) {
                               Room room(in_.size, out_.size);
                               for (auto b = Index(begin); b != end; ++b) {
                                   curve(b, false, room);
                                   curve(b, true, room);
                               }
                           });
    }

private:
    struct Room {
        Room(Index in_size, Index out_size)
            : n_in(C * std::size_t(in_size)),
              n_out(C * std::size_t(out_size)),
              row(n_in + 2 * C),
              left(n_in),
              right(n_in),
              odd(n_in + detail::kRowSlack<C>),
              even(n_in + detail::kRowSlack<C>),
              rows(3 * n_out) {}
        detail::EndedRow<T> whole_row() const {
            return {row.data(), row.data() + C, row.data() + C + n_in};
        }

        std::size_t n_in, n_out;
        std::vector<T> row;          // with a point more at each end
        std::vector<T> left, right;  // beyond the ends of all rows
        std::vector<T> odd, even, rows;
    };

    static void mirror(const T* p, const T* centre, T* out) {
        for (int c = 0; c < C; ++c)
            out[c] = 2 * centre[c] - p[c];
    }

    void find_vertex_centre(Index v) {
        if (!r_.is_used(v))
            return;
        T* centre = vertex_centres_.data() + C * std::size_t(v);
        switch (r_.kinds_[v]) {
            case PointKind::Pinned:
            case PointKind::Spike:
                detail::copy_point<C>(base_ + C * std::size_t(v), centre);
                break;
            case PointKind::Curve: {
                const T *a = in_.curve(r_.border_out(v), false),
                        *b = in_.curve(r_.border_in(v), true);
                for (int c = 0; c < C; ++c)
                    centre[c] = T(0.5) * (a[c] + b[c]);
                break;
            }
            case PointKind::Inner:
            case PointKind::Dart: {
                int n = 0;
                T sum[C] = {};
                t_.for_each_outgoing(v, [&](Index h) {
                    for (int c = 0; c < C; ++c)
                        sum[c] += in_.cell(h, 0, 0)[c];
                    ++n;
                });
                for (int c = 0; c < C; ++c)
                    centre[c] = sum[c] / T(n);
            }
        }
    }

    void find_face_centre(Index f) {
        const Index last = in_.size - 1;
        T sum[C] = {};
        for (Index h = t_.face_offsets[f]; h < t_.face_offsets[f + 1]; ++h) {
            for (int c = 0; c < C; ++c)
                sum[c] += in_.cell(h, last, last)[c];
        }
        for (int c = 0; c < C; ++c)
            face_centres_[C * std::size_t(f) + c] = sum[c] / T(t_.face_size(f));
    }

    /// From size points inside a row.
    void refine_row(const detail::EndedRow<T>& row, Room& room, T* out) const {
        if (!kRefines) {
            detail::three_along<C>(T(0.25), T(0.5), row, in_.size, out);
            return;
        }
        const T* in = row.inside;
        T *even = room.even.data(), *odd = room.odd.data();
        const std::size_t last = room.n_in - C;
        detail::nearer_row(in, row.first, even, C);
        detail::nearer_row(in + C, in, even + C, last);
        detail::nearer_row(in, in + C, odd, last);
        detail::nearer_row(in + last, row.last, odd + last, C);
        detail::interleave<C>(even, odd, room.n_in, out);
    }

    /// The rows below and above a quarter, and the points beyond its other sides.
    void quarter(Index h, Room& room) const {
        const Index s = in_.size, last = s - 1;
        const Index next = t_.next(h), prev = t_.prev(h);
        const T* own = in_.cells(h);
        const auto at = [&](std::vector<T>& row, Index i) {
            return row.data() + C * std::size_t(i);
        };
        const std::ptrdiff_t column = C * std::ptrdiff_t(s);
        std::copy_n(in_.cell(next, 0, last), room.n_in, room.right.data());
        if (t_.is_border(prev)) {
            const T* curve = in_.curve(r_.border_number_[prev], true);
            for (Index j = 0; j < s; ++j)
                mirror(own + column * j, curve + C * std::size_t(j), at(room.left, j));
        } else {
            std::copy_n(in_.cells(t_.twin[prev]), room.n_in, room.left.data());
        }

        T *below = room.rows.data(), *middle = below + room.n_out,
          *above = middle + room.n_out;
        T* out = out_.cells(h);
        for (Index j = 0; j < s + 2; ++j) {
            if (j == 0) {
                row_below(h, room);
                refine_row(room.whole_row(), room, above);
            } else if (j <= s) {
                refine_row(
                    {at(room.left, j - 1), own + column * (j - 1), at(room.right, j - 1)},
                    room, above);
            } else {
                row_above(h, prev, room);
                refine_row(room.whole_row(), room, above);
            }
            // Two rows between this and the last, nearer to each, but none outside.
            const auto add = [&](const T* nearer, const T* farther) {
                detail::nearer_row(nearer, farther, out, room.n_out);
                out += room.n_out;
            };
            if (kRefines && j > 1)
                add(middle, above);
            if (kRefines && j > 0 && j <= s)
                add(above, middle);
            if (!kRefines && j > 1) {
                detail::three_rows(T(0.25), below, T(0.5), middle, above, out,
                                   room.n_out);
                out += room.n_out;
            }
            std::swap(below, middle);
            std::swap(middle, above);
        }
    }

    void row_below(Index h, Room& room) const {
        const Index s = in_.size, last = s - 1, next = t_.next(h);
        T* row = room.row.data();
        T* end = row + C + room.n_in;
        if (t_.is_border(h)) {
            const Index b = r_.border_number_[h];
            const T *curve = in_.curve(b, false), *own = in_.cells(h);
            for (Index i = 0; i < s; ++i)
                mirror(own + C * std::size_t(i), curve + C * std::size_t(i),
                       row + C * (std::size_t(i) + 1));
            mirror(in_.cell(next, 0, last), in_.curve(b, true) + C * std::size_t(last),
                   end);
        } else {
            const T* beyond = in_.cells(t_.next(t_.twin[h]));
            for (Index i = 0; i < s; ++i)
                detail::copy_point<C>(beyond + C * std::size_t(s) * i,
                                      row + C * (std::size_t(i) + 1));
            detail::copy_point<C>(in_.cell(t_.twin[h], last, 0), end);
        }
        complete(vertex_centres_.data() + C * std::size_t(t_.vertex[h]), in_.cells(h),
                 room.left.data(), row + C, row);
    }

    void row_above(Index h, Index prev, Room& room) const {
        const Index s = in_.size, last = s - 1;
        T* row = room.row.data();
        for (Index i = 0; i < s; ++i)
            detail::copy_point<C>(in_.cell(prev, last, i),
                                  row + C * (std::size_t(i) + 1));
        if (t_.is_border(prev)) {
            mirror(row + C,
                   in_.curve(r_.border_number_[prev], false) + C * std::size_t(last),
                   row);
        } else {
            detail::copy_point<C>(in_.cell(t_.next(t_.twin[prev]), 0, last), row);
        }
        complete(face_centres_.data() + C * std::size_t(t_.face(h)),
                 in_.cell(h, last, last), room.right.data() + room.n_in - C,
                 row + room.n_in, row + C + room.n_in);
    }

    /// The fourth point that has a centre with three others.
    static void complete(const T* centre, const T* a, const T* b, const T* c, T* out) {
        for (int k = 0; k < C; ++k)
            out[k] = 4 * centre[k] - a[k] - b[k] - c[k];
    }

    void curve(Index b, bool second, Room& room) const {
        const Index h = r_.borders_[b];
        const Index v = second ? t_.to_vertex(h) : t_.vertex[h];
        const T* points = in_.curve(b, second);
        T* row = room.row.data();
        mirror(points, vertex_centres_.data() + C * std::size_t(v), row);
        std::copy_n(points, room.n_in, row + C);
        detail::copy_point<C>(in_.curve(b, !second) + room.n_in - C, row + C + room.n_in);
        refine_row(room.whole_row(), room, out_.curve(b, second));
    }

    const EvenGrids& r_;
    const Topology& t_;
    const T* base_;
    const Level<const T, C>& in_;
    const Level<T, C>& out_;
    std::vector<T> vertex_centres_, face_centres_;
};

template <class V>
void EvenGrids::points(std::span<const V> base, std::span<V> out) const {
    using T = typename V::value_type;
    constexpr int C = V::length();
    static_assert(sizeof(V) == C * sizeof(T));
    assert(base.size() == n_base_points_ && out.size() == n_vertices());
    if (out.empty())
        return;
    const Topology& t = base_;
    std::vector<V> cut;
    for (const Index v : base_vertices_)
        cut.push_back(base[v]);

    // Passes write in turns to `out` and to another array, to `out` at last.
    const int n_smoothings = (degree_ - 2) / 2;
    int passes_left = n_levels_ * (1 + n_smoothings);
    const auto n_points = [&](Index size) {
        return std::size_t(first_curve(size)) + 2 * size * n_borders();
    };
    Buffer<T> other(C * n_points(n_smoothings > 0 ? size_ : size_ / 2));
    const auto target = [&] {
        return --passes_left % 2 == 0 ? &out.data()->x : other.data();
    };

    // To level 1: each corner to the middle of itself, its face and two edges.
    T* to = target();
    const T* from = &cut.data()->x;
    const Level<T, C> first(*this, 1, to);
    detail::for_ranges(t.n_faces(), 4, [&](std::size_t begin, std::size_t end) {
        for (auto f = Index(begin); f != end; ++f) {
            V sum(T(0));
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
                sum += cut[t.vertex[h]];
            sum *= T(0.25) / T(t.face_size(f));
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
                const V p = sum + T(0.5) * cut[t.vertex[h]] +
                            T(0.125) * (cut[t.to_vertex(h)] + cut[t.vertex[t.prev(h)]]);
                detail::copy_point<C>(&p.x, first.cells(h));
            }
        }
    });
    for (Index b = 0; b < n_borders(); ++b) {
        const V &start = cut[t.vertex[borders_[b]]], &end = cut[t.to_vertex(borders_[b])];
        const V near_start = T(0.75) * start + T(0.25) * end,
                near_end = T(0.25) * start + T(0.75) * end;
        detail::copy_point<C>(&near_start.x, first.curve(b, false));
        detail::copy_point<C>(&near_end.x, first.curve(b, true));
    }

    Index size = 1;
    const T* base_points = from;
    from = to;
    for (int l = 1; l <= n_levels_; ++l) {
        if (l > 1) {
            to = target();
            const Level<const T, C> coarse(*this, size, from);
            const Level<T, C> fine(*this, 2 * size, to);
            Step<T, C, true>(*this, base_points, coarse, fine).run();
            size *= 2;
            from = to;
        }
        for (int i = 0; i < n_smoothings; ++i) {
            to = target();
            const Level<const T, C> before(*this, size, from);
            const Level<T, C> after(*this, size, to);
            Step<T, C, false>(*this, base_points, before, after).run();
            from = to;
        }
    }
    for (std::size_t p = 0; p < pinned_.size(); ++p)
        out[n_points(size_) + p] = cut[pinned_[p]];
}

template void EvenGrids::points(std::span<const Vec2<float>>,
                                std::span<Vec2<float>>) const;
template void EvenGrids::points(std::span<const Vec3<float>>,
                                std::span<Vec3<float>>) const;
template void EvenGrids::points(std::span<const Vec2<double>>,
                                std::span<Vec2<double>>) const;
template void EvenGrids::points(std::span<const Vec3<double>>,
                                std::span<Vec3<double>>) const;

}  // namespace osdx::inline OSDX_ABI
