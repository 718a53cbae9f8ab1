// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/build_patch_table.h>
#include <osdx/evaluate_addresses.h>
#include <osdx/evaluator.h>
#include <osdx/face_varying.h>
#include <osdx/face_varying_surface.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/tessellate.h>
#include <osdx/topology.h>

#include "far/mesh/address_counts.h"
#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// The bilinear patch under a point, and the place of the point there.
struct Bilinear {
    const Topology& base;
    Index face, first, n, corner;
    double x, y, scale;

    Bilinear(const Topology& t, const QuarterPoint& where)
        : base(t),
          face(t.face(where.quarter)),
          first(t.face_offsets[face]),
          n(t.face_size(face)),
          corner(where.quarter),
          x(where.x),
          y(where.y),
          scale(2) {
        if (n == 4) {
            const Address a = to_address(t, where);
            x = a.u, y = a.v, scale = 1;
        }
    }

    /// The corners of the patch, from (0,0) counter-clockwise.
    /// \param at  at(h): the value at corner h of the mesh
    template <class At>
    std::array<double, 4> corners(At&& at) const {
        if (n == 4)
            return {at(first), at(first + 1), at(first + 2), at(first + 3)};
        double centre = 0;
        for (Index h = first; h < first + n; ++h)
            centre += at(h);
        return {at(corner), 0.5 * (at(corner) + at(base.next(corner))),
                centre / double(n), 0.5 * (at(corner) + at(base.prev(corner)))};
    }

    /// p, du, dv, duu, duv, dvv.
    std::array<double, 6> jet(const std::array<double, 4>& p) const {
        return {(1 - y) * ((1 - x) * p[0] + x * p[1]) + y * ((1 - x) * p[3] + x * p[2]),
                scale * ((1 - y) * (p[1] - p[0]) + y * (p[2] - p[3])),
                scale * ((1 - x) * (p[3] - p[0]) + x * (p[2] - p[1])),
                0,
                scale * scale * (p[2] - p[1] + p[0] - p[3]),
                0};
    }
};

template <class T>
void interpolate(const Topology& t, std::span<const T> points, int n_channels,
                 const QuarterPoint& where, int order, T* out) noexcept {
    const Bilinear patch(t, where);
    for (int c = 0; c < n_channels; ++c) {
        const auto jet = patch.jet(patch.corners([&](Index h) {
            return double(points[std::size_t(t.vertex[h]) * n_channels + c]);
        }));
        for (int r = 0; r < n_derivatives(order); ++r)
            out[r * n_channels + c] = static_cast<T>(jet[r]);
    }
}

}  // namespace

struct FaceVaryingSurface::Impl {
    const FaceVarying channel;
    const Index n_values;
    const std::vector<Index> second_sides;  // the mesh's edge of each edge that is added
    // None for the rule All; they stay put, the evaluator refers to the table.
    std::optional<const PatchTable> table = {};
    std::optional<const Evaluator> evaluator = {};

    /// From the first use of dependents() on.
    struct Moves {
        std::vector<Index> offsets,
            vertices;  // those of the channel that have each value
        std::optional<const Dependents> dependents;
    };
    std::optional<const Moves> moves = {};

    bool has_point(const Address& at) const noexcept {
        return at.face < channel.topology.n_faces() &&
               !channel.features.is_hole(at.face) && at.u == at.u && at.v == at.v;
    }

    /// Calls f(vertex, value) for the vertices that have one of the values.
    template <class F>
    void for_each_moved(std::span<const Index> moved, F&& f) const {
        for (const Index value : moved) {
            for (Index i = moves->offsets[value]; i < moves->offsets[value + 1]; ++i)
                f(moves->vertices[i], value);
        }
    }

    void make_moves() {
        Moves m;
        m.offsets.assign(std::size_t(n_values) + 1, 0);
        for (const Index value : channel.values)
            ++m.offsets[value + 1];
        for (Index i = 0; i < n_values; ++i)
            m.offsets[i + 1] += m.offsets[i];
        m.vertices.resize(channel.values.size());
        std::vector<Index> next(m.offsets.begin(), m.offsets.end() - 1);
        for (Index v = 0; v < channel.values.size(); ++v)
            m.vertices[next[channel.values[v]]++] = v;
        if (table)
            m.dependents.emplace(*table);
        moves.emplace(std::move(m));
    }

