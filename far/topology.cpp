// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/topology.h"

#include <algorithm>
#include <cassert>

namespace osdx {

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
            t.face.push_back(static_cast<Index>(f.idx()));
            h = h.next();
        } while (h != first);
        t.face_offsets.push_back(t.n_halfedges());
    }
    t.twin.assign(t.n_halfedges(), kInvalidIndex);
    for (const auto h : mesh.halfedges()) {
        if (number[h.idx()] != kInvalidIndex)
            t.twin[number[h.idx()]] = number[h.opp().idx()];
    }
    return t;
}

MeshData to_mesh_data(const Topology& topology, std::vector<Vec3<double>> positions) {
    MeshData data;
    data.positions = std::move(positions);
    data.face_vertices = topology.vertex;
    for (Index f = 0; f < topology.n_faces(); ++f)
        data.face_sizes.push_back(topology.face_size(f));
    return data;
}

Topology split(const Topology& t) {
    const Index n = t.n_halfedges();
    const Index first_edge = t.n_vertices();
    const Index first_face = first_edge + t.n_edges;

    Topology s;
    s.n_edges = 2 * t.n_edges + n;
    s.face_offsets.resize(n + 1);
    s.vertex.resize(4 * n);
    s.twin.resize(4 * n);
    s.edge.resize(4 * n);
    s.face.resize(4 * n);
    s.vertex_halfedge.assign(first_face + t.n_faces(), kInvalidIndex);

    // The half of edge(h) next to the start of h. The lower halfedge of the pair owns the
    // first half.
    const auto half = [&](Index h) { return 2 * t.edge[h] + (h < t.twin[h] ? 0 : 1); };
    const auto other_half = [&](Index h) { return half(h) ^ 1; };
    for (Index h = 0; h < n; ++h) {
        const Index p = t.prev(h);
        const Index q = 4 * h;
        s.face_offsets[h + 1] = q + 4;
        s.vertex[q] = t.vertex[h];
        s.vertex[q + 1] = first_edge + t.edge[h];
        s.vertex[q + 2] = first_face + t.face[h];
        s.vertex[q + 3] = first_edge + t.edge[p];
        // Corner to edge middle to face centre to edge middle and back; see the header.
        s.twin[q] = t.is_border(h) ? kInvalidIndex : 4 * t.next(t.twin[h]) + 3;
        s.twin[q + 1] = 4 * t.next(h) + 2;
        s.twin[q + 2] = 4 * p + 1;
        s.twin[q + 3] = t.is_border(p) ? kInvalidIndex : 4 * t.twin[p];
        s.edge[q] = half(h);
        s.edge[q + 1] = 2 * t.n_edges + h;
        s.edge[q + 2] = 2 * t.n_edges + p;
        s.edge[q + 3] = other_half(p);
        for (Index k = 0; k < 4; ++k) {
            s.face[q + k] = h;
            Index& out = s.vertex_halfedge[s.vertex[q + k]];
            if (out == kInvalidIndex || s.is_border(q + k))
                out = q + k;
        }
    }
    return s;
}

Topology dual(const Topology& t, std::vector<Index>* halfedge_map) {
    const Index n = t.n_halfedges();
    std::vector<Index> map(n);
    Topology d;
    d.n_edges = t.n_edges;
    d.face_offsets.reserve(t.n_vertices() + 1);
    d.vertex.reserve(n);
    d.edge.reserve(n);
    d.face.reserve(n);
    d.twin.resize(n);
    d.vertex_halfedge.assign(t.n_faces(), kInvalidIndex);
    assert(std::ranges::find(t.twin, kInvalidIndex) == t.twin.end());
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (t.vertex_halfedge[v] == kInvalidIndex)
            continue;
        const Index dual_face = d.n_faces();
        t.for_each_outgoing(v, [&](Index h) {
            map[h] = d.n_halfedges();
            Index& out = d.vertex_halfedge[t.face[h]];
            if (out == kInvalidIndex)
                out = d.n_halfedges();
            d.vertex.push_back(t.face[h]);
            d.edge.push_back(
                t.edge[t.ccw(h)]);  // the edge crossed on the way to the next
            d.face.push_back(dual_face);
        });
        d.face_offsets.push_back(d.n_halfedges());
    }
    for (Index h = 0; h < n; ++h)
        d.twin[map[h]] = map[t.next(t.ccw(h))];
    if (halfedge_map)
        *halfedge_map = std::move(map);
    return d;
}

}  // namespace osdx
