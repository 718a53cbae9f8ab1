// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/resolved_features.h>
#include <osdx/result.h>
#include <osdx/stencil_table.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The faces around a vertex that are smooth together: all, or those between two sharp edges.
struct FanShape {
    int n_faces;
    bool open;  ///< between two infinitely sharp edges: borders or both sides of a crease
    bool sharp;  ///< the surface is pinned to the vertex

    int n_edges() const noexcept { return n_faces + open; }
    /// c of the fan: tangents t_i along its edges have t_(i-1) + t_(i+1) = 2 c t_i, but those
    /// of a sharp vertex.
    double cosine() const noexcept;
};

/// A linear form over a fan: weights of the vertex, of the other ends e_0, e_1, .. of the
/// edges counter-clockwise, and of the centroids c_0, .. of the faces, c_j after edge j.
using FanMask = std::vector<double>;

/// The limit point of Catmull-Clark.
FanMask limit_mask(const FanShape& fan);

/// The tangent t_i along edge i: a third of the derivative of a cubic border.
///
/// The plane is the limit's, from the left eigenvectors of the subdivision matrix; at open
/// fans of k >= 3 faces too, whose mask is not that of Biermann, Levin and Zorin (2000).
/// \pre 0 <= edge < fan.n_edges()
FanMask paper_tangents(const FanShape& fan, int edge);

/// The same with a length that follows the limit surface closer where it bends away from its
/// tangent plane: g(n) times as long. For open fans of k >= 4 faces, where the limit has no
/// tangent plane, the mask of Biermann et al.
FanMask tuned_tangents(const FanShape& fan, int edge);

/// How the control points are chosen.
struct GregoryRules {
    /// Any rule with t_(i-1) + t_(i+1) = 2 cosine() t_i makes patches that are G1.
    FanMask (*tangents)(const FanShape& fan, int edge) = tuned_tangents;
    /// Faces that are no quads get a centre point, such that the middle of the patch is the
    /// limit point of the middle of the face; without, weights are to be normalised.
    bool centre = true;
};

/// Refuses what gregory_points() does not cover: semi-sharp edges and vertices, which are to
/// be used up by refinement before (InvalidOption), and smooth triangles (UnsupportedTag).
/// All else is covered: faces and vertices of any size and valence (2 included), borders,
/// corners, creases and their ends.
/// \param data  the mesh of the topology, for its lines and tags
Status check_gregory(const MeshData& data, const Topology& topology,
                     const Features& features);

/// The control points of the Gregory patch of a face, as stencils of the vertices.
///
/// Rows: for each corner i, p_i, e_i+, e_i-, f_i+, f_i- in the order of GregoryBasis, then
/// the centre. Entries are in ascending order. What two faces share, p and e on their edge,
/// is in both the same to the last bit; so it is on both sides of a crease.
///
///     e+ = p + t of the edge to the next corner,  e- = p + t of the edge to the one before,
///     f+ = (c1 p + (3 - 2 c0 - c1) e+ + 2 c0 e_(i+1)- + r) / 3,
///     r  = (m_(j+1) - m_(j-1)) / 3 + 2 (c_j - c_(j-1)) / 3
///
/// with c0 and c1 the cosines of the fans at this corner and the next, and r from the middles
/// m of the edges beside the edge j to the next corner and the centroids c of the faces
/// beside it; f- is its mirror image. At a sharp edge f+ = f-.
///
/// The patches meet with a common tangent plane at all edges that are not sharp, but at those
/// that end at a sharp vertex of two or more faces, which is the tip of a cone. Corners and
/// sharp edges lie on the limit of Catmull-Clark, but not where a crease ends inside: that
/// vertex has the points of a smooth one.
/// Source: Loop, Schaefer, Ni and Castaño, Approximating subdivision surfaces with Gregory
/// patches for hardware tessellation (2009). Differs: the length of the tangents, open fans,
/// and the inner points of triangles, which are of degree 3 as all others.
/// \pre check_gregory()
StencilTable gregory_points(const Topology& topology, const ResolvedFeatures& features,
                            Index face, const GregoryRules& options = {});

}  // namespace osdx::inline OSDX_ABI
