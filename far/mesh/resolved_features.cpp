// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <osdx/resolved_features.h>

namespace osdx::inline OSDX_ABI {

ResolvedFeatures resolve(const Topology& t, Features f) {
    return resolve(t, std::move(f), border_halfedges(t));
}

ResolvedFeatures resolve(const Topology& t, Features f, std::span<const Index> borders) {
    if (borders.empty())
        return ResolvedFeatures(std::move(f));
    f.edge_sharpness.resize(t.n_edges);
    for (const Index h : borders) {
        double& sharpness = f.edge_sharpness[t.edge[h]];
        const bool is_sharpened = is_infinitely_sharp(sharpness);
        sharpness = kInfinitelySharp;
        const Index v = t.vertex[h];
        if (f.boundary == BoundaryRule::EdgeAndCorner && t.valence(v) == 1) {
            f.vertex_sharpness.resize(t.n_vertices());
            f.vertex_sharpness[v] = kInfinitelySharp;
        }
        if (f.boundary == BoundaryRule::None && !is_sharpened) {
            f.hole.resize(t.n_faces());
            const auto add_holes = [&](Index at) {
                t.for_each_outgoing(at, [&](Index out) { f.hole[t.face(out)] = true; });
            };
            add_holes(v);
            add_holes(t.to_vertex(h));
        }
    }
    return ResolvedFeatures(std::move(f));
}

}  // namespace osdx::inline OSDX_ABI
