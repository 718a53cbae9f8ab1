// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include <osdx/evaluate_addresses.h>
#include <osdx/evaluator.h>
#include <osdx/grid_evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/tessellation.h>
#include <osdx/tessellation_rates.h>
#include <osdx/topology.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// A point of a face.
struct Place {
    QuarterPoint point;  ///< quarter: the corner
    Address address;     ///< in a face 0
    Index sample;        ///< of GridEvaluator at the rate, or kInvalidIndex
};

/// Some facets of a face. Their corners are inner points, ~number, or points on the edges:
/// those from the last one before the side on, so that 1 is the start of the side.
struct Part {
    std::vector<Place>
        places;  ///< inner points; of a side those on its edge but the last
    std::vector<Index> facet_sizes;
    std::vector<std::int32_t> corners;
    std::vector<Vec2<double>> uvs;  ///< of these

    /// No corner is on an edge: facets of a side begin with one that is, and so do those of the
    /// inside of a rate of 1; of any other inside all are inner.
    bool is_inner() const { return !corners.empty() && corners.front() < 0; }
};

/// The parts of the faces of n corners with a rate inside.
///
/// The points lie on rings: ring 0 on the edges, at the rates of these; ring k at k/rate from
/// the edges, with rate - 2k segments on each side; a ring without segments is the centre.
/// Strips of facets join each ring to the next one. Those from ring 0 are parts of their own,
/// one for each side; the others are the inside.
class Pattern {
public:
    Pattern(Index n, int rate) : n_(static_cast<int>(n)), rate_(rate) {
        // A mesh of this face alone, whose halfedges are its corners.
        base_.face_offsets = {0, n};
        base_.faces.assign(n, 0);
    }

    Part inside() const {
        Part part;
        for (int k = 1; rate_ - 2 * k >= 0; ++k) {
            if (rate_ == 2 * k)
                part.places.push_back(centre());
            for (int i = 0; i < n_ && rate_ > 2 * k; ++i) {
                for (int j = 0; j < rate_ - 2 * k; ++j)
                    part.places.push_back(place(i, k + j, k, rate_));
            }
        }
        for (int k = 1; rate_ - 2 * k >= 2; ++k) {
            for (int i = 0; i < n_; ++i)
                add_strip(part, i, {k, rate_ - 2 * k, rate_}, k + 1, true, true);
        }
        if (rate_ % 2 == 0)
            return part;
        // The innermost ring of an odd rate has one segment a side.
        const int k = rate_ / 2;
        const auto at = [&](int i) {
            return k > 0 ? ring_point(k, i % n_, 0)
                         : Corner{1 + i % n_, place(i % n_, 0, 0, 1).point};
        };
        if (n_ == 3) {
            add_facet(part, 0, {at(0), at(1), at(2)});
        } else if (n_ == 4) {
            add_facet(part, 0, {at(0), at(1), at(2), at(3)});
        } else {
            const Corner last{~static_cast<int>(part.places.size()), centre().point};
            part.places.push_back(centre());
            part.places.back().sample = kInvalidIndex;  // between the samples
            for (int i = 0; i < n_; ++i)
                add_facet(part, i, {at(i), at(i + 1), last});
        }
        return part;
    }

    /// \param segments  of the edge
    /// \param joined_before, joined_after  the facets at the corner are one quad, which belongs
    ///        to the side after it; where this side and that one have the rate of the inside
    Part side(int i, int segments, bool joined_before, bool joined_after) const {
        Part part;
        for (int j = 0; j < segments; ++j)
            part.places.push_back(place(i, j, 0, segments));
        if (rate_ > 1)
            add_strip(part, i, {0, segments, segments}, 1, joined_before, joined_after);
        return part;
    }

private:
    struct Corner {
        int number;
        QuarterPoint point;
    };
    /// A side of a ring: point j at (first + j)/rate of the edge.
    struct Chain {
        int first, segments, rate;
        /// Twice the parameter of the middle of segment j, times the rate.
        std::int64_t middle(int j) const { return 2 * (first + j) + 1; }
        bool in_second_half(int j) const { return middle(j) > rate; }
    };

    /// The point at along/rate of side i and across/rate from it.
    Place place(int i, int along, int across, int rate) const {
        const bool second_half = 2 * along > rate;
        const int corner = (i + second_half) % n_;
        const int x = second_half ? across : along,
                  y = second_half ? rate - along : across;
        Place p;
        p.point = {static_cast<Index>(corner), 2.0 * x / rate, 2.0 * y / rate};
        p.address = to_address(base_, p.point);
        if (n_ == 4) {
            const auto at =
                rate * square_corner<int>(corner) + turn(Vec2<int>(x, y), corner);
            p.sample = static_cast<Index>(at.y * (rate + 1) + at.x);
        } else {
            const int row = rate / 2 + 1;
            p.sample = static_cast<Index>((corner * row + y) * row + x);
        }
        return p;
    }

