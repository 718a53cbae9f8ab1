// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include <osdx/surface_jet.h>

#include "benchmarks/meshes.h"
#include "benchmarks/suite.h"

namespace osdx::bench {

/// A point of a quad.
struct Place {
    Index face;
    float u, v;
};

/// Samples of a side of the grid on each face.
inline constexpr int kGridSide = 8;
inline constexpr std::size_t kGridSize = kGridSide * kGridSide;

/// From corner to corner: those on edges of the mesh come with each of their faces.
inline constexpr int kGridRate = kGridSide - 1;
constexpr float grid_parameter(int i) {
    return static_cast<float>(i) / kGridRate;
}

/// The grid on each face of a mesh of quads, row by row in u.
std::vector<Place> grid_places(Index n_faces);

/// A way to evaluate places to position, du and dv in float.
struct SampleWay {
    std::string library, name;
    std::size_t stride;  ///< floats of output for a place
    /// Places first to last - 1, into `out`; both are multiples of kGridSize for grids.
    std::function<void(std::size_t first, std::size_t last, float* out)> evaluate;
    /// Place i of the n of a call from its output. Null: nine floats, one place after the other.
    std::function<SurfaceJet<float>(const float* out, std::size_t i, std::size_t n)>
        read = {};
    double bytes = 0;
    /// A call goes wide by itself; otherwise callers may call it from several threads.
    bool is_wide = false;
};

/// All places, in calls of kGridSize.
std::vector<SurfaceJet<float>> evaluate_all(const SampleWay& way, std::size_t n_places);

/// The output stays in the first cache: blocks of eight faces go into the same array.
Way in_cache(const SampleWay& way, std::size_t n_places);
/// All output goes into one array; several threads take parts of it.
Way into_buffer(const SampleWay& way, std::size_t n_places, int threads);

}  // namespace osdx::bench
