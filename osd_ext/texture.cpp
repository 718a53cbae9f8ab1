// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <cassert>
#include <utility>

#include <osdx/build_topology.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/tessellate.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

Result<TextureSurface> TextureSurface::build(const MeshData& data,
                                             const PatchTableOptions& options,
                                             const FeatureOptions& tags,
                                             std::optional<FaceVaryingRule> rule) {
    const Result<Topology> built = build_topology(data);
    if (!built)
        return built.error();
    const Topology& topology = *built;
    if (data.face_uvs.empty()) {
        return fail(ErrorCode::NoTexcoords, "the mesh has no texture coordinates");
    }
    const Result<Features> features = build_features(data, topology, tags);
    if (!features)
        return features.error();
    const Result<FaceVaryingRule> used = face_varying_rule(data, rule, tags.ignore_tags);
    if (!used)
        return used.error();
    Result<FaceVarying> channel =
        build_face_varying(topology, *features, data.face_uvs, *used);
    if (!channel)
        return channel.error();

    TextureSurface s;
    s.channel_ = std::make_unique<const FaceVarying>(std::move(*channel));
    const FaceVarying& c = *s.channel_;
    for (const Index value : c.values) {
        s.values_.push_back(data.uvs[value].x);
        s.values_.push_back(data.uvs[value].y);
    }
    if (c.rule == FaceVaryingRule::All)
        return s;
    if (const Status status = check_surface(data, c.topology, c.features, options.degree);
        !status)
        return status.error();
    Result<PatchTable> table = build_patch_table(
        c.topology, c.features,
        {.degree = options.degree,
         .multisided = {.crease_end_level = 4, .isolate_corners = true}});
    if (!table)
        return table.error();
    s.table_ = std::make_unique<const PatchTable>(std::move(*table));
    s.evaluator_ = std::make_unique<const Evaluator>(*s.table_);
    s.values_.resize(2 * std::size_t(s.table_->n_points()));
    s.table_->refresh_channels<double>(2, s.values_);
    return s;
}

TextureJet TextureSurface::evaluate(const QuarterPoint& where) const noexcept {
    if (!table_)
        return interpolate(where);
    std::array<double, 6> d;
    evaluator_->evaluate_channels<double>(values_, 2, table_->locate(where), 1,
                                          Chart::BaseUV, d);
    return {{d[0], d[1]}, {d[2], d[3]}, {d[4], d[5]}};
}

TextureJet TextureSurface::interpolate(const QuarterPoint& where) const noexcept {
    const Topology& t = channel_->topology;
    const auto at = [&](Index h) {
        const std::size_t v = t.vertex[h];
        return Vec2<double>(values_[2 * v], values_[2 * v + 1]);
    };
    const Index face = t.face(where.quarter), first = t.face_offsets[face],
                n = t.face_size(face);
    // The corners of the bilinear patch, from (0,0) counter-clockwise.
    std::array<Vec2<double>, 4> p;
    double x = where.x, y = where.y, scale = 2;
    if (n == 4) {
        const Address a = to_address(t, where);
        x = a.u, y = a.v, scale = 1;
        for (Index c = 0; c < 4; ++c)
            p[c] = at(first + c);
    } else {
        const Vec2<double> corner = at(where.quarter);
        Vec2<double> centre(0);
        for (Index h = first; h < first + n; ++h)
            centre += at(h);
        p = {corner, 0.5 * (corner + at(t.next(where.quarter))), centre / double(n),
             0.5 * (corner + at(t.prev(where.quarter)))};
    }
    return {(1 - y) * ((1 - x) * p[0] + x * p[1]) + y * ((1 - x) * p[3] + x * p[2]),
            scale * ((1 - y) * (p[1] - p[0]) + y * (p[2] - p[3])),
            scale * ((1 - x) * (p[3] - p[0]) + x * (p[2] - p[1]))};
}

void TextureSurface::add_to(Tessellation& t, int rate) const {
    add(t, {.rate = rate});
}

void TextureSurface::add_to(Tessellation& t, const Topology& base,
                            const TessellationRates& rates) const {
    // The same corners; edges of the mesh have one each on both sides of a seam.
    const Topology& cut = channel_->topology;
    std::vector<int> edges(rates.edges.empty() ? 0 : cut.n_edges);
    if (!edges.empty()) {
        for (Index h = 0; h < cut.n_halfedges(); ++h)
            edges[cut.edge[h]] = rates.edges[base.edge[h]];
    }
    add(t, {rates.rate, edges, rates.faces});
}

void TextureSurface::add(Tessellation& t, const TessellationRates& rates) const {
    // The same facets over the other topology: what is shared there is shared here.
    ResolvedFeatures holes;
    holes.hole = channel_->features.hole;
    Tessellation own =
        tessellate(channel_->topology, holes, rates, [this](const QuarterPoint& q) {
            SurfaceJet<double> jet;
            jet.p = Vec3<double>(evaluate(q).p, 0);
            return jet;
        });
    assert(own.facet_faces == t.facet_faces && own.facet_sizes == t.facet_sizes);
    t.texcoords.assign(own.positions.begin(), own.positions.end());
    t.facet_texcoords = std::move(own.facet_points);
}

}  // namespace osdx::inline OSDX_ABI
