// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <osdx/features.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"

namespace osdx::cli {
namespace {

const char* plural(std::int64_t n) {
    return n == 1 ? "" : "s";
}

}  // namespace

Status info_command(const CommandOptions& options) {
    const Result<Job> job = load_job(options);
    if (!job)
        return job.error();
    const Topology& t = job->surface.base();
    const PatchTable& patches = job->surface.patches();
    // As tags, before the border is taken as what it is.
    const Result<Features> features = build_features(job->mesh, t, options.features);
    if (!features)
        return in_file(features.error(), options.input);

    std::set<Index> control_points;
    for (Index p = 0; p < patches.n_patches(); ++p) {
        const PatchRef patch = patches.patch(p);
        control_points.insert(patch.points.begin(), patch.points.end());
    }
    Json by_level = Json::object();
    for (int level = 0; level < patches.n_levels(); ++level)
        by_level[std::to_string(level)] = patch_counts(patches, level);
    Json tags = Json::object();
    for (const Tag& tag : job->mesh.tags)
        tags[tag.name] = tags.value(tag.name, 0) + 1;
    const auto unused = job->surface.unused_vertices();
    Index n_bare = 0;
    for (Index f = 0; f < t.n_faces(); ++f)
        n_bare += !patches.has_surface(f);

    Json mesh = mesh_details(t);
    mesh["unused_vertices"] = std::vector<Index>(unused.begin(), unused.end());
    mesh["tags"] = tags;
    mesh["features"] = feature_report(*features);
    mesh["faces_without_surface"] = n_bare;
    const Json report = {{"mesh", mesh},
                         {"degree", options.patches.degree},
                         {"refinement_levels", patches.n_levels() - 1},
                         {"patches", patch_counts(patches)},
                         {"patches_by_level", by_level},
                         {"control_points", control_points.size()}};
    if (const Status s = write_report(options, report); !s)
        return s;

    const bool closed = mesh["closed"].get<bool>();
    const auto components = mesh["components"].get<Index>(),
               loops = mesh["boundary_loops"].get<Index>();
    const std::string border =
        closed ? "closed"
               : fmt::format("open with {} boundary edges in {} loop{}",
                             mesh["boundary_edges"].get<Index>(), loops, plural(loops));
    fmt::print("{} vertices, {} edges, {} faces, {}; {} component{}, Euler number {}\n",
               t.n_vertices(), t.n_edges, t.n_faces(), border, components,
               plural(components), mesh["euler"].get<long long>());
    fmt::print("valences:   {}\n", one_line(mesh["valences"]));
    if (!closed)
        fmt::print("at borders: {} (faces)\n", one_line(mesh["boundary_valences"]));
    fmt::print("face sizes: {}\n", one_line(mesh["face_sizes"]));
    fmt::print("tags:       {}{}\n", one_line(tags),
               options.features.ignore_tags && !tags.empty() ? " (ignored)" : "");
    fmt::print("{}", feature_lines(mesh["features"], closed));
    if (n_bare > 0)
        fmt::print("bare:       {} faces without surface\n", n_bare);
    if (!unused.empty()) {
        fmt::print("unused:     {} vertices that no face uses, the first is {}\n",
                   unused.size(), unused[0]);
    }
    fmt::print("degree {}: {} level{} of refinement, {} control points\n",
               options.patches.degree, patches.n_levels() - 1,
               plural(patches.n_levels() - 1), control_points.size());
    fmt::print("patches:    {}\n", patch_summary(patches));
    for (int level = 0; level < patches.n_levels(); ++level)
        fmt::print("  level {}:  {}\n", level, patch_summary(patches, level));
    return ok();
}

}  // namespace osdx::cli
