// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/grids/grid_steps.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

#include <osdx/topology.h>

#include "far/refine/grids/point_rows.h"
#include "far/refine/smoothing.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

/// The grids of a level with their points.
template <class T, int C>
class Points {
public:
    using Value = std::remove_const_t<T>;

    Points(const QuadGrids& grids, T* points)
        : g_(grids),
          points_(points),
          edges_(points + C * std::size_t(g_.first_edge_vertex())),
          faces_(points + C * std::size_t(g_.first_face_vertex())) {}

    const QuadGrids& grids() const { return g_; }
    T* vertex(Index v) const { return points_ + C * std::size_t(v); }

    /// From the first inner point of a root edge on, in the order of the edge.
    T* inside_edge(Index edge) const {
        return edges_ + C * std::size_t(g_.n_inner()) * edge;
    }
    /// The inner points of a root, row by row.
    T* inside_face(Index root) const {
        return faces_ + C * std::size_t(g_.n_inner()) * g_.n_inner() * root;
    }
    const T* on_edge(Index halfedge, Index t) const {
        return vertex(g_.edge_vertex(halfedge, t));
    }

    /// The point on an edge next to its end.
    const T* beside_end(const EdgeEnd& e) const {
        return on_edge(e.halfedge, e.at_end ? g_.size - 1 : 1);
    }

    /// The inner points of a halfedge's edge from its start on.
    Strided<const T> along(Index halfedge) const {
        const T* inside = inside_edge(g_.roots.edge[halfedge]);
        return g_.is_first(halfedge)
                   ? Strided<const T>{inside, C}
                   : Strided<const T>{inside + C * (std::ptrdiff_t(g_.n_inner()) - 1),
                                      -C};
    }
    /// The points one row inside of a halfedge's face, but those on edges.
    Strided<const T> beside(Index halfedge) const {
        const Index root = g_.roots.face(halfedge);
        const Index side = g_.n_inner() == 1 ? 0 : halfedge - g_.roots.face_offsets[root];
        const auto row = C * std::ptrdiff_t(g_.n_inner());
        const T* inside = inside_face(root);
        switch (side) {
            case 0:
                return {inside, C};
            case 1:
                return {inside + row - C, row};
            case 2:
                return {inside + row * g_.n_inner() - C, -C};
            default:
                return {inside + row * (std::ptrdiff_t(g_.n_inner()) - 1), -row};
        }
    }
    /// The points of a halfedge's edge from its start on.
    void copy_edge(Index halfedge, Value* row) const {
        copy_row(vertex(g_.roots.vertex[halfedge]), along(halfedge),
                 vertex(g_.roots.to_vertex(halfedge)), row);
    }
    void copy_row(const T* first, Strided<const T> inside, const T* last,
                  Value* row) const {
        copy_point<C>(first, row);
        for (Index t = 1; t < g_.size; ++t)
            copy_point<C>(inside[t - 1], row + C * std::size_t(t));
        copy_point<C>(last, row + C * std::size_t(g_.size));
    }

private:
    QuadGrids g_;
    T *points_, *edges_, *faces_;
};

/// Rows of points as cubic B-spline curves after a linear subdivision: size + 1 points to the
/// 2 size - 1 finer ones between the ends.
template <class T, int C>
class Refining {
public:
    static constexpr bool kRefines = true;
    /// The weight of the rows beside; their own is 1 - 2 kAcross.
    static constexpr T kAcross = T(0.125);

    explicit Refining(Index size)
        : n_inner_(size - 1),
          middles_(C * std::size_t(size) + kRowSlack<C>),
          vertices_(C * std::size_t(size) + kRowSlack<C>) {}

    void operator()(const EndedRow<T>& row, T* out) {
        const std::size_t n = C * n_inner_;
        const T* in = row.inside;
        T* middles = middles_.data();
        mean_row(row.first, in, middles, C);
        mean_row(in, in + C, middles + C, n - C);
        mean_row(in + n - C, row.last, middles + n, C);
        three_along<C>(T(0.125), T(0.75), row, n_inner_, vertices_.data());
        interleave<C>(middles, vertices_.data(), n, out);
        copy_point<C>(middles + n, out + 2 * n);
    }
    static SmoothWeights vertex_weights(double n) {
        return {(n - 1.75) / n, 1.5 / (n * n), 0.25 / (n * n)};
    }

private:
    std::size_t n_inner_;
    std::vector<T> middles_, vertices_;
};

