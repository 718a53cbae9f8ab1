// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/measure.h"

#include <fmt/format.h>

#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

namespace osdx::cli {

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

Json Measures::report() const {
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

Result<Measures> measure(Job& job, const LimitSurface& limit, int rate,
                         ProgressBar& progress) {
    Measures m;
    const Topology& base = job.surface.base();
    Stopwatch watch;
    if (const Status s = job.surface.set_positions(job.mesh.positions); !s)
        return s.error();
    m.seconds_points = watch.lap();
    (void)job.tessellate({.rate = rate});
    m.seconds_evaluate = watch.lap();

    progress.stage("measuring continuity");
    const auto continuity = measure_continuity(job.surface, rate, *progress.work());
    if (!continuity)
        return continuity.error();
    m.continuity = *continuity;
    progress.stage("measuring distances to the limit surface");
    const auto distance = measure_distance(base, job.surface.features(), job.function(),
                                           surface_function(base, limit), rate + rate % 2,
                                           job.diagonal(), progress.work());
    if (!distance)
        return distance.error();
    m.limit = *distance;
    return m;
}

}  // namespace osdx::cli
