// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
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

namespace osdx {

/// What the point of a vertex is to the surface. Even degrees have border curves of their
/// own: at level 0 the border runs through the vertices, later it runs midway between the
/// Inner points and their mirror images beyond the border, through the Curve points.
enum class PointKind : std::uint8_t {
    Inner,
    Curve,   ///< of the control polygon of a border curve
    Pinned,  ///< the end of border curves, where the surface is pinned to its vertex
    Dart,    ///< level 0: where a crease ends inside
    Spike,   ///< level 0: an infinitely sharp vertex without creases
};

/// Even degrees, levels from 1 on: what lies in the middle of a face.
enum class FaceKind : std::uint8_t {
    Plain,
    Border,  ///< half a face: its mirror image completes it; a border curve runs through
    Pinned,  ///< the sector of a face between two border curves that end in its middle
    Dart,    ///< an infinitely sharp crease ends in its middle
    Spike,   ///< the surface is pinned to a point in its middle
};

/// Even degrees, level 0: what is sharp at a vertex, on all sides of cuts.
struct BaseSharpness {
    int n_sharp = 0;           ///< infinitely sharp edges
    std::vector<double> rays;  ///< sharpness of the semi-sharp ones
    double vertex_sharpness = 0;
};

/// Even degrees, levels from 1 on: a semi-sharp crease that crosses an edge in its middle.
struct Ray {
    Index point;       ///< of the crease curve there: a vertex without faces
    double sharpness;  ///< what is left of it
};

/// Even degrees, levels from 1 on: a face in whose middle creases meet, or a sharp vertex is,
/// as long as that changes the rules there from level to level.
struct Junction {
    Index face;
    Index point;  ///< in the middle: a vertex without faces
    int n_sharp;  ///< infinitely sharp edges that meet there
    double vertex_sharpness;
    std::vector<double> rays;  ///< sharpness of the others
};

namespace detail {
class LevelRows;
struct RefinedPart;
}  // namespace detail

/// One level of refinement, of the whole mesh or of a part.
struct RefinedLevel {
    Topology topology;
    /// Odd degrees and level 0: what is left of the sharpness; the border is infinitely sharp.
    Features features;
    /// What its points are made of, from level 1 on; see Refinement::factors().
    std::shared_ptr<const detail::LevelRows> rows;
    /// By halfedge of the level above: the face (odd degrees) or vertex (even degrees) that
    /// its corner became; kInvalidIndex where that part was left out. Empty at level 0.
    Buffer<Index> children;
    /// Even degrees: by vertex that comes from a corner, the halfedge that starts there in
    /// the face of that corner's vertex (at level 1) or face (later levels).
    std::vector<Index> corner_halfedges;

    /// Odd degrees: vertices that are sharp or at the end of a sharp edge; empty: none.
    Flags sharp;
    /// Edges that are borders only because the mesh was left out beyond; empty: none.
    Flags gap;
    /// Vertices whose points are known: those too close to a gap are not. Empty: all.
    Flags known;

    /// Even degrees: infinitely sharp edges are cut, so that all curves are borders.
    std::vector<Index> base_vertices;           ///< level 0: where each vertex comes from
    std::vector<BaseSharpness> base_sharpness;  ///< level 0: of each vertex
    std::vector<PointKind> point_kinds;
    std::vector<FaceKind> face_kinds;
    std::vector<Ray> rays;
    std::vector<Index> edge_rays;  ///< by edge: its ray or kInvalidIndex; empty: none
    std::vector<Junction> junctions;

    bool is_gap(Index edge) const noexcept { return !gap.empty() && gap[edge]; }
    bool is_known(Index vertex) const noexcept { return known.empty() || known[vertex]; }
};

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

}  // namespace osdx
