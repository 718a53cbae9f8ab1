// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/pictures.h"

#include <array>
#include <memory>
#include <span>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <osdx/channels.h>
#include <osdx/evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/query.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

namespace osdx::cli {

using namespace render;

std::vector<std::filesystem::path> picture_files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& picture : kPictures)
        files.push_back(folder / fmt::format("{}.png", picture.second));
    return files;
}

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

Status show_color(PictureInput& input, const Job& job, int limit_isolation) {
    const NamedChannels* const color = find_channels(job.mesh.channels, kColorName);
    if (!color)
        return ok();
    if (job.limit) {
        Result<LimitSurface> built = job.build_limit(color->view(), 0, limit_isolation);
        if (!built)
            return built.error();
        const auto limit = std::make_shared<const LimitSurface>(std::move(*built));
        input.color = [&base = job.surface.base(), limit](const QuarterPoint& q) {
            return limit->evaluate(to_address(base, q)).p;
        };
        return ok();
    }
    const auto values =
        std::make_shared<const Buffer<double>>(job.surface.values(color->view()));
    input.color = [&s = job.surface, values, n = color->n](const QuarterPoint& q) {
        std::array<double, 4> c{};
        s.evaluator().evaluate_channels<double>(
            *values, n, s.patches().locate(q), 0, Chart::BaseUV,
            std::span(c).first(static_cast<std::size_t>(n)));
        return Vec3<double>(c[0], c[1], c[2]);
    };
    return ok();
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
