// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/build_patch_table.h>
#include <osdx/build_topology.h>
#include <osdx/evaluate_addresses.h>
#include <osdx/evaluator.h>
#include <osdx/features.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/topology.h>

#include "far/mesh/position_range.h"
#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {

namespace {

/// \tparam Mesh  MeshData or MeshView: what is checked, with its lines
template <class Mesh>
Result<PatchTable> build_table(const Mesh& mesh, Topology topology, Features features,
                               const PatchTableOptions& options) {
    // Gregory patches take interior vertices of two faces.
    if (options.family == PatchFamily::Multisided) {
        const Status s = check_surface(mesh, topology, features, options.degree);
        if (!s)
            return s.error();
    }
    return build_patch_table(std::move(topology), std::move(features), options);
}

/// \param vertex  vertex(i): that of position i
template <class T, class Vertex>
Status check_positions(Channels<const T> positions, std::size_t n, Vertex&& vertex) {
    if (positions.n != 3) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("positions have 3 channels, not {}", positions.n));
    }
    return detail::check_range(positions, n, vertex, [](Index) { return Index(0); });
}

Error moved_from() {
    return fail(ErrorCode::SizeMismatch,
                "the surface was moved from and has no vertices");
}

}  // namespace

struct Surface::Impl {
    template <class T>
    Impl(PatchTable patches, Channels<const T> positions) : table(std::move(patches)) {
        detail::in_parallel([&] { evaluator.emplace(table); },
                            [&] {
                                points.resize(table.n_points());
                                set(positions);
                            });
        const Topology& base = table.base();
        for (Index v = base.find_valence(0); v != kInvalidIndex;
             v = base.find_valence(0, v + 1))
            unused_vertices.push_back(v);
    }

    template <class T>
    void set(Channels<const T> positions) {
        detail::for_each_index(table.n_base_points(), [&](Index v) {
            const T* p = positions[v];
            points[v] = {p[0], p[1], p[2]};
        });
        table.refresh_points<double>(points);
    }

    template <class T>
    Status set_checked(Channels<const T> positions) {
        const Status sound =
            check_positions(positions, table.n_base_points(), [](Index v) { return v; });
        if (sound)
            set(positions);
        return sound;
    }

    template <class T, class Mesh, class FeaturesOf>
    static Result<Surface> build(const Mesh& mesh, Channels<const T> positions,
                                 FeaturesOf&& features_of,
                                 const PatchTableOptions& options, Progress* progress);

    /// Of no faces: what a surface that was moved from is.
    static const Impl& none() {
        static const Impl impl(
            *build_patch_table(Topology(), Features(), PatchTableOptions()),
            Channels<const double>{nullptr, 3, 3});
        return impl;
    }

    const PatchTable table;  // stays put: the evaluator refers to it
    std::optional<Evaluator> evaluator;
    std::optional<Dependents> dependents;  // from the first use on
    Buffer<Vec3<double>> points;
    std::vector<Index> unused_vertices;
};

/// \param mesh  MeshData or MeshView
/// \param features_of  reads the features of a Topology
template <class T, class Mesh, class FeaturesOf>
Result<Surface> Surface::Impl::build(const Mesh& mesh, Channels<const T> positions,
                                     FeaturesOf&& features_of,
                                     const PatchTableOptions& options,
                                     Progress* progress) {
    return detail::cancellable(progress, [&]() -> Result<Surface> {
        detail::at_stage("linking faces", 0, 0.2);
        Result<Topology> topology = build_topology(mesh);
        if (!topology)
            return topology.error();
        if constexpr (std::is_same_v<Mesh, MeshView>) {
            const Status sound =
                check_positions(positions, mesh.n_vertices, [](Index v) { return v; });
            if (!sound)
                return sound.error();
        }
        Result<Features> features = features_of(*topology);
        if (!features)
            return features.error();
        detail::at_stage("laying patches", 0.2, 0.8);
        Result<PatchTable> patches =
            build_table(mesh, std::move(*topology), std::move(*features), options);
        if (!patches)
            return patches.error();
        detail::at_stage("placing points", 0.8, 1);
        return Surface(std::make_unique<Impl>(std::move(*patches), positions));
    });
}

