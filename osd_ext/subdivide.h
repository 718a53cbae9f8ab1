// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <optional>

#include <osdx/face_varying.h>
#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/progress.h>
#include <osdx/result.h>

namespace osdx::inline OSDX_ABI {

struct SubdivideOptions {
    int degree = 3;  ///< of the B-splines; kMinDegree to kMaxDegree
    int levels = 1;  ///< steps of refinement, 0 or more
    FeatureOptions features = {};
    /// Where texture coordinates are linear; instead of the mesh's tags, or All.
    std::optional<FaceVaryingRule> uv_rule = {};
};

struct SubdividedMesh {
    MeshData data;
    std::size_t n_border_edges = 0;  ///< edges with one face
};

/// Refines a mesh uniformly, as Refinement of this degree does; degree 3 is Catmull-Clark.
///
/// The mesh has the tags that make its surface that of the base mesh: what is left of creases
/// and corners, the holes, and the rules of the mesh. Infinitely sharp edges of even degrees
/// have become borders. Channels of vertices are refined as positions are. Odd degrees keep the
/// texture coordinates, refined by their rule, with the tag for it, other face-varying channels,
/// each by its own, and the names of the faces; even ones, whose faces are no parts of those
/// before, drop all three.
///
/// Threads: goes wide; the result does not depend on their number.
/// \param progress  null, or to watch and cancel it: then Cancelled is returned
/// \return InvalidOption, also for levels of more corners of faces than there are numbers;
///         what build_topology, build_features, check_refinement and, with face-varying
///         data, face_varying_rule and build_face_varying return
OSDX_API Result<SubdividedMesh> subdivide(const MeshData& mesh,
                                          const SubdivideOptions& options = {},
                                          Progress* progress = nullptr);

}  // namespace osdx::inline OSDX_ABI
