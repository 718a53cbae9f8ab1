// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <memory>
#include <numeric>
#include <utility>

#include <osdx/evaluator.h>
#include <osdx/grid_evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// The facets of a face of n corners at a rate, and its points by local numbers.
///
/// The points lie on rings: ring k at k/rate from the edges, with rate - 2k segments on each
/// side; a ring without segments is the centre. Point j of side i of ring 0 has the number
/// i rate + j; those of the other rings follow.
struct Pattern {
    std::vector<QuarterPoint> points;  ///< quarter: the corner
    std::vector<Address> addresses;    ///< of the points, in a face 0
    std::vector<Index> samples;  ///< of GridEvaluator at the points, or kInvalidIndex
    std::vector<Index> facet_sizes;
    std::vector<Index> corners;     ///< of facets: points
    std::vector<Vec2<double>> uvs;  ///< of these

    Pattern(Index n, int rate) : n_(static_cast<int>(n)), rate_(rate) {
        // A mesh of this face alone, whose halfedges are its corners.
        base_.face_offsets = {0, n};
        base_.faces.assign(n, 0);
        std::vector<Index> outer = add_ring(0);
        int k = 0;
        for (; rate - 2 * k >= 2; ++k) {
            std::vector<Index> inner = add_ring(k + 1);
            const int m = rate - 2 * k;
            const auto out = [&](int i, int j) { return outer[((i + n_) % n_) * m + j]; };
            const auto in = [&](int i, int j) {
                return inner[(i * (m - 2) + j) % static_cast<int>(inner.size())];
            };
            for (int i = 0; i < n_; ++i) {
                add_facet(i, {out(i, 0), out(i, 1), in(i, 0), out(i - 1, m - 1)});
                for (int j = 1; j + 1 < m; ++j) {
                    const bool second_half = 2 * (k + j) + 1 > rate;
                    add_facet((i + second_half) % n_,
                              {out(i, j), out(i, j + 1), in(i, j), in(i, j - 1)});
                }
                // The last facet of a side is the first of the next.
            }
            outer = std::move(inner);
        }
        if (rate % 2 == 0)
            return;
        // The innermost ring of an odd rate has one segment a side.
        if (n == 3) {
            add_facet(0, {outer[0], outer[1], outer[2]});
        } else if (n == 4) {
            add_facet(0, {outer[0], outer[1], outer[2], outer[3]});
        } else {
            const Index centre = add_centre();
            samples.back() = kInvalidIndex;  // between the samples
            for (int i = 0; i < n_; ++i)
                add_facet(i, {outer[i], outer[(i + 1) % n_], centre});
        }
    }

    Index n_outer() const { return static_cast<Index>(n_ * rate_); }
    Index n_inner() const { return static_cast<Index>(points.size()) - n_outer(); }

private:
    /// The point x/rate and y/rate along the edges from a corner.
    Index add_point(int corner, int x, int y) {
        const QuarterPoint p{static_cast<Index>(corner), 2.0 * x / rate_,
                             2.0 * y / rate_};
        points.push_back(p);
        addresses.push_back(to_address(base_, p));
        if (n_ == 4) {
            const auto at =
                rate_ * square_corner<int>(corner) + turn(Vec2<int>(x, y), corner);
            samples.push_back(static_cast<Index>(at.y * (rate_ + 1) + at.x));
        } else {
            const int row = rate_ / 2 + 1;
            samples.push_back(static_cast<Index>((corner * row + y) * row + x));
        }
        return static_cast<Index>(points.size() - 1);
    }

    Index add_centre() {
        const Index centre = add_point(0, rate_ / 2, rate_ / 2);
        points[centre].x = points[centre].y = 1;
        addresses[centre] = to_address(base_, points[centre]);
        return centre;
    }

    std::vector<Index> add_ring(int k) {
        const int segments = rate_ - 2 * k;
        if (segments == 0)
            return {add_centre()};
        std::vector<Index> ring;
        for (int i = 0; i < n_; ++i) {
            for (int j = 0; j < segments; ++j) {
                const int along = k + j;
                ring.push_back(2 * along <= rate_
                                   ? add_point(i, along, k)
                                   : add_point((i + 1) % n_, k, rate_ - along));
            }
        }
        return ring;
    }

