// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <osdx/buffer.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

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

/// What only levels of even degrees have: infinitely sharp edges are cut, so that all curves are
/// borders, and what is sharp is marked in the middle of faces and edges.
struct EvenLevel {
    std::vector<PointKind> point_kinds;  ///< of the vertices

    // Level 0:
    std::vector<Index> base_vertices;           ///< where each vertex comes from
    std::vector<BaseSharpness> base_sharpness;  ///< of each vertex

    // Later levels:
    /// By vertex that comes from a corner, the halfedge that starts there in the face of that
    /// corner's vertex (at level 1) or face (later levels).
    std::vector<Index> corner_halfedges;
    std::vector<FaceKind> face_kinds;
    std::vector<Ray> rays;
    std::vector<Index> edge_rays;  ///< by edge: its ray or kInvalidIndex; empty: none
    std::vector<Junction> junctions;
};

namespace detail {
class LevelRows;
}

/// One level of refinement, of the whole mesh or of a part.
struct RefinedLevel {
    Topology topology;
    /// Odd degrees and level 0: what is left of the sharpness; the border is infinitely sharp.
    ResolvedFeatures features;
    /// What its points are made of, from level 1 on; see Refinement::factors().
    std::shared_ptr<const detail::LevelRows> rows;
    /// By halfedge of the level above: the face (odd degrees) or vertex (even degrees) that
    /// its corner became; kInvalidIndex where that part was left out. Empty at level 0.
    Buffer<Index> children;

    /// Odd degrees: vertices that are sharp or at the end of a sharp edge; empty: none.
    Flags sharp;
    /// Edges that are borders only because the mesh was left out beyond; empty: none.
    Flags gap;
    /// Vertices whose points are known: those too close to a gap are not. Empty: all.
    Flags known;

    std::optional<EvenLevel> even;  ///< of even degrees

    bool is_gap(Index edge) const noexcept { return !gap.empty() && gap[edge]; }
    bool is_known(Index vertex) const noexcept { return known.empty() || known[vertex]; }
    /// There may be faces that are not plain.
    bool has_face_kinds() const noexcept { return even && !even->face_kinds.empty(); }
    FaceKind face_kind(Index face) const noexcept {
        return has_face_kinds() ? even->face_kinds[face] : FaceKind::Plain;
    }
};

namespace detail {

/// A part of a level.
struct RefinedPart {
    RefinedLevel level;
    Buffer<Index> vertices, halfedges;  ///< of the whole level
};

/// The part that has the faces `keep`.
std::shared_ptr<const RefinedPart> part_of(const RefinedLevel& level, const Flags& keep);

/// Vertices at the end of an edge that is a gap; empty: none.
Flags vertices_beside_gaps(const RefinedLevel& level);

/// Vertices that share a face with one whose flag is not set.
Flags vertices_beside_unknown(const Topology& topology, const Flags& known);

}  // namespace detail
}  // namespace osdx::inline OSDX_ABI