Result<Surface> Surface::build(const MeshData& mesh, const PatchTableOptions& options,
                               const FeatureOptions& tags, Progress* progress) {
    return Impl::build(
        mesh, channels(mesh.positions.data()),
        [&](const Topology& t) { return build_features(mesh, t, tags); }, options,
        progress);
}
Result<Surface> Surface::build(const MeshView& mesh, Channels<const float> positions,
                               const PatchTableOptions& options, Progress* progress) {
    return Impl::build(
        mesh, positions, [&](const Topology& t) { return build_features(mesh, t); },
        options, progress);
}
Result<Surface> Surface::build(const MeshView& mesh, Channels<const double> positions,
                               const PatchTableOptions& options, Progress* progress) {
    return Impl::build(
        mesh, positions, [&](const Topology& t) { return build_features(mesh, t); },
        options, progress);
}

Surface::Surface(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Surface::Surface(Surface&&) noexcept = default;
Surface& Surface::operator=(Surface&&) noexcept = default;
Surface::~Surface() = default;

const Surface::Impl& Surface::impl() const noexcept {
    return impl_ ? *impl_ : Impl::none();
}

const Topology& Surface::base() const noexcept {
    return impl().table.base();
}
const ResolvedFeatures& Surface::features() const noexcept {
    return impl().table.features();
}
const PatchTable& Surface::patches() const noexcept {
    return impl().table;
}
const Evaluator& Surface::evaluator() const noexcept {
    return *impl().evaluator;
}
std::span<const Vec3<double>> Surface::points() const noexcept {
    return impl().points;
}
std::span<const Index> Surface::unused_vertices() const noexcept {
    return impl().unused_vertices;
}

SurfaceJet<double> Surface::evaluate(const Address& where, Chart chart) const noexcept {
    if (!patches().has_point(where)) {
        constexpr Vec3<double> kNone(std::numeric_limits<double>::quiet_NaN());
        return {kNone, kNone, kNone, kNone, kNone, kNone};
    }
    return evaluator().evaluate<double>(points(), where, chart);
}

Status Surface::set_positions(std::span<const Vec3<double>> positions) {
    if (positions.size() != base().n_vertices()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("{} positions were given for {} vertices",
                                positions.size(), base().n_vertices()));
    }
    return set_positions(channels(positions.data()));
}

Status Surface::set_positions(Channels<const float> positions) {
    if (!impl_)
        return moved_from();
    return impl_->set_checked(positions);
}
Status Surface::set_positions(Channels<const double> positions) {
    if (!impl_)
        return moved_from();
    return impl_->set_checked(positions);
}

Result<Change> Surface::move_vertices(std::span<const Index> vertices,
                                      std::span<const Vec3<double>> positions) {
    if (positions.size() != vertices.size()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("{} positions were given for {} vertices",
                                positions.size(), vertices.size()));
    }
    Result<Change> change = dependents(vertices);
    if (!change)
        return change;
    if (const Status s = check_positions(channels(positions.data()), positions.size(),
                                         [&](Index i) { return vertices[i]; });
        !s)
        return s.error();
    for (std::size_t i = 0; i < vertices.size(); ++i)
        impl_->points[vertices[i]] = positions[i];
    patches().refresh_channels(
        3, std::span(&impl_->points.data()->x, 3 * impl_->points.size()), change->points);
    return change;
}

Result<Change> Surface::dependents(std::span<const Index> vertices) {
    for (const Index v : vertices) {
        if (v >= base().n_vertices()) {
            return fail(ErrorCode::IndexOutOfRange,
                        fmt::format("vertex {} was to be moved, but the mesh has {}", v,
                                    base().n_vertices()),
                        v);
        }
    }
    if (!impl_)
        return moved_from();
    if (!impl_->dependents)
        impl_->dependents.emplace(patches());
    return impl_->dependents->of(vertices);
}

