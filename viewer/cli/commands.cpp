// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/commands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <ostream>
#include <set>

#include <fmt/format.h>

#include <osdx/analysis/comparison.h>
#include <osdx/analysis/continuity.h>
#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/file.h>
#include <osdx/files/tessellation_file.h>
#include <osdx/mesh_file.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/query.h>
#include <osdx/texture.h>

#include "viewer/cli/demo_mesh.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"
#include "viewer/render/picture.h"

namespace osdx {
namespace {

const char* plural(std::int64_t n) {
    return n == 1 ? "" : "s";
}

Json distance_report(const SurfaceDistance& d) {
    return {{"distance_max", d.distance_max},
            {"distance_rms", d.distance_rms},
            {"normal_deg_max", d.normal_deg_max},
            {"normal_deg_rms", d.normal_deg_rms},
            {"samples", d.n_samples}};
}

std::string distance_line(const SurfaceDistance& d) {
    return fmt::format(
        "distance max {:.3e}, rms {:.3e}; normals max {:.3f}, rms {:.3f} degrees",
        d.distance_max, d.distance_rms, d.normal_deg_max, d.normal_deg_rms);
}

/// What `compare` measures of one surface; used by `demo` for its table.
struct Measures {
    SurfaceDistance limit;
    Continuity continuity;
    double seconds_points = 0, seconds_evaluate = 0;

    Json report() const {
        return {{"limit", distance_report(limit)},
                {"continuity",
                 {{"gap_max", continuity.gap_max},
                  {"normal_jump_deg_max", continuity.normal_jump_deg_max},
                  {"curvature_jump_max", continuity.curvature_jump_max},
                  {"curvature_max", continuity.curvature_max},
                  {"samples", continuity.n_samples},
                  {"sharp_normal_jump_deg_max", continuity.sharp_normal_jump_deg_max},
                  {"sharp_samples", continuity.n_sharp_samples}}}};
    }
};

Result<Measures> measure(Job& job, const LimitSurface& limit, int rate,
                         Progress& progress) {
    Measures m;
    const Topology& base = job.surface.base();
    Stopwatch watch;
    if (const Status s = job.surface.set_positions(job.mesh.positions); !s)
        return s.error();
    m.seconds_points = watch.lap();
    tessellate(base, job.surface.patches().features(), rate, job.function());
    m.seconds_evaluate = watch.lap();

    progress.stage("measuring continuity");
    m.continuity = measure_continuity(job.surface, rate);
    progress.stage("measuring distances to the limit surface");
    const auto distance =
        measure_distance(base, job.surface.features(), job.function(),
                         surface_function(base, limit), rate + rate % 2, job.diagonal());
    if (!distance)
        return distance.error();
    m.limit = *distance;
    return m;
}

/// The texture coordinates of a job's mesh, over the same faces as its surface.
Result<TextureSurface> load_texture(const Job& job, const CommandOptions& options) {
    Result<TextureSurface> texture = TextureSurface::build(
        job.mesh, options.patches, options.features, options.uv_rule);
    if (!texture)
        return in_file(texture.error(), options.input);
    return texture;
}

/// The picture input of a job. The limit surface has no patches of ours to show.
PictureInput job_picture(const Job& job) {
    PictureInput input = picture_input(job.surface);
    if (job.limit) {
        input.surface = job.function();
        input.patch = nullptr;
        input.patch_groups.clear();
    }
    return input;
}

/// Lets Shade::Distance show the distance to the limit surface, over the diagonal.
void show_distance(PictureInput& input, const Surface& surface, const LimitSurface& limit,
                   double diagonal) {
    input.distance = [&surface, to = surface_function(surface.base(), limit), diagonal](
                         const SurfaceJet<double>& s, const QuarterPoint& q) {
        const ClosestPoint there = closest_point(surface.base(), surface.features(), to,
                                                 s.p, q, 1e-9 * diagonal);
        return there.distance / diagonal;
    };
}

Status write_picture(const PictureInput& input, PictureOptions options, Shade shade,
                     const std::filesystem::path& file) {
    options.shade = shade;
    const Result<Image> image = render_picture(input, options);
    if (!image)
        return image.error();
    return written(write_png(file, *image), file);
}

Status make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) {
        return fail(ErrorCode::WriteFailed,
                    fmt::format("{}: the folder cannot be made: {}", folder.string(),
                                error.message()));
    }
    return ok();
}

