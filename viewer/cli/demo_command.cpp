// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <ostream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <osdx/file.h>
#include <osdx/files/tessellation_file.h>
#include <osdx/opensubdiv/limit_surface.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/demo_mesh.h"
#include "viewer/cli/job.h"
#include "viewer/cli/measure.h"
#include "viewer/cli/pictures.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {

Status demo_command(const CommandOptions& options) {
    constexpr int kRate = 8;
    if (const Status s = make_folder(options.out); !s)
        return s;
    CommandOptions own = options;
    own.input = options.out / "valve_body.obj";
    if (const Status s = written(
            write_file(own.input, [](std::ostream& out) { out << demo_mesh_obj(); }),
            own.input);
        !s)
        return s;
    fmt::print("The mesh, {}:\n", own.input.string());
    own.json = options.out / "info.json";
    if (const Status s = info_command(own); !s)
        return s;

    Progress progress;
    progress.print(fmt::format(
        "\nDistance to the Catmull-Clark limit and joins of the patches, by degree\n"
        "(lengths over the bounding-box diagonal, angles in degrees):\n\n"
        "{:>6} {:>11} {:>11} {:>11} {:>9} {:>9} {:>9}  {}\n",
        "degree", "distance", "rms", "normal rms", "gap", "normal", "curvature",
        "patches"));
    Json table = Json::array();
    for (int degree = 2; degree <= 7; ++degree) {
        own.patches.degree = degree;
        progress.stage(fmt::format("degree {}", degree));
        Result<Job> job = load_job(own);
        if (!job)
            return job.error();
        // The limit surface refers to the base of one job; each job has its own.
        auto built = job->build_limit(own.limit_isolation);
        if (!built)
            return in_file(built.error(), own.input);
        const Result<Measures> m = measure(*job, *built, kRate, progress);
        if (!m)
            return in_file(m.error(), own.input);
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
    own.json = options.out / "compare.json";
    if (const Status s = write_report(own, table); !s)
        return s;

    own.patches.degree = 3;
    const Result<Job> job = load_job(own);
    if (!job)
        return job.error();
    progress.stage("writing the tessellation");
    const auto glb = options.out / "surface.glb";
    if (const Status s =
            written(write_tessellation(glb, job->surface.tessellate(kRate)), glb);
        !s)
        return s;

    progress.print(fmt::format("\nwrote {}\n", glb.string()));
    auto built = job->build_limit(own.limit_isolation);
    if (!built)
        return in_file(built.error(), own.input);
    const auto picture = [&](const render::PictureInput& input, render::Shade shade,
                             std::string_view name) {
        progress.stage(fmt::format("tracing {}", name));
        const auto file = options.out / fmt::format("{}.png", name);
        const Status s = write_picture(input, {}, shade, file);
        if (s)
            progress.print(fmt::format("wrote {}\n", file.string()));
        return s;
    };
    render::PictureInput input = job_picture(*job);
    show_distance(input, job->surface, *built, job->diagonal());
    input.title = "osdx, degree 3";
    for (const auto& [shade, name] : kPictures) {
        if (const Status s = picture(input, shade, name); !s)
            return s;
    }
    render::PictureInput catmark = input;
    catmark.surface = surface_function(job->surface.base(), *built);
    catmark.title = "Catmull-Clark limit";
    if (const Status s =
            picture(catmark, render::Shade::Reflection, "reflection_catmark");
        !s)
        return s;
    own.patches.degree = 5;
    const Result<Job> quintic = load_job(own);
    if (!quintic)
        return quintic.error();
    render::PictureInput input5 = job_picture(*quintic);
    input5.title = "osdx, degree 5";
    return picture(input5, render::Shade::Reflection, "reflection_degree5");
}

}  // namespace osdx::cli
