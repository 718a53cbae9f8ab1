// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
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

/// Odd degrees: what a vertex is to the creases through it.
enum class VertexRule : std::uint8_t { Smooth, Crease, Corner };

inline VertexRule vertex_rule(double vertex_sharpness, std::size_t n_sharp_edges) {
    if (vertex_sharpness > 0 || n_sharp_edges > 2)
        return VertexRule::Corner;
    return n_sharp_edges == 2 ? VertexRule::Crease : VertexRule::Smooth;
}

/// What ends at a vertex on a step, of its own sharpness and that of its edges.
class EndOfSharpness {
public:
    void note(double before, double after) {
        if (before > 0 && after <= 0) {
            ++n_;
            sum_ += before;
        }
    }
    /// Of the rule before the step in the mixture with the one after it.
    double weight_before() const { return n_ == 0 ? 1 : std::min(1.0, sum_ / n_); }

private:
    int n_ = 0;
    double sum_ = 0;
};

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
