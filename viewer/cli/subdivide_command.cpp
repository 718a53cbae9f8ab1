// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <osdx/mesh_file.h>
#include <osdx/subdivide.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {

Status subdivide_command(const CommandOptions& options) {
    ProgressBar progress;
    progress.stage("reading");
    const Result<MeshData> data = load_mesh(options);
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
    if (options.patches.degree % 2 == 0 &&
        !(data->groups.faces.empty() && data->objects.faces.empty() &&
          data->materials.faces.empty() && data->face_uvs.empty())) {
        progress.print(
            "faces of even degrees are no parts of those before: without their groups, "
            "objects, materials and texture coordinates\n");
    }
    progress.stage("writing");
    if (const Status s = written(write_mesh(options.out, mesh), options.out); !s)
        return s;
    return write_report(
        options, {{"degree", options.patches.degree},
                  {"levels", options.levels},
                  {"mesh", mesh_report(mesh.positions.size(), mesh.face_sizes.size(),
                                       refined->n_border_edges)}});
}

}  // namespace osdx::cli