constexpr std::array kPictures = {
    std::pair(Shade::Phong, "phong"),       std::pair(Shade::Reflection, "reflection"),
    std::pair(Shade::Mean, "mean"),         std::pair(Shade::Gauss, "gauss"),
    std::pair(Shade::Patches, "patches"),   std::pair(Shade::Normals, "normals"),
    std::pair(Shade::Distance, "distance"),
};

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

Status tessellate_command(const CommandOptions& options) {
    Progress progress;
    progress.stage("laying patches");
    const Result<Job> job = load_job(options);
    if (!job)
        return job.error();
    progress.stage("evaluating");
    Stopwatch watch;
    Tessellation t = tessellate(job->surface.base(), job->surface.patches().features(),
                                options.rate, job->function(Chart::Native));
    const double seconds = watch.lap();
    if (!job->mesh.face_uvs.empty()) {
        const Result<TextureSurface> texture = load_texture(*job, options);
        if (!texture)
            return texture.error();
        texture->add_to(t, options.rate);
    }
    progress.stage("writing");
    if (const Status s = written(write_tessellation(options.out, t), options.out); !s)
        return s;
    return write_report(
        options, {{"mesh", mesh_report(job->surface.base())},
                  {"points", t.positions.size()},
                  {"facets", t.facet_sizes.size()},
                  {"seconds", {{"build", job->seconds_build}, {"evaluate", seconds}}}});
}

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
        PictureInput input = job_picture(*job);
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

Status render_command(const CommandOptions& options) {
    Progress progress;
    progress.stage("laying patches");
    const Result<Job> job = load_job(options);
    if (!job)
        return job.error();
    PictureInput input = job_picture(*job);
    std::optional<LimitSurface> limit;
    if (options.shade == "distance") {
        auto built = job->build_limit(options.limit_isolation);
        if (!built)
            return in_file(built.error(), options.input);
        limit.emplace(std::move(*built));
        show_distance(input, job->surface, *limit, job->diagonal());
    }
    std::optional<TextureSurface> texture;
    if (options.shade == "checker") {
        Result<TextureSurface> built = load_texture(*job, options);
        if (!built)
            return built.error();
        texture.emplace(std::move(*built));
        input.texture = [&](const QuarterPoint& q) { return texture->evaluate(q); };
    }
    input.title = fmt::format("{}, degree {}", options.input.filename().string(),
                              options.patch == "catmark" ? 3 : options.patches.degree);
    PictureOptions picture;
    picture.width = options.width;
    picture.height = options.height;
    picture.azimuth_deg = options.azimuth;
    picture.elevation_deg = options.elevation;
    picture.range = options.range;
    progress.stage("tracing");
    const Status s =
        write_picture(input, picture, *parse_shade(options.shade), options.out);
    if (!s)
        return s;
    return write_report(options, {{"mesh", mesh_report(job->surface.base())},
                                  {"patches", patch_counts(job->surface.patches())},
                                  {"width", options.width},
                                  {"height", options.height},
                                  {"shade", options.shade}});
}

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
    const auto picture = [&](const PictureInput& input, Shade shade,
                             const std::string& name) {
        progress.stage(fmt::format("tracing {}", name));
        const auto file = options.out / (name + ".png");
        const Status s = write_picture(input, {}, shade, file);
        if (s)
            progress.print(fmt::format("wrote {}\n", file.string()));
        return s;
    };
    PictureInput input = job_picture(*job);
    show_distance(input, job->surface, *built, job->diagonal());
    input.title = "osdx, degree 3";
    for (const auto& [shade, name] : kPictures) {
        if (const Status s = picture(input, shade, name); !s)
            return s;
    }
    PictureInput catmark = input;
    catmark.surface = surface_function(job->surface.base(), *built);
    catmark.title = "Catmull-Clark limit";
    if (const Status s = picture(catmark, Shade::Reflection, "reflection_catmark"); !s)
        return s;
    own.patches.degree = 5;
    const Result<Job> quintic = load_job(own);
    if (!quintic)
        return quintic.error();
    PictureInput input5 = job_picture(*quintic);
    input5.title = "osdx, degree 5";
    return picture(input5, Shade::Reflection, "reflection_degree5");
}

}  // namespace osdx
