// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine.h"

#include <cassert>

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
StencilTable odd_smoothing(const Topology& quads) {
    StencilTable s;
    for (Index v = 0; v < quads.n_vertices(); ++v) {
        const Index n = quads.valence(v);
        if (n == 0) {
            s.add(v, 1.0);
            s.end_row();
            continue;
        }
        const double w = 1.0 / (double(n) * n);
        if (n != 3)
            s.add(v, (double(n) - 3.0) / n);
        quads.for_each_outgoing(v, [&](Index h) {
            const Index to = quads.next(h);
            s.add(quads.vertex[to], 2.0 * w);
            s.add(quads.vertex[quads.next(to)], w);
        });
        s.end_row();
    }
    return s;
}

RefinedLevel refine_odd(const Topology& parent, int degree) {
    RefinedLevel level;
    level.topology = split(parent);
    level.factors.push_back(split_stencils(parent));
    if (degree >= 3) {
        const StencilTable smoothing = odd_smoothing(level.topology);
        level.factors.insert(level.factors.end(), (degree - 1) / 2, smoothing);
    }
    return level;
}

RefinedLevel refine_even(const Topology& parent, int degree, bool parent_is_base) {
    RefinedLevel level;
    const Topology quads = split(parent);
    std::vector<Index> map;
    level.topology = dual(quads, &map);
    level.factors.push_back(split_stencils(parent));
    level.factors.push_back(face_centroids(quads));
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

std::vector<StencilTable> Refinement::stencils(
    std::vector<std::vector<bool>> wanted) const {
    // Backwards: the rows of each factor that the rows after it read.
    std::vector<std::vector<std::vector<bool>>> rows(levels_.size());
    for (std::size_t l = levels_.size(); l-- > 1;) {
        const auto& factors = levels_[l].factors;
        rows[l].resize(factors.size());
        std::vector<bool> need = wanted[l];
        for (std::size_t f = factors.size(); f-- > 0;) {
            const StencilTable& factor = factors[f];
            std::vector<bool> inputs =
                f > 0 ? std::vector<bool>(factors[f - 1].n_rows(), false) : wanted[l - 1];
            for (Index r = 0; r < factor.n_rows(); ++r) {
                if (!need[r])
                    continue;
                for (std::size_t k = factor.offsets[r]; k < factor.offsets[r + 1]; ++k)
                    inputs[factor.indices[k]] = true;
            }
            rows[l][f] = std::move(need);
            need = std::move(inputs);
        }
        wanted[l - 1] = std::move(need);
    }

    // Forwards: the product, level by level.
    const Index n_base = levels_[0].topology.n_vertices();
    StencilTable product = identity(n_base);
    std::vector<StencilTable> result;
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        for (std::size_t f = 0; f < levels_[l].factors.size(); ++f)
            product = compose(levels_[l].factors[f], product, n_base, rows[l][f]);
        result.push_back(product);
    }
    return result;
}

StencilTable Refinement::stencils() const {
    std::vector<std::vector<bool>> wanted;
    for (const RefinedLevel& level : levels_)
        wanted.emplace_back(level.topology.n_vertices(), false);
    wanted.back().assign(wanted.back().size(), true);
    auto tables = stencils(std::move(wanted));
    if (!tables.empty())
        return std::move(tables.back());
    return identity(levels_[0].topology.n_vertices());
}

}  // namespace osdx
