// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include <osdx/version.h>

namespace osdx::inline OSDX_ABI {

/// What covers the surface where its neighbourhood is not regular.
enum class PatchFamily : std::uint8_t {
    Multisided,  ///< one patch over each extraordinary vertex or face; G^(d-1)
    /// One patch over each face; degree 3, G1, close to the limit of Catmull and Clark
    /// (Loop, Schaefer, Ni and Castaño 2009).
    Gregory,
};

struct MultisidedOptions {
    /// Level to which the inner ends of infinitely sharp creases, and infinitely sharp
    /// vertices without creases, are refined: 0 to 16. One patch covers what is left around
    /// them. It joins its neighbours like all others, but inside it errs from the limit
    /// surface. At level 6, over the length of the edges there: at ends of creases by some
    /// 1e-5, and by a third of it with each level more (along the surface by a half); at such
    /// vertices by some 1e-3, and by 0.65 of it, the eigenvalue of their rule.
    int crease_end_level = 6;
    /// Refines pinned vertices of several faces like that, too. Their patches are exact on the
    /// border, but inside run at a pace of their own, which shows in texture coordinates.
    bool isolate_corners = false;
};

struct GregoryOptions {
    /// Steps of refinement before patches are laid over faces that are not regular, 0 to 10;
    /// the limit surface is closer by some factor of 4 to 6 with each. Semi-sharp features
    /// are refined until they are used up in any case.
    int levels = 0;
    bool uniform = false;  ///< `levels` steps everywhere, not only where needed
    /// Tangents of the limit's eigenvectors in their own length, instead of the length that
    /// follows the limit closer; see far/patches/gregory_net.h.
    bool paper_tangents = false;
    /// Faces that are no quads get no centre point; weights are divided by their sum. Such
    /// patches are further from the limit inside.
    bool normalised = false;
};

struct PatchTableOptions {
    int degree = 3;  ///< of the patches; kMinDegree to kMaxDegree
    PatchFamily family = PatchFamily::Multisided;
    MultisidedOptions multisided = {};
    GregoryOptions gregory = {};
};

}  // namespace osdx::inline OSDX_ABI
