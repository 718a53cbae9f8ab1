// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/pictures.h"

#include <system_error>

#include <fmt/format.h>

#include <osdx/query.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

namespace osdx::cli {

using namespace render;

PictureInput job_picture(const Job& job) {
    PictureInput input = picture_input(job.surface);
    if (job.limit) {
        input.surface = job.function();
        input.patch = nullptr;
        input.patch_groups.clear();
    }
    return input;
}

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

}  // namespace osdx::cli
