// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/patch_table.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/pictures.h"
#include "viewer/cli/progress.h"
#include "viewer/render/picture.h"

namespace osdx::cli {

Status render_command(const CommandOptions& options) {
    const std::string extension = options.out.extension().string();
    if (!extension.empty() && !is_extension(extension, ".png")) {
        return in_file(fail(ErrorCode::InvalidOption,
                            fmt::format("the extension '{}' is not .png: pictures are "
                                        "written as PNG only",
                                        extension)),
                       options.out);
    }
    ProgressBar progress(options);
    progress.stage("laying patches");
    const Result<Job> job = load_job(options, progress);
    if (!job)
        return job.error();
    render::PictureInput input = job_picture(*job);
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
    if (options.shade == "color") {
        if (const Status s = show_color(input, *job, options.limit_isolation); !s)
            return in_file(s.error(), options.input);
    }
    input.title = fmt::format("{}, degree {}", options.input.filename().string(),
                              options.patch == "catmark" ? 3 : options.patches.degree);
    render::PictureOptions picture;
    picture.width = options.width;
    picture.height = options.height;
    picture.azimuth_deg = options.azimuth;
    picture.elevation_deg = options.elevation;
    picture.range = options.range;
    progress.stage("tracing");
    const Status s =
        write_picture(input, picture, *render::parse_shade(options.shade), options.out);
    if (!s)
        return s;
    return write_report(options,
                        {{"mesh", mesh_report(job->surface.base())},
                         {"patches", patch_counts(job->surface.patches())},
                         {"width", options.width},
                         {"height", options.height},
                         {"shade", options.shade}},
                        progress);
}

}  // namespace osdx::cli
