// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <string>

#include <fmt/format.h>

#include <osdx/analysis/comparison.h>
#include <osdx/opensubdiv/limit_surface.h>

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

}  // namespace

Status compare_command(const CommandOptions& options) {
    Progress progress;
    progress.stage("laying patches");
    Result<Job> job = load_job(options);
    if (!job)
        return job.error();
    const Topology& base = job->surface.base();
    const double diagonal = job->diagonal();
    const int even_rate = options.rate + options.rate % 2;
    progress.stage("building the limit surface");
    const Result<LimitSurface> limit = job->build_limit(options.limit_isolation);
    if (!limit)
        return in_file(limit.error(), options.input);
    const Result<double> error =
        isolation_error(base, job->surface.features(), job->mesh.positions,
                        options.limit_isolation, diagonal);
    if (!error)
        return in_file(error.error(), options.input);
    const Result<Measures> m = measure(*job, *limit, options.rate, progress);
    if (!m)
        return in_file(m.error(), options.input);

    if (!options.images.empty()) {
        if (const Status s = make_folder(options.images); !s)
            return s;
        render::PictureInput input = job_picture(*job);
        show_distance(input, job->surface, *limit, diagonal);
        for (const auto& [shade, name] : kPictures) {
            progress.stage(fmt::format("tracing {}", name));
            const auto file = options.images / fmt::format("{}.png", name);
            if (const Status s = write_picture(input, {}, shade, file); !s)
                return s;
        }
    }

    Json report = {{"mesh", mesh_report(base)}, {"degree", options.patches.degree}};
    report.update(family_report(*job, *m));
    report["limit"]["isolation"] = options.limit_isolation;
    report["limit"]["isolation_error"] = *error;

    std::string lines = family_lines(options, *job, *m);
    lines += fmt::format("(limit of OpenSubdiv at isolation {}, itself within {:.1e})\n",
                         options.limit_isolation, *error);
    if (options.with == "catmark") {
        progress.stage("measuring OpenSubdiv's patches");
        const Result<LimitSurface> peer = job->build_limit(options.with_isolation);
        if (!peer)
            return in_file(peer.error(), options.input);
        const auto to_limit =
            measure_distance(base, job->surface.features(), surface_function(base, *peer),
                             surface_function(base, *limit), even_rate, diagonal);
        if (!to_limit)
            return in_file(to_limit.error(), options.input);
        report["with"] = {{"patch", options.with},
                          {"isolation", options.with_isolation},
                          {"patches", {{"all", peer->n_patches()}}},
                          {"limit", distance_report(*to_limit)}};
        lines += fmt::format(
            "OpenSubdiv at isolation {}: {} patches\n  to the limit: {}\n",
            options.with_isolation, peer->n_patches(), distance_line(*to_limit));
    } else if (!options.with.empty()) {
        CommandOptions others = options;
        others.patch = options.with;
        Result<Job> other = load_job(others);
        if (!other)
            return other.error();
        const Result<Measures> n = measure(*other, *limit, options.rate, progress);
        if (!n)
            return in_file(n.error(), options.input);
        progress.stage("measuring the distance between the two");
        const auto between =
            measure_distance(base, job->surface.features(), job->function(),
                             other->function(), even_rate, diagonal);
        if (!between)
            return in_file(between.error(), options.input);
        report["with"] = family_report(*other, *n);
        report["with"]["patch"] = options.with;
        report["with"]["distance"] = distance_report(*between);
        lines += family_lines(others, *other, *n);
        lines += fmt::format("between {} and {}: {}\n", options.patch, options.with,
                             distance_line(*between));
    }
    if (const Status s = write_report(options, report); !s)
        return s;
    progress.print(lines);
    return ok();
}

}  // namespace osdx::cli