    template <class T>
    void refresh(Channels<const T> values, std::span<T> points) const {
        const auto n = static_cast<std::size_t>(values.n);
        assert(points.size() == n_points() * n);
        detail::for_each_index(channel.values.size(), [&](Index v) {
            std::copy_n(values[channel.values[v]], n, &points[v * n]);
        });
        if (table)
            table->refresh_channels(values.n, points);
    }

    template <class T>
    void refresh(Channels<const T> values, const Change& change,
                 std::span<const Index> moved, std::span<T> points) const {
        const auto n = static_cast<std::size_t>(values.n);
        assert(moves && points.size() == n_points() * n);
        for_each_moved(moved, [&](Index v, Index value) {
            std::copy_n(values[value], n, &points[v * n]);
        });
        if (table)
            table->refresh_channels<T>(values.n, points, change.points);
    }

    Index n_points() const noexcept {
        return table ? table->n_points() : channel.topology.n_vertices();
    }

    template <class T>
    void evaluate(std::span<const T> points, int n_channels, const QuarterPoint& where,
                  int order, std::span<T> out) const noexcept {
        assert(points.size() == std::size_t(n_points()) * n_channels);
        assert(out.size() == std::size_t(n_derivatives(order)) * n_channels);
        if (table) {
            evaluator->evaluate_channels<T>(points, n_channels, table->locate(where),
                                            order, Chart::BaseUV, out);
        } else {
            interpolate(channel.topology, points, n_channels, where, order, out.data());
        }
    }

    template <class T>
    void evaluate(std::span<const T> points, int n_channels, const Address& where,
                  int order, std::span<T> out) const noexcept {
        if (has_point(where))
            evaluate(points, n_channels, to_quarter(channel.topology, where), order, out);
        else
            std::ranges::fill(out, std::numeric_limits<T>::quiet_NaN());
    }

    template <class T>
    AddressReport evaluate(std::span<const T> points, int n_channels,
                           std::span<const Address> where, int order,
                           Channels<T> out) const {
        assert(points.size() == std::size_t(n_points()) * n_channels);
        assert(out.n == n_derivatives(order) * n_channels);
        if (table) {
            return evaluate_addresses(*evaluator, points, n_channels, where, order,
                                      Chart::BaseUV, out);
        }
        const Topology& t = channel.topology;
        detail::AddressCounts counts;
        detail::for_each_chunk(
            where.size(), detail::kSmallChunk,
            [&](std::size_t, std::size_t begin, std::size_t end) {
                std::size_t n_clamped = 0, n_without = 0, first_without = SIZE_MAX;
                for (std::size_t i = begin; i < end; ++i) {
                    if (!has_point(where[i])) {
                        std::fill_n(out[i], out.n, std::numeric_limits<T>::quiet_NaN());
                        ++n_without;
                        first_without = std::min(first_without, i);
                        continue;
                    }
                    const QuarterPoint q = to_quarter(t, where[i]);
                    n_clamped += detail::was_clamped(t, where[i], q);
                    interpolate(t, points, n_channels, q, order, out[i]);
                }
                counts.add(n_clamped, n_without, first_without);
            });
        return counts.report();
    }