    Place centre() const {
        Place p = place(0, rate_ / 2, rate_ / 2, rate_);
        p.point = {0, 1, 1};
        p.address = to_address(base_, p.point);
        return p;
    }

    /// Point j of side i of a ring that is not the outer one.
    Corner ring_point(int k, int i, int j) const {
        // Rings 1 to k - 1 have n (rate - 2) .. n (rate - 2 (k - 1)) points.
        const int first = n_ * (k - 1) * (rate_ - k), segments = rate_ - 2 * k;
        if (segments == 0)
            return {~first, centre().point};
        return {~(first + (i * segments + j) % (n_ * segments)),
                place(i, k + j, k, rate_).point};
    }

    /// Facets between side i of a ring and that of ring k, next to it: a triangle for each
    /// segment in the order of their middles, a quad for two whose middles are abreast.
    void add_strip(Part& part, int i, const Chain& outer, int k, bool joined_before,
                   bool joined_after) const {
        const Chain inner{k, rate_ - 2 * k, rate_};
        const auto out = [&](int j) -> Corner {
            const int side = j < 0 ? (i + n_ - 1) % n_ : i,
                      at = j < 0 ? outer.segments + j : j;
            if (k > 1)
                return ring_point(k - 1, side, at);
            return {1 + j, place(side, at, 0, outer.rate).point};
        };
        const auto in = [&](int j) { return ring_point(k, i, j); };
        int o = 0, p = 0;
        if (joined_before) {
            add_facet(part, i, {out(0), out(1), in(0), out(-1)});
            o = 1;
        }
        const int end = outer.segments - joined_after;
        while (o < end || p < inner.segments) {
            const std::int64_t a = outer.middle(o) * inner.rate,
                               b = inner.middle(p) * outer.rate;
            const bool outer_next = p == inner.segments || (o < end && a <= b),
                       inner_next = o == end || (p < inner.segments && b <= a);
            const int quarter =
                (i + (outer_next ? outer.in_second_half(o) : inner.in_second_half(p))) %
                n_;
            if (outer_next && inner_next)
                add_facet(part, quarter, {out(o), out(o + 1), in(p + 1), in(p)});
            else if (outer_next)
                add_facet(part, quarter, {out(o), out(o + 1), in(p)});
            else
                add_facet(part, quarter, {out(o), in(p + 1), in(p)});
            o += outer_next;
            p += inner_next;
        }
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

    void add_facet(Part& part, int quarter, std::initializer_list<Corner> facet) const {
        part.facet_sizes.push_back(static_cast<Index>(facet.size()));
        for (const Corner& c : facet) {
            const Address a =
                to_address(base_, in_quarter(c.point, static_cast<Index>(quarter)));
            part.corners.push_back(c.number);
            part.uvs.emplace_back(a.u, a.v);
        }
    }

    int n_, rate_;
    Topology base_;
};

/// The parts that occur, each made once.
class Parts {
public:
    const Part& operator[](Index i) const { return parts_[i]; }

    Index inside(Index n, int rate) {
        return find({n, rate, kInvalidIndex, 0, 0},
                    [&] { return Pattern(n, rate).inside(); });
    }
    /// \param segments, before, after  of the edge, and of those before and after it
    Index side(Index n, int rate, Index i, int segments, int before, int after) {
        const bool plain = segments == rate && rate > 1;
        const bool joined_before = plain && before == rate,
                   joined_after = plain && after == rate;
        return find({n, rate, i, segments, 2 * joined_before + joined_after}, [&] {
            return Pattern(n, rate).side(static_cast<int>(i), segments, joined_before,
                                         joined_after);
        });
    }

private:
    struct Key {
        Index n;
        int rate;
        Index side;  ///< kInvalidIndex: the inside
        int segments, joined;
        bool operator==(const Key&) const = default;
    };
    struct Hash {
        std::size_t operator()(const Key& key) const {
            std::uint64_t h = 0;
            for (const std::uint64_t part :
                 {std::uint64_t(key.n), std::uint64_t(key.rate), std::uint64_t(key.side),
                  std::uint64_t(key.segments), std::uint64_t(key.joined)})
                h = (h ^ part) * 0x9e3779b97f4a7c15u, h ^= h >> 32;
            return static_cast<std::size_t>(h);
        }
    };

