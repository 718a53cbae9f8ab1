// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "far/refine.h"

/// The steps of Refinement, one file for odd and one for even degrees.
namespace osdx::detail {

RefinedLevel refine_odd(const RefinedLevel& parent, int degree);

/// Level 0 for even degrees.
/// \param features  with_border()
RefinedLevel even_base(Topology base, const Features& features);
RefinedLevel refine_even(const RefinedLevel& parent, int degree, bool parent_is_base);

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
std::vector<bool> vertices_beside_gaps(const RefinedLevel& level);

/// Follows what is known through the factors of a level.
class KnownRows {
public:
    explicit KnownRows(std::vector<bool> inputs) : known_(std::move(inputs)) {}

    /// The rows, but empty where an input is unknown or `unusable` says so.
    template <class Rows>
    StencilTable filter(Rows&& rows, const std::vector<bool>& unusable) {
        if (known_.empty() && unusable.empty())
            return std::forward<Rows>(rows);
        return usable(rows, unusable);
    }
    /// After rows that are empty where filter() would make them so.
    void follow(const StencilTable& rows, const std::vector<bool>& unusable) {
        if (known_.empty() && unusable.empty())
            return;
        known_.resize(rows.n_rows());
        for (Index r = 0; r < rows.n_rows(); ++r)
            known_[r] = rows.offsets[r] < rows.offsets[r + 1];
    }
    bool contains(std::span<const Index> points) const {
        return known_.empty() ||
               std::ranges::all_of(points, [&](Index p) { return known_[p]; });
    }
    /// Empty: all are known.
    std::vector<bool> take() { return std::move(known_); }

private:
    StencilTable usable(const StencilTable& rows, const std::vector<bool>& unusable);

    std::vector<bool> known_;
};

}  // namespace osdx::detail