    template <class T>
    void add_to(Tessellation& t, std::string name, std::span<const T> points,
                int n_channels, const TessellationRates& rates) const {
        std::vector<int> edges(rates.edges.begin(), rates.edges.end());
        if (!edges.empty()) {
            for (const Index e : second_sides)
                edges.push_back(rates.edges[e]);
        }
        // The same facets over the other topology: what is shared there is shared here. Each
        // point is where it lies, which a double holds exactly.
        ResolvedFeatures holes;
        holes.hole = channel.features.hole;
        const Tessellation own =
            tessellate(channel.topology, holes, {rates.rate, edges, rates.faces},
                       [](const QuarterPoint& q) {
                           SurfaceJet<double> jet;
                           jet.p = {double(q.quarter), q.x, q.y};
                           return jet;
                       });
        assert(own.facet_faces == t.facet_faces && own.facet_sizes == t.facet_sizes);
        const auto n = static_cast<std::size_t>(n_channels);
        FaceVaryingChannels& result = t.face_varying.emplace_back();
        result.name = std::move(name);
        result.n = n_channels;
        result.corner_values.assign(own.facet_points.begin(), own.facet_points.end());
        result.values.resize(n * own.positions.size());
        detail::for_each_chunk(
            own.positions.size(), detail::kSmallChunk,
            [&](std::size_t, std::size_t begin, std::size_t end) {
                std::vector<T> value(n);
                for (std::size_t i = begin; i < end; ++i) {
                    const Vec3<double>& p = own.positions[i];
                    const QuarterPoint at{static_cast<Index>(p.x), p.y, p.z};
                    evaluate<T>(points, n_channels, at, 0, value);
                    std::ranges::copy(value, &result.values[n * i]);
                }
            });
    }
};

Result<FaceVaryingSurface> FaceVaryingSurface::build(const Surface& surface,
                                                     const FaceVaryingView& corners) {
    const Topology& base = surface.base();
    if (const Status s = check_face_varying(corners, base); !s)
        return s.error();
    Result<FaceVarying> built =
        build_face_varying(base, surface.features(), corners.corner_values, corners.rule);
    if (!built)
        return built.error();
    std::vector<Index> second_sides(built->topology.n_edges - base.n_edges);
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        if (built->topology.edge[h] != base.edge[h])
            second_sides[built->topology.edge[h] - base.n_edges] = base.edge[h];
    }
    FaceVaryingSurface s(std::unique_ptr<Impl>(
        new Impl{std::move(*built), corners.n_values, std::move(second_sides)}));
    if (corners.rule == FaceVaryingRule::All)
        return s;
    const FaceVarying& c = s.channel();
    const int degree = surface.patches().degree();
    // A surface of Gregory patches may have what these are refused for.
    if (const Status fit = check_surface(MeshView{}, c.topology, c.features, degree);
        !fit) {
        Error error = fit.error();
        if (error.code == ErrorCode::ValenceTwo) {
            error.element = base.vertex[c.topology.vertex_halfedge[error.element]];
            error.message = fmt::format("vertex {} is interior and has two faces only",
                                        error.element);
        }
        return error;
    }
    Result<PatchTable> table = build_patch_table(
        c.topology, c.features,
        {.degree = degree,
         .multisided = {.crease_end_level = 4, .isolate_corners = true}});
    if (!table)
        return table.error();
    s.impl_->table.emplace(std::move(*table));
    s.impl_->evaluator.emplace(*s.impl_->table);
    return s;
}

FaceVaryingSurface::FaceVaryingSurface(std::unique_ptr<Impl> impl) noexcept
    : impl_(std::move(impl)) {}
FaceVaryingSurface::FaceVaryingSurface(FaceVaryingSurface&&) noexcept = default;
FaceVaryingSurface& FaceVaryingSurface::operator=(FaceVaryingSurface&&) noexcept =
    default;
FaceVaryingSurface::~FaceVaryingSurface() = default;

const FaceVarying& FaceVaryingSurface::channel() const noexcept {
    return impl_->channel;
}
Index FaceVaryingSurface::n_values() const noexcept {
    return impl_->n_values;
}
Index FaceVaryingSurface::n_points() const noexcept {
    return impl_->n_points();
}

Buffer<float> FaceVaryingSurface::values(Channels<const float> values) const {
    Buffer<float> points(std::size_t(n_points()) * static_cast<std::size_t>(values.n));
    refresh(values, points);
    return points;
}
Buffer<double> FaceVaryingSurface::values(Channels<const double> values) const {
    Buffer<double> points(std::size_t(n_points()) * static_cast<std::size_t>(values.n));
    refresh(values, points);
    return points;
}
void FaceVaryingSurface::refresh(Channels<const float> values,
                                 std::span<float> points) const {
    impl_->refresh(values, points);
}
void FaceVaryingSurface::refresh(Channels<const double> values,
                                 std::span<double> points) const {
    impl_->refresh(values, points);
}