/// Rows of points smoothed once more: size + 1 points to the size - 1 between the ends.
template <class T, int C>
class Smoothing {
public:
    static constexpr bool kRefines = false;
    static constexpr T kAcross = T(0.25);

    explicit Smoothing(Index size) : n_inner_(size - 1) {}

    void operator()(const EndedRow<T>& row, T* out) {
        three_along<C>(T(0.25), T(0.5), row, n_inner_, out);
    }
    static SmoothWeights vertex_weights(double n) { return smooth_weights(n, false); }

private:
    std::size_t n_inner_;
};

/// Mixes smooth points inside an edge with those of a crease.
template <class T>
void mix_edge(const SharpEdge& e, const GridRules& rules, const T* crease, Index n_points,
              int n_channels, T* points) {
    for (Index t = 0; t < n_points; ++t) {
        const bool all = e.weights == SharpEdge::kAll;
        const auto w = all ? T(1) : T(rules.crease_weights[e.weights + t]);
        for (int c = 0; c < n_channels; ++c, ++crease, ++points)
            *points = all ? *crease : w * *crease + (T(1) - w) * *points;
    }
}

/// Mixes the smooth point of a vertex with those of creases and corners.
template <class T, int C>
void mix_vertex(const SharpVertex& rule, T along, const Points<const T, C>& in,
                const Points<T, C>& out) {
    const T* own = in.vertex(rule.vertex);
    const T* ends[2] = {own, own};
    for (int k = 0; k < 2 && rule.crease > 0; ++k)
        ends[k] = in.beside_end(rule.ends[k]);
    T* p = out.vertex(rule.vertex);
    for (int c = 0; c < C; ++c) {
        const T crease = (T(1) - 2 * along) * own[c] + along * (ends[0][c] + ends[1][c]);
        const T sharp = T(rule.corner) * own[c] + T(rule.crease) * crease;
        p[c] = rule.smooth > 0 ? sharp + T(rule.smooth) * p[c] : sharp;
    }
}

template <class T, int C>
void mix_vertices(const Points<const T, C>& in, const Points<T, C>& out,
                  const GridRules& rules, T along) {
    for_ranges(rules.vertices.size(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i)
            mix_vertex(rules.vertices[i], along, in, out);
    });
}

/// Those that no face uses.
template <class T, int C>
void copy_loose_vertices(const Points<const T, C>& in, const Points<T, C>& out) {
    const Topology& roots = in.grids().roots;
    for (Index v = 0; v < roots.n_vertices(); ++v) {
        if (roots.vertex_halfedge[v] == kInvalidIndex)
            copy_point<C>(in.vertex(v), out.vertex(v));
    }
}

/// A step of all points, with its room for rows. What lies inside a root depends on the root
/// alone, what lies inside an edge on two roots, and a vertex on its one-ring.
template <class T, int C, class Rows>
class Step {
public:
    Step(const Points<const T, C>& in, const Points<T, C>& out)
        : in_(in),
          out_(out),
          roots_(in.grids().roots),
          size_(in.grids().size),
          n_in_(C * (std::size_t(size_) + 1)),
          n_out_(C * std::size_t(out.grids().n_inner())),
          rows_(size_),
          in_rows_(n_in_),
          out_rows_(3 * n_out_) {}

    void face(Index f) {
        const Index h = roots_.face_offsets[f], s = size_;
        // Of the sides 1, 2, 3 as they bound rows: upwards, to the right, upwards.
        const Strided<const T> right = in_.along(h + 1),
                               top = in_.along(h + 2).reversed(s - 1),
                               left = in_.along(h + 3).reversed(s - 1);
        const T* inside = in_.inside_face(f);
        T *below = out_rows_.data(), *middle = below + n_out_, *above = middle + n_out_;
        T* row = out_.inside_face(f);
        for (Index j = 0; j <= s; ++j) {
            if (j == 0) {
                in_.copy_edge(h, in_rows_.data());
                rows_(whole_row(), above);
            } else if (j == s) {
                in_.copy_row(in_.vertex(roots_.vertex[h + 3]), top,
                             in_.vertex(roots_.vertex[h + 2]), in_rows_.data());
                rows_(whole_row(), above);
            } else {
                rows_({left[j - 1], inside, right[j - 1]}, above);
                inside += n_in_ - 2 * C;
            }
            if (j > 1) {
                three_rows(Rows::kAcross, below, 1 - 2 * Rows::kAcross, middle, above,
                           row, n_out_);
                row += n_out_;
            }
            if (Rows::kRefines && j > 0) {
                mean_row(middle, above, row, n_out_);
                row += n_out_;
            }
            std::swap(below, middle);
            std::swap(middle, above);
        }
    }