    /// The same point in the frame of another quarter, if it lies there.
    QuarterPoint in_quarter(const QuarterPoint& p, Index quarter) const {
        if (p.x == 1 && p.y == 1)
            return {quarter, 1, 1};
        if (p.x == 1 && base_.next(p.quarter) == quarter)
            return cross_side(base_, p, 1);
        if (p.y == 1 && base_.prev(p.quarter) == quarter)
            return cross_side(base_, p, 2);
        return p;
    }

    void add_facet(int quarter, std::initializer_list<Index> facet) {
        facet_sizes.push_back(static_cast<Index>(facet.size()));
        for (const Index p : facet) {
            const Address a =
                to_address(base_, in_quarter(points[p], static_cast<Index>(quarter)));
            corners.push_back(p);
            uvs.emplace_back(a.u, a.v);
        }
    }

    int n_, rate_;
    Topology base_;
};

class Tessellator {
public:
    Tessellator(const Topology& base, const ResolvedFeatures& features, int rate)
        : base_(base), features_(features), rate_(rate) {
        number_vertices();
        number_edges();
        number_faces();
        const Face& end = faces_.back();
        out_.positions.resize(n_points_);
        out_.addresses.resize(n_points_);
        out_.normals.resize(n_points_ + n_sides_);
        out_.facet_sizes.resize(end.facet);
        out_.facet_faces.resize(end.facet);
        out_.facet_points.resize(end.corner);
        out_.facet_normals.resize(end.corner);
        out_.facet_uvs.resize(end.corner);
    }

    Tessellation build(const SurfaceFunction& surface) {
        for_each_face([&](Index face) {
            if (is_hole(face))
                return;
            add_facets(face);
            const Pattern& pattern = pattern_of(face);
            const Index first = base_.face_offsets[face];
            add_points(face, [&](Index local) {
                QuarterPoint p = pattern.points[local];
                p.quarter += first;
                return surface(p);
            });
        });
        return std::move(out_);
    }

    Tessellation build(const Evaluator& evaluator, std::span<const Vec3<double>> points) {
        const GridEvaluator<double> grid(
            evaluator, rate_, {.native_at_borders = true, .min_table_uses = 2});
        grid.for_each_block(points, [&](const SampleBlock<double>& block) {
            const auto at = [&](int r, std::size_t sample) {
                const double* v = block.values[r] + 3 * sample;
                return Vec3<double>(v[0], v[1], v[2]);
            };
            for (Index face = block.first_unit; face < block.first_unit + block.n_units;
                 ++face) {
                if (is_hole(face))
                    continue;
                add_facets(face);
                const Pattern& pattern = pattern_of(face);
                const std::size_t first = grid.first_sample(face) - block.first_sample;
                add_points(face, [&](Index local) -> SurfaceJet<double> {
                    const Index sample = pattern.samples[local];
                    if (sample != kInvalidIndex)
                        return {at(0, first + sample), at(1, first + sample),
                                at(2, first + sample)};
                    QuarterPoint p = pattern.points[local];
                    p.quarter += base_.face_offsets[face];
                    return evaluator.evaluate<double, 1>(points, p, Chart::Native);
                });
            }
        });
        return std::move(out_);
    }

private:
    template <class F>
    void for_each_face(F&& f) const {
        detail::for_each_range(base_.n_faces(), 64, [&](Index begin, Index end) {
            for (Index i = begin; i < end; ++i)
                f(i);
        });
    }

    bool is_hole(Index face) const { return features_.is_hole(face); }
    bool is_sharp(Index edge) const { return is_infinitely_sharp(features_.edge(edge)); }
    const Pattern& pattern_of(Index face) const {
        return *patterns_[base_.face_size(face)];
    }

    void number_vertices() {
        const Index n = base_.n_vertices();
        vertex_owner_.assign(n, kInvalidIndex);
        vertex_point_.assign(n, kInvalidIndex);
        vertex_side_.assign(base_.n_halfedges(), kInvalidIndex);
        std::vector<std::uint8_t> has_sharp(n, 0);
        detail::for_each_range(n, 1024, [&](Index begin, Index end) {
            for (Index v = begin; v < end; ++v) {
                base_.for_each_outgoing(v, [&](Index h) {
                    if (vertex_owner_[v] == kInvalidIndex && !is_hole(base_.face(h)))
                        vertex_owner_[v] = h;
                    has_sharp[v] |= is_sharp(base_.edge[h]);
                });
            }
        });
        for (Index v = 0; v < n; ++v) {
            if (vertex_owner_[v] == kInvalidIndex)
                continue;
            vertex_point_[v] = n_points_++;
            if (has_sharp[v])
                add_vertex_sides(v);
        }
        n_sides_ = static_cast<Index>(side_owner_.size());
    }

