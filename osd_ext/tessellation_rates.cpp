// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cassert>
#include <cmath>

#include <glm/geometric.hpp>

#include <osdx/grid_evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_jet.h>
#include <osdx/tessellation_rates.h>

namespace osdx::inline OSDX_ABI {
namespace {

using Point = Vec3<double>;

constexpr int kSamples = 8;  // segments of an edge that are looked at

/// The samples of a quad, or of a quarter of another polygon.
struct SampleGrid {
    const double* values;
    int n;                ///< segments a side
    Index first, corner;  ///< of the face: its first halfedge; the corner of the quarter
    bool is_quad;
    Index face_size;

    Point at(int i, int j) const {
        const double* v = values + 3 * (j * (n + 1) + i);
        return {v[0], v[1], v[2]};
    }
    int n_sides() const { return is_quad ? 4 : 2; }
    Index halfedge(int side) const {
        if (is_quad)
            return first + static_cast<Index>(side);
        return first + (side == 0 ? corner : (corner + face_size - 1) % face_size);
    }
    /// Point `along` a side on the edge of the face and `across` from it.
    Point at_side(int side, int along, int across) const {
        if (!is_quad)
            return side == 0 ? at(along, across) : at(across, along);
        const auto p =
            n * square_corner<int>(side) + turn(Vec2<int>(along, across), side);
        return at(p.x, p.y);
    }
};

/// Calls f(face, grid) for the grids of all faces with a surface; those of a face together.
template <class F>
void for_each_grid(const Evaluator& evaluator, std::span<const Point> points, F&& f) {
    const Topology& base = evaluator.table().base();
    const GridEvaluator<double> grids(evaluator, kSamples,
                                      {.order = 0, .min_table_uses = 2});
    grids.for_each_block(points, [&](const SampleBlock<double>& block) {
        for (Index face = block.first_unit; face < block.first_unit + block.n_units;
             ++face) {
            const std::size_t first = grids.first_sample(face);
            if (grids.first_sample(face + 1) == first)
                continue;
            const Index size = base.face_size(face);
            SampleGrid grid{block.values[0] + 3 * (first - block.first_sample),
                            size == 4 ? kSamples : kSamples / 2,
                            base.face_offsets[face],
                            0,
                            size == 4,
                            size};
            for (; grid.corner < (size == 4 ? 1 : size); ++grid.corner) {
                f(face, grid);
                grid.values += 3 * (grid.n + 1) * (grid.n + 1);
            }
        }
    });
}

/// The greater one for each edge of what its halfedges have.
std::vector<double> of_edges(const Topology& base, std::span<const double> halfedges) {
    std::vector<double> edges(base.n_edges, 0);
    for (Index h = 0; h < base.n_halfedges(); ++h)
        edges[base.edge[h]] = std::max(edges[base.edge[h]], halfedges[h]);
    return edges;
}

std::vector<int> rounded_up(std::span<const double> rates, int max_rate) {
    std::vector<int> result;
    result.reserve(rates.size());
    for (const double r : rates)
        result.push_back(r < max_rate ? std::max(1, static_cast<int>(std::ceil(r)))
                                      : max_rate);
    return result;
}

/// The length along a normal; all of it where there is none.
double along(const Point& d, const Point& normal) {
    return normal == Point(0) ? glm::length(d) : std::abs(glm::dot(d, normal));
}

/// The length across a tangent.
double across(const Point& d, const Point& tangent) {
    const double length = glm::length(tangent);
    return length > 0 ? glm::length(glm::cross(d, tangent / length)) : glm::length(d);
}

/// The second difference that decides on the rate inside. A right-angled triangle of legs h has
/// at the middles of its sides h^2/8 times the second derivatives in u, v and u + v or u - v.
double bend_inside(const SampleGrid& g) {
    double bend = 0;
    for (int j = 1; j < g.n; ++j) {
        for (int i = 1; i < g.n; ++i) {
            const Point normal = unit_normal(g.at(i + 1, j) - g.at(i - 1, j),
                                             g.at(i, j + 1) - g.at(i, j - 1));
            const Point p = 2.0 * g.at(i, j), uu = g.at(i + 1, j) - p + g.at(i - 1, j),
                        vv = g.at(i, j + 1) - p + g.at(i, j - 1),
                        uv = 0.25 * (g.at(i + 1, j + 1) - g.at(i - 1, j + 1) -
                                     g.at(i + 1, j - 1) + g.at(i - 1, j - 1));
            for (const Point& d : {uu, vv, uu + 2.0 * uv + vv, uu - 2.0 * uv + vv})
                bend = std::max(bend, along(d, normal));
        }
    }
    return bend;
}

/// Second differences near an edge.
struct EdgeBend {
    double along = 0, twist = 0;
};

/// On the edge and the row of samples next to it, for the strip of facets there has as few
/// points along them.
/// \param is_free  a border or a sharp edge
void add_bend(const SampleGrid& g, int side, bool is_free, EdgeBend& bend) {
    for (int row = 0; row < 2; ++row) {
        for (int i = 1; i < g.n; ++i) {
            const Point a = g.at_side(side, i - 1, row), b = g.at_side(side, i, row),
                        c = g.at_side(side, i + 1, row);
            const Point d = a - 2.0 * b + c;
            const Point e = 0.5 * (g.at_side(side, i + 1, row + 1) - c -
                                   g.at_side(side, i - 1, row + 1) + a);
            const Point normal = unit_normal(c - a, g.at_side(side, i, row + 1) - b);
            bend.along = std::max(
                bend.along, is_free && row == 0 ? across(d, c - a) : along(d, normal));
            bend.twist = std::max(bend.twist, along(e, normal));
        }
    }
}

}  // namespace

RateArrays rates_of_edges(const Topology& base,
                          const std::function<int(Index edge)>& rate) {
    RateArrays rates;
    rates.edges.reserve(base.n_edges);
    for (Index e = 0; e < base.n_edges; ++e)
        rates.edges.push_back(rate(e));
    return rates;
}

RateArrays rates_from_length(const Evaluator& evaluator, std::span<const Point> points,
                             double length, int max_rate) {
    assert(max_rate >= 1);
    const Topology& base = evaluator.table().base();
    // Of the two quarters of an edge, the second one's halfedge is the one before its corner.
    std::vector<double> lengths(base.n_halfedges(), 0);
    for_each_grid(evaluator, points, [&](Index, const SampleGrid& g) {
        for (int side = 0; side < g.n_sides(); ++side) {
            double& sum = lengths[g.halfedge(side)];
            for (int i = 0; i < g.n; ++i)
                sum += glm::distance(g.at_side(side, i, 0), g.at_side(side, i + 1, 0));
        }
    });
    std::vector<double> rates = of_edges(base, lengths);
    for (double& r : rates)
        r = length > 0 ? r / length : max_rate;
    return {rounded_up(rates, max_rate), {}};
}

RateArrays rates_from_error(const Evaluator& evaluator, std::span<const Point> points,
                            double error, int max_rate) {
    assert(max_rate >= 1);
    const Topology& base = evaluator.table().base();
    const ResolvedFeatures& features = evaluator.table().features();
    std::vector<EdgeBend> bends(base.n_halfedges());
    std::vector<double> faces(base.n_faces(), 0);
    for_each_grid(evaluator, points, [&](Index face, const SampleGrid& g) {
        faces[face] = std::max(faces[face], bend_inside(g));
        for (int side = 0; side < g.n_sides(); ++side) {
            const Index h = g.halfedge(side);
            const bool is_free =
                base.is_border(h) || is_infinitely_sharp(features.edge(base.edge[h]));
            add_bend(g, side, is_free, bends[h]);
        }
    });
    // The error of chords is bend (kSamples / rate)^2 / 8.
    const double scale = kSamples * kSamples / (8 * error);
    for (double& r : faces)
        r = error > 0 ? std::sqrt(scale * r) : max_rate;
    // The strip inside of an edge has sides (1/rate, 1/rate inside), where twice the twist
    // counts.
    std::vector<double> halfedges(base.n_halfedges());
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        const double inside = std::max(1.0, faces[base.face(h)]);
        halfedges[h] = error > 0 ? std::max(std::sqrt(scale * bends[h].along),
                                            2 * scale * bends[h].twist / inside)
                                 : max_rate;
    }
    return {rounded_up(of_edges(base, halfedges), max_rate), rounded_up(faces, max_rate)};
}

}  // namespace osdx::inline OSDX_ABI