Result<Change> FaceVaryingSurface::dependents(std::span<const Index> moved) {
    for (const Index value : moved) {
        if (value >= n_values()) {
            return fail(ErrorCode::IndexOutOfRange,
                        fmt::format("value {} was to be moved, but there are {}", value,
                                    n_values()),
                        value);
        }
    }
    if (!impl_->moves)
        impl_->make_moves();
    std::vector<Index> vertices;
    impl_->for_each_moved(moved, [&](Index v, Index) { vertices.push_back(v); });
    if (impl_->moves->dependents)
        return impl_->moves->dependents->of(vertices);
    Change change;
    const Topology& t = channel().topology;
    for (const Index v : vertices)
        t.for_each_outgoing(v, [&](Index h) { change.faces.push_back(t.face(h)); });
    std::ranges::sort(change.faces);
    change.faces.erase(std::unique(change.faces.begin(), change.faces.end()),
                       change.faces.end());
    return change;
}
void FaceVaryingSurface::refresh(Channels<const float> values, const Change& change,
                                 std::span<const Index> moved,
                                 std::span<float> points) const {
    impl_->refresh(values, change, moved, points);
}
void FaceVaryingSurface::refresh(Channels<const double> values, const Change& change,
                                 std::span<const Index> moved,
                                 std::span<double> points) const {
    impl_->refresh(values, change, moved, points);
}

void FaceVaryingSurface::evaluate(std::span<const float> points, int n_channels,
                                  const Address& where, int order,
                                  std::span<float> out) const noexcept {
    impl_->evaluate(points, n_channels, where, order, out);
}
void FaceVaryingSurface::evaluate(std::span<const double> points, int n_channels,
                                  const Address& where, int order,
                                  std::span<double> out) const noexcept {
    impl_->evaluate(points, n_channels, where, order, out);
}
void FaceVaryingSurface::evaluate(std::span<const float> points, int n_channels,
                                  const QuarterPoint& where, int order,
                                  std::span<float> out) const noexcept {
    impl_->evaluate(points, n_channels, where, order, out);
}
void FaceVaryingSurface::evaluate(std::span<const double> points, int n_channels,
                                  const QuarterPoint& where, int order,
                                  std::span<double> out) const noexcept {
    impl_->evaluate(points, n_channels, where, order, out);
}
AddressReport FaceVaryingSurface::evaluate(std::span<const float> points, int n_channels,
                                           std::span<const Address> where, int order,
                                           Channels<float> out) const {
    return impl_->evaluate(points, n_channels, where, order, out);
}
AddressReport FaceVaryingSurface::evaluate(std::span<const double> points, int n_channels,
                                           std::span<const Address> where, int order,
                                           Channels<double> out) const {
    return impl_->evaluate(points, n_channels, where, order, out);
}

void FaceVaryingSurface::add_to(Tessellation& t, std::string name,
                                std::span<const float> points, int n_channels,
                                const TessellationRates& rates) const {
    impl_->add_to(t, std::move(name), points, n_channels, rates);
}
void FaceVaryingSurface::add_to(Tessellation& t, std::string name,
                                std::span<const double> points, int n_channels,
                                const TessellationRates& rates) const {
    impl_->add_to(t, std::move(name), points, n_channels, rates);
}
void FaceVaryingSurface::add_to(Tessellation& t, std::string name,
                                std::span<const float> points, int n_channels,
                                int rate) const {
    add_to(t, std::move(name), points, n_channels, {.rate = rate});
}
void FaceVaryingSurface::add_to(Tessellation& t, std::string name,
                                std::span<const double> points, int n_channels,
                                int rate) const {
    add_to(t, std::move(name), points, n_channels, {.rate = rate});
}

}  // namespace osdx::inline OSDX_ABI
