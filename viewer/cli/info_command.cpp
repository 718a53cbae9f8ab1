// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <osdx/features.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {
namespace {

const char* plural(std::int64_t n) {
    return n == 1 ? "" : "s";
}

Index count_control_points(const PatchTable& patches) {
    std::set<Index> points;
    for (Index p = 0; p < patches.n_patches(); ++p) {
        const PatchRef patch = patches.patch(p);
        points.insert(patch.points.begin(), patch.points.end());
    }
    return static_cast<Index>(points.size());
}

/// \param features  as tags, before the border is taken as what it is
Json info_mesh(const Job& job, const Features& features) {
    const Topology& t = job.surface.base();
    const auto unused = job.surface.unused_vertices();
    Json tags = Json::object();
    for (const Tag& tag : job.mesh.tags)
        tags[tag.name] = tags.value(tag.name, 0) + 1;
    Index n_bare = 0;
    for (Index f = 0; f < t.n_faces(); ++f)
        n_bare += !job.surface.patches().has_surface(f);

    Json mesh = mesh_details(t);
    mesh["unused_vertices"] = std::vector<Index>(unused.begin(), unused.end());
    mesh["tags"] = tags;
    mesh["features"] = feature_report(features);
    mesh["faces_without_surface"] = n_bare;
    return mesh;
}

Json info_report(const Job& job, const Features& features, int degree) {
    const PatchTable& patches = job.surface.patches();
    Json by_level = Json::object();
    for (int level = 0; level < patches.n_levels(); ++level)
        by_level[std::to_string(level)] = patch_counts(patches, level);
    return {{"mesh", info_mesh(job, features)},
            {"degree", degree},
            {"refinement_levels", patches.n_levels() - 1},
            {"patches", patch_counts(patches)},
            {"patches_by_level", by_level},
            {"control_points", count_control_points(patches)}};
}

std::string mesh_lines(const Json& mesh, bool ignore_tags) {
    const bool closed = mesh["closed"].get<bool>();
    const auto components = mesh["components"].get<Index>(),
               loops = mesh["boundary_loops"].get<Index>();
    const std::string border =
        closed ? "closed"
               : fmt::format("open with {} boundary edges in {} loop{}",
                             mesh["boundary_edges"].get<Index>(), loops, plural(loops));
    std::string lines = fmt::format(
        "{} vertices, {} edges, {} faces, {}; {} component{}, Euler number {}\n",
        mesh["vertices"].get<Index>(), mesh["edges"].get<Index>(),
        mesh["faces"].get<Index>(), border, components, plural(components),
        mesh["euler"].get<long long>());
    lines += fmt::format("valences:   {}\n", one_line(mesh["valences"]));
    if (!closed)
        lines +=
            fmt::format("at borders: {} (faces)\n", one_line(mesh["boundary_valences"]));
    lines += fmt::format("face sizes: {}\n", one_line(mesh["face_sizes"]));
    const Json& tags = mesh["tags"];
    lines += fmt::format("tags:       {}{}\n", one_line(tags),
                         ignore_tags && !tags.empty() ? " (ignored)" : "");
    lines += feature_lines(mesh["features"], closed);
    if (const auto n_bare = mesh["faces_without_surface"].get<Index>(); n_bare > 0)
        lines += fmt::format("bare:       {} faces without surface\n", n_bare);
    if (const Json& unused = mesh["unused_vertices"]; !unused.empty()) {
        lines +=
            fmt::format("unused:     {} vertices that no face uses, the first is {}\n",
                        unused.size(), unused[0].get<Index>());
    }
    return lines;
}

std::string patch_lines(const PatchTable& patches, const Json& report) {
    const int n_steps = patches.n_levels() - 1;
    std::string lines =
        fmt::format("degree {}: {} level{} of refinement, {} control points\n",
                    report["degree"].get<int>(), n_steps, plural(n_steps),
                    report["control_points"].get<Index>());
    lines += fmt::format("patches:    {}\n", patch_summary(patches));
    for (int level = 0; level < patches.n_levels(); ++level)
        lines += fmt::format("  level {}:  {}\n", level, patch_summary(patches, level));
    return lines;
}

}  // namespace

Status info_command(const CommandOptions& options) {
    ProgressBar progress(options);
    progress.stage("laying patches");
    const Result<Job> job = load_job(options, progress);
    if (!job)
        return job.error();
    const Result<Features> features =
        build_features(job->mesh, job->surface.base(), options.features);
    if (!features)
        return in_file(features.error(), options.input);
    const Json report = info_report(*job, *features, options.patches.degree);
    if (const Status s = write_report(options, report, progress); !s)
        return s;
    progress.print(mesh_lines(report["mesh"], options.features.ignore_tags) +
                   patch_lines(job->surface.patches(), report));
    return ok();
}

}  // namespace osdx::cli
