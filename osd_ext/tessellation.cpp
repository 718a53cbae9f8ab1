// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "osd_ext/tessellation.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cassert>

namespace osdx {
namespace {

/// The points of a face lie on rings: ring k at k/rate from the edges, with rate - 2k
/// segments on each side; a ring without segments is the centre.
class Tessellator {
public:
    Tessellator(const Topology& base, int rate) : base_(base), rate_(rate) {}

    Tessellation build(const SurfaceFunction& surface) {
        number_shared_points();
        for (Index f = 0; f < base_.n_faces(); ++f)
            add_face(f);
        const std::size_t n = points_.size();
        out_.positions.resize(n);
        out_.normals.resize(n);
        out_.addresses.resize(n);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 256),
                          [&](const auto& range) {
                              for (std::size_t i = range.begin(); i < range.end(); ++i) {
                                  const SurfaceJet<double> jet = surface(points_[i]);
                                  out_.positions[i] = jet.p;
                                  out_.normals[i] = normal(jet);
                                  out_.addresses[i] = to_address(base_, points_[i]);
                              }
                          });
        return std::move(out_);
    }

private:
    /// A corner of a facet: a point of this face, and its number in the tessellation.
    struct Corner {
        QuarterPoint at;
        Index point;
    };

    Index add_point(const QuarterPoint& p) {
        points_.push_back(p);
        return static_cast<Index>(points_.size() - 1);
    }

    /// First vertices, then inner points of edges, from the first face of each.
    void number_shared_points() {
        vertex_point_.assign(base_.n_vertices(), kInvalidIndex);
        for (Index v = 0; v < base_.n_vertices(); ++v) {
            const Index h = base_.vertex_halfedge[v];
            if (h != kInvalidIndex)
                vertex_point_[v] = add_point({h, 0, 0});
        }
        edge_point_.resize(base_.n_edges);
        for (Index h = 0; h < base_.n_halfedges(); ++h) {
            if (h > base_.twin[h])
                continue;
            edge_point_[base_.edge[h]] = static_cast<Index>(points_.size());
            for (int j = 1; j < rate_; ++j)
                add_point(edge_point(base_, h, double(j) / rate_));
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

    Index shared_point(Index h, int j) const {
        if (j == 0)
            return vertex_point_[base_.vertex[h]];
        const bool owner = h < base_.twin[h];
        return edge_point_[base_.edge[h]] + (owner ? j - 1 : rate_ - 1 - j);
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
                ring.push_back({p, k == 0 ? shared_point(first + i, j) : add_point(p)});
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
    int rate_;
    Tessellation out_;
    std::vector<QuarterPoint> points_;
    std::vector<Index> vertex_point_;  // per vertex
    std::vector<Index> edge_point_;    // per edge: the first of its rate - 1 inner points
};

}  // namespace

Tessellation tessellate(const Topology& base, int rate, const SurfaceFunction& surface) {
    assert(rate >= 1);
    return Tessellator(base, rate).build(surface);
}

std::vector<std::array<Index, 3>> triangles(const Tessellation& t) {
    std::vector<std::array<Index, 3>> result;
    const Index* p = t.facet_points.data();
    for (const Index n : t.facet_sizes) {
        for (Index c = 2; c < n; ++c)
            result.push_back({p[0], p[c - 1], p[c]});
        p += n;
    }
    return result;
}

}  // namespace osdx
