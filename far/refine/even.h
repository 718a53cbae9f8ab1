// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "far/refine/level.h"

/// The steps of Refinement of even degrees.
namespace osdx::inline OSDX_ABI::detail {

/// Level 0.
RefinedLevel even_base(Topology base, const ResolvedFeatures& features);

/// Refines a level, or a part of it.
/// \param part  null: all
void refine_even(const RefinedLevel& parent, const RefinedPart* part, int degree,
                 bool parent_is_base, RefinedLevel& level);

}  // namespace osdx::inline OSDX_ABI::detail
