// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "osd_ext/tessellation.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <utility>

namespace osdx {
namespace {

/// The points of a face lie on rings: ring k at k/rate from the edges, with rate - 2k
/// segments on each side; a ring without segments is the centre.
class Tessellator {
public:
    Tessellator(const Topology& base, const Features& features, int rate)
        : base_(base), features_(features), rate_(rate) {}

    Tessellation build(const SurfaceFunction& surface) {
        number_vertices();
        number_edges();
        for (Index f = 0; f < base_.n_faces(); ++f) {
            if (!is_hole(f))
                add_face(f);
        }
        const std::size_t n = points_.size();
        out_.facet_normals = out_.facet_points;
        for (const auto& [corner, side] : side_corners_)
            out_.facet_normals[corner] = static_cast<Index>(n + side);

        out_.positions.resize(n);
        out_.addresses.resize(n);
        out_.normals.resize(n + side_points_.size());
        for_each(n, [&](std::size_t i) {
            const SurfaceJet<double> jet = surface(points_[i]);
            out_.positions[i] = jet.p;
            out_.normals[i] = normal(jet);
            out_.addresses[i] = to_address(base_, points_[i]);
        });
        for_each(side_points_.size(), [&](std::size_t i) {
            out_.normals[n + i] = normal(surface(side_points_[i]));
        });
        return std::move(out_);
    }

private:
    /// A corner of a facet: a point of this face, its number in the tessellation, and that
    /// of its normal in side_points_, where the normal is not the point's own.
    struct Corner {
        QuarterPoint at;
        Index point;
        Index side = kInvalidIndex;
    };

