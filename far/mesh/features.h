// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <vector>

#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

struct Topology;

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
OSDX_API Result<Features> build_features(const MeshData& data, const Topology& topology,
                                         const FeatureOptions& options = {});

/// The features of a view; looks at its face-varying channels.
/// \return what check_face_varying() returns; SizeMismatch; InvalidFeature where it names what is not there or a sharpness that
///         is not a number, with the place in its list
OSDX_API Result<Features> build_features(const MeshView& view, const Topology& topology);

/// The tags from which build_features() makes these features again.
OSDX_API std::vector<Tag> to_tags(const Topology& topology, const Features& features);

/// Refuses what a surface of a degree cannot be made of: interior vertices of two faces, over
/// which no patch can be laid (ValenceTwo), and for even degrees smooth triangles, which they
/// have no rule for (UnsupportedTag).
/// \param view  of the topology, for the lines of its vertices
OSDX_API Status check_surface(const MeshView& view, const Topology& topology,
                              const Features& features, int degree);
/// With the number of the tag and its line.
OSDX_API Status check_surface(const MeshData& data, const Topology& topology,
                              const Features& features, int degree);

/// The part of check_surface() that refinement needs: nothing for odd degrees.
OSDX_API Status check_refinement(const MeshView& view, const Topology& topology,
                                 const Features& features, int degree);
OSDX_API Status check_refinement(const MeshData& data, const Topology& topology,
                                 const Features& features, int degree);

}  // namespace osdx::inline OSDX_ABI
