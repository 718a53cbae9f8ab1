// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/mesh/topology_edits.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {

Topology split(const Topology& t) {
    const Index n = t.n_halfedges();
    const Index first_edge = t.n_vertices();
    const Index first_face = first_edge + t.n_edges;

    Topology s;
    s.quads_only = true;
    s.n_edges = 2 * t.n_edges + n;
    s.face_offsets.resize(n + 1);
    s.vertex.resize(4 * n);
    s.twin.resize(4 * n);
    s.edge.resize(4 * n);
    s.vertex_halfedge.resize(first_face + t.n_faces());

    // The half of edge(h) next to the start of h. The lower halfedge of the pair owns the
    // first half.
    const auto half = [&](Index h) { return 2 * t.edge[h] + (h < t.twin[h] ? 0 : 1); };
    const auto other_half = [&](Index h) { return half(h) ^ 1; };
    detail::for_each_index(
        n,
        [&](Index h) {
            const Index p = t.prev(h);
            const Index q = 4 * h;
            s.face_offsets[h + 1] = q + 4;
            s.vertex[q] = t.vertex[h];
            s.vertex[q + 1] = first_edge + t.edge[h];
            s.vertex[q + 2] = first_face + t.face(h);
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
            // The border's or the lowest halfedge at the middle of the edge that leaves h.
            const Index next = 4 * t.next(h) + 3;
            Index& out = s.vertex_halfedge[first_edge + t.edge[h]];
            if (t.is_border(h))
                out = next;
            else if (h < t.twin[h])
                out = std::min({q + 1, next, 4 * t.next(t.twin[h]) + 3});
        },
        detail::kSmallChunk);
    detail::for_each_index(t.n_vertices(), [&](Index v) {
        const Index h = t.vertex_halfedge[v];
        s.vertex_halfedge[v] = h == kInvalidIndex ? kInvalidIndex : 4 * h;
    });
    detail::for_each_index(t.n_faces(), [&](Index f) {
        s.vertex_halfedge[first_face + f] = 4 * t.face_offsets[f] + 2;
    });
    return s;
}

Topology dual(const Topology& t, std::vector<Index>* halfedge_map) {
    const Index n = t.n_halfedges();
    std::vector<Index> map(n, kInvalidIndex);
    Topology d;
    d.face_offsets.reserve(t.n_vertices() + 1);
    d.vertex.reserve(n);
    d.faces.reserve(n);
    d.vertex_halfedge.assign(t.n_faces(), kInvalidIndex);
    std::vector<Index> source;
    source.reserve(n);
    for (Index v = 0; v < t.n_vertices(); ++v) {
        const Index first = t.vertex_halfedge[v];
        if (first == kInvalidIndex || t.is_border(first))
            continue;
        const Index dual_face = d.n_faces();
        t.for_each_outgoing(v, [&](Index h) {
            map[h] = d.n_halfedges();
            source.push_back(h);
            d.vertex.push_back(t.face(h));
            d.faces.push_back(dual_face);
        });
        d.face_offsets.push_back(d.n_halfedges());
    }
    d.twin.resize(d.n_halfedges());
    d.edge.resize(d.n_halfedges());
    // Dual halfedges cross an edge on the way to the next face; edges keep their order.
    std::vector<Index> number(t.n_edges, kInvalidIndex);
    for (const Index h : source)
        number[t.edge[t.ccw(h)]] = 0;
    for (Index& e : number) {
        if (e != kInvalidIndex)
            e = d.n_edges++;
    }
    for (Index k = 0; k < d.n_halfedges(); ++k) {
        const Index onwards = t.ccw(source[k]);
        d.twin[k] = map[t.next(onwards)];
        d.edge[k] = number[t.edge[onwards]];
        Index& out = d.vertex_halfedge[d.vertex[k]];
        if (out == kInvalidIndex || d.is_border(k))
            out = k;
    }
    if (halfedge_map)
        *halfedge_map = std::move(map);
    return d;
}

