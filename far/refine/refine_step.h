// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <osdx/topology.h>

#include "far/refine/refinement.h"
#include "far/refine/stencil_rows.h"

/// The steps of Refinement, one file for odd and one for even degrees.
namespace osdx::detail {

/// From the points of the level above to those of a level, by factors that are applied one
/// after the other. Rows are made when they are asked for: of a part that is refined few are.
/// Threads: const members may run at the same time.
class LevelRows {
public:
    virtual ~LevelRows() = default;
    virtual int n_factors() const = 0;
    virtual Index n_rows(int factor) const = 0;
    /// Appends the entries of a row; none where the point is not known.
    /// \param sums  of the thread
    virtual void add(int factor, Index row, DenseRow& sums,
                     StencilTable& table) const = 0;
};

/// A part of a level.
struct RefinedPart {
    RefinedLevel level;
    Buffer<Index> vertices, halfedges;  ///< of the whole level
};

/// Refines a level, or a part of it. The level that is made refers to itself, `parent` and `part`.
/// \param part  null: all
void refine_odd(const RefinedLevel& parent, std::shared_ptr<const RefinedPart> part,
                int degree, RefinedLevel& level);
void refine_even(const RefinedLevel& parent, std::shared_ptr<const RefinedPart> part,
                 int degree, bool parent_is_base, RefinedLevel& level);

/// Level 0 for even degrees.
/// \param features  with_border()
RefinedLevel even_base(Topology base, const Features& features);

/// Odd degrees: takes the flags `sharp` from vertices where nothing is.
void keep_sharp(RefinedLevel& level);

/// Odd degrees, the smoothing of a vertex of n quads: of itself, of each neighbour along an
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

/// Weight of a triangle's centre in OpenSubdiv's TRI_SUB_SMOOTH.
inline constexpr double kSmoothTriangle = 0.47;

StencilTable identity_stencils(Index n);

/// Vertices at the end of an edge that is a gap; empty: none.
Flags vertices_beside_gaps(const RefinedLevel& level);

/// Vertices that share a face with one whose flag is not set.
Flags vertices_beside_unknown(const Topology& topology, const Flags& known);

}  // namespace osdx::detail
