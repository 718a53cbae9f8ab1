// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <osdx/build_topology.h>
#include <osdx/openmesh.h>

namespace osdx::inline OSDX_ABI {

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
                        data.view().line_of_face(f));
        }
    }
    return mesh;
}

Topology build_topology(const Mesh& mesh) {
    Topology t;
    t.vertex_halfedge.assign(mesh.n_vertices(), kInvalidIndex);
    t.n_edges = static_cast<Index>(mesh.n_edges());
    std::vector<Index> number(mesh.n_halfedges(), kInvalidIndex);
    for (const auto f : mesh.faces()) {
        // OpenMesh's face names the halfedge that ends at the first vertex.
        const auto first = f.halfedge().next();
        auto h = first;
        do {
            number[h.idx()] = t.n_halfedges();
            const auto v = static_cast<Index>(h.from().idx());
            if (t.vertex_halfedge[v] == kInvalidIndex || h.opp().is_boundary())
                t.vertex_halfedge[v] = t.n_halfedges();
            t.vertex.push_back(v);
            t.edge.push_back(static_cast<Index>(h.edge().idx()));
            t.faces.push_back(static_cast<Index>(f.idx()));
            h = h.next();
        } while (h != first);
        t.face_offsets.push_back(t.n_halfedges());
    }
    t.twin.assign(t.n_halfedges(), kInvalidIndex);
    for (const auto h : mesh.halfedges()) {
        if (number[h.idx()] != kInvalidIndex)
            t.twin[number[h.idx()]] = number[h.opp().idx()];
    }
    t.quads_only = has_only_quads(t);
    if (t.quads_only)
        t.faces = {};
    Buffer<std::uint8_t> valences;
    for (Index v = 0; v < t.n_vertices(); ++v)
        valences.push_back(Topology::stored_valence(t.valence(v)));
    t.valences = std::move(valences);
    return t;
}

}  // namespace osdx::inline OSDX_ABI
