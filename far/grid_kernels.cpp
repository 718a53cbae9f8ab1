// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/grid_kernels.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

#include "far/refine_step.h"

namespace osdx::detail {
namespace {

/// Calls f(range) for parts of 0 .. n, each of `work` points an item.
template <class F>
void for_ranges(std::size_t n, std::size_t work, F&& f) {
    constexpr std::size_t kPointsInTask = 1 << 14;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(
                          0, n, std::max<std::size_t>(1, kPointsInTask / work)),
                      f);
}

/// out = (a + b)/2
template <class T>
void mean_row(const T* __restrict a, const T* __restrict b, T* __restrict out,
              std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = T(0.5) * (a[i] + b[i]);
}

/// out = b_weight b + side_weight (a + c)
template <class T>
void three_rows(T side_weight, const T* __restrict a, T b_weight, const T* __restrict b,
                const T* __restrict c, T* __restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = b_weight * b[i] + side_weight * (a[i] + c[i]);
}

/// Points that lie a constant step apart.
template <class T>
struct Strided {
    const T* first;
    std::ptrdiff_t step;
    const T* operator[](Index i) const { return first + std::ptrdiff_t(i) * step; }
};

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
        const Index root = g_.roots.face[halfedge];
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
    /// The same, and the points on the edges at both ends. \pre size > 1
    void copy_beside(Index halfedge, Value* row) const {
        copy_point(on_edge(g_.roots.prev(halfedge), g_.size - 1), row);
        copy_inner(beside(halfedge), row);
        copy_point(on_edge(g_.roots.next(halfedge), 1), row + C * std::size_t(g_.size));
    }
    void copy_edge(Index halfedge, Value* row) const {
        copy_point(vertex(g_.roots.vertex[halfedge]), row);
        copy_inner(along(halfedge), row);
        copy_point(vertex(g_.roots.to_vertex(halfedge)), row + C * std::size_t(g_.size));
    }
    /// Points (0, j) .. (size, j) of a root. \pre size > 1
    void copy_row(Index root, Index j, Value* row) const {
        const Index h = g_.roots.face_offsets[root];
        const Index s = g_.size, m = g_.n_inner();
        if (j == 0)
            return copy_edge(h, row);
        if (j == s) {
            copy_point(vertex(g_.roots.vertex[h + 3]), row);
            const Strided<const T> back = along(h + 2);
            copy_inner({back[m - 1], -back.step}, row);
            copy_point(vertex(g_.roots.vertex[h + 2]), row + C * std::size_t(s));
            return;
        }
        copy_point(on_edge(h + 3, s - j), row);
        std::memcpy(row + C, inside_face(root) + C * std::size_t(m) * (j - 1),
                    C * m * sizeof(T));
        copy_point(on_edge(h + 1, j), row + C * std::size_t(s));
    }

private:
    static void copy_point(const T* from, Value* to) { std::copy_n(from, C, to); }
    void copy_inner(Strided<const T> from, Value* row) const {
        for (Index t = 1; t < g_.size; ++t)
            copy_point(from[t - 1], row + C * std::size_t(t));
    }

    QuadGrids g_;
    T *points_, *edges_, *faces_;
};

// A row of points is refined as a cubic B-spline curve, without the points at its ends.
template <class T, int C>
class RowRefiner {
public:
    explicit RowRefiner(Index size)
        : size_(size),
          middles_(C * std::size_t(size) + kSlack),
          vertices_(C * std::size_t(size) + kSlack) {}

    /// From size + 1 points to 2 size - 1. `out` has room for kSlack more values.
    void operator()(const T* in, T* out) {
        const std::size_t n = C * std::size_t(size_);
        mean_row(in, in + C, middles_.data(), n);
        three_rows(T(0.25), middles_.data(), T(0.5), in + C, middles_.data() + C,
                   vertices_.data(), n - C);
        const T *m = middles_.data(), *v = vertices_.data();
        // Whole vectors: what is too much is written over by the next point.
        for (std::size_t i = 0; i < n - C; i += C, out += 2 * C) {
            std::memcpy(out, m + i, kCopied * sizeof(T));
            std::memcpy(out + C, v + i, kCopied * sizeof(T));
        }
        std::memcpy(out, m + n - C, kCopied * sizeof(T));
    }

