// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine.h"

#include <cassert>
#include <numeric>

#include "far/parallel.h"
#include "far/refine_step.h"
#include "far/stencil_rows.h"

namespace osdx {
namespace detail {

StencilTable identity_stencils(Index n) {
    StencilTable s;
    for (Index i = 0; i < n; ++i) {
        s.add(i, 1.0);
        s.end_row();
    }
    return s;
}

std::vector<bool> vertices_beside_gaps(const RefinedLevel& level) {
    const Topology& t = level.topology;
    std::vector<bool> result;
    if (level.gap.empty())
        return result;
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (!t.is_border(h) || !level.is_gap(t.edge[h]))
            continue;
        result.resize(t.n_vertices());
        result[t.vertex[h]] = result[t.to_vertex(h)] = true;
    }
    return result;
}

StencilTable KnownRows::usable(const StencilTable& rows,
                               const std::vector<bool>& unusable) {
    std::vector<std::uint8_t> known(rows.n_rows());
    StencilTable result = make_rows(rows.n_rows(), [&](Index r, StencilTable& table) {
        bool ok = unusable.empty() || !unusable[r];
        const std::size_t begin = rows.offsets[r], end = rows.offsets[r + 1];
        for (std::size_t k = begin; ok && k < end; ++k)
            ok = known_.empty() || known_[rows.indices[k]];
        for (std::size_t k = begin; ok && k < end; ++k)
            table.add(rows.indices[k], rows.weights[k]);
        known[r] = ok;
    });
    known_.assign(known.begin(), known.end());
    return result;
}

}  // namespace detail

StencilTable split_stencils(const Topology& t) {
    // Vertices stay, edges and faces take the middle.
    const Index first_edge = t.n_vertices(), first_face = first_edge + t.n_edges;
    std::vector<Index> halfedge(t.n_edges);
    detail::for_each_index(t.n_halfedges(), [&](Index h) {
        if (t.is_border(h) || h > t.twin[h])
            halfedge[t.edge[h]] = h;
    });
    return detail::make_rows(first_face + t.n_faces(), [&](Index r, StencilTable& s) {
        if (r < first_edge) {
            s.add(r, 1.0);
        } else if (r < first_face) {
            const Index h = halfedge[r - first_edge];
            s.add(t.vertex[h], 0.5);
            s.add(t.to_vertex(h), 0.5);
        } else {
            const Index f = r - first_face;
            const double w = 1.0 / t.face_size(f);
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
                s.add(t.vertex[h], w);
        }
    });
}

namespace {

/// The part of a level that has the faces `keep`.
RefinedLevel part_of(const RefinedLevel& level, const std::vector<bool>& keep,
                     std::vector<Index>& vertices, std::vector<Index>& halfedges) {
    Submesh sub = submesh(level.topology, keep);
    RefinedLevel part;
    const auto select = [](const auto& from, const std::vector<Index>& which, auto& to) {
        if (from.empty())
            return;
        to.reserve(which.size());
        for (const Index i : which)
            to.push_back(from[i]);
    };
    part.features.boundary = level.features.boundary;
    part.features.creases = level.features.creases;
    part.features.smooth_triangles = level.features.smooth_triangles;
    select(level.features.edge_sharpness, sub.edges, part.features.edge_sharpness);
    select(level.features.hole, sub.faces, part.features.hole);
    select(level.face_kinds, sub.faces, part.face_kinds);
    select(level.gap, sub.edges, part.gap);
    for (Index h = 0; h < sub.topology.n_halfedges(); ++h) {
        if (sub.topology.is_border(h) && !level.topology.is_border(sub.halfedges[h])) {
            part.gap.resize(sub.topology.n_edges);
            part.gap[sub.topology.edge[h]] = true;
        }
    }
    // Points without faces come with the faces and edges that they are for.
    const auto take_point = [&](Index point) {
        sub.topology.vertex_halfedge.push_back(kInvalidIndex);
        sub.vertices.push_back(point);
        return sub.topology.n_vertices() - 1;
    };
    if (!level.rays.empty()) {
        for (const Index e : sub.edges) {
            const Index ray = level.edge_rays[e];
            part.edge_rays.push_back(kInvalidIndex);
            if (ray == kInvalidIndex)
                continue;
            part.edge_rays.back() = static_cast<Index>(part.rays.size());
            part.rays.push_back(
                {take_point(level.rays[ray].point), level.rays[ray].sharpness});
        }
    }
    std::vector<Index> face(level.junctions.empty() ? 0 : level.topology.n_faces(),
                            kInvalidIndex);
    for (Index f = 0; f < sub.faces.size() && !face.empty(); ++f)
        face[sub.faces[f]] = f;
    for (const Junction& j : level.junctions) {
        if (face[j.face] == kInvalidIndex)
            continue;
        part.junctions.push_back(j);
        part.junctions.back().face = face[j.face];
        part.junctions.back().point = take_point(j.point);
    }
    select(level.features.vertex_sharpness, sub.vertices, part.features.vertex_sharpness);
    select(level.known, sub.vertices, part.known);
    select(level.point_kinds, sub.vertices, part.point_kinds);
    select(level.base_sharpness, sub.vertices, part.base_sharpness);
    part.topology = std::move(sub.topology);
    vertices = std::move(sub.vertices);
    halfedges = std::move(sub.halfedges);
    return part;
}

}  // namespace

Refinement::Refinement(Topology base, int degree, Features features)
    : degree_(degree), n_base_points_(base.n_vertices()) {
    assert(degree >= kMinDegree && degree <= kMaxDegree);
    features = with_border(base, std::move(features));
    if (degree % 2 == 0) {
        levels_.push_back(detail::even_base(std::move(base), features));
        return;
    }
    RefinedLevel level;
    level.topology = std::move(base);
    level.features = std::move(features);
    levels_.push_back(std::move(level));
}

