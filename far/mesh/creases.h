// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/mesh_data.h>

namespace osdx::inline OSDX_ABI {

struct Topology;

/// Infinitely sharp creases, as tags, where the normals of the two faces at an edge differ by
/// more than an angle. Of faces that are not flat it is the normal of their mean plane; faces
/// without an area crease nothing.
/// \param topology  of the mesh
/// \param degrees  0 to 180
OSDX_API std::vector<Tag> crease_tags(const MeshData& mesh, const Topology& topology,
                                      double degrees);

}  // namespace osdx::inline OSDX_ABI
