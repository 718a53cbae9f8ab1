// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/job.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <ostream>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/add_channels.h>
#include <osdx/build_patch_table.h>
#include <osdx/build_topology.h>
#include <osdx/creases.h>
#include <osdx/file.h>
#include <osdx/mesh_file.h>
#include <osdx/repair.h>
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

namespace {

/// "3 vertices welded, 1 face turned".
std::string one_line(const RepairReport& r) {
    std::string line;
    const auto add = [&](Index n, std::string_view one, std::string_view several,
                         std::string_view what) {
        if (n > 0) {
            line += fmt::format("{}{} {} {}", line.empty() ? "" : ", ", n,
                                n == 1 ? one : several, what);
        }
    };
    add(r.n_welded, "vertex", "vertices", "welded");
    add(r.n_dropped_faces, "face", "faces", "dropped");
    add(r.n_shortened_faces, "face", "faces", "without repeated vertices");
    add(r.n_parted_edges, "edge", "edges", "of three or more faces parted");
    add(r.n_cut_edges, "edge", "edges", "cut that no orientation suits");
    add(r.n_flipped_faces, "face", "faces", "turned");
    add(r.n_added_vertices, "vertex", "vertices", "added");
    add(r.n_dropped_tags, "tag", "tags", "dropped");
    return line.empty() ? "nothing to do" : line;
}

}  // namespace

namespace {

Result<MeshData> repaired_mesh(const MeshData& mesh, const CommandOptions& options) {
    RepairOptions how{.faces = options.repair};
    how.weld = options.weld.value_or(how.weld);
    Result<RepairedMesh> repaired = repair(mesh, how);
    if (!repaired)
        return in_file(repaired.error(), options.input);
    if (!options.quiet) {
        fmt::print(stderr, "osdx: {}: repaired: {}\n", options.input.string(),
                   one_line(repaired->report));
    }
    return std::move(repaired->mesh);
}

}  // namespace

Result<MeshData> load_mesh(const CommandOptions& options) {
    Result<MeshData> mesh = read_mesh(options.input);
    if (!mesh)
        return in_file(mesh.error(), options.input);
    for (const Warning& warning : mesh->warnings) {
        if (!options.quiet)
            warn(warning, options.input);
    }
    if (options.repair || options.weld)
        mesh = repaired_mesh(*mesh, options);
    if (!mesh || !options.crease_angle)
        return mesh;
    const Result<Topology> topology = build_topology(*mesh);
    if (!topology)
        return refused(topology.error(), options);
    std::vector<Tag> creases = crease_tags(*mesh, *topology, *options.crease_angle);
    // A later tag replaces an earlier one.
    mesh->tags.insert(mesh->tags.end(), std::make_move_iterator(creases.begin()),
                      std::make_move_iterator(creases.end()));
    return mesh;
}

Error refused(Error error, const CommandOptions& options) {
    using enum ErrorCode;
    constexpr std::array kRepaired = {FaceTooSmall, RepeatedVertex, NonManifoldEdge,
                                      OppositeFaces, NonManifoldVertex};
    if (!options.repair && std::ranges::find(kRepaired, error.code) != kRepaired.end())
        error.message += " (--repair helps)";
    return in_file(std::move(error), options.input);
}

Result<Job> load_job(const CommandOptions& options, Progress* progress) {
    Result<MeshData> mesh = load_mesh(options);
    if (!mesh)
        return mesh.error();
    Stopwatch watch;
    PatchTableOptions patches = options.patches;
    patches.family =
        options.patch == "gregory" ? PatchFamily::Gregory : PatchFamily::Multisided;
    Result<Surface> surface = Surface::build(*mesh, patches, options.features, progress);
    if (!surface)
        return refused(surface.error(), options);
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

std::string to_text(const Json& json, int indent) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

void warn(const Warning& warning, const std::filesystem::path& file) {
    const Error as_error = in_file(
        {ErrorCode::FileFormat, warning.message, kInvalidIndex, warning.line}, file);
    fmt::print(stderr, "osdx: warning: {}\n", as_error.message);
}

Status write_report(const CommandOptions& options, const Json& report) {
    if (options.json.empty())
        return ok();
    return write_file(options.json,
                      [&](std::ostream& out) { out << to_text(report, 2) << '\n'; });
}

}  // namespace osdx::cli
