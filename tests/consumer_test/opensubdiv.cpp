// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#undef far  // names a folder and a namespace of OpenSubdiv
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#pragma GCC diagnostic pop

#include <osdx/mesh_file.h>
#include <osdx/surface.h>

namespace Far = OpenSubdiv::Far;

Far::TopologyDescriptor to_descriptor(const osdx::MeshData& mesh) {
    Far::TopologyDescriptor result;
    result.numFaces = static_cast<int>(mesh.face_sizes.size());
    return result;
}
