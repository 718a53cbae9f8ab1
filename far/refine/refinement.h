// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <deque>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <osdx/buffer.h>
#include <osdx/features.h>
#include <osdx/stencil_table.h>
#include <osdx/topology.h>
#include <osdx/types.h>

#include "far/refine/level.h"

namespace osdx::inline OSDX_ABI {

/// Linear subdivision of the points of a mesh to those of split().
StencilTable split_stencils(const Topology& topology);

/// Uniform subdivision of any degree d >= 2: on a regular grid the refinement of the uniform
/// B-spline of bi-degree d, elsewhere its natural generalisation.
///
/// Odd d: linear subdivision, then (d - 1)/2 smoothings of the vertices; d = 3 is
/// Catmull-Clark. Vertices of a level: those of the level above, its edges, its faces.
/// Even d: linear subdivision, its dual, then (d - 2)/2 smoothings. Vertices of a level:
/// the corners (halfedges) of the level above; a vertex that no face uses has none; at level 1
/// then two points for each edge of a border curve and one for each pinned end.
/// Source: Stam, On subdivision schemes generalizing uniform B-spline surfaces of arbitrary
/// degree (2001). Differs: next to faces that are no quads the first smoothing takes the
/// edge points of Catmull and Clark (1978), so that d = 3 is their scheme on every mesh.
///
/// Sharp features, odd d: every smoothing keeps corners, and takes (1/4, 1/2, 1/4) along
/// creases and borders; where sharpness ends on a level, sharp and smooth rules are mixed by
/// what was left of it. d = 3 is the scheme of OpenSubdiv (DeRose, Kass and Truong 1998), and
/// a border is refined like the uniform B-spline curve of degree d of its polygon.
/// Even d: the same for curves and vertices of their own points, as if the surface went on
/// beyond a curve by the point reflection P(-x) = 2 P(0) - P(x): a face that a curve halves
/// has its centroid on the curve, and an edge that it crosses its middle.
///
/// For the points of the last level alone UniformRefinement is far quicker.
class Refinement {
public:
    /// \pre kMinDegree <= degree <= kMaxDegree; even degrees: check_refinement()
    Refinement(Topology base, int degree, Features features = {});
    // Levels refer to each other.
    Refinement(const Refinement&) = delete;
    Refinement(Refinement&&) = default;

    int degree() const noexcept { return degree_; }
    int n_levels() const noexcept { return static_cast<int>(levels_.size()); }
    /// Level 0 is the base mesh; even degrees cut it along infinitely sharp edges.
    const RefinedLevel& level(int i) const noexcept { return levels_[i]; }
    const Topology& topology(int i) const noexcept { return levels_[i].topology; }
    Index n_base_points() const noexcept { return n_base_points_; }
    /// Even degrees: where each vertex of level 0 comes from. Empty: they are the base points.
    std::span<const Index> base_vertices() const noexcept {
        const auto& even = levels_[0].even;
        return even ? std::span<const Index>(even->base_vertices)
                    : std::span<const Index>();
    }
    /// Hands out a level; nothing is to be asked of the refinement from then on.
    RefinedLevel release(int i) noexcept { return std::move(levels_[i]); }

    void add_level();
    /// Refines a part of the last level.
    /// \pre keep.size() == topology(n_levels() - 1).n_faces()
    void add_level(const Flags& keep);

    /// From the points of the level above to those of a level > 0: the tables are applied one
    /// after the other. Kept apart, since their product is larger. Rows of points that are not
    /// known are empty. Odd degrees: they are made anew with each call.
    std::vector<StencilTable> factors(int level) const;

    /// The points of the last level.
    /// \pre base.size() == n_base_points(); no level was added in part
    std::vector<Vec3<double>> points(std::span<const Vec3<double>> base) const;

    /// The points of the last level as stencils over the base vertices.
    ///
    /// Around a vertex of valence n all points depend on its whole one-ring, so that the rows
    /// grow with n; chain() does not.
    StencilTable stencils() const;

    /// Selected points of all levels, each as a stencil over the base vertices and the points
    /// before it: an array that starts with the base points is extended row by row.
    struct Chain {
        StencilTable rows;
        /// Where groups of rows begin, and the end; rows of a group read none of it.
        std::vector<Index> groups{0};
        /// By level and vertex: the place in the array; kInvalidIndex where it has none.
        std::vector<Buffer<Index>> place;
    };
    /// \param wanted  by level and vertex; points on the way to these get rows as well. Those
    ///        of level 0 are there in any case, and nothing is asked of wanted[0].
    /// \pre wanted.size() == n_levels(); wanted[i].size() == topology(i).n_vertices() for
    ///      i > 0; what is wanted is known
    /// \param more  there will be room for so many rows and entries behind those of the chain
    Chain chain(std::vector<Flags> wanted, const StencilTable& more = {}) const;

private:
    void add_refined(std::shared_ptr<const detail::RefinedPart> part);

    int degree_;
    Index n_base_points_;
    std::deque<RefinedLevel> levels_;  // references stay valid
};

}  // namespace osdx::inline OSDX_ABI