Submesh submesh(const Topology& t, const Flags& keep) {
    Submesh s;
    Topology& r = s.topology;
    Buffer<Index> face, vertex, edge;  // their numbers in the part
    s.faces = detail::flagged(keep, &face);
    r.quads_only = t.quads_only;
    r.face_offsets.resize(s.faces.size() + 1);
    for (Index f = 0; f < s.faces.size(); ++f) {
        r.face_offsets[f + 1] =
            t.quads_only ? 4 * (f + 1) : r.face_offsets[f] + t.face_size(s.faces[f]);
    }
    Flags has_vertex(t.n_vertices()), has_edge(t.n_edges);
    const auto for_each_halfedge = [&](auto&& f) {
        detail::for_each_index(
            s.faces.size(),
            [&](Index i) {
                Index k = r.face_offsets[i];
                for (Index h = t.face_offsets[s.faces[i]]; k < r.face_offsets[i + 1];)
                    f(i, k++, h++);
            },
            detail::kSmallChunk);
    };
    for_each_halfedge([&](Index, Index, Index h) {
        detail::set_flag(has_vertex[t.vertex[h]]);
        detail::set_flag(has_edge[t.edge[h]]);
    });
    s.vertices = detail::flagged(has_vertex, &vertex);
    s.edges = detail::flagged(has_edge, &edge);
    r.n_edges = static_cast<Index>(s.edges.size());

    const auto number = [&](Index h) {
        const Index f = h == kInvalidIndex ? kInvalidIndex : face[t.face(h)];
        return f == kInvalidIndex ? kInvalidIndex
                                  : r.face_offsets[f] + (h - t.face_offsets[t.face(h)]);
    };
    const Index n_halfedges = r.face_offsets.back();
    s.halfedges.resize(n_halfedges);
    for (auto* array : {&r.vertex, &r.twin, &r.edge})
        array->resize(n_halfedges);
    if (!r.quads_only)
        r.faces.resize(n_halfedges);
    for_each_halfedge([&](Index f, Index k, Index h) {
        s.halfedges[k] = h;
        if (!r.quads_only)
            r.faces[k] = f;
        r.vertex[k] = vertex[t.vertex[h]];
        r.edge[k] = edge[t.edge[h]];
        r.twin[k] = number(t.twin[h]);
    });
    // The first one of each vertex, but at the border the last of the border's: the highest of
    // numbers that fall for the others and rise above them for the border's.
    constexpr Index kBorder = Index(1) << 31;
    r.vertex_halfedge = detail::filled<Index>(s.vertices.size(), 0);
    detail::for_each_index(n_halfedges, [&](Index k) {
        const Index rank = r.is_border(k) ? kBorder | k : kBorder - 1 - k;
        detail::raise(r.vertex_halfedge[r.vertex[k]], rank);
    });
    detail::for_each_index(s.vertices.size(), [&](Index v) {
        Index& out = r.vertex_halfedge[v];
        out = out & kBorder ? out & ~kBorder : kBorder - 1 - out;
    });
    return s;
}

Flags grown(const Topology& t, Flags faces, int rings) {
    Flags vertices(rings > 0 ? t.n_vertices() : 0);
    // Flags of vertices stay: what was grown before is a part of what is grown now.
    for (int ring = 0; ring < rings; ++ring) {
        detail::for_each_index(t.n_faces(), [&](Index f) {
            for (Index h = t.face_offsets[f]; faces[f] && h < t.face_offsets[f + 1]; ++h)
                detail::set_flag(vertices[t.vertex[h]]);
        });
        detail::for_each_index(t.n_faces(), [&](Index f) {
            for (Index h = t.face_offsets[f]; !faces[f] && h < t.face_offsets[f + 1]; ++h)
                faces[f] = vertices[t.vertex[h]];
        });
    }
    return faces;
}