    /// \pre h is the first halfedge of its edge, and not of the border
    void edge(Index h) {
        const Index twin = roots_.twin[h], s = size_;
        const Strided<const T> own = in_.along(h), left = in_.beside(h),
                               right = in_.beside(twin).reversed(s - 1);
        T* x = in_rows_.data();
        const auto add = [&](const T* p, const T* a, const T* b) {
            for (int c = 0; c < C; ++c)
                x[c] = (1 - 2 * Rows::kAcross) * p[c] + Rows::kAcross * (a[c] + b[c]);
            x += C;
        };
        add(in_.vertex(roots_.vertex[h]), in_.on_edge(roots_.prev(h), s - 1),
            in_.on_edge(roots_.next(twin), 1));
        for (Index t = 0; t + 1 < s; ++t)
            add(own[t], left[t], right[t]);
        add(in_.vertex(roots_.vertex[twin]), in_.on_edge(roots_.next(h), 1),
            in_.on_edge(roots_.prev(twin), s - 1));
        rows_(whole_row(), out_.inside_edge(roots_.edge[h]));
    }
    void sharp_edge(const SharpEdge& e, const GridRules& rules) {
        in_.copy_edge(e.halfedge, in_rows_.data());
        rows_(whole_row(), out_rows_.data());
        mix_edge(e, rules, out_rows_.data(), out_.grids().n_inner(), C,
                 out_.inside_edge(roots_.edge[e.halfedge]));
    }

    void vertex(Index v) {
        T beside[C] = {}, diagonal[C] = {};
        int valence = 0;
        roots_.for_each_outgoing(v, [&](Index h) {
            const T* e = in_.on_edge(h, 1);
            const T* f = size_ > 1 ? in_.beside(h)[0]
                                   : in_.vertex(roots_.to_vertex(roots_.next(h)));
            for (int c = 0; c < C; ++c) {
                beside[c] += e[c];
                diagonal[c] += f[c];
            }
            ++valence;
        });
        const SmoothWeights w = Rows::vertex_weights(valence);
        const T* own = in_.vertex(v);
        for (int c = 0; c < C; ++c) {
            out_.vertex(v)[c] =
                T(w.own) * own[c] + T(w.beside) * beside[c] + T(w.diagonal) * diagonal[c];
        }
    }

private:
    EndedRow<T> whole_row() const {
        const T* row = in_rows_.data();
        return {row, row + C, row + n_in_ - C};
    }

    const Points<const T, C>& in_;
    const Points<T, C>& out_;
    const Topology& roots_;
    Index size_;
    std::size_t n_in_, n_out_;
    Rows rows_;
    std::vector<T> in_rows_, out_rows_;
};

template <class T, int C, class Rows>
void run_step(const Points<const T, C>& in, const Points<T, C>& out,
              const GridRules& rules) {
    const Topology& roots = in.grids().roots;
    const Index n_inner = out.grids().n_inner();
    // Root by root with its edges and vertices, whose inputs are in the cache then.
    for_ranges(
        roots.n_faces(), 4 + std::size_t(n_inner) * n_inner,
        [&](std::size_t begin, std::size_t end) {
            Step<T, C, Rows> step(in, out);
            for (auto f = Index(begin); f != end; ++f) {
                if (n_inner > 0)
                    step.face(f);
                for (Index h = roots.face_offsets[f]; h < roots.face_offsets[f + 1];
                     ++h) {
                    if (n_inner > 0 && in.grids().is_first(h) && !roots.is_border(h))
                        step.edge(h);
                    if (roots.vertex_halfedge[roots.vertex[h]] == h)
                        step.vertex(roots.vertex[h]);
                }
            }
        });
    copy_loose_vertices(in, out);
    for_ranges(n_inner > 0 ? rules.edges.size() : 0, n_inner,
               [&](std::size_t begin, std::size_t end) {
                   Step<T, C, Rows> step(in, out);
                   for (std::size_t i = begin; i != end; ++i)
                       step.sharp_edge(rules.edges[i], rules);
               });
    mix_vertices<T, C>(in, out, rules, Rows::kAcross);
}

