// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/job.h"

#include <ostream>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/add_channels.h>
#include <osdx/build_patch_table.h>
#include <osdx/file.h>
#include <osdx/mesh_file.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

namespace osdx::cli {

Error in_file(Error error, const std::filesystem::path& file) {
    error.message = error.line > 0 ? fmt::format("{}:{}: {}", file.string(), error.line,
                                                 error.message)
                                   : fmt::format("{}: {}", file.string(), error.message);
    return error;
}

SurfaceFunction Job::function(Chart chart) const {
    return limit ? surface_function(surface.base(), *limit)
                 : surface_function(surface, chart);
}

Tessellation Job::tessellate(const TessellationRates& rates) const {
    return limit ? osdx::tessellate(surface.base(), surface.features(), rates, function())
                 : surface.tessellate(rates);
}

Result<Tessellation> Job::tessellate(int rate, Progress& progress) const {
    if (limit)
        return tessellate({.rate = rate});
    return surface.tessellate(rate, progress);
}

Status Job::add_channels(Tessellation& t, int limit_isolation) const {
    if (!limit)
        return osdx::add_channels(t, surface, mesh.channels);
    // Three numbers at a time, in the place of positions.
    for (const NamedChannels& c : mesh.channels) {
        NamedChannels own{c.name, c.n, {}};
        own.values.resize(t.addresses.size() * static_cast<std::size_t>(c.n));
        for (int first = 0; first < c.n; first += 3) {
            const Result<LimitSurface> built =
                build_limit(c.view(), first, limit_isolation);
            if (!built)
                return built.error();
            const auto to = channels(own.values.data(), c.n);
            for (std::size_t i = 0; i < t.addresses.size(); ++i) {
                const Vec3<double> p = built->evaluate(t.addresses[i]).p;
                for (int k = 0; k < 3 && first + k < c.n; ++k)
                    to[i][first + k] = p[k];
            }
        }
        t.channels.push_back(std::move(own));
    }
    return ok();
}

double Job::diagonal() const {
    return bounding_diagonal(mesh.positions);
}

Result<LimitSurface> Job::build_limit(int isolation) const {
    return LimitSurface::build(surface.base(), surface.features(), mesh.positions,
                               isolation);
}

Result<LimitSurface> Job::build_limit(Channels<const double> channels, int first,
                                      int isolation) const {
    std::vector<Vec3<double>> values(surface.base().n_vertices(), Vec3<double>(0));
    for (std::size_t v = 0; v < values.size(); ++v) {
        for (int k = 0; k < 3 && first + k < channels.n; ++k)
            values[v][k] = channels[v][first + k];
    }
    return LimitSurface::build(surface.base(), surface.features(), values, isolation);
}

Result<Job> load_job(const CommandOptions& options, Progress* progress) {
    Result<MeshData> mesh = read_mesh(options.input);
    if (!mesh)
        return in_file(mesh.error(), options.input);
    Stopwatch watch;
    PatchTableOptions patches = options.patches;
    patches.family =
        options.patch == "gregory" ? PatchFamily::Gregory : PatchFamily::Multisided;
    Result<Surface> surface = Surface::build(*mesh, patches, options.features, progress);
    if (!surface)
        return in_file(surface.error(), options.input);
    Job job{std::move(*mesh), std::move(*surface), std::nullopt, watch.lap()};
    if (options.patch == "catmark") {
        Result<LimitSurface> limit = job.build_limit(options.limit_isolation);
        if (!limit)
            return in_file(limit.error(), options.input);
        job.limit.emplace(std::move(*limit));
    }
    return job;
}

Result<TextureSurface> load_texture(const Job& job, const CommandOptions& options) {
    Result<TextureSurface> texture =
        TextureSurface::build(job.surface, job.mesh, options.features, options.uv_rule);
    if (!texture)
        return in_file(texture.error(), options.input);
    return texture;
}

Status written(Status status, const std::filesystem::path& file) {
    return status ? std::move(status) : in_file(status.error(), file);
}

Status write_report(const CommandOptions& options, const Json& report) {
    if (options.json.empty())
        return ok();
    return write_file(options.json,
                      [&](std::ostream& out) { out << report.dump(2) << '\n'; });
}

}  // namespace osdx::cli