    static constexpr int kCopied = C == 3 ? 4 : C;
    static constexpr std::size_t kSlack = kCopied - C;

private:
    Index size_;
    std::vector<T> middles_, vertices_;
};

/// The inner points of twice as fine grids, which depend on nothing else.
template <class T, int C>
void refine_faces(const Points<const T, C>& in, const Points<T, C>& out) {
    const Topology& roots = in.grids().roots;
    const Index s = in.grids().size;
    if (s == 1) {
        for_ranges(roots.n_faces(), 1, [&](const auto& range) {
            for (auto f = Index(range.begin()); f != range.end(); ++f) {
                T sum[C] = {};
                for (Index h = roots.face_offsets[f]; h < roots.face_offsets[f + 1];
                     ++h) {
                    for (int c = 0; c < C; ++c)
                        sum[c] += in.vertex(roots.vertex[h])[c];
                }
                for (int c = 0; c < C; ++c)
                    out.inside_face(f)[c] = sum[c] * (T(1) / T(roots.face_size(f)));
            }
        });
        return;
    }
    for_ranges(roots.n_faces(), 4 * std::size_t(s) * s, [&](const auto& range) {
        const std::size_t n = C * (2 * std::size_t(s) - 1);
        const std::size_t stride = n + RowRefiner<T, C>::kSlack;
        std::vector<T> coarse(C * (std::size_t(s) + 1)), refined(3 * stride);
        RowRefiner<T, C> refine(s);
        for (auto f = Index(range.begin()); f != range.end(); ++f) {
            T *below = refined.data(), *middle = below + stride, *above = middle + stride;
            T* row = out.inside_face(f);
            for (Index j = 0; j <= s; ++j) {
                in.copy_row(f, j, coarse.data());
                refine(coarse.data(), above);
                if (j > 1) {
                    three_rows(T(0.125), below, T(0.75), middle, above, row, n);
                    row += n;
                }
                if (j > 0) {
                    mean_row(middle, above, row, n);
                    row += n;
                }
                std::swap(below, middle);
                std::swap(middle, above);
            }
        }
    });
}

/// Mixes smooth points with those of a crease.
template <class T, int C>
void mix_edge(const SharpEdge& e, const GridRules& rules, const T* crease, Index n,
              T* points) {
    if (e.weights == SharpEdge::kAll) {
        std::copy_n(crease, C * std::size_t(n), points);
        return;
    }
    for (Index t = 0; t < n; ++t) {
        const auto w = T(rules.crease_weights[e.weights + t]);
        for (std::size_t i = C * std::size_t(t); i < C * (std::size_t(t) + 1); ++i)
            points[i] = w * crease[i] + (T(1) - w) * points[i];
    }
}

/// The finer points inside edges. Across an edge, with p the refined points of its own row
/// and a, b the finer rows beside it: (h_-1 + 6 h_0 + h_1)/8 = p/2 + (a + b)/4.
template <class T, int C>
void refine_edges(const Points<const T, C>& in, const Points<T, C>& out,
                  const GridRules& rules) {
    const Topology& roots = in.grids().roots;
    const Index s = in.grids().size, n = 2 * s - 1;
    const std::size_t room = C * std::size_t(n) + RowRefiner<T, C>::kSlack;
    for_ranges(roots.n_halfedges(), s, [&](const auto& range) {
        std::vector<T> coarse(C * (std::size_t(s) + 1)), own(room);
        RowRefiner<T, C> refine(s);
        for (auto h = Index(range.begin()); h != range.end(); ++h) {
            if (!in.grids().is_first(h) || roots.is_border(h))
                continue;
            in.copy_edge(h, coarse.data());
            refine(coarse.data(), own.data());
            const Index edge = roots.edge[h];
            const auto side =
                T(rules.face_weights.empty() ? 0.25 : rules.face_weights[edge]);
            const T middle = T(1) - 2 * side;
            const Strided<const T> a = out.beside(h), b = out.beside(roots.twin[h]);
            T* to = out.inside_edge(edge);
            for (Index t = 0; t < n; ++t) {
                const T *p = own.data() + C * std::size_t(t), *left = a[t],
                        *right = b[n - 1 - t];
                for (int c = 0; c < C; ++c)
                    to[C * std::size_t(t) + c] =
                        middle * p[c] + side * (left[c] + right[c]);
            }
        }
    });
    for_ranges(rules.edges.size(), s, [&](const auto& range) {
        std::vector<T> coarse(C * (std::size_t(s) + 1)), own(room);
        RowRefiner<T, C> refine(s);
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            const SharpEdge& e = rules.edges[i];
            in.copy_edge(e.halfedge, coarse.data());
            refine(coarse.data(), own.data());
            mix_edge<T, C>(e, rules, own.data(), n,
                           out.inside_edge(roots.edge[e.halfedge]));
        }
    });
}

