// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <filesystem>
#include <ostream>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/file.h>
#include <osdx/files/tessellation_file.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/patch_table.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/demo_mesh.h"
#include "viewer/cli/job.h"
#include "viewer/cli/measure.h"
#include "viewer/cli/pictures.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {
namespace {

constexpr int kRate = 8;

Status write_demo_mesh(const std::filesystem::path& file) {
    return written(write_file(file, [](std::ostream& out) { out << demo_mesh_obj(); }),
                   file);
}

Result<Measures> measure_limit(Job& job, const CommandOptions& options,
                               ProgressBar& progress) {
    const Result<LimitSurface> limit = job.build_limit(options.limit_isolation);
    if (!limit)
        return in_file(limit.error(), options.input);
    Result<Measures> m = measure(job, *limit, kRate, progress);
    if (!m)
        return in_file(m.error(), options.input);
    return m;
}

/// Prints a row for each degree. \return the same as JSON
Result<Json> compare_degrees(CommandOptions options, ProgressBar& progress) {
    progress.print(fmt::format(
        "\nDistance to the Catmull-Clark limit and joins of the patches, by degree\n"
        "(lengths over the bounding-box diagonal, angles in degrees):\n\n"
        "{:>6} {:>11} {:>11} {:>11} {:>9} {:>9} {:>9}  {}\n",
        "degree", "distance", "rms", "normal rms", "gap", "normal", "curvature",
        "patches"));
    Json table = Json::array();
    for (int degree = 2; degree <= 7; ++degree) {
        options.patches.degree = degree;
        progress.stage(fmt::format("degree {}", degree));
        Result<Job> job = load_job(options, progress);
        if (!job)
            return job.error();
        const Result<Measures> m = measure_limit(*job, options, progress);
        if (!m)
            return m.error();
        const PatchTable& patches = job->surface.patches();
        const Continuity& c = m->continuity;
        progress.print(fmt::format(
            "{:>6} {:>11.2e} {:>11.2e} {:>11.3f} {:>9.1e} {:>9.1e} {:>9.1e}  {}\n",
            degree, m->limit.distance_max, m->limit.distance_rms, m->limit.normal_deg_rms,
            c.gap_max, c.normal_jump_deg_max, c.curvature_jump_max,
            patch_summary(patches)));
        Json row = {{"degree", degree}, {"patches", patch_counts(patches)}};
        row.update(m->report());
        table.push_back(std::move(row));
    }
    return table;
}

/// Traces a picture into the folder and says so.
Status draw(const render::PictureInput& input, render::Shade shade, std::string_view name,
            const std::filesystem::path& folder, ProgressBar& progress) {
    progress.stage(fmt::format("tracing {}", name));
    const auto file = folder / fmt::format("{}.png", name);
    Status s = write_picture(input, {}, shade, file);
    if (s)
        progress.print(fmt::format("wrote {}\n", file.string()));
    return s;
}

/// The tessellation, and the pictures, beside one of the limit surface.
Status show_cubic(CommandOptions options, ProgressBar& progress) {
    options.patches.degree = 3;
    const Result<Job> job = load_job(options, progress);
    if (!job)
        return job.error();
    progress.stage("writing the tessellation");
    const auto glb = options.out / "surface.glb";
    if (const Status s =
            written(write_tessellation(glb, job->tessellate({.rate = kRate})), glb);
        !s)
        return s;
    progress.print(fmt::format("\nwrote {}\n", glb.string()));

    const Result<LimitSurface> limit = job->build_limit(options.limit_isolation);
    if (!limit)
        return in_file(limit.error(), options.input);
    render::PictureInput input = job_picture(*job);
    show_distance(input, job->surface, *limit, job->diagonal());
    input.title = "osdx, degree 3";
    for (const auto& [shade, name] : kPictures) {
        if (const Status s = draw(input, shade, name, options.out, progress); !s)
            return s;
    }
    render::PictureInput catmark = input;
    catmark.surface = surface_function(job->surface.base(), *limit);
    catmark.title = "Catmull-Clark limit";
    return draw(catmark, render::Shade::Reflection, "reflection_catmark", options.out,
                progress);
}

Status show_quintic(CommandOptions options, ProgressBar& progress) {
    options.patches.degree = 5;
    const Result<Job> job = load_job(options, progress);
    if (!job)
        return job.error();
    render::PictureInput input = job_picture(*job);
    input.title = "osdx, degree 5";
    return draw(input, render::Shade::Reflection, "reflection_degree5", options.out,
                progress);
}

}  // namespace

Status demo_command(const CommandOptions& options) {
    if (const Status s = make_folder(options.out); !s)
        return s;
    CommandOptions own = options;
    own.input = options.out / "valve_body.obj";
    if (const Status s = write_demo_mesh(own.input); !s)
        return s;
    {
        ProgressBar progress(options);
        progress.print(fmt::format("The mesh, {}:\n", own.input.string()));
    }
    own.json = options.out / "info.json";
    if (const Status s = info_command(own); !s)
        return s;

    ProgressBar progress(options);
    const Result<Json> table = compare_degrees(own, progress);
    if (!table)
        return table.error();
    const auto file = options.out / "compare.json";
    const Status s =
        write_file(file, [&](std::ostream& out) { out << table->dump(2) << '\n'; });
    if (!s)
        return in_file(s.error(), file);
    if (const Status shown = show_cubic(own, progress); !shown)
        return shown;
    if (const Status shown = show_quintic(own, progress); !shown)
        return shown;
    Json files = Json::array();
    for (const std::filesystem::path& made : demo_files(options.out))
        files.push_back(made.string());
    return write_report(options, {{"files", files}, {"degrees", *table}}, progress);
}

std::vector<std::filesystem::path> demo_files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files = picture_files(folder);
    for (const char* name : {"valve_body.obj", "info.json", "compare.json", "surface.glb",
                             "reflection_catmark.png", "reflection_degree5.png"})
        files.push_back(folder / name);
    return files;
}

}  // namespace osdx::cli