    void add_vertex_sides(Index v) {
        std::vector<Index> ring;
        base_.for_each_outgoing(v, [&](Index h) { ring.push_back(h); });
        // Between two halfedges of the ring lies the edge of the second.
        Index last_fan = 0, own_fan = 0;
        std::vector<Index> fan(ring.size(), 0);
        for (std::size_t i = 1; i < ring.size(); ++i)
            fan[i] = last_fan += is_sharp(base_.edge[ring[i]]);
        // Around an interior vertex the last fan goes on into the first.
        if (!base_.is_border(ring[0]) && !is_sharp(base_.edge[ring[0]]))
            std::ranges::replace(fan, last_fan, Index(0));
        std::vector<Index> fan_side(last_fan + 1, kInvalidIndex);
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const Index h = ring[i];
            if (h == vertex_owner_[v])
                own_fan = fan[i];
        }
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const Index h = ring[i];
            if (is_hole(base_.face(h)) || fan[i] == own_fan)
                continue;
            Index& side = fan_side[fan[i]];
            if (side == kInvalidIndex) {
                side = static_cast<Index>(side_owner_.size());
                side_owner_.push_back(h);
            }
            vertex_side_[h] = side;
        }
    }

    /// Inner points of edges, from the first face of each that is no hole.
    void number_edges() {
        edge_owner_.assign(base_.n_edges, kInvalidIndex);
        edge_point_.assign(base_.n_edges, kInvalidIndex);
        edge_side_.assign(base_.n_edges, kInvalidIndex);
        for (Index h = 0; h < base_.n_halfedges(); ++h) {
            const Index e = base_.edge[h];
            if (is_hole(base_.face(h)))
                continue;
            if (edge_owner_[e] == kInvalidIndex) {
                edge_owner_[e] = h;
                edge_point_[e] = n_points_;
                n_points_ += static_cast<Index>(rate_ - 1);
            } else if (is_sharp(e)) {
                edge_side_[e] = n_sides_;
                n_sides_ += static_cast<Index>(rate_ - 1);
            }
        }
    }

    void number_faces() {
        faces_.reserve(base_.n_faces() + 1);
        Face next{n_points_, 0, 0};
        for (Index f = 0; f < base_.n_faces(); ++f) {
            faces_.push_back(next);
            if (is_hole(f))
                continue;
            const Index n = base_.face_size(f);
            if (patterns_.size() <= n)
                patterns_.resize(n + 1);
            if (!patterns_[n])
                patterns_[n] = std::make_unique<const Pattern>(n, rate_);
            next.point += patterns_[n]->n_inner();
            next.facet += patterns_[n]->facet_sizes.size();
            next.corner += patterns_[n]->corners.size();
        }
        faces_.push_back(next);
        n_points_ = next.point;
    }

    /// Calls f(local point, number of the point, number of its normal) for the points on the
    /// edges of a face.
    template <class F>
    void for_each_outer(Index face, F&& f) const {
        Index local = 0;
        for (Index h = base_.face_offsets[face]; h < base_.face_offsets[face + 1]; ++h) {
            const Index v = base_.vertex[h], e = base_.edge[h];
            const auto normal_of = [&](Index point, Index side) {
                return side == kInvalidIndex ? point : n_points_ + side;
            };
            f(local++, vertex_point_[v], normal_of(vertex_point_[v], vertex_side_[h]));
            const Index first = edge_point_[e];
            for (Index j = 1; j < static_cast<Index>(rate_); ++j) {
                if (edge_owner_[e] == h) {
                    f(local++, first + j - 1, first + j - 1);
                    continue;
                }
                const Index point = first + static_cast<Index>(rate_) - 1 - j;
                f(local++, point,
                  edge_side_[e] == kInvalidIndex ? point
                                                 : n_points_ + edge_side_[e] + j - 1);
            }
        }
    }

    void add_facets(Index face) {
        const Pattern& pattern = pattern_of(face);
        const Face& at = faces_[face];
        std::ranges::copy(pattern.facet_sizes, out_.facet_sizes.begin() + at.facet);
        std::fill_n(out_.facet_faces.begin() + at.facet, pattern.facet_sizes.size(),
                    face);
        std::ranges::copy(pattern.uvs, out_.facet_uvs.begin() + at.corner);
        std::vector<Index>& points = point_numbers_.local();
        std::vector<Index>& normals = normal_numbers_.local();
        points.resize(pattern.points.size());
        normals.resize(pattern.points.size());
        for_each_outer(face, [&](Index local, Index point, Index normal) {
            points[local] = point;
            normals[local] = normal;
        });
        std::iota(points.begin() + pattern.n_outer(), points.end(), at.point);
        std::iota(normals.begin() + pattern.n_outer(), normals.end(), at.point);
        Index* out_points = out_.facet_points.data() + at.corner;
        Index* out_normals = out_.facet_normals.data() + at.corner;
        for (const Index c : pattern.corners) {
            *out_points++ = points[c];
            *out_normals++ = normals[c];
        }
    }

    /// The points and normals that are this face's to make.
    /// \param surface  surface(local point) gives the jet there
    template <class F>
    void add_points(Index face, F&& surface) {
        const Pattern& pattern = pattern_of(face);
        const auto add_point = [&](Index local, Index point) {
            const SurfaceJet<double> jet = surface(local);
            out_.positions[point] = jet.p;
            out_.normals[point] = unit_normal(jet.du, jet.dv);
            out_.addresses[point] = {face, pattern.addresses[local].u,
                                     pattern.addresses[local].v};
        };
        const auto add_normal = [&](Index local, Index side) {
            const SurfaceJet<double> jet = surface(local);
            out_.normals[n_points_ + side] = unit_normal(jet.du, jet.dv);
        };
        Index local = 0;
        for (Index h = base_.face_offsets[face]; h < base_.face_offsets[face + 1];
             ++h, local += static_cast<Index>(rate_)) {
            const Index v = base_.vertex[h], e = base_.edge[h], side = vertex_side_[h];
            if (vertex_owner_[v] == h)
                add_point(local, vertex_point_[v]);
            else if (side != kInvalidIndex && side_owner_[side] == h)
                add_normal(local, side);
            for (Index j = 1; j < static_cast<Index>(rate_); ++j) {
                if (edge_owner_[e] == h)
                    add_point(local + j, edge_point_[e] + j - 1);
                else if (edge_side_[e] != kInvalidIndex)
                    add_normal(local + j, edge_side_[e] + j - 1);
            }
        }
        for (Index i = 0; i < pattern.n_inner(); ++i)
            add_point(local + i, faces_[face].point + i);
    }

    const Topology& base_;
    const ResolvedFeatures& features_;
    int rate_;
    Tessellation out_;
    std::vector<std::unique_ptr<const Pattern>> patterns_;  // by the number of corners
    /// Points: vertices, edges, then those inside of each face. Sides, where there are other
    /// normals at a point: vertices, then edges.
    Index n_points_ = 0, n_sides_ = 0;
    std::vector<Index> vertex_point_, vertex_owner_;  // per vertex; a halfedge there
    std::vector<Index> vertex_side_;  // per halfedge, at its start; or kInvalidIndex
    std::vector<Index> side_owner_;   // per side of a vertex: a halfedge there
    std::vector<Index> edge_owner_;   // per edge: the halfedge along which its points run
    std::vector<Index> edge_point_;   // per edge: the first of its rate - 1 inner points
    std::vector<Index> edge_side_;    // its sides, along the other halfedge
    struct Face {
        Index point;  // the first of those inside
        std::size_t facet, corner;
    };
    std::vector<Face> faces_;
    detail::PerThread<std::vector<Index>> point_numbers_, normal_numbers_;
};

}  // namespace

Tessellation tessellate(const Topology& base, const ResolvedFeatures& features, int rate,
                        const SurfaceFunction& surface) {
    assert(rate >= 1);
    return Tessellator(base, features, rate).build(surface);
}

Tessellation tessellate(const Evaluator& evaluator, std::span<const Vec3<double>> points,
                        int rate) {
    assert(rate >= 1);
    const PatchTable& table = evaluator.table();
    return Tessellator(table.base(), table.features(), rate).build(evaluator, points);
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

}  // namespace osdx::inline OSDX_ABI