/// The points of vertices whose rule is a mixture; smooth ones are in place.
/// \param along  weight of the crease's neighbours
template <class T, int C>
void mix_vertices(const Points<const T, C>& in, const Points<T, C>& out,
                  const GridRules& rules, T along) {
    const QuadGrids& g = in.grids();
    for_ranges(rules.vertices.size(), 8, [&](const auto& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            const SharpVertex& r = rules.vertices[i];
            const T* own = in.vertex(r.vertex);
            const T* ends[2] = {own, own};
            for (int k = 0; k < 2 && r.crease > 0; ++k)
                ends[k] =
                    in.on_edge(r.ends[k].halfedge, r.ends[k].at_end ? g.size - 1 : 1);
            T* to = out.vertex(r.vertex);
            for (int c = 0; c < C; ++c) {
                const T crease =
                    (T(1) - 2 * along) * own[c] + along * (ends[0][c] + ends[1][c]);
                T p = T(r.corner) * own[c] + T(r.crease) * crease;
                if (r.smooth > 0)
                    p += T(r.smooth) * to[c];
                to[c] = p;
            }
        }
    });
}

/// The points of vertices, as by Catmull and Clark: (n - 2)/n v + (sum of neighbours along
/// edges and of new face points)/n^2.
template <class T, int C>
void refine_vertices(const Points<const T, C>& in, const Points<T, C>& out,
                     const GridRules& rules) {
    const Topology& roots = in.grids().roots;
    for_ranges(roots.n_vertices(), 8, [&](const auto& range) {
        for (auto v = Index(range.begin()); v != range.end(); ++v) {
            T sum[C] = {};
            int valence = 0;
            roots.for_each_outgoing(v, [&](Index h) {
                const T *e = in.on_edge(h, 1), *f = out.beside(h)[0];
                for (int c = 0; c < C; ++c)
                    sum[c] += e[c] + f[c];
                ++valence;
            });
            const T* own = in.vertex(v);
            if (valence == 0) {
                std::copy_n(own, C, out.vertex(v));
                continue;
            }
            const T n = T(valence), weight = T(1) / (n * n), own_weight = (n - 2) / n;
            for (int c = 0; c < C; ++c)
                out.vertex(v)[c] = own_weight * own[c] + weight * sum[c];
        }
    });
    mix_vertices<T, C>(in, out, rules, T(0.125));
}

/// (a + 2 b + c)/4 along a row of size + 1 points, without its ends.
template <class T, int C>
void smooth_row(const T* in, Index size, T* out) {
    three_rows(T(0.25), in, T(0.5), in + C, in + 2 * C, out, C * (std::size_t(size) - 1));
}

template <class T, int C>
void smooth_faces(const Points<const T, C>& in, const Points<T, C>& out) {
    const Index s = in.grids().size;
    if (s == 1)
        return;
    for_ranges(in.grids().roots.n_faces(), std::size_t(s) * s, [&](const auto& range) {
        const std::size_t n = C * (std::size_t(s) - 1);
        std::vector<T> row(C * (std::size_t(s) + 1)), smooth(3 * n);
        for (auto f = Index(range.begin()); f != range.end(); ++f) {
            T *below = smooth.data(), *middle = below + n, *above = middle + n;
            for (Index j = 0; j <= s; ++j) {
                in.copy_row(f, j, row.data());
                smooth_row<T, C>(row.data(), s, above);
                if (j > 1) {
                    three_rows(T(0.25), below, T(0.5), middle, above,
                               out.inside_face(f) + n * (j - 2), n);
                }
                std::swap(below, middle);
                std::swap(middle, above);
            }
        }
    });
}

