// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/level.h"

#include <atomic>

#include "far/mesh/topology_edits.h"
#include "far/parallel.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

template <class From, class To>
void select(const From& from, const Buffer<Index>& which, To& to) {
    if (from.empty())
        return;
    to.resize(which.size());
    for_each_index(which.size(), [&](Index i) { to[i] = from[which[i]]; });
}

/// Of the vertices, points without faces and all that an even level has.
void take_even_part(const EvenLevel& level, const Topology& topology, Submesh& sub,
                    EvenLevel& part) {
    select(level.face_kinds, sub.faces, part.face_kinds);
    // Points without faces come with the faces and edges that they are for.
    const auto take_point = [&](Index point) {
        sub.topology.vertex_halfedge.push_back(kInvalidIndex);
        sub.vertices.push_back(point);
        return sub.topology.n_vertices() - 1;
    };
    if (!level.rays.empty()) {
        for (const Index e : sub.edges) {
            const Index ray = level.edge_rays[e];
            part.edge_rays.push_back(kInvalidIndex);
            if (ray == kInvalidIndex)
                continue;
            part.edge_rays.back() = static_cast<Index>(part.rays.size());
            part.rays.push_back(
                {take_point(level.rays[ray].point), level.rays[ray].sharpness});
        }
    }
    std::vector<Index> face(level.junctions.empty() ? 0 : topology.n_faces(),
                            kInvalidIndex);
    for (Index f = 0; f < sub.faces.size() && !face.empty(); ++f)
        face[sub.faces[f]] = f;
    for (const Junction& j : level.junctions) {
        if (face[j.face] == kInvalidIndex)
            continue;
        part.junctions.push_back(j);
        part.junctions.back().face = face[j.face];
        part.junctions.back().point = take_point(j.point);
    }
    select(level.point_kinds, sub.vertices, part.point_kinds);
    select(level.base_sharpness, sub.vertices, part.base_sharpness);
}

}  // namespace

std::shared_ptr<const RefinedPart> part_of(const RefinedLevel& level, const Flags& keep) {
    Submesh sub = submesh(level.topology, keep);
    auto result = std::make_shared<RefinedPart>();
    RefinedLevel& part = result->level;
    part.features.boundary = level.features.boundary;
    part.features.creases = level.features.creases;
    part.features.smooth_triangles = level.features.smooth_triangles;
    select(level.features.edge_sharpness, sub.edges, part.features.edge_sharpness);
    for (const Index f : sub.faces) {
        if (!level.features.hole.empty())
            part.features.hole.push_back(level.features.hole[f]);
    }
    select(level.gap, sub.edges, part.gap);
    if (sub.faces.size() < level.topology.n_faces()) {
        part.gap.resize(sub.topology.n_edges);
        for_each_index(sub.topology.n_halfedges(), [&](Index h) {
            if (sub.topology.is_border(h) && !level.topology.is_border(sub.halfedges[h]))
                part.gap[sub.topology.edge[h]] = true;
        });
    }
    if (level.even)
        take_even_part(*level.even, level.topology, sub, part.even.emplace());
    select(level.features.vertex_sharpness, sub.vertices, part.features.vertex_sharpness);
    select(level.sharp, sub.vertices, part.sharp);
    select(level.known, sub.vertices, part.known);
    part.topology = std::move(sub.topology);
    result->vertices = std::move(sub.vertices);
    result->halfedges = std::move(sub.halfedges);
    return result;
}

Flags vertices_beside_gaps(const RefinedLevel& level) {
    const Topology& t = level.topology;
    Flags result(level.gap.empty() ? 0 : t.n_vertices());
    std::atomic<bool> any = false;
    for_each_index(result.empty() ? 0 : t.n_halfedges(), [&](Index h) {
        if (!t.is_border(h) || !level.is_gap(t.edge[h]))
            return;
        any.store(true, std::memory_order_relaxed);
        set_flag(result[t.vertex[h]]);
        set_flag(result[t.to_vertex(h)]);
    });
    if (!any)
        result.clear();
    return result;
}

Flags vertices_beside_unknown(const Topology& t, const Flags& known) {
    Flags result(t.n_vertices());
    for_each_index(t.n_faces(), [&](Index f) {
        const Index begin = t.face_offsets[f], end = t.face_offsets[f + 1];
        bool all = true;
        for (Index h = begin; h < end; ++h)
            all &= known[t.vertex[h]] != 0;
        for (Index h = begin; h < end && !all; ++h)
            set_flag(result[t.vertex[h]]);
    });
    return result;
}

}  // namespace osdx::inline OSDX_ABI::detail
