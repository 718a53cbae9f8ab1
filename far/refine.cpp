// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine.h"

#include <cassert>
#include <numeric>

namespace osdx {
namespace {

/// Appends a row per face: the centroid of its vertices.
void add_face_centroids(const Topology& t, StencilTable& s) {
    for (Index f = 0; f < t.n_faces(); ++f) {
        const double w = 1.0 / t.face_size(f);
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
            s.add(t.vertex[h], w);
        s.end_row();
    }
}

StencilTable face_centroids(const Topology& t) {
    StencilTable s;
    add_face_centroids(t, s);
    return s;
}

StencilTable identity(Index n) {
    StencilTable s;
    for (Index i = 0; i < n; ++i) {
        s.add(i, 1.0);
        s.end_row();
    }
    return s;
}

/// Rows of split(t): vertices stay, edges and faces take the middle.
StencilTable split_stencils(const Topology& t) {
    StencilTable s = identity(t.n_vertices());
    std::vector<Index> halfedge(t.n_edges);
    for (Index h = 0; h < t.n_halfedges(); ++h)
        halfedge[t.edge[h]] = h;
    for (const Index h : halfedge) {
        s.add(t.vertex[h], 0.5);
        s.add(t.to_vertex(h), 0.5);
        s.end_row();
    }
    add_face_centroids(t, s);
    return s;
}

/// A row per vertex over faces: the average of the incident ones.
StencilTable vertex_averages(const Topology& t) {
    StencilTable s;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        const double w = 1.0 / t.valence(v);
        t.for_each_outgoing(v, [&](Index h) { s.add(t.face[h], w); });
        s.end_row();
    }
    return s;
}

/// v' = (n-3)/n v + 2/n avg(edge neighbours) + 1/n avg(face-diagonal neighbours), on quads.
///
/// Right after split(parent), the vertices of edges become the average of their edge
/// neighbours, as in Catmull-Clark: the same between quads, but not next to other faces.
/// \param parent  null for the later smoothings
StencilTable odd_smoothing(const Topology& quads, const Topology* parent) {
    StencilTable s;
    const Index first_edge = parent ? parent->n_vertices() : 0;
    const Index end_edge = parent ? first_edge + parent->n_edges : 0;
    for (Index v = 0; v < quads.n_vertices(); ++v) {
        const Index n = quads.valence(v);
        const bool of_edge = v >= first_edge && v < end_edge;
        double own = (double(n) - 3) / n;
        double beside = 2.0 / (double(n) * n), diagonal = 1.0 / (double(n) * n);
        if (of_edge) {
            own = diagonal = 0;
            beside = 0.25;
        } else if (n == 0) {
            own = 1;
        }
        if (own != 0)
            s.add(v, own);
        quads.for_each_outgoing(v, [&](Index h) {
            const Index to = quads.next(h);
            s.add(quads.vertex[to], beside);
            if (diagonal != 0)
                s.add(quads.vertex[quads.next(to)], diagonal);
        });
        s.end_row();
    }
    return s;
}

RefinedLevel refine_odd(const Topology& parent, int degree) {
    RefinedLevel level;
    level.topology = split(parent);
    level.factors.push_back(compose(odd_smoothing(level.topology, &parent),
                                    split_stencils(parent), parent.n_vertices()));
    if (degree >= 5) {
        const StencilTable smoothing = odd_smoothing(level.topology, nullptr);
        level.factors.insert(level.factors.end(), (degree - 3) / 2, smoothing);
    }
    return level;
}

RefinedLevel refine_even(const Topology& parent, int degree, bool parent_is_base) {
    RefinedLevel level;
    const Topology quads = split(parent);
    std::vector<Index> map;
    level.topology = dual(quads, &map);
    level.factors.push_back(
        compose(face_centroids(quads), split_stencils(parent), parent.n_vertices()));
    if (degree >= 4) {
        const StencilTable to_faces = face_centroids(level.topology);
        const StencilTable to_vertices = vertex_averages(level.topology);
        for (int i = 0; i < (degree - 2) / 2; ++i) {
            level.factors.push_back(to_faces);
            level.factors.push_back(to_vertices);
        }
    }
    // Quad h of split(parent) has the vertex of corner h at its corner 0, the face at 2.
    level.corner_halfedges.resize(parent.n_halfedges());
    for (Index h = 0; h < parent.n_halfedges(); ++h)
        level.corner_halfedges[h] = map[4 * h + (parent_is_base ? 0 : 2)];
    return level;
}

}  // namespace

