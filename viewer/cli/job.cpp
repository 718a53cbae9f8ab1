// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/job.h"

#include <algorithm>
#include <array>
#include <cctype>
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
namespace {

/// The extension of a path where it is one of `known`; else that of --format, if that is given.
template <std::size_t N>
std::string extension_of(const std::filesystem::path& path, const std::string& format,
                         const std::array<std::string_view, N>& known) {
    std::string extension = path.extension().string();
    const auto is_this = [&](std::string_view k) { return is_extension(extension, k); };
    if (format.empty() || std::ranges::any_of(known, is_this))
        return extension;
    return "." + format;
}

}  // namespace

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
    return line;
}

const char* name_of(WarningCode code) {
    switch (code) {
        case WarningCode::MissingTexcoords:
            return "uvs-missing";
        case WarningCode::InvalidTexcoords:
            return "uvs-invalid";
        case WarningCode::ExtraValues:
            return "extra-values";
        case WarningCode::MissingHeader:
            return "header-missing";
        case WarningCode::OutsideFace:
            return "outside-face";
    }
    return "";
}

Result<MeshData> read_input(const CommandOptions& options) {
    constexpr std::array<std::string_view, 3> kKnown = {".obj", ".off", ".ply"};
    const Result<std::string> text = read_file(options.input);
    if (!text)
        return in_file(text.error(), options.input);
    Result<MeshData> mesh =
        parse_mesh(*text, extension_of(options.input, options.format, kKnown));
    if (!mesh)
        return in_file(mesh.error(), options.input);
    return mesh;
}

Result<MeshData> repaired_mesh(const MeshData& mesh, const CommandOptions& options,
                               ProgressBar& progress) {
    RepairOptions how{.faces = options.repair};
    how.weld = options.weld.value_or(how.weld);
    Result<RepairedMesh> repaired = repair(mesh, how);
    if (!repaired)
        return in_file(repaired.error(), options.input);
    if (const std::string done = one_line(repaired->report); !done.empty())
        progress.warn("repaired", fmt::format("{}: {}", options.input.string(), done));
    return std::move(repaired->mesh);
}

}  // namespace

void warn(const Warning& warning, const std::filesystem::path& file,
          ProgressBar& progress) {
    const Error as_error = in_file(
        {ErrorCode::FileFormat, warning.message, kInvalidIndex, warning.line}, file);
    progress.warn(name_of(warning.code), as_error.message);
}

Result<MeshData> load_mesh(const CommandOptions& options, ProgressBar& progress) {
    Result<MeshData> mesh = read_input(options);
    if (!mesh)
        return mesh;
    for (const Warning& warning : mesh->warnings)
        warn(warning, options.input, progress);
    if (options.repair || options.weld)
        mesh = repaired_mesh(*mesh, options, progress);
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

Result<Job> load_job(const CommandOptions& options, ProgressBar& progress) {
    Result<MeshData> mesh = load_mesh(options, progress);
    if (!mesh)
        return mesh.error();
    return build_job(std::move(*mesh), options, progress.work());
}

Result<Job> build_job(MeshData mesh, const CommandOptions& options, Progress* progress) {
    Stopwatch watch;
    PatchTableOptions patches = options.patches;
    patches.family =
        options.patch == "gregory" ? PatchFamily::Gregory : PatchFamily::Multisided;
    Result<Surface> surface = Surface::build(mesh, patches, options.features, progress);
    if (!surface)
        return refused(surface.error(), options);
    Job job{std::move(mesh), std::move(*surface), std::nullopt, watch.lap()};
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

bool is_extension(std::string_view extension, std::string_view lower) {
    return std::ranges::equal(extension, lower, {},
                              [](unsigned char c) { return std::tolower(c); });
}

std::string output_extension(const CommandOptions& options) {
    constexpr std::array<std::string_view, 5> kKnown = {".obj", ".off", ".ply", ".stl",
                                                        ".glb"};
    if (!options.out_format.empty())
        return "." + options.out_format;
    return extension_of(options.out, options.format, kKnown);
}

Status write_report(const CommandOptions& options, Json report,
                    const ProgressBar& progress) {
    if (options.json.empty())
        return ok();
    report["warnings"] = progress.warnings();
    // Names of a mesh may have bytes that are no UTF-8.
    return written(
        write_file(options.json,
                   [&](std::ostream& out) { out << to_text(report, 2) << '\n'; }),
        options.json);
}

}  // namespace osdx::cli
