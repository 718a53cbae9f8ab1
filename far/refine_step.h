// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "far/refine.h"

/// The steps of Refinement, one file for odd and one for even degrees.
namespace osdx::detail {

RefinedLevel refine_odd(const RefinedLevel& parent, int degree);

/// Level 0 for even degrees.
/// \param features  with_border()
RefinedLevel even_base(Topology base, const Features& features);
RefinedLevel refine_even(const RefinedLevel& parent, int degree, bool parent_is_base);

StencilTable identity_stencils(Index n);

/// Vertices at the end of an edge that is a gap; empty: none.
std::vector<bool> vertices_beside_gaps(const RefinedLevel& level);

/// Follows what is known through the factors of a level.
class KnownRows {
public:
    explicit KnownRows(std::vector<bool> inputs) : known_(std::move(inputs)) {}

    /// The rows, but empty where an input is unknown or `unusable` says so.
    StencilTable filter(StencilTable rows, const std::vector<bool>& unusable);
    /// Empty: all are known.
    std::vector<bool> take() { return std::move(known_); }

private:
    std::vector<bool> known_;
};

}  // namespace osdx::detail