/// The first step of any polygons, as by Catmull and Clark: to one point for each edge and
/// face.
template <class T, int C>
void refine_polygons(const Points<const T, C>& in, const Points<T, C>& out,
                     const GridRules& rules) {
    const Topology& t = in.grids().roots;
    for_ranges(t.n_faces(), 1, [&](std::size_t begin, std::size_t end) {
        for (auto f = Index(begin); f != end; ++f) {
            T sum[C] = {};
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
                for (int c = 0; c < C; ++c)
                    sum[c] += in.vertex(t.vertex[h])[c];
            }
            for (int c = 0; c < C; ++c)
                out.inside_face(f)[c] = sum[c] / T(t.face_size(f));
        }
    });
    for_ranges(t.n_halfedges(), 1, [&](std::size_t begin, std::size_t end) {
        for (auto h = Index(begin); h != end; ++h) {
            if (!in.grids().is_first(h) || t.is_border(h))
                continue;
            const Index e = t.edge[h];
            const auto w = T(rules.face_weights.empty() ? 0.25 : rules.face_weights[e]);
            const T *v0 = in.vertex(t.vertex[h]), *v1 = in.vertex(t.to_vertex(h)),
                    *f0 = out.inside_face(t.face(h)),
                    *f1 = out.inside_face(t.face(t.twin[h]));
            for (int c = 0; c < C; ++c) {
                out.inside_edge(e)[c] =
                    w * (f0[c] + f1[c]) + (T(0.5) - w) * (v0[c] + v1[c]);
            }
        }
    });
    // (n - 2)/n of the vertex and 1/n^2 of each neighbour and each centre of a face.
    for_ranges(t.n_vertices(), 8, [&](std::size_t begin, std::size_t end) {
        for (auto v = Index(begin); v != end; ++v) {
            T sum[C] = {};
            int n = 0;
            t.for_each_outgoing(v, [&](Index h) {
                const T *e = in.vertex(t.to_vertex(h)), *f = out.inside_face(t.face(h));
                for (int c = 0; c < C; ++c)
                    sum[c] += e[c] + f[c];
                ++n;
            });
            if (n == 0)
                continue;
            for (int c = 0; c < C; ++c) {
                out.vertex(v)[c] = T(n - 2) / T(n) * in.vertex(v)[c] + sum[c] / T(n * n);
            }
        }
    });
    copy_loose_vertices(in, out);
    for (const SharpEdge& e : rules.edges) {
        const T *v0 = in.on_edge(e.halfedge, 0), *v1 = in.on_edge(e.halfedge, 1);
        T middle[C];
        mean_row(v0, v1, middle, C);
        mix_edge(e, rules, middle, 1, C, out.inside_edge(t.edge[e.halfedge]));
    }
    mix_vertices<T, C>(in, out, rules, T(0.125));
}

}  // namespace

template <class T, int C>
void refine_grids(const QuadGrids& grids, const GridRules& rules, const T* in, T* out) {
    const Points<const T, C> coarse(grids, in);
    const Points<T, C> fine({grids.roots, 2 * grids.size}, out);
    if (grids.size == 1)
        refine_polygons(coarse, fine, rules);
    else
        run_step<T, C, Refining<T, C>>(coarse, fine, rules);
}

template <class T, int C>
void smooth_grids(const QuadGrids& grids, const GridRules& rules, const T* in, T* out) {
    run_step<T, C, Smoothing<T, C>>(Points<const T, C>(grids, in),
                                    Points<T, C>(grids, out), rules);
}

#define OSDX_INSTANTIATE(T, C)                                                          \
    template void refine_grids<T, C>(const QuadGrids&, const GridRules&, const T*, T*); \
    template void smooth_grids<T, C>(const QuadGrids&, const GridRules&, const T*, T*);
OSDX_INSTANTIATE(float, 2)
OSDX_INSTANTIATE(float, 3)
OSDX_INSTANTIATE(double, 2)
OSDX_INSTANTIATE(double, 3)
#undef OSDX_INSTANTIATE

}  // namespace osdx::inline OSDX_ABI::detail
