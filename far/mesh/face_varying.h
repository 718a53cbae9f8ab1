// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <span>
#include <vector>

#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The topology of face-varying data: the faces and halfedges of the mesh, cut open along the
/// seams. Smooth rules refine and evaluate it as they do the mesh itself.
struct FaceVarying {
    FaceVaryingRule rule = FaceVaryingRule::All;
    /// Face f and halfedge h are those of the mesh. Edge e below the mesh's n_edges is its
    /// edge e; the others are second sides of seams.
    Topology topology;
    /// n_vertices of the topology: which value each has, as the corners name them.
    std::vector<Index> values;
    /// Creases, corners and holes of the mesh, and what the rule pins; the boundary rule is
    /// EdgeOnly. With these, Refinement of degree 3 is OpenSubdiv's for all rules but All.
    Features features;
};

/// The rule of the tags facevaryinginterpolateboundary (0 to 5: None to All) and
/// facevaryingpropagatecorners (1: CornersPlus1 becomes CornersPlus2); All without tags. The
/// numbers are those of OpenSubdiv's regression shapes as Far reads them. A later tag
/// replaces an earlier one.
/// \return InvalidTag, UnsupportedTag where corners are to be propagated by another rule
OSDX_API Result<FaceVaryingRule> face_varying_rule(const MeshData& data);
/// The rule that is given, or that of the tags; All where these are ignored.
OSDX_API Result<FaceVaryingRule> face_varying_rule(const MeshData& data,
                                                   std::optional<FaceVaryingRule> given,
                                                   bool ignore_tags);

/// \param view  of the topology, for the lines of its faces
/// \return SizeMismatch; IndexOutOfRange with the face that names a value which is not there
OSDX_API Status check_face_varying(const FaceVaryingView& channel,
                                   const Topology& topology, const MeshView& view = {});
/// MeshData::face_varying with its values.
/// \return besides, SizeMismatch for values that are not n each, NonFinitePoint with the number
///         of the value
OSDX_API Status check_face_varying(const MeshData& data, const Topology& topology);

/// Corners at a vertex are one vertex of the result when they are joined by edges over which
/// both ends agree in their values; all other edges are seams. O(mesh).
/// \param features  of the mesh, resolved or not
/// \param corner_values  n_halfedges; equal numbers are equal values
/// \return SizeMismatch; UnsupportedTag (with the vertex) where Chaikin's rule for creases
///         joins both sides of a seam, which sharpness on one side cannot express
OSDX_API Result<FaceVarying> build_face_varying(const Topology& mesh,
                                                const Features& features,
                                                std::span<const Index> corner_values,
                                                FaceVaryingRule rule);

}  // namespace osdx::inline OSDX_ABI
