// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <vector>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <osdx/mesh_data.h>
#include <osdx/types.h>

#include "far/refine/refinement.h"

// What the tests of Refinement and of refinement on grids share.

namespace osdx::test {

template <class T>
std::vector<Vec3<T>> base_points(const MeshData& mesh) {
    return {mesh.positions.begin(), mesh.positions.end()};
}

/// The entries of the longest row of every factor, at least `least` each, in all: what
/// rounding adds up over the levels.
inline std::size_t sum_of_longest_rows(const Refinement& r, std::size_t least = 0) {
    std::size_t sum = 0;
    for (int l = 1; l < r.n_levels(); ++l) {
        for (const StencilTable& factor : r.factors(l)) {
            std::size_t longest = least;
            for (Index row = 0; row < factor.n_rows(); ++row)
                longest =
                    std::max(longest, factor.offsets[row + 1] - factor.offsets[row]);
            sum += longest;
        }
    }
    return sum;
}

/// Runs f with that many threads.
template <class F>
auto with_threads(int n_threads, F&& f) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(n_threads));
    tbb::task_arena arena(n_threads);
    return arena.execute(f);
}

}  // namespace osdx::test