    template <class F>
    static void for_each(std::size_t n, F&& f) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 256),
                          [&](const auto& range) {
                              for (std::size_t i = range.begin(); i < range.end(); ++i)
                                  f(i);
                          });
    }

    bool is_hole(Index face) const {
        return !features_.hole.empty() && features_.hole[face];
    }
    bool is_sharp(Index edge) const { return features_.edge(edge) >= kInfinitelySharp; }

    Index add_point(const QuarterPoint& p) {
        points_.push_back(p);
        return static_cast<Index>(points_.size() - 1);
    }
    Index add_side_point(const QuarterPoint& p) {
        side_points_.push_back(p);
        return static_cast<Index>(side_points_.size() - 1);
    }

    void number_vertices() {
        vertex_point_.assign(base_.n_vertices(), kInvalidIndex);
        vertex_side_.assign(base_.n_halfedges(), kInvalidIndex);
        std::vector<Index> ring, fan, fan_side;
        for (Index v = 0; v < base_.n_vertices(); ++v) {
            ring.clear();
            base_.for_each_outgoing(v, [&](Index h) { ring.push_back(h); });
            if (ring.empty())
                continue;
            // Between two halfedges of the ring lies the edge of the second.
            Index last_fan = 0;
            fan.assign(ring.size(), 0);
            for (std::size_t i = 1; i < ring.size(); ++i)
                fan[i] = last_fan += is_sharp(base_.edge[ring[i]]);
            // Around an interior vertex the last fan goes on into the first.
            if (!base_.is_border(ring[0]) && !is_sharp(base_.edge[ring[0]]))
                std::ranges::replace(fan, last_fan, Index(0));

            Index own_fan = kInvalidIndex;
            fan_side.assign(last_fan + 1, kInvalidIndex);
            for (std::size_t i = 0; i < ring.size(); ++i) {
                const Index h = ring[i];
                if (is_hole(base_.face[h]))
                    continue;
                if (vertex_point_[v] == kInvalidIndex) {
                    vertex_point_[v] = add_point({h, 0, 0});
                    own_fan = fan[i];
                }
                if (fan[i] == own_fan)
                    continue;
                Index& side = fan_side[fan[i]];
                if (side == kInvalidIndex)
                    side = add_side_point({h, 0, 0});
                vertex_side_[h] = side;
            }
        }
    }

    /// Inner points of edges, from the first face of each that is no hole.
    void number_edges() {
        edge_owner_.assign(base_.n_edges, kInvalidIndex);
        edge_point_.assign(base_.n_edges, kInvalidIndex);
        edge_side_.assign(base_.n_edges, kInvalidIndex);
        for (Index h = 0; h < base_.n_halfedges(); ++h) {
            const Index e = base_.edge[h];
            if (is_hole(base_.face[h]))
                continue;
            if (edge_owner_[e] == kInvalidIndex) {
                edge_owner_[e] = h;
                edge_point_[e] = static_cast<Index>(points_.size());
                for (int j = 1; j < rate_; ++j)
                    add_point(edge_point(base_, h, double(j) / rate_));
            } else if (is_sharp(e)) {
                edge_side_[e] = static_cast<Index>(side_points_.size());
                for (int j = 1; j < rate_; ++j)
                    add_side_point(edge_point(base_, h, double(j) / rate_));
            }
        }
    }

    /// Point j of side i of ring k, 0 <= j < rate - 2k.
    QuarterPoint ring_point(Index face, int k, int i, int j) const {
        const Index h = base_.face_offsets[face] + i;
        const double depth = 2.0 * k / rate_;
        const int along = k + j;
        if (2 * along <= rate_)
            return {h, 2.0 * along / rate_, depth};
        return {base_.next(h), depth, 2.0 * (rate_ - along) / rate_};
    }

    /// The point of the edge of h at j segments from its start, as a corner of its face.
    Corner shared_corner(const QuarterPoint& at, Index h, int j) const {
        if (j == 0)
            return {at, vertex_point_[base_.vertex[h]], vertex_side_[h]};
        const Index e = base_.edge[h];
        if (edge_owner_[e] == h)
            return {at, edge_point_[e] + j - 1};
        const Index side = edge_side_[e];
        return {at, edge_point_[e] + rate_ - 1 - j,
                side == kInvalidIndex ? kInvalidIndex : side + j - 1};
    }

    std::vector<Corner> make_ring(Index face, int k) {
        const auto n = static_cast<int>(base_.face_size(face));
        const int segments = rate_ - 2 * k;
        const Index first = base_.face_offsets[face];
        if (segments == 0)
            return {{{first, 1, 1}, add_point({first, 1, 1})}};
        std::vector<Corner> ring;
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < segments; ++j) {
                const QuarterPoint p = ring_point(face, k, i, j);
                ring.push_back(k == 0 ? shared_corner(p, first + i, j)
                                      : Corner{p, add_point(p)});
            }
        }
        return ring;
    }

    /// The same point of the face in the frame of another quarter, if it lies there.
    QuarterPoint in_quarter(const QuarterPoint& p, Index quarter) const {
        if (p.x == 1 && p.y == 1)
            return {quarter, 1, 1};
        if (p.x == 1 && base_.next(p.quarter) == quarter)
            return cross_side(base_, p, 1);
        if (p.y == 1 && base_.prev(p.quarter) == quarter)
            return cross_side(base_, p, 2);
        return p;
    }

    void add_facet(Index face, Index quarter, std::initializer_list<Corner> corners) {
        out_.facet_sizes.push_back(static_cast<Index>(corners.size()));
        out_.facet_faces.push_back(face);
        for (const Corner& c : corners) {
            const Address a = to_address(base_, in_quarter(c.at, quarter));
            if (c.side != kInvalidIndex)
                side_corners_.emplace_back(out_.facet_points.size(), c.side);
            out_.facet_points.push_back(c.point);
            out_.facet_uvs.emplace_back(a.u, a.v);
        }
    }

    void add_face(Index face) {
        const auto n = static_cast<int>(base_.face_size(face));
        const Index first = base_.face_offsets[face];
        std::vector<Corner> outer = make_ring(face, 0);
        int k = 0;
        for (; rate_ - 2 * k >= 2; ++k) {
            std::vector<Corner> inner = make_ring(face, k + 1);
            const int m = rate_ - 2 * k;
            const auto out = [&](int i, int j) { return outer[((i + n) % n) * m + j]; };
            const auto in = [&](int i, int j) {
                return inner[(i * (m - 2) + j) % static_cast<int>(inner.size())];
            };
            for (int i = 0; i < n; ++i) {
                add_facet(face, first + i,
                          {out(i, 0), out(i, 1), in(i, 0), out(i - 1, m - 1)});
                for (int j = 1; j + 1 < m; ++j) {
                    const bool second_half = 2 * (k + j) + 1 > rate_;
                    const Corner last = j + 1 < m ? out(i, j + 1) : out(i + 1, 0);
                    add_facet(face, first + (i + second_half) % n,
                              {out(i, j), last, in(i, j), in(i, j - 1)});
                }
            }
            outer = std::move(inner);
        }
        if (rate_ % 2 == 0)
            return;
        // The innermost ring of an odd rate has one segment a side.
        if (n == 3) {
            add_facet(face, first, {outer[0], outer[1], outer[2]});
        } else if (n == 4) {
            add_facet(face, first, {outer[0], outer[1], outer[2], outer[3]});
        } else {
            const QuarterPoint centre{first, 1, 1};
            const Corner c{centre, add_point(centre)};
            for (int i = 0; i < n; ++i)
                add_facet(face, first + i, {outer[i], outer[(i + 1) % n], c});
        }
    }

    const Topology& base_;
    const Features& features_;
    int rate_;
    Tessellation out_;
    std::vector<QuarterPoint> points_;       // vertices, edges, then those of one face
    std::vector<QuarterPoint> side_points_;  // where the other normals are evaluated
    std::vector<std::pair<std::size_t, Index>> side_corners_;  // facet corner, side point
    std::vector<Index> vertex_point_;                          // per vertex
    std::vector<Index> vertex_side_;  // per halfedge, at its start; or kInvalidIndex
    std::vector<Index> edge_owner_;   // per edge: the halfedge along which its points run
    std::vector<Index> edge_point_;   // per edge: the first of its rate - 1 inner points
    std::vector<Index> edge_side_;  // the same in side_points_, along the other halfedge
};

}  // namespace

Tessellation tessellate(const Topology& base, const Features& features, int rate,
                        const SurfaceFunction& surface) {
    assert(rate >= 1);
    return Tessellator(base, features, rate).build(surface);
}

std::vector<std::array<Index, 3>> triangle_corners(const Tessellation& t) {
    std::vector<std::array<Index, 3>> result;
    Index first = 0;
    for (const Index n : t.facet_sizes) {
        for (Index c = 2; c < n; ++c)
            result.push_back({first, first + c - 1, first + c});
        first += n;
    }
    return result;
}

std::vector<std::array<Index, 3>> triangles(const Tessellation& t) {
    std::vector<std::array<Index, 3>> result = triangle_corners(t);
    for (std::array<Index, 3>& triangle : result) {
        for (Index& corner : triangle)
            corner = t.facet_points[corner];
    }
    return result;
}

}  // namespace osdx
