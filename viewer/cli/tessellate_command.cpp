// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <osdx/files/tessellation_file.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {

Status tessellate_command(const CommandOptions& options) {
    ProgressBar progress;
    progress.stage("laying patches");
    const Result<Job> job = load_job(options, progress.work());
    if (!job)
        return job.error();
    progress.stage("evaluating");
    Stopwatch watch;
    Result<Tessellation> tessellated = job->tessellate(options.rate, *progress.work());
    if (!tessellated)
        return tessellated.error();
    Tessellation& t = *tessellated;
    const double seconds = watch.lap();
    if (!job->mesh.face_uvs.empty()) {
        const Result<TextureSurface> texture = load_texture(*job, options);
        if (!texture)
            return texture.error();
        texture->add_to(t, options.rate);
    }
    if (const Status s = job->add_channels(t, options.limit_isolation); !s)
        return in_file(s.error(), options.input);
    progress.stage("writing");
    if (const Status s = written(write_tessellation(options.out, t), options.out); !s)
        return s;
    return write_report(
        options, {{"mesh", mesh_report(job->surface.base())},
                  {"points", t.positions.size()},
                  {"facets", t.facet_sizes.size()},
                  {"seconds", {{"build", job->seconds_build}, {"evaluate", seconds}}}});
}

}  // namespace osdx::cli
