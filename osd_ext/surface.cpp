// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <functional>
#include <map>

#include <fmt/format.h>

#include <osdx/build_patch_table.h>
#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/surface.h>

#include "far/parallel.h"

namespace osdx {

Result<Surface> Surface::build(const MeshData& data, const PatchTableOptions& options,
                               const FeatureOptions& tags) {
    Result<Topology> topology = build_topology(data);
    if (!topology)
        return topology.error();
    Result<Features> features = build_features(data, *topology, tags);
    if (!features)
        return features.error();
    // Gregory patches take interior vertices of two faces.
    if (options.family == PatchFamily::Multisided) {
        const Status s = check_surface(data, *topology, *features, options.degree);
        if (!s)
            return s.error();
    }

    Result<PatchTable> table =
        build_patch_table(std::move(*topology), std::move(*features), options);
    if (!table)
        return table.error();

    Surface s;
    s.table_ = std::make_unique<const PatchTable>(std::move(*table));
    detail::in_parallel(
        [&] { s.evaluator_ = std::make_unique<const Evaluator>(*s.table_); },
        [&] {
            s.points_.resize(s.table_->n_points());
            detail::for_each_index(data.positions.size(),
                                   [&](Index v) { s.points_[v] = data.positions[v]; });
            s.table_->refresh_points<double>(s.points_);
        });
    for (Index v = s.base().find_valence(0); v != kInvalidIndex;
         v = s.base().find_valence(0, v + 1))
        s.unused_vertices_.push_back(v);
    return s;
}

namespace {

/// \param vertex  of position i
template <class Vertex>
Status check_positions(std::span<const Vec3<double>> positions, Vertex&& vertex) {
    const Index i = detail::first_index(positions.size(), [&](Index k) {
        const auto& p = positions[k];
        return !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z);
    });
    if (i == kInvalidIndex)
        return ok();
    const auto& p = positions[i];
    return fail(
        ErrorCode::NonFinitePoint,
        fmt::format("vertex {} has the position ({}, {}, {})", vertex(i), p.x, p.y, p.z),
        vertex(i));
}

}  // namespace

Status Surface::set_positions(std::span<const Vec3<double>> positions) {
    if (positions.size() != base().n_vertices()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("{} positions were given for {} vertices",
                                positions.size(), base().n_vertices()));
    }
    if (const Status s = check_positions(positions, [](Index v) { return v; }); !s)
        return s;
    detail::for_each_index(positions.size(), [&](Index v) { points_[v] = positions[v]; });
    table_->refresh_points<double>(points_);
    return ok();
}

Result<Change> Surface::move_vertices(std::span<const Index> vertices,
                                      std::span<const Vec3<double>> positions) {
    if (positions.size() != vertices.size()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("{} positions were given for {} vertices",
                                positions.size(), vertices.size()));
    }
    for (const Index v : vertices) {
        if (v >= base().n_vertices()) {
            return fail(ErrorCode::IndexOutOfRange,
                        fmt::format("vertex {} was to be moved, but the mesh has {}", v,
                                    base().n_vertices()),
                        v);
        }
    }
    if (const Status s = check_positions(positions, [&](Index i) { return vertices[i]; });
        !s)
        return s.error();
    if (!dependents_)
        dependents_ = std::make_unique<const Dependents>(*table_);
    for (std::size_t i = 0; i < vertices.size(); ++i)
        points_[vertices[i]] = positions[i];
    Change change = dependents_->of(vertices);
    table_->refresh_channels(3, std::span(&points_.data()->x, 3 * points_.size()),
                             change.points);
    return change;
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
