// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx {

/// What the surface does at the border of an open mesh. The names and, at degree 3, the
/// meanings are those of OpenSubdiv's Sdc.
enum class BoundaryRule : std::uint8_t {
    /// Faces that touch the border carry no surface: they are holes. Not where the border's
    /// edges are infinitely sharp by a tag.
    None,
    EdgeOnly,       ///< the border is the B-spline curve of the border polygon
    EdgeAndCorner,  ///< the same, and it is pinned to border vertices of one face
};

/// How the sharpness of a crease goes down from level to level.
enum class CreaseMethod : std::uint8_t {
    Uniform,  ///< by one
    Chaikin,  ///< averaged along the crease (Chaikin 1974), then by one
};

/// A sharpness from here on never goes down (OpenSubdiv's limit).
constexpr double kInfinitelySharp = 10;
constexpr bool is_infinitely_sharp(double s) noexcept {
    return s >= kInfinitelySharp;
}
/// Sharp for some levels.
constexpr bool is_semi_sharp(double s) noexcept {
    return s > 0 && s < kInfinitelySharp;
}

/// Where the surface is not smooth, and where it is not.
///
/// Sharpness s > 0: the next s levels of refinement take the rules of a crease or corner; a
/// fraction mixes sharp and smooth rules on the last of them.
/// Shapes: edge_sharpness n_edges, vertex_sharpness n_vertices, hole n_faces; or empty where
/// there is none.
struct Features {
    std::vector<double> edge_sharpness;    ///< of each edge (Topology::edge)
    std::vector<double> vertex_sharpness;  ///< of each vertex
    std::vector<bool> hole;  ///< faces that carry no surface but smooth others
    BoundaryRule boundary = BoundaryRule::EdgeOnly;
    CreaseMethod creases = CreaseMethod::Uniform;
    /// Edge points beside triangles of the base mesh lean to the triangles (OpenSubdiv's
    /// TRI_SUB_SMOOTH).
    bool smooth_triangles = false;

    bool operator==(const Features&) const = default;

    double edge(Index e) const noexcept {
        return edge_sharpness.empty() ? 0.0 : edge_sharpness[e];
    }
    double vertex(Index v) const noexcept {
        return vertex_sharpness.empty() ? 0.0 : vertex_sharpness[v];
    }
    bool is_hole(Index face) const noexcept { return !hole.empty() && hole[face]; }
};

struct FeatureOptions {
    bool ignore_tags = false;                   ///< take the mesh as if it had no tags
    std::optional<BoundaryRule> boundary = {};  ///< instead of the tag, or EdgeOnly
};

/// Reads the tags crease (one edge, one sharpness), corner, hole, interpolateboundary (0
/// none, 1 edge and corner, 2 edge only), creasemethod (normal, chaikin) and
/// smoothtriangles (catmark, smooth). A later tag replaces an earlier one. Face-varying tags
/// are left to the data that they speak of.
/// \return InvalidTag where a tag names what is not there, UnsupportedTag for tags that
///         change the surface in another way; with the number of the tag and its line
Result<Features> build_features(const MeshData& data, const Topology& topology,
                                const FeatureOptions& options = {});

/// The tags from which build_features() makes these features again.
std::vector<Tag> to_tags(const Topology& topology, const Features& features);

/// Refuses what a surface of a degree cannot be made of: interior vertices of two faces, over
/// which no patch can be laid (ValenceTwo), and for even degrees smooth triangles, which they
/// have no rule for (UnsupportedTag).
/// \param data  the mesh of the topology, for its lines and tags
Status check_surface(const MeshData& data, const Topology& topology,
                     const Features& features, int degree);

/// The part of check_surface() that refinement needs: nothing for odd degrees.
Status check_refinement(const MeshData& data, const Topology& topology,
                        const Features& features, int degree);

}  // namespace osdx
