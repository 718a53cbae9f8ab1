// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/features.h>
#include <osdx/patch_options.h>
#include <osdx/patch_table.h>
#include <osdx/result.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

/// Covers the surface with patches, each at the coarsest level at which its neighbourhood
/// allows it: an extraordinary vertex or face that is isolated in the base mesh needs no
/// refinement. Only what is not covered yet is refined.
/// Source: Hettinga and Kosinka, Multisided B-spline patches over extraordinary regions
/// (2020), for the control nets.
/// \return InvalidOption, or NotIsolated with the base face whose surroundings no refinement
///         makes regular
/// \pre check_surface() has taken the mesh
OSDX_API Result<PatchTable> build_patch_table(Topology base, Features features,
                                              const PatchTableOptions& options = {});

}  // namespace osdx::inline OSDX_ABI
