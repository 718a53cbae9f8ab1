// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "benchmarks/meshes.h"
#include "benchmarks/suite.h"

/// Each stage checks what the peers give against ours, then measures. The meshes are one mesh
/// at several sizes, in ascending order; the stages "degree", "threads" and "size" get their
/// rows from those that they concern.
namespace osdx::bench {

/// Peers are measured on meshes of up to so many faces: limit stencils of a grid hold some
/// 16 KB a face, patch tables 2 KB.
inline constexpr Index kLargestForStencils = 100'000;
inline constexpr Index kLargestForPeers = 500'000;

/// evaluate_grid_cached, evaluate_grid_buffer, evaluate_grid_ev5, evaluate_grid_gregory
void evaluate_grid_stage(Suite& suite, std::span<const BenchMesh> meshes);
/// evaluate_point_regular, evaluate_point_ev5, evaluate_point_gregory, and evaluate_many_ ..;
/// evaluate_scattered
void evaluate_points_stage(Suite& suite, std::span<const BenchMesh> meshes);
void build_stage(Suite& suite, std::span<const BenchMesh> meshes);
/// update, update_local
void update_stage(Suite& suite, std::span<const BenchMesh> meshes);
void subdivide_stage(Suite& suite, std::span<const BenchMesh> meshes);
/// tessellate, tessellate_error
void tessellate_stage(Suite& suite, std::span<const BenchMesh> meshes);

}  // namespace osdx::bench
