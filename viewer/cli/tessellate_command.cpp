// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <ostream>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include <osdx/channels.h>
#include <osdx/displace.h>
#include <osdx/file.h>
#include <osdx/files/tessellation_file.h>
#include <osdx/tessellation_rates.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"
#include "viewer/render/image.h"

namespace osdx::cli {
namespace {

/// Of the edges and the insides of faces, as the options want them; empty for one rate.
RateArrays measured_rates(const Job& job, const CommandOptions& options) {
    const Surface& s = job.surface;
    if (options.error) {
        return rates_from_error(s.evaluator(), s.points(),
                                *options.error * job.diagonal(), options.max_rate);
    }
    if (options.edge_length) {
        return rates_from_length(s.evaluator(), s.points(),
                                 *options.edge_length * job.diagonal(), options.max_rate);
    }
    return {};
}

/// Moves points by the heights of an image at their texture coordinates.
Status displace_by_image(Tessellation& t, const Job& job, const TextureSurface& texture,
                         const CommandOptions& options) {
    const Result<render::HeightMap> map = render::read_heights(options.displace);
    if (!map)
        return fail(map.error().code, fmt::format("--displace: {}", map.error().message));
    const double scale = options.displace_scale * job.diagonal();
    displace(t, [&](const Address& at, const Vec3<double>&, const Vec3<double>&) {
        return scale * map->at(texture.evaluate(at).p);
    });
    return ok();
}

/// Of what the format of a file has no place for.
void warn_of_format(const Tessellation& t, std::string_view extension,
                    ProgressBar& progress) {
    const bool is_obj = is_extension(extension, ".obj"),
               is_stl = is_extension(extension, ".stl");
    if (is_stl && !t.texcoords.empty())
        progress.warn("uvs-dropped", "STL files have no texture coordinates");
    const auto is_dropped = [&](const NamedChannels& c) {
        return is_stl || (is_obj && c.name != kColorName);
    };
    if (std::ranges::any_of(t.channels, is_dropped)) {
        progress.warn("channels-dropped",
                      is_stl ? "STL files have no colours and other channels"
                             : "OBJ files have no channels beside colours");
    }
}

Status write_surface(const Tessellation& t, const MeshData& mesh,
                     const CommandOptions& options, const std::string& extension) {
    if (extension == options.out.extension())
        return written(write_tessellation(options.out, t, &mesh), options.out);
    const Result<std::string> text = format_tessellation(t, extension, &mesh);
    if (!text)
        return in_file(text.error(), options.out);
    return written(write_file(options.out, [&](std::ostream& out) { out << *text; }),
                   options.out);
}

}  // namespace

Status tessellate_command(const CommandOptions& options) {
    ProgressBar progress(options);
    const std::string extension = output_extension(options);
    const Result<std::string> format = format_tessellation({}, extension);
    if (!format && format.error().code == ErrorCode::InvalidOption)
        return in_file(format.error(), options.out);
    progress.stage("laying patches");
    const Result<Job> job = load_job(options, progress);
    if (!job)
        return job.error();
    progress.stage("evaluating");
    Stopwatch watch;
    const RateArrays measured = measured_rates(*job, options);
    const bool one_rate = measured.edges.empty();
    const TessellationRates rates{options.rate, measured.edges, measured.faces};
    Result<Tessellation> tessellated =
        one_rate ? job->tessellate(options.rate, *progress.work())
                 : Result<Tessellation>(job->tessellate(rates));
    if (!tessellated)
        return tessellated.error();
    Tessellation& t = *tessellated;
    const double seconds = watch.lap();
    if (!job->mesh.face_uvs.empty()) {
        const Result<TextureSurface> texture = load_texture(*job, options);
        if (!texture)
            return texture.error();
        texture->add_to(t, rates);
        if (!options.displace.empty()) {
            if (const Status s = displace_by_image(t, *job, *texture, options); !s)
                return s;
        }
    } else if (!options.displace.empty()) {
        return fail(ErrorCode::NoTexcoords,
                    fmt::format("--displace: {} has no texture coordinates",
                                options.input.string()));
    }
    if (const Status s = job->add_channels(t, options.limit_isolation); !s)
        return in_file(s.error(), options.input);
    progress.stage("writing");
    warn_of_format(t, extension, progress);
    if (const Status s = write_surface(t, job->mesh, options, extension); !s)
        return s;
    Json report = {{"mesh", mesh_report(job->surface.base())},
                   {"points", t.positions.size()},
                   {"facets", t.facet_sizes.size()},
                   {"seconds", {{"build", job->seconds_build}, {"evaluate", seconds}}}};
    if (!one_rate) {
        const auto n_greatest = std::ranges::count(measured.edges, options.max_rate);
        report["rates"] = {
            {"least", std::ranges::min(measured.edges)},
            {"greatest", std::ranges::max(measured.edges)},
            {"edges_at_max_rate", n_greatest},
        };
        if (n_greatest > 0) {
            progress.warn(
                "rate-limited",
                fmt::format("{} of {} edges have the greatest rate, --max-rate {}",
                            n_greatest, measured.edges.size(), options.max_rate));
        }
    }
    return write_report(options, report, progress);
}

}  // namespace osdx::cli
