// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <ostream>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include <osdx/channels.h>
#include <osdx/file.h>
#include <osdx/mesh_file.h>
#include <osdx/subdivide.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {
namespace {

void warn_of_even_degree(const MeshData& data, ProgressBar& progress) {
    const char* const kReason = "faces of even degrees are no parts of those before";
    if (!data.groups.faces.empty() || !data.objects.faces.empty() ||
        !data.materials.faces.empty()) {
        progress.warn(
            "names-dropped",
            fmt::format("{}: without their groups, objects and materials", kReason));
    }
    if (!data.face_uvs.empty()) {
        progress.warn("uvs-dropped",
                      fmt::format("{}: without their texture coordinates", kReason));
    }
}

/// Of what the format of a file has no place for.
/// \param data  before refinement: only its own tags are missed
void warn_of_format(const MeshData& data, const MeshData& mesh,
                    std::string_view extension, ProgressBar& progress) {
    const bool is_obj = is_extension(extension, ".obj"),
               is_ply = is_extension(extension, ".ply");
    if (!is_obj && !is_ply && !mesh.face_uvs.empty())
        progress.warn("uvs-dropped", "OFF files have no texture coordinates");
    const auto is_feature = [](const Tag& tag) {
        return tag.name == "crease" || tag.name == "corner" || tag.name == "hole";
    };
    if (!is_obj && std::ranges::any_of(data.tags, is_feature) &&
        std::ranges::any_of(mesh.tags, is_feature))
        progress.warn("tags-dropped", "only OBJ files have creases, corners and holes");
    const auto is_other = [](const NamedChannels& c) { return c.name != kColorName; };
    if (!is_ply && std::ranges::any_of(mesh.channels, is_other))
        progress.warn("channels-dropped", "only PLY files have channels beside colours");
}

Status write_refined(const MeshData& mesh, const CommandOptions& options,
                     const std::string& extension) {
    if (extension == options.out.extension())
        return written(write_mesh(options.out, mesh), options.out);
    const Result<std::string> text = format_mesh(mesh, extension);
    if (!text)
        return in_file(text.error(), options.out);
    return written(write_file(options.out, [&](std::ostream& out) { out << *text; }),
                   options.out);
}

}  // namespace

Status subdivide_command(const CommandOptions& options) {
    ProgressBar progress(options);
    const std::string extension = output_extension(options);
    const Result<std::string> format = format_mesh({}, extension);
    if (!format && format.error().code == ErrorCode::InvalidOption)
        return in_file(format.error(), options.out);
    progress.stage("reading");
    const Result<MeshData> data = load_mesh(options, progress);
    if (!data)
        return data.error();
    progress.stage("refining");
    const Result<SubdividedMesh> refined = subdivide(*data,
                                                     {.degree = options.patches.degree,
                                                      .levels = options.levels,
                                                      .features = options.features,
                                                      .uv_rule = options.uv_rule},
                                                     progress.work());
    if (!refined) {
        // No file is to blame for an option.
        return refined.error().code == ErrorCode::InvalidOption
                   ? refined.error()
                   : refused(refined.error(), options);
    }
    const MeshData& mesh = refined->data;
    if (options.patches.degree % 2 == 0)
        warn_of_even_degree(*data, progress);
    warn_of_format(*data, mesh, extension, progress);
    progress.stage("writing");
    if (const Status s = write_refined(mesh, options, extension); !s)
        return s;
    return write_report(
        options,
        {{"degree", options.patches.degree},
         {"levels", options.levels},
         {"mesh", mesh_report(mesh.positions.size(), mesh.face_sizes.size(),
                              refined->n_border_edges)}},
        progress);
}

}  // namespace osdx::cli