    template <class Make>
    Index find(const Key& key, Make&& make) {
        const auto [at, is_new] =
            numbers_.try_emplace(key, static_cast<Index>(parts_.size()));
        if (is_new)
            parts_.push_back(make());
        return at->second;
    }

    std::vector<Part> parts_;
    std::unordered_map<Key, Index, Hash> numbers_;
};

class Tessellator {
public:
    Tessellator(const Topology& base, const ResolvedFeatures& features,
                const TessellationRates& rates)
        : base_(base), features_(features), rates_(rates) {
        assert(rates.edges.empty() || rates.edges.size() == base.n_edges);
        assert(rates.faces.empty() || rates.faces.size() == base.n_faces());
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
            for_each_own(face, [&](const Place& place, Index number) {
                const SurfaceJet<double> jet = surface(in_mesh(place.point, face));
                add_jet(face, place, number, jet.p, jet.du, jet.dv);
            });
        });
        return std::move(out_);
    }

    Tessellation build(const Evaluator& evaluator, std::span<const Vec3<double>> points) {
        if (common_rate_ > 0)
            build_grids(evaluator, points);
        else
            build_addresses(evaluator, points);
        return std::move(out_);
    }

private:
    /// Where all rates are equal.
    void build_grids(const Evaluator& evaluator, std::span<const Vec3<double>> points) {
        const GridEvaluator<double> grid(
            evaluator, common_rate_, {.native_at_borders = true, .min_table_uses = 2});
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
                const std::size_t first = grid.first_sample(face) - block.first_sample;
                for_each_own(face, [&](const Place& place, Index number) {
                    if (place.sample != kInvalidIndex) {
                        const std::size_t sample = first + place.sample;
                        add_jet(face, place, number, at(0, sample), at(1, sample),
                                at(2, sample));
                        return;
                    }
                    const auto jet = evaluator.evaluate<double, 1>(
                        points, in_mesh(place.point, face), Chart::Native);
                    add_jet(face, place, number, jet.p, jet.du, jet.dv);
                });
            }
        });
    }

    void build_addresses(const Evaluator& evaluator,
                         std::span<const Vec3<double>> points) {
        Buffer<Address> sides(n_sides_);
        for_each_face([&](Index face) {
            if (is_hole(face))
                return;
            add_facets(face);
            for_each_own(face, [&](const Place& place, Index number) {
                (number < n_points_ ? out_.addresses[number]
                                    : sides[number - n_points_]) = {face, place.address.u,
                                                                    place.address.v};
            });
        });
        const std::span<const double> values(&points.data()->x, 3 * points.size());
        std::vector<double> jets;
        const auto evaluate = [&](std::span<const Address> all, Index first_normal) {
            constexpr std::size_t kMany = std::size_t(1) << 16;  // 5 MB of jets
            for (std::size_t begin = 0; begin < all.size(); begin += kMany) {
                const auto where =
                    all.subspan(begin, std::min(kMany, all.size() - begin));
                jets.resize(9 * where.size());
                evaluate_addresses<double>(evaluator, values, 3, where, 1, Chart::Native,
                                           channels(jets.data(), 9));
                detail::for_each_index(where.size(), [&](Index i) {
                    const double* v = jets.data() + 9 * std::size_t(i);
                    const auto number = static_cast<Index>(first_normal + begin + i);
                    const Vec3<double> p(v[0], v[1], v[2]);
                    if (number < n_points_)
                        out_.positions[number] = p;
                    out_.normals[number] =
                        unit_normal(p, {v[3], v[4], v[5]}, {v[6], v[7], v[8]});
                });
            }
        };
        evaluate(out_.addresses, 0);
        evaluate(sides, n_points_);
    }

    template <class F>
    void for_each_face(F&& f) const {
        detail::for_each_range(base_.n_faces(), 64, [&](Index begin, Index end) {
            for (Index i = begin; i < end; ++i)
                f(i);
        });
    }

    bool is_hole(Index face) const { return features_.is_hole(face); }
    bool is_sharp(Index edge) const { return is_infinitely_sharp(features_.edge(edge)); }
    int edge_rate(Index edge) const {
        return std::max(1, rates_.edges.empty() ? rates_.rate : rates_.edges[edge]);
    }
    QuarterPoint in_mesh(QuarterPoint p, Index face) const {
        p.quarter += base_.face_offsets[face];
        return p;
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

    Index inner_points(Index edge) const {
        return static_cast<Index>(edge_rate(edge) - 1);
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
                n_points_ += inner_points(e);
            } else if (is_sharp(e)) {
                edge_side_[e] = n_sides_;
                n_sides_ += inner_points(e);
            }
        }
    }

    void number_faces() {
        faces_.reserve(base_.n_faces() + 1);
        side_parts_.resize(base_.n_halfedges());
        std::vector<int> rates, last_rates;  // of the edges, then that inside
        Face next{n_points_, kInvalidIndex, 0, 0};
        Index last_face = kInvalidIndex;
        for (Index f = 0; f < base_.n_faces(); ++f) {
            if (is_hole(f)) {
                faces_.push_back(next);
                continue;
            }
            const Index first = base_.face_offsets[f], n = base_.face_size(f);
            rates.clear();
            for (Index i = 0; i < n; ++i)
                rates.push_back(edge_rate(base_.edge[first + i]));
            const int rate = inside_rate(f, rates);
            rates.push_back(rate);
            if (rates != last_rates) {
                next.inside = parts_.inside(n, rate);
                for (Index i = 0; i < n; ++i) {
                    side_parts_[first + i] = parts_.side(
                        n, rate, i, rates[i], rates[(i + n - 1) % n], rates[(i + 1) % n]);
                }
                const bool equal = std::ranges::count(rates, rate) == n + 1;
                const bool as_before = last_face == kInvalidIndex || rate == common_rate_;
                common_rate_ = equal && as_before ? rate : 0;
                std::swap(rates, last_rates);
            } else {
                const auto last = side_parts_.begin() + base_.face_offsets[last_face];
                std::copy_n(last, n, side_parts_.begin() + first);
            }
            last_face = f;
            faces_.push_back(next);
            for (Index h = first; h < first + n; ++h) {
                next.facet += parts_[side_parts_[h]].facet_sizes.size();
                next.corner += parts_[side_parts_[h]].corners.size();
            }
            const Part& inside = parts_[next.inside];
            next.point += static_cast<Index>(inside.places.size());
            next.facet += inside.facet_sizes.size();
            next.corner += inside.corners.size();
        }
        faces_.push_back(next);
        n_points_ = next.point;
    }

    /// \param edges  rates of the edges of the face
    int inside_rate(Index face, std::span<const int> edges) const {
        const int largest = std::ranges::max(edges);
        const int rate = std::max(1, rates_.faces.empty() ? largest : rates_.faces[face]);
        return rate == 1 && largest > 1 ? 2 : rate;
    }

    void add_facets(Index face) {
        std::vector<Index>& points = outer_points_.local();
        std::vector<Index>& normals = outer_normals_.local();
        points.assign(1, 0);
        normals.assign(1, 0);
        for_each_outer(face, [&](Index point, Index normal) {
            points.push_back(point);
            normals.push_back(normal);
        });
        // The last one is before the first one too, and the first one after the last one.
        points.front() = points.back();
        normals.front() = normals.back();
        points.push_back(points[1]);
        normals.push_back(normals[1]);

        const Face& at = faces_[face];
        Index* sizes = out_.facet_sizes.data() + at.facet;
        Index* out_points = out_.facet_points.data() + at.corner;
        Index* out_normals = out_.facet_normals.data() + at.corner;
        Vec2<double>* uvs = out_.facet_uvs.data() + at.corner;
        const auto add = [&](const Part& part, std::size_t first) {
            sizes = std::ranges::copy(part.facet_sizes, sizes).out;
            uvs = std::ranges::copy(part.uvs, uvs).out;
            if (part.is_inner()) {
                Index* const begin = out_points;
                for (const std::int32_t c : part.corners)
                    *out_points++ = at.point + static_cast<Index>(~c);
                out_normals = std::copy(begin, out_points, out_normals);
                return;
            }
            for (const std::int32_t c : part.corners) {
                const Index inner = at.point + static_cast<Index>(~c);
                *out_points++ = c < 0 ? inner : points[first + static_cast<Index>(c)];
                *out_normals++ = c < 0 ? inner : normals[first + static_cast<Index>(c)];
            }
        };
        std::size_t first = 0;
        for (Index h = base_.face_offsets[face]; h < base_.face_offsets[face + 1]; ++h) {
            const Part& side = parts_[side_parts_[h]];
            add(side, first);
            first += side.places.size();
        }
        add(parts_[at.inside], 0);
        std::fill(out_.facet_faces.data() + at.facet,
                  out_.facet_faces.data() + faces_[face + 1].facet, face);
    }

    /// Calls f(number of the point, number of its normal) for the points on the edges of a
    /// face.
    template <class F>
    void for_each_outer(Index face, F&& f) const {
        for (Index h = base_.face_offsets[face]; h < base_.face_offsets[face + 1]; ++h) {
            const Index v = base_.vertex[h], e = base_.edge[h];
            const auto normal_of = [&](Index point, Index side) {
                return side == kInvalidIndex ? point : n_points_ + side;
            };
            f(vertex_point_[v], normal_of(vertex_point_[v], vertex_side_[h]));
            const Index first = edge_point_[e], n = inner_points(e);
            for (Index j = 0; j < n; ++j) {
                if (edge_owner_[e] == h) {
                    f(first + j, first + j);
                    continue;
                }
                const Index point = first + n - 1 - j;
                f(point,
                  edge_side_[e] == kInvalidIndex ? point : n_points_ + edge_side_[e] + j);
            }
        }
    }

    /// Calls f(place, number of the normal) for those that are this face's to make; the number
    /// is that of the point too, or of a further side from n_points_ on.
    template <class F>
    void for_each_own(Index face, F&& f) const {
        for (Index h = base_.face_offsets[face]; h < base_.face_offsets[face + 1]; ++h) {
            const std::vector<Place>& places = parts_[side_parts_[h]].places;
            const Index v = base_.vertex[h], e = base_.edge[h], side = vertex_side_[h];
            if (vertex_owner_[v] == h)
                f(places[0], vertex_point_[v]);
            else if (side != kInvalidIndex && side_owner_[side] == h)
                f(places[0], n_points_ + side);
            for (Index j = 1; j < static_cast<Index>(places.size()); ++j) {
                if (edge_owner_[e] == h)
                    f(places[j], edge_point_[e] + j - 1);
                else if (edge_side_[e] != kInvalidIndex)
                    f(places[j], n_points_ + edge_side_[e] + j - 1);
            }
        }
        Index point = faces_[face].point;
        for (const Place& place : parts_[faces_[face].inside].places)
            f(place, point++);
    }

    void add_jet(Index face, const Place& place, Index number, const Vec3<double>& p,
                 const Vec3<double>& du, const Vec3<double>& dv) {
        out_.normals[number] = unit_normal(p, du, dv);
        if (number >= n_points_)
            return;
        out_.positions[number] = p;
        out_.addresses[number] = {face, place.address.u, place.address.v};
    }

    const Topology& base_;
    const ResolvedFeatures& features_;
    TessellationRates rates_;
    Tessellation out_;
    Parts parts_;
    int common_rate_ = 0;  // of all edges and faces; 0: they differ
    /// Points: vertices, edges, then those inside of each face. Sides, where there are other
    /// normals at a point: vertices, then edges.
    Index n_points_ = 0, n_sides_ = 0;
    std::vector<Index> vertex_point_, vertex_owner_;  // per vertex; a halfedge there
    std::vector<Index> vertex_side_;  // per halfedge, at its start; or kInvalidIndex
    std::vector<Index> side_owner_;   // per side of a vertex: a halfedge there
    std::vector<Index> edge_owner_;   // per edge: the halfedge along which its points run
    std::vector<Index> edge_point_;   // per edge: the first of its inner points
    std::vector<Index> edge_side_;    // its sides, along the other halfedge
    struct Face {
        Index point;   // the first of those inside
        Index inside;  // its part
        std::size_t facet, corner;
    };
    std::vector<Face> faces_;
    std::vector<Index> side_parts_;  // per halfedge
    detail::PerThread<std::vector<Index>> outer_points_, outer_normals_;
};

}  // namespace

Tessellation tessellate(const Topology& base, const ResolvedFeatures& features,
                        const TessellationRates& rates, const SurfaceFunction& surface) {
    return Tessellator(base, features, rates).build(surface);
}

Tessellation tessellate(const Topology& base, const ResolvedFeatures& features, int rate,
                        const SurfaceFunction& surface) {
    return tessellate(base, features, {.rate = rate}, surface);
}

Tessellation tessellate(const Evaluator& evaluator, std::span<const Vec3<double>> points,
                        const TessellationRates& rates) {
    const PatchTable& table = evaluator.table();
    return Tessellator(table.base(), table.features(), rates).build(evaluator, points);
}

Tessellation tessellate(const Evaluator& evaluator, std::span<const Vec3<double>> points,
                        int rate) {
    return tessellate(evaluator, points, {.rate = rate});
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
