// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/mesh.h"

#include <fmt/format.h>

#include "far/topology.h"

namespace osdx {

Result<Mesh> build_mesh(const MeshData& data) {
    const Result<Topology> topology = build_topology(data);
    if (!topology)
        return topology.error();

    Mesh mesh;
    mesh.reserve(topology->n_vertices(), topology->n_edges, topology->n_faces());
    for (const auto& p : data.positions)
        mesh.add_vertex({p.x, p.y, p.z});
    std::vector<Mesh::VertexHandle> face;
    for (Index f = 0; f < topology->n_faces(); ++f) {
        face.clear();
        for (Index h = topology->face_offsets[f]; h < topology->face_offsets[f + 1]; ++h)
            face.emplace_back(static_cast<int>(topology->vertex[h]));
        // OpenMesh refuses what it cannot link; the checks leave nothing to refuse.
        const Mesh::FaceHandle handle = mesh.add_face(face);
        if (!handle.is_valid() || handle.idx() != static_cast<int>(f)) {
            return fail(ErrorCode::NonManifoldVertex,
                        fmt::format("face {} cannot be linked to its neighbours", f), f,
                        f < data.face_lines.size() ? data.face_lines[f] : 0);
        }
    }
    return mesh;
}

}  // namespace osdx