Topology cut(const Topology& t, const std::vector<bool>& edges,
             std::vector<Index>& vertices) {
    Topology c = t.to_relink();
    vertices.resize(t.n_vertices());
    for (Index v = 0; v < t.n_vertices(); ++v)
        vertices[v] = v;
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (!edges[t.edge[h]] || t.is_border(h))
            continue;
        c.twin[h] = kInvalidIndex;
        if (h > t.twin[h])
            c.edge[h] = c.n_edges++;
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        std::vector<Index> fans;
        t.for_each_outgoing(v, [&](Index h) {
            if (c.is_border(h))
                fans.push_back(h);
        });
        for (std::size_t i = 0; i < fans.size(); ++i) {
            Index fan = v;
            if (i == 0) {
                c.vertex_halfedge[v] = fans[0];
            } else {
                fan = c.n_vertices();
                c.vertex_halfedge.push_back(fans[i]);
                vertices.push_back(v);
            }
            for (Index h = fans[i]; h != kInvalidIndex; h = c.ccw(h))
                c.vertex[h] = fan;
        }
    }
    return c;
}

Topology with_border_strip(const Topology& t, const std::vector<Index>& borders,
                           const std::vector<bool>& corner) {
    Topology s = t.to_relink();
    std::vector<Index> quad(t.n_halfedges(), kInvalidIndex);
    for (std::size_t i = 0; i < borders.size(); ++i)
        quad[borders[i]] = t.n_halfedges() + 4 * static_cast<Index>(i);
    const auto add_vertex = [&] {
        s.vertex_halfedge.push_back(kInvalidIndex);
        return s.n_vertices() - 1;
    };
    const auto add_quad = [&](std::array<Index, 4> corners) {
        const Index first = s.n_halfedges();
        for (const Index v : corners) {
            s.vertex.push_back(v);
            s.twin.push_back(kInvalidIndex);
            s.edge.push_back(kInvalidIndex);
            if (!s.quads_only)
                s.faces.push_back(s.n_faces());
        }
        s.face_offsets.push_back(s.n_halfedges());
        return first;
    };
    const auto join = [&](Index a, Index b) {
        s.twin[a] = b;
        s.twin[b] = a;
    };
    // The border halfedge that ends where h starts, if it has a quad.
    const auto before = [&](Index h) {
        for (Index next = h; next != kInvalidIndex; next = t.ccw(h))
            h = next;
        const Index p = t.prev(h);
        return quad[p] == kInvalidIndex ? kInvalidIndex : p;
    };
    // Quad of h: from its end to its start, out, back along the strip, and in.
    std::vector<Index> out_of(borders.size()), into(borders.size());
    for (std::size_t i = 0; i < borders.size(); ++i)
        out_of[i] = add_vertex();
    for (std::size_t i = 0; i < borders.size(); ++i)
        into[i] = add_vertex();
    for (std::size_t i = 0; i < borders.size(); ++i) {
        const Index p = before(borders[i]);
        if (p != kInvalidIndex && !corner[t.vertex[borders[i]]])
            into[(quad[p] - t.n_halfedges()) / 4] = out_of[i];
    }
    for (std::size_t i = 0; i < borders.size(); ++i) {
        const Index h = borders[i];
        const Index q = add_quad({t.to_vertex(h), t.vertex[h], out_of[i], into[i]});
        assert(q == quad[h]);
        join(q, h);
        s.edge[q] = t.edge[h];
    }
    for (std::size_t i = 0; i < borders.size(); ++i) {
        const Index h = borders[i], p = before(h);
        if (p == kInvalidIndex)
            continue;
        if (!corner[t.vertex[h]]) {
            join(quad[h] + 1, quad[p] + 3);
            continue;
        }
        const Index q = add_quad(
            {t.vertex[h], s.vertex[quad[p] + 3], add_vertex(), s.vertex[quad[h] + 2]});
        join(q, quad[p] + 3);
        join(q + 3, quad[h] + 1);
    }
    for (Index h = t.n_halfedges(); h < s.n_halfedges(); ++h) {
        if (s.edge[h] != kInvalidIndex)
            continue;
        s.edge[h] = s.n_edges++;
        if (!s.is_border(h))
            s.edge[s.twin[h]] = s.edge[h];
    }
    // Vertices of the mesh lie inside now: any halfedge will do. Others take their border's.
    for (Index h = t.n_halfedges(); h < s.n_halfedges(); ++h) {
        Index& out = s.vertex_halfedge[s.vertex[h]];
        if (out == kInvalidIndex || s.is_border(h))
            out = h;
    }
    return s;
}

}  // namespace osdx::inline OSDX_ABI
