// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/version.h>

/// The weights of smoothing of odd degrees, for levels and grids.
namespace osdx::inline OSDX_ABI::detail {

/// The smoothing of a vertex of n quads: of itself, of each neighbour along an
/// edge and of each across a quad.
struct SmoothWeights {
    double own, beside, diagonal;
};

inline SmoothWeights smooth_weights(double n, bool right_after_split) {
    // The centre's weight would be negative; Zorin and Schroeder's (2001) is not.
    if (n == 2 && !right_after_split)
        return {0.25, 0.25, 0.125};
    return {(n - 3) / n, 2 / (n * n), 1 / (n * n)};
}

/// The point of an edge between faces F0 and F1: f (F0 + F1) + (1/2 - f) (V0 + V1), where f is
/// the sum of what both faces say. 0.47 is of OpenSubdiv's TRI_SUB_SMOOTH.
constexpr double half_face_weight(bool is_smooth_triangle) {
    return 0.5 * (is_smooth_triangle ? 0.47 : 0.25);
}

}  // namespace osdx::inline OSDX_ABI::detail
