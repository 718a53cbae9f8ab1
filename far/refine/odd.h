// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "far/refine/level.h"

/// The steps of Refinement of odd degrees.
namespace osdx::inline OSDX_ABI::detail {

/// Refines a level, or a part of it. The level that is made refers to itself, `parent` and `part`.
/// \param part  null: all
void refine_odd(const RefinedLevel& parent, std::shared_ptr<const RefinedPart> part,
                int degree, RefinedLevel& level);

/// Takes the flags `sharp` from vertices where nothing is.
void keep_sharp(RefinedLevel& level);

}  // namespace osdx::inline OSDX_ABI::detail
