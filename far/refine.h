// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include "far/features.h"
#include "far/stencil_table.h"
#include "far/topology.h"
#include "far/types.h"

namespace osdx {

/// One level of uniform refinement.
struct RefinedLevel {
    Topology topology;
    /// What is left of the sharpness on this level; the border is infinitely sharp.
    Features features;
    /// From the points of the level above to the points of this one: the tables are applied
    /// one after the other. Kept apart, since their product is larger.
    std::vector<StencilTable> factors;
    /// Even degrees: vertex h comes from corner h of the level above, and this halfedge
    /// starts there in the face of that corner's vertex (at level 1) or face (later levels).
    /// Empty for odd degrees.
    std::vector<Index> corner_halfedges;
};

/// Uniform subdivision of any degree d >= 2: on a regular grid the refinement of the uniform
/// B-spline of bi-degree d, elsewhere its natural generalisation.
///
/// Odd d: linear subdivision, then (d - 1)/2 smoothings of the vertices; d = 3 is
/// Catmull-Clark. Vertices of a level: those of the level above, its edges, its faces.
/// Even d: linear subdivision, its dual, then (d - 2)/2 smoothings. Vertices of a level:
/// the corners (halfedges) of the level above; a vertex that no face uses has none.
/// Source: Stam, On subdivision schemes generalizing uniform B-spline surfaces of arbitrary
/// degree (2001). Differs: next to faces that are no quads the first smoothing takes the
/// edge points of Catmull and Clark (1978), so that d = 3 is their scheme on every mesh.
///
/// Sharp features, odd d: every smoothing keeps corners, and takes (1/4, 1/2, 1/4) along
/// creases and borders; where sharpness ends on a level, sharp and smooth rules are mixed by
/// what was left of it. d = 3 is the scheme of OpenSubdiv (DeRose, Kass and Truong 1998), and
/// a border is refined like the uniform B-spline curve of degree d of its polygon.
class Refinement {
public:
    /// \pre kMinDegree <= degree <= kMaxDegree; even degrees: check_closed_and_smooth()
    Refinement(Topology base, int degree, Features features = {});

    int degree() const noexcept { return degree_; }
    int n_levels() const noexcept { return static_cast<int>(levels_.size()); }
    /// Level 0 is the base mesh.
    const RefinedLevel& level(int i) const noexcept { return levels_[i]; }
    const Topology& topology(int i) const noexcept { return levels_[i].topology; }

    void add_level();

    /// The points of the last level.
    /// \pre base.size() == topology(0).n_vertices()
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
        /// By level and vertex: the place in the array; kInvalidIndex where it has none.
        std::vector<std::vector<Index>> place;
    };
    /// \param wanted  by level and vertex; points on the way to these get rows as well
    /// \pre wanted.size() == n_levels(); wanted[i].size() == topology(i).n_vertices()
    Chain chain(std::vector<std::vector<bool>> wanted) const;

private:
    int degree_;
    std::vector<RefinedLevel> levels_;
};

}  // namespace osdx