Refinement::Refinement(Topology base, int degree) : degree_(degree) {
    assert(degree >= kMinDegree && degree <= kMaxDegree);
    levels_.push_back({std::move(base), {}, {}});
}

void Refinement::add_level() {
    const Topology& parent = levels_.back().topology;
    levels_.push_back(degree_ % 2 ? refine_odd(parent, degree_)
                                  : refine_even(parent, degree_, levels_.size() == 1));
}

std::vector<Vec3<double>> Refinement::points(std::span<const Vec3<double>> base) const {
    std::vector<Vec3<double>> in(base.begin(), base.end()), out;
    for (const RefinedLevel& level : levels_) {
        for (const StencilTable& factor : level.factors) {
            out.resize(factor.n_rows());
            factor.apply(std::span<const Vec3<double>>(in), std::span(out));
            in.swap(out);
        }
    }
    return in;
}

StencilTable Refinement::stencils() const {
    const Index n_base = levels_[0].topology.n_vertices();
    StencilTable product = identity(n_base);
    for (const RefinedLevel& level : levels_) {
        for (const StencilTable& factor : level.factors)
            product = compose(factor, product, n_base);
    }
    return product;
}

Refinement::Chain Refinement::chain(std::vector<std::vector<bool>> wanted) const {
    // Backwards: the rows of each factor that the rows after it read.
    std::vector<std::vector<std::vector<bool>>> needed(levels_.size());
    for (std::size_t l = levels_.size(); l-- > 1;) {
        const auto& factors = levels_[l].factors;
        needed[l].resize(factors.size());
        std::vector<bool> rows = wanted[l];
        for (std::size_t f = factors.size(); f-- > 0;) {
            const StencilTable& factor = factors[f];
            std::vector<bool> inputs =
                f > 0 ? std::vector<bool>(factors[f - 1].n_rows(), false)
                      : std::move(wanted[l - 1]);
            for (Index r = 0; r < factor.n_rows(); ++r) {
                if (!rows[r])
                    continue;
                for (std::size_t k = factor.offsets[r]; k < factor.offsets[r + 1]; ++k)
                    inputs[factor.indices[k]] = true;
            }
            needed[l][f] = std::move(rows);
            rows = std::move(inputs);
        }
        wanted[l - 1] = std::move(rows);
    }

    // Forwards: their places, and the rows over them.
    const Index n_base = levels_[0].topology.n_vertices();
    Chain chain;
    std::vector<Index> place(n_base);
    std::iota(place.begin(), place.end(), Index(0));
    chain.place.push_back(place);
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        for (std::size_t f = 0; f < levels_[l].factors.size(); ++f) {
            const StencilTable& factor = levels_[l].factors[f];
            std::vector<Index> next(factor.n_rows(), kInvalidIndex);
            for (Index r = 0; r < factor.n_rows(); ++r) {
                if (!needed[l][f][r])
                    continue;
                next[r] = n_base + chain.rows.n_rows();
                for (std::size_t k = factor.offsets[r]; k < factor.offsets[r + 1]; ++k)
                    chain.rows.add(place[factor.indices[k]], factor.weights[k]);
                chain.rows.end_row();
            }
            place = std::move(next);
        }
        chain.place.push_back(place);
    }
    return chain;
}

}  // namespace osdx
