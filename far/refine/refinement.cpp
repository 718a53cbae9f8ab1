// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/refinement.h"

#include <algorithm>
#include <cassert>
#include <deque>
#include <numeric>

#include "far/mesh/topology_edits.h"
#include "far/parallel.h"
#include "far/refine/even.h"
#include "far/refine/level_rows.h"
#include "far/refine/odd.h"
#include "far/refine/stencil_rows.h"

namespace osdx::inline OSDX_ABI {

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

Refinement::Refinement(Topology base, int degree, Features features)
    : degree_(degree), n_base_points_(base.n_vertices()) {
    assert(degree >= kMinDegree && degree <= kMaxDegree);
    const std::vector<Index> borders = border_halfedges(base);
    const bool has_sharp =
        !features.edge_sharpness.empty() || !features.vertex_sharpness.empty();
    ResolvedFeatures resolved = resolve(base, std::move(features), borders);
    if (degree % 2 == 0) {
        levels_.push_back(detail::even_base(std::move(base), resolved));
        return;
    }
    RefinedLevel level;
    level.topology = std::move(base);
    level.features = std::move(resolved);
    if (has_sharp || !borders.empty())
        level.sharp.resize(level.topology.n_vertices(), has_sharp);
    for (const Index h : borders)
        level.sharp[level.topology.vertex[h]] = level.sharp[level.topology.to_vertex(h)] =
            true;
    if (has_sharp)
        detail::keep_sharp(level);
    levels_.push_back(std::move(level));
}

void Refinement::add_refined(std::shared_ptr<const detail::RefinedPart> part) {
    const RefinedLevel& parent = levels_.back();
    const bool parent_is_base = levels_.size() == 1;
    RefinedLevel& level = levels_.emplace_back();
    if (degree_ % 2 == 1)
        detail::refine_odd(parent, std::move(part), degree_, level);
    else
        detail::refine_even(parent, part.get(), degree_, parent_is_base, level);
}

void Refinement::add_level() {
    const Index n_corners = levels_.back().topology.n_halfedges();
    add_refined(nullptr);
    levels_.back().children.resize(n_corners);
    std::iota(levels_.back().children.begin(), levels_.back().children.end(), Index(0));
}

void Refinement::add_level(const Flags& keep) {
    const auto part = detail::part_of(levels_.back(), keep);
    auto children = detail::filled(levels_.back().topology.n_halfedges(), kInvalidIndex);
    detail::for_each_index(part->halfedges.size(),
                           [&](Index h) { children[part->halfedges[h]] = h; });
    add_refined(part);
    levels_.back().children = std::move(children);
}

std::vector<StencilTable> Refinement::factors(int level) const {
    const detail::LevelRows& rows = *levels_[level].rows;
    std::vector<StencilTable> tables;
    detail::PerThread<detail::DenseRow> sums;
    for (int f = 0; f < rows.n_factors(); ++f) {
        tables.push_back(detail::make_rows(
            rows.n_rows(f),
            [&](Index r, StencilTable& table) { rows.add(f, r, sums.local(), table); }));
    }
    return tables;
}

std::vector<Vec3<double>> Refinement::points(std::span<const Vec3<double>> base) const {
    std::vector<Vec3<double>> in(base.begin(), base.end()), out;
    if (!base_vertices().empty()) {
        in.clear();
        for (const Index v : base_vertices())
            in.push_back(base[v]);
    }
    for (int l = 1; l < n_levels(); ++l) {
        for (const StencilTable& factor : factors(l)) {
            out.resize(factor.n_rows());
            factor.apply(std::span<const Vec3<double>>(in), std::span(out));
            in.swap(out);
        }
    }
    return in;
}

namespace {

StencilTable identity_stencils(Index n) {
    StencilTable s;
    for (Index i = 0; i < n; ++i) {
        s.add(i, 1.0);
        s.end_row();
    }
    return s;
}

}  // namespace

StencilTable Refinement::stencils() const {
    const Index n_base = n_base_points_;
    StencilTable product = identity_stencils(levels_[0].topology.n_vertices());
    if (!base_vertices().empty())
        std::ranges::copy(base_vertices(), product.indices.begin());
    for (int l = 1; l < n_levels(); ++l) {
        for (const StencilTable& factor : factors(l))
            product = compose(factor, product, n_base);
    }
    return product;
}

namespace {

/// The rows of a factor that are wanted.
struct WantedRows {
    int level;
    Buffer<Index> rows, place;         // which, and by row: where
    std::vector<StencilTable> tables;  // of kRowChunk rows each, over the factor before
    Index first = 0;
};

}  // namespace

Refinement::Chain Refinement::chain(std::vector<Flags> wanted,
                                    const StencilTable& more) const {
    // Backwards: the rows of each factor, and which of the factor before they read.
    std::deque<WantedRows> factors;
    detail::PerThread<detail::DenseRow> sums;
    for (int l = n_levels(); l-- > 1;) {
        const detail::LevelRows& rows = *levels_[l].rows;
        Flags flags = std::move(wanted[l]);
        for (int f = rows.n_factors(); f-- > 0;) {
            Flags inputs = f > 0   ? Flags(rows.n_rows(f - 1))
                           : l > 1 ? std::move(wanted[l - 1])
                                   : Flags();
            WantedRows& factor = factors.emplace_front();
            factor.level = l;
            factor.rows = detail::flagged(flags, &factor.place);
            factor.tables.resize(detail::n_chunks(factor.rows.size(), detail::kRowChunk));
            detail::for_each_chunk(
                factor.rows.size(), detail::kRowChunk,
                [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                    StencilTable& table = factor.tables[chunk];
                    // Enough inside of a mesh of quads.
                    table.indices.reserve(9 * (end - begin));
                    table.weights.reserve(9 * (end - begin));
                    detail::DenseRow& row_sums = sums.local();
                    for (std::size_t i = begin; i < end; ++i) {
                        rows.add(f, factor.rows[i], row_sums, table);
                        table.end_row();
                    }
                    for (const Index i : table.indices) {
                        if (!inputs.empty())
                            detail::set_flag(inputs[i]);
                    }
                });
            flags = std::move(inputs);
        }
        wanted[l - 1] = std::move(flags);
    }

    // Forwards: their places, and the rows over them.
    struct Chunk {
        std::size_t factor, chunk, first_weight;
    };
    std::vector<Chunk> chunks;
    std::size_t n_weights = 0;
    Chain chain;
    for (std::size_t f = 0; f < factors.size(); ++f) {
        factors[f].first = chain.groups.back();
        chain.groups.push_back(chain.groups.back() +
                               static_cast<Index>(factors[f].rows.size()));
        for (std::size_t c = 0; c < factors[f].tables.size(); ++c) {
            chunks.push_back({f, c, n_weights});
            n_weights += factors[f].tables[c].indices.size();
        }
    }
    chain.rows.offsets.reserve(chain.groups.back() + more.offsets.size());
    chain.rows.indices.reserve(n_weights + more.indices.size());
    chain.rows.weights.reserve(n_weights + more.indices.size());
    chain.rows.offsets.resize(chain.groups.back() + std::size_t(1));
    chain.rows.indices.resize(n_weights);
    chain.rows.weights.resize(n_weights);
    const auto for_each_table = [&](auto&& f) {
        detail::for_each_chunk(
            chunks.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
                const Chunk& chunk = chunks[i];
                f(chunk, chunk.factor, chunk.chunk * detail::kRowChunk);
            });
    };
    for_each_table([&](const Chunk& chunk, std::size_t f, std::size_t begin) {
        WantedRows& factor = factors[f];
        for (Index r = 0; r < factor.tables[chunk.chunk].n_rows(); ++r)
            factor.place[factor.rows[begin + r]] += n_base_points_ + factor.first;
    });
    const std::span<const Index> base_vertices = this->base_vertices();
    for_each_table([&](const Chunk& chunk, std::size_t f, std::size_t begin) {
        const WantedRows& factor = factors[f];
        const StencilTable& table = factor.tables[chunk.chunk];
        const auto place = [&](Index i) {
            return f > 0                   ? factors[f - 1].place[i]
                   : base_vertices.empty() ? i
                                           : base_vertices[i];
        };
        for (Index r = 0; r < table.n_rows(); ++r) {
            chain.rows.offsets[factor.first + begin + r + 1] =
                chunk.first_weight + table.offsets[r + 1];
        }
        for (std::size_t k = 0; k < table.indices.size(); ++k) {
            chain.rows.indices[chunk.first_weight + k] = place(table.indices[k]);
            chain.rows.weights[chunk.first_weight + k] = table.weights[k];
        }
    });
    chain.place.resize(levels_.size());
    chain.place[0].assign(base_vertices.begin(), base_vertices.end());
    if (base_vertices.empty()) {
        chain.place[0].resize(n_base_points_);
        detail::for_each_index(n_base_points_, [&](Index v) { chain.place[0][v] = v; });
    }
    // The last factor of a level makes its points.
    for (WantedRows& factor : factors)
        chain.place[factor.level] = std::move(factor.place);
    return chain;
}

}  // namespace osdx::inline OSDX_ABI