namespace {

template <class T>
void refresh_all(const PatchTable& table, Channels<const T> vertices,
                 std::span<T> values) {
    const auto n = static_cast<std::size_t>(vertices.n);
    assert(values.size() == table.n_points() * n);
    detail::for_each_index(table.n_base_points(),
                           [&](Index v) { std::copy_n(vertices[v], n, &values[v * n]); });
    table.refresh_channels(vertices.n, values);
}

template <class T>
void refresh_some(const PatchTable& table, Channels<const T> vertices,
                  const Change& change, std::span<const Index> moved,
                  std::span<T> values) {
    const auto n = static_cast<std::size_t>(vertices.n);
    assert(values.size() == table.n_points() * n);
    for (const Index v : moved)
        std::copy_n(vertices[v], n, &values[v * n]);
    table.refresh_channels<T>(vertices.n, values, change.points);
}

}  // namespace

Buffer<float> Surface::values(Channels<const float> vertices) const {
    Buffer<float> values(points().size() * static_cast<std::size_t>(vertices.n));
    refresh(vertices, values);
    return values;
}
Buffer<double> Surface::values(Channels<const double> vertices) const {
    Buffer<double> values(points().size() * static_cast<std::size_t>(vertices.n));
    refresh(vertices, values);
    return values;
}
void Surface::refresh(Channels<const float> vertices, std::span<float> values) const {
    refresh_all(patches(), vertices, values);
}
void Surface::refresh(Channels<const double> vertices, std::span<double> values) const {
    refresh_all(patches(), vertices, values);
}
void Surface::refresh(Channels<const float> vertices, const Change& change,
                      std::span<const Index> moved, std::span<float> values) const {
    refresh_some(patches(), vertices, change, moved, values);
}
void Surface::refresh(Channels<const double> vertices, const Change& change,
                      std::span<const Index> moved, std::span<double> values) const {
    refresh_some(patches(), vertices, change, moved, values);
}

AddressReport Surface::evaluate(std::span<const Address> where, int order,
                                Channels<double> out, Chart chart) const {
    return evaluate({&impl().points.data()->x, 3 * impl().points.size()}, 3, where, order,
                    out, chart);
}
AddressReport Surface::evaluate(std::span<const float> values, int n_channels,
                                std::span<const Address> where, int order,
                                Channels<float> out, Chart chart) const {
    return evaluate_addresses(evaluator(), values, n_channels, where, order, chart, out);
}
AddressReport Surface::evaluate(std::span<const double> values, int n_channels,
                                std::span<const Address> where, int order,
                                Channels<double> out, Chart chart) const {
    return evaluate_addresses(evaluator(), values, n_channels, where, order, chart, out);
}

void Surface::add_base_weights(const Address& where, int r, double scale,
                               std::span<double> weights) const {
    if (!patches().has_point(where) || r < 0 || r >= n_derivatives(2) ||
        weights.size() != base().n_vertices())
        return;
    const PatchPoint point = patches().locate(where);
    const PatchRef patch = patches().patch(point.patch);
    const std::size_t n = patch.points.size();
    std::vector<double> all(n_derivatives(2) * n);
    evaluator().weights(point, 2, Chart::BaseUV, all);
    // From the last point back: each hands its weight on to the points before it.
    std::map<Index, double, std::greater<>> open;
    for (std::size_t i = 0; i < n; ++i)
        open[patch.points[i]] += scale * all[static_cast<std::size_t>(r) * n + i];
    const StencilTable& rows = patches().refined_points();
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

SurfaceFunction surface_function(const Surface& surface, Chart chart) {
    const Evaluator& evaluator = surface.evaluator();
    const auto points = surface.points();
    return [&evaluator, points, chart](const QuarterPoint& p) {
        return evaluator.evaluate<double>(points, p, chart);
    };
}

Tessellation Surface::tessellate(int rate) const {
    return osdx::tessellate(evaluator(), points(), rate);
}
Result<Tessellation> Surface::tessellate(int rate, Progress& progress) const {
    return detail::cancellable(&progress, [&]() -> Result<Tessellation> {
        detail::at_stage("evaluating", 0, 1);
        return tessellate(rate);
    });
}

Tessellation Surface::tessellate(const TessellationRates& rates) const {
    return osdx::tessellate(evaluator(), points(), rates);
}

}  // namespace osdx::inline OSDX_ABI
