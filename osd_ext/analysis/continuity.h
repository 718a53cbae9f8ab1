// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/progress.h>
#include <osdx/result.h>
#include <osdx/surface.h>

namespace osdx::inline OSDX_ABI {

/// How well the patches of a surface join: the largest jumps over all patch edges. Borders
/// and the edges of holes join nothing and do not count.
///
/// Infinitely sharp edges may be creased, so that only the gap counts there; the angle between
/// the normals of their two sides stands apart.
struct Continuity {
    double gap_max = 0;              ///< of the position, over the bounding-box diagonal
    double normal_jump_deg_max = 0;  ///< of the normal, in degrees
    /// Of the curvature: the larger of the jump of the mean curvature over curvature_max and
    /// of the Gauss curvature over its square; curvatures below 1e-6 count as none.
    double curvature_jump_max = 0;
    double curvature_max = 0;  ///< largest principal curvature met, times the diagonal
    double sharp_normal_jump_deg_max = 0;  ///< across infinitely sharp edges
    std::size_t n_samples = 0;
    std::size_t n_sharp_samples = 0;  ///< of these, on infinitely sharp edges
    QuarterPoint worst_gap, worst_normal, worst_curvature, worst_sharp_normal;  ///< where
};

/// Evaluates both patches at `rate` + 1 points of every patch edge, corners included; normals
/// and curvature in the chart of the patch, which is regular where (u, v) is not.
/// Threads: goes wide; the result does not depend on their number.
OSDX_API Continuity measure_continuity(const Surface& surface, int rate = 8);
/// The same as work that may be cancelled.
OSDX_API Result<Continuity> measure_continuity(const Surface& surface, int rate,
                                               Progress& progress);

}  // namespace osdx::inline OSDX_ABI