void Refinement::add_refined(const RefinedLevel& parent) {
    levels_.push_back(degree_ % 2
                          ? detail::refine_odd(parent, degree_)
                          : detail::refine_even(parent, degree_, levels_.size() == 1));
}

void Refinement::add_level() {
    const RefinedLevel& parent = levels_.back();
    add_refined(parent);
    levels_.back().children.resize(parent.topology.n_halfedges());
    std::iota(levels_.back().children.begin(), levels_.back().children.end(), Index(0));
}

void Refinement::add_level(const std::vector<bool>& keep) {
    std::vector<Index> vertices, halfedges;
    const Index n_corners = levels_.back().topology.n_halfedges();
    const RefinedLevel part = part_of(levels_.back(), keep, vertices, halfedges);
    add_refined(part);
    RefinedLevel& level = levels_.back();
    for (Index& i : level.factors.front().indices)
        i = vertices[i];
    level.children.assign(n_corners, kInvalidIndex);
    for (Index h = 0; h < halfedges.size(); ++h)
        level.children[halfedges[h]] = h;
}

std::vector<Vec3<double>> Refinement::points(std::span<const Vec3<double>> base) const {
    std::vector<Vec3<double>> in(base.begin(), base.end()), out;
    if (!levels_[0].base_vertices.empty()) {
        in.clear();
        for (const Index v : levels_[0].base_vertices)
            in.push_back(base[v]);
    }
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
    const Index n_base = n_base_points_;
    StencilTable product = detail::identity_stencils(levels_[0].topology.n_vertices());
    if (!levels_[0].base_vertices.empty())
        product.indices = levels_[0].base_vertices;
    for (const RefinedLevel& level : levels_) {
        for (const StencilTable& factor : level.factors)
            product = compose(factor, product, n_base);
    }
    return product;
}

Refinement::Chain Refinement::chain(std::vector<std::vector<std::uint8_t>> wanted) const {
    // Backwards: the rows of each factor that the rows after it read.
    std::vector<std::vector<std::vector<std::uint8_t>>> needed(levels_.size());
    for (std::size_t l = levels_.size(); l-- > 1;) {
        const auto& factors = levels_[l].factors;
        needed[l].resize(factors.size());
        std::vector<std::uint8_t> rows = std::move(wanted[l]);
        for (std::size_t f = factors.size(); f-- > 0;) {
            const StencilTable& factor = factors[f];
            std::vector<std::uint8_t> inputs =
                f > 0 ? std::vector<std::uint8_t>(factors[f - 1].n_rows(), false)
                      : std::move(wanted[l - 1]);
            if (f > 0 || l > 1) {
                detail::for_each_index(factor.n_rows(), [&](Index r) {
                    if (!rows[r])
                        return;
                    for (auto k = factor.offsets[r]; k < factor.offsets[r + 1]; ++k)
                        detail::set_flag(inputs[factor.indices[k]]);
                });
            }
            needed[l][f] = std::move(rows);
            rows = std::move(inputs);
        }
        wanted[l - 1] = std::move(rows);
    }

    // Forwards: their places, and the rows over them.
    const Index n_base = n_base_points_;
    Chain chain;
    std::vector<Index> place = levels_[0].base_vertices;
    if (place.empty()) {
        place.resize(n_base);
        std::iota(place.begin(), place.end(), Index(0));
    }
    chain.place.push_back(place);
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        for (std::size_t f = 0; f < levels_[l].factors.size(); ++f) {
            const StencilTable& factor = levels_[l].factors[f];
            const std::vector<std::uint8_t>& rows = needed[l][f];
            std::vector<Index> next(factor.n_rows(), kInvalidIndex);
            // Their number first, then their places and weights.
            struct Size {
                Index n_rows = 0;
                std::size_t n_weights = 0;
            };
            std::vector<Size> first(detail::n_chunks(factor.n_rows()) + 1);
            detail::for_each_chunk(
                factor.n_rows(), detail::kChunk,
                [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                    for (std::size_t r = begin; r < end; ++r) {
                        if (!rows[r])
                            continue;
                        ++first[chunk + 1].n_rows;
                        first[chunk + 1].n_weights +=
                            factor.offsets[r + 1] - factor.offsets[r];
                    }
                });
            first[0] = {chain.rows.n_rows(), chain.rows.indices.size()};
            for (std::size_t chunk = 1; chunk < first.size(); ++chunk) {
                first[chunk].n_rows += first[chunk - 1].n_rows;
                first[chunk].n_weights += first[chunk - 1].n_weights;
            }
            chain.rows.offsets.resize(first.back().n_rows + std::size_t(1));
            chain.rows.indices.resize(first.back().n_weights);
            chain.rows.weights.resize(first.back().n_weights);
            detail::for_each_chunk(
                factor.n_rows(), detail::kChunk,
                [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                    auto [row, weight] = first[chunk];
                    for (std::size_t r = begin; r < end; ++r) {
                        if (!rows[r])
                            continue;
                        next[r] = n_base + row;
                        for (std::size_t k = factor.offsets[r]; k < factor.offsets[r + 1];
                             ++k, ++weight) {
                            chain.rows.indices[weight] = place[factor.indices[k]];
                            chain.rows.weights[weight] = factor.weights[k];
                        }
                        chain.rows.offsets[++row] = weight;
                    }
                });
            chain.groups.push_back(chain.rows.n_rows());
            place = std::move(next);
        }
        chain.place.push_back(place);
    }
    return chain;
}

}  // namespace osdx
