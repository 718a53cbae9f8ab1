// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "osd_ext/surface.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>

#include "far/features.h"

namespace osdx {

Result<Surface> Surface::build(const MeshData& data, const SurfaceOptions& options) {
    Result<Topology> topology = build_topology(data);
    if (!topology)
        return topology.error();
    Result<Features> features = build_features(
        data, *topology,
        {.ignore_tags = options.ignore_tags, .boundary = options.boundary});
    if (!features)
        return features.error();
    // Gregory patches take interior vertices of two faces.
    if (options.family == PatchFamily::Multisided) {
        const Status s = check_surface(data, *topology, *features, options.degree);
        if (!s)
            return s.error();
    }

    Result<PatchTable> table =
        build_patch_table(std::move(*topology), std::move(*features),
                          {.degree = options.degree,
                           .family = options.family,
                           .levels = options.levels,
                           .uniform = options.uniform,
                           .paper_tangents = options.paper_tangents,
                           .normalised = options.normalised,
                           .isolation = options.isolation});
    if (!table)
        return table.error();

    Surface s;
    s.table_ = std::make_unique<const PatchTable>(std::move(*table));
    s.evaluator_ = std::make_unique<const Evaluator>(*s.table_);
    s.points_.resize(s.table_->n_points());
    std::ranges::copy(data.positions, s.points_.begin());
    s.table_->refresh_points<double>(s.points_);
    for (Index v = 0; v < s.base().n_vertices(); ++v) {
        if (s.base().vertex_halfedge[v] == kInvalidIndex)
            s.unused_vertices_.push_back(v);
    }
    return s;
}

Status Surface::set_positions(std::span<const Vec3<double>> positions) {
    if (positions.size() != base().n_vertices()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("{} positions were given for {} vertices",
                                positions.size(), base().n_vertices()));
    }
    for (Index v = 0; v < positions.size(); ++v) {
        const auto& p = positions[v];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
            return fail(
                ErrorCode::NonFinitePoint,
                fmt::format("vertex {} has the position ({}, {}, {})", v, p.x, p.y, p.z),
                v);
        }
    }
    std::ranges::copy(positions, points_.begin());
    table_->refresh_points<double>(points_);
    return ok();
}

void Surface::add_base_weights(const Address& where, int r, double scale,
                               std::span<double> weights) const {
    const PatchPoint point = table_->locate(where);
    const PatchRef patch = table_->patch(point.patch);
    const std::size_t n = patch.points.size();
    std::vector<double> all(n_derivatives(2) * n);
    evaluator_->weights(point, 2, Chart::BaseUV, all);
    // From the last point back: each hands its weight on to the points before it.
    std::map<Index, double, std::greater<>> open;
    for (std::size_t i = 0; i < n; ++i)
        open[patch.points[i]] += scale * all[r * n + i];
    const StencilTable& rows = table_->refined_points();
    while (!open.empty()) {
        const auto [index, w] = *open.begin();
        open.erase(open.begin());
        if (index < weights.size()) {
            weights[index] += w;
            continue;
        }
        const std::size_t row = index - weights.size();
        for (std::size_t k = rows.offsets[row]; k < rows.offsets[row + 1]; ++k)
            open[rows.indices[k]] += w * rows.weights[k];
    }
}

SurfaceFunction Surface::function(Chart chart) const {
    return [this, chart](const QuarterPoint& p) {
        return evaluator_->evaluate<double>(points_, p, chart);
    };
}

Tessellation Surface::tessellate(int rate) const {
    return osdx::tessellate(*evaluator_, points_, rate);
}

}  // namespace osdx
