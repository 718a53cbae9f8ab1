// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <filesystem>
#include <string>

#include <fmt/format.h>

#include <osdx/analysis/comparison.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/measure.h"
#include "viewer/cli/pictures.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {
namespace {

Json family_report(const Job& job, const Measures& m) {
    Json report = {{"patches", patch_counts(job.surface.patches())}};
    report.update(m.report());
    report["seconds"] = {{"build", job.seconds_build},
                         {"points", m.seconds_points},
                         {"evaluate", m.seconds_evaluate}};
    return report;
}

std::string family_lines(const CommandOptions& options, const Job& job,
                         const Measures& m) {
    const Continuity& c = m.continuity;
    std::string lines =
        fmt::format("{} patches (degree {}): {}\n", options.patch, options.patches.degree,
                    patch_summary(job.surface.patches()));
    lines +=
        fmt::format("  to the Catmull-Clark limit, over the bounding-box diagonal: {}\n",
                    distance_line(m.limit));
    lines += fmt::format(
        "  across patch edges: gap {:.1e} of the diagonal, normal jump {:.1e} degrees, "
        "curvature jump {:.1e} of the largest\n",
        c.gap_max, c.normal_jump_deg_max, c.curvature_jump_max);
    if (c.n_sharp_samples > 0) {
        lines += fmt::format(
            "  across infinitely sharp edges: angles between normals up to {:.1f} "
            "degrees\n",
            c.sharp_normal_jump_deg_max);
    }
    return lines;
}

/// What a comparison tells: as JSON, and in lines for people.
struct Findings {
    Json report;
    std::string lines;
};

/// Both surfaces over the base of the job, at the samples of an even rate.
Result<SurfaceDistance> distance_between(const Job& job, const SurfaceFunction& from,
                                         const SurfaceFunction& to,
                                         const CommandOptions& options) {
    const Result<SurfaceDistance> distance =
        measure_distance(job.surface.base(), job.surface.features(), from, to,
                         options.rate + options.rate % 2, job.diagonal());
    if (!distance)
        return in_file(distance.error(), options.input);
    return distance;
}

/// OpenSubdiv's patches, at a low isolation.
Status add_catmark(const Job& job, const LimitSurface& limit,
                   const CommandOptions& options, ProgressBar& progress,
                   Findings& findings) {
    progress.stage("measuring OpenSubdiv's patches");
    const Result<LimitSurface> peer = job.build_limit(options.with_isolation);
    if (!peer)
        return in_file(peer.error(), options.input);
    const Topology& base = job.surface.base();
    const auto to_limit = distance_between(job, surface_function(base, *peer),
                                           surface_function(base, limit), options);
    if (!to_limit)
        return to_limit.error();
    findings.report["with"] = {{"patch", options.with},
                               {"isolation", options.with_isolation},
                               {"patches", {{"all", peer->n_patches()}}},
                               {"limit", distance_report(*to_limit)}};
    findings.lines +=
        fmt::format("OpenSubdiv at isolation {}: {} patches\n  to the limit: {}\n",
                    options.with_isolation, peer->n_patches(), distance_line(*to_limit));
    return ok();
}

/// Another family of ours.
Status add_family(const Job& job, const LimitSurface& limit,
                  const CommandOptions& options, ProgressBar& progress,
                  Findings& findings) {
    CommandOptions others = options;
    others.patch = options.with;
    Result<Job> other = build_job(job.mesh, others);  // the file may be a pipe
    if (!other)
        return other.error();
    const Result<Measures> m = measure(*other, limit, options.rate, progress);
    if (!m)
        return in_file(m.error(), options.input);
    progress.stage("measuring the distance between the two");
    const auto between =
        distance_between(job, job.function(), other->function(), options);
    if (!between)
        return between.error();
    Json& with = findings.report["with"];
    with = family_report(*other, *m);
    with["patch"] = options.with;
    with["distance"] = distance_report(*between);
    findings.lines += family_lines(others, *other, *m);
    findings.lines += fmt::format("between {} and {}: {}\n", options.patch, options.with,
                                  distance_line(*between));
    return ok();
}

Status draw_pictures(const Job& job, const LimitSurface& limit,
                     const std::filesystem::path& folder, ProgressBar& progress) {
    if (const Status s = make_folder(folder); !s)
        return s;
    render::PictureInput input = job_picture(job);
    show_distance(input, job.surface, limit, job.diagonal());
    for (const auto& [shade, name] : kPictures) {
        progress.stage(fmt::format("tracing {}", name));
        const auto file = folder / fmt::format("{}.png", name);
        if (const Status s = write_picture(input, {}, shade, file); !s)
            return s;
    }
    return ok();
}

}  // namespace

Status compare_command(const CommandOptions& options) {
    ProgressBar progress(options);
    progress.stage("laying patches");
    Result<Job> job = load_job(options, progress);
    if (!job)
        return job.error();
    const Topology& base = job->surface.base();
    const int isolation = options.limit_isolation;
    progress.stage("building the limit surface");
    const Result<LimitSurface> limit = job->build_limit(isolation);
    if (!limit)
        return in_file(limit.error(), options.input);
    const Result<double> error = isolation_error(
        base, job->surface.features(), job->mesh.positions, isolation, job->diagonal());
    if (!error)
        return in_file(error.error(), options.input);
    const Result<Measures> m = measure(*job, *limit, options.rate, progress);
    if (!m)
        return in_file(m.error(), options.input);
    if (!options.images.empty()) {
        const Status s = draw_pictures(*job, *limit, options.images, progress);
        if (!s)
            return s;
    }

    Findings f;
    f.report = {{"mesh", mesh_report(base)}, {"degree", options.patches.degree}};
    f.report.update(family_report(*job, *m));
    f.report["limit"]["isolation"] = isolation;
    f.report["limit"]["isolation_error"] = *error;
    f.lines = family_lines(options, *job, *m);
    f.lines +=
        fmt::format("(limit of OpenSubdiv at isolation {}, itself within {:.1e})\n",
                    isolation, *error);
    if (!options.with.empty()) {
        const auto add = options.with == "catmark" ? add_catmark : add_family;
        if (const Status s = add(*job, *limit, options, progress, f); !s)
            return s;
    }
    if (const Status s = write_report(options, f.report, progress); !s)
        return s;
    progress.print(f.lines);
    return ok();
}

}  // namespace osdx::cli
