// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include <osdx/analysis/comparison.h>
#include <osdx/analysis/continuity.h>
#include <osdx/opensubdiv/limit_surface.h>

#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"
#include "viewer/cli/report.h"

namespace osdx::cli {

/// {"distance_max", "distance_rms", "normal_deg_max", "normal_deg_rms", "samples"}
Json distance_report(const SurfaceDistance& distance);
std::string distance_line(const SurfaceDistance& distance);

/// What `compare` measures of one surface, and `demo` of each degree.
struct Measures {
    SurfaceDistance limit;  ///< to the limit surface
    Continuity continuity;
    double seconds_points = 0;    ///< for the control points of new positions
    double seconds_evaluate = 0;  ///< for a tessellation

    Json report() const;  ///< {"limit", "continuity"}
};

/// \param limit  of the mesh of the job
Result<Measures> measure(Job& job, const LimitSurface& limit, int rate,
                         ProgressBar& progress);

}  // namespace osdx::cli