template <class T, int C>
void smooth_edges(const Points<const T, C>& in, const Points<T, C>& out,
                  const GridRules& rules) {
    const Topology& roots = in.grids().roots;
    const Index s = in.grids().size;
    if (s == 1)
        return;
    const std::size_t n = C * (std::size_t(s) + 1);
    for_ranges(roots.n_halfedges(), s, [&](const auto& range) {
        std::vector<T> left(n), own(n), right(n), turned(n);
        for (auto h = Index(range.begin()); h != range.end(); ++h) {
            if (!in.grids().is_first(h) || roots.is_border(h))
                continue;
            in.copy_beside(h, left.data());
            in.copy_edge(h, own.data());
            in.copy_beside(roots.twin[h], turned.data());
            for (std::size_t i = 0; i < n; i += C)
                std::copy_n(turned.data() + i, C, right.data() + n - C - i);
            three_rows(T(0.25), left.data(), T(0.5), own.data(), right.data(),
                       turned.data(), n);
            smooth_row<T, C>(turned.data(), s, out.inside_edge(roots.edge[h]));
        }
    });
    for_ranges(rules.edges.size(), s, [&](const auto& range) {
        std::vector<T> own(n), crease(n);
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            const SharpEdge& e = rules.edges[i];
            in.copy_edge(e.halfedge, own.data());
            smooth_row<T, C>(own.data(), s, crease.data());
            mix_edge<T, C>(e, rules, crease.data(), s - 1,
                           out.inside_edge(roots.edge[e.halfedge]));
        }
    });
}

template <class T, int C>
void smooth_vertices(const Points<const T, C>& in, const Points<T, C>& out,
                     const GridRules& rules) {
    const QuadGrids& g = in.grids();
    for_ranges(g.roots.n_vertices(), 8, [&](const auto& range) {
        for (auto v = Index(range.begin()); v != range.end(); ++v) {
            T beside[C] = {}, diagonal[C] = {};
            int valence = 0;
            g.roots.for_each_outgoing(v, [&](Index h) {
                const T* e = in.on_edge(h, 1);
                const T* f = g.size > 1 ? in.beside(h)[0]
                                        : in.vertex(g.roots.to_vertex(g.roots.next(h)));
                for (int c = 0; c < C; ++c) {
                    beside[c] += e[c];
                    diagonal[c] += f[c];
                }
                ++valence;
            });
            const T* own = in.vertex(v);
            if (valence == 0) {
                std::copy_n(own, C, out.vertex(v));
                continue;
            }
            const SmoothWeights w = smooth_weights(valence, false);
            for (int c = 0; c < C; ++c)
                out.vertex(v)[c] = T(w.own) * own[c] + T(w.beside) * beside[c] +
                                   T(w.diagonal) * diagonal[c];
        }
    });
    mix_vertices<T, C>(in, out, rules, T(0.25));
}

}  // namespace

template <class T, int C>
void refine_grids(const QuadGrids& grids, const GridRules& rules, const T* in, T* out) {
    const Points<const T, C> coarse(grids, in);
    const Points<T, C> fine({grids.roots, 2 * grids.size}, out);
    refine_faces<T, C>(coarse, fine);
    refine_edges<T, C>(coarse, fine, rules);
    refine_vertices<T, C>(coarse, fine, rules);
}

template <class T, int C>
void smooth_grids(const QuadGrids& grids, const GridRules& rules, const T* in, T* out) {
    const Points<const T, C> before(grids, in);
    const Points<T, C> after(grids, out);
    smooth_faces<T, C>(before, after);
    smooth_edges<T, C>(before, after, rules);
    smooth_vertices<T, C>(before, after, rules);
}

#define OSDX_INSTANTIATE(T, C)                                                          \
    template void refine_grids<T, C>(const QuadGrids&, const GridRules&, const T*, T*); \
    template void smooth_grids<T, C>(const QuadGrids&, const GridRules&, const T*, T*);
OSDX_INSTANTIATE(float, 2)
OSDX_INSTANTIATE(float, 3)
OSDX_INSTANTIATE(float, 4)
OSDX_INSTANTIATE(double, 2)
OSDX_INSTANTIATE(double, 3)
OSDX_INSTANTIATE(double, 4)
#undef OSDX_INSTANTIATE

}  // namespace osdx::detail
