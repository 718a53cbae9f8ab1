// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>

#include "far/refine_step.h"

namespace osdx::detail {
namespace {

/// Rows that come entry by entry, with sums where an index comes again.
class RowSums {
public:
    explicit RowSums(StencilTable& table) : table_(table) {}

    void add(Index index, double weight) {
        const auto begin =
            table_.indices.begin() + static_cast<std::ptrdiff_t>(table_.offsets.back());
        const auto found = std::find(begin, table_.indices.end(), index);
        if (found != table_.indices.end())
            table_.weights[found - table_.indices.begin()] += weight;
        else
            table_.add(index, weight);
    }
    void end_row() { table_.end_row(); }

private:
    StencilTable& table_;
};

/// Where the middle of each face is: its centroid, or on the curve that runs through it.
class FaceCentres {
public:
    explicit FaceCentres(const RefinedLevel& level) : level_(level) {
        if (!level.spikes.empty())
            spike_.assign(level.topology.n_faces(), kInvalidIndex);
        for (const auto& [face, vertex] : level.spikes)
            spike_[face] = vertex;
    }

    /// Calls f(vertex, weight) for the vertices of the level that make up the centre.
    template <class F>
    void for_each(Index face, F&& f) const {
        const FaceKind kind =
            level_.face_kinds.empty() ? FaceKind::Plain : level_.face_kinds[face];
        if (kind == FaceKind::Spike) {
            f(spike_[face], 1.0);
            return;
        }
        const Topology& t = level_.topology;
        const auto counts = [&](Index h) {
            switch (kind) {
                case FaceKind::Border:
                    return level_.point_kinds[t.vertex[h]] == PointKind::Curve;
                case FaceKind::Pinned:
                    return level_.point_kinds[t.vertex[h]] == PointKind::Pinned;
                case FaceKind::Dart:
                    return level_.point_kinds[t.vertex[h]] == PointKind::Inner;
                default:
                    return true;
            }
        };
        const Index begin = t.face_offsets[face], end = t.face_offsets[face + 1];
        int n = 0;
        for (Index h = begin; h < end; ++h)
            n += counts(h);
        for (Index h = begin; h < end; ++h) {
            if (counts(h))
                f(t.vertex[h], 1.0 / n);
        }
    }

private:
    const RefinedLevel& level_;
    std::vector<Index> spike_;
};

/// From the points of a level to the corners of its faces: corner x goes to the middle of x,
/// the face's centre and the middles of the edges at x. Beside a border curve's point half of
/// the edge is beyond the border, and its middle is that point.
StencilTable corner_rows(const RefinedLevel& level, bool is_base) {
    const Topology& t = level.topology;
    const FaceCentres centres(level);
    const auto kind = [&](Index v) {
        return is_base ? PointKind::Inner : level.point_kinds[v];
    };
    StencilTable s;
    RowSums row(s);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        const Index x = t.vertex[h];
        const double to_centre = kind(x) == PointKind::Inner   ? 0.25
                                 : kind(x) == PointKind::Curve ? 0.5
                                                               : 0.0;
        if (to_centre > 0) {
            centres.for_each(t.face[h],
                             [&](Index v, double w) { row.add(v, to_centre * w); });
        }
        if (kind(x) == PointKind::Inner) {
            row.add(x, 0.25);
            for (const Index y : {t.to_vertex(h), t.vertex[t.prev(h)]}) {
                const bool curve = kind(y) == PointKind::Curve;
                row.add(y, curve ? 0.25 : 0.125);
                if (!curve)
                    row.add(x, 0.125);
            }
        } else {
            row.add(x, 1 - to_centre);
        }
        row.end_row();
    }
    return s;
}

/// The face kinds that the points give; darts and spikes are for the caller to name.
std::vector<FaceKind> face_kinds(const Topology& t,
                                 const std::vector<PointKind>& points) {
    std::vector<FaceKind> kinds(t.n_faces(), FaceKind::Plain);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        FaceKind& kind = kinds[t.face[h]];
        if (points[t.vertex[h]] == PointKind::Pinned)
            kind = FaceKind::Pinned;
        else if (points[t.vertex[h]] == PointKind::Curve && kind == FaceKind::Plain)
            kind = FaceKind::Border;
    }
    return kinds;
}

void add_spike(RefinedLevel& level, Index face) {
    level.face_kinds[face] = FaceKind::Spike;
    level.spikes.emplace_back(face, level.topology.n_vertices());
    level.topology.vertex_halfedge.push_back(kInvalidIndex);
    level.point_kinds.push_back(PointKind::Pinned);
}

StencilTable face_rows(const RefinedLevel& level) {
    const FaceCentres centres(level);
    StencilTable s;
    for (Index f = 0; f < level.topology.n_faces(); ++f) {
        centres.for_each(f, [&](Index v, double w) { s.add(v, w); });
        s.end_row();
    }
    return s;
}

/// A row per vertex over faces: the average of the incident ones.
StencilTable vertex_averages(const RefinedLevel& level) {
    const Topology& t = level.topology;
    StencilTable s;
    Index spike = 0;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (spike < level.spikes.size() && level.spikes[spike].second == v) {
            s.add(level.spikes[spike++].first, 1.0);
        } else {
            const double w = 1.0 / t.valence(v);
            t.for_each_outgoing(v, [&](Index h) { s.add(t.face[h], w); });
        }
        s.end_row();
    }
    return s;
}

void note_gaps(RefinedLevel& level) {
    const Topology& t = level.topology;
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (!t.is_border(h) || (level.point_kinds[t.vertex[h]] != PointKind::Inner &&
                                level.point_kinds[t.to_vertex(h)] != PointKind::Inner))
            continue;
        level.gap.resize(t.n_edges);
        level.gap[t.edge[h]] = true;
    }
}

}  // namespace

RefinedLevel even_base(Topology base, const Features& features) {
    std::vector<bool> sharp(base.n_edges);
    std::vector<int> n_sharp(base.n_vertices(), 0);
    for (Index v = 0; v < base.n_vertices(); ++v) {
        base.for_each_edge(v, [&](Index e, Index) {
            sharp[e] = features.edge(e) >= kInfinitelySharp;
            n_sharp[v] += sharp[e];
        });
    }
    RefinedLevel level;
    level.topology = cut(base, sharp, level.base_vertices);
    level.features.boundary = features.boundary;
    level.features.hole = features.hole;
    const Topology& t = level.topology;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        const Index source = level.base_vertices[v], h = t.vertex_halfedge[v];
        const bool open = h != kInvalidIndex && t.is_border(h);
        const bool pinned =
            features.vertex(source) >= kInfinitelySharp || n_sharp[source] > 2;
        level.point_kinds.push_back(pinned ? (open ? PointKind::Pinned : PointKind::Spike)
                                    : !open                ? PointKind::Inner
                                    : n_sharp[source] == 1 ? PointKind::Dart
                                                           : PointKind::Curve);
    }
    return level;
}

RefinedLevel refine_even(const RefinedLevel& parent, int degree, bool parent_is_base) {
    const Topology& mesh = parent.topology;
    RefinedLevel level;
    level.features.boundary = parent.features.boundary;
    StencilTable rows = corner_rows(parent, parent_is_base);
    std::vector<Index> map;
    if (!parent_is_base) {
        level.topology = dual(split(mesh), &map);
        for (Index h = 0; h < mesh.n_halfedges(); ++h)
            level.point_kinds.push_back(parent.point_kinds[mesh.vertex[h]]);
        level.face_kinds = face_kinds(level.topology, level.point_kinds);
        const auto child = [&](Index face) {
            return level.topology.face[map[4 * mesh.face_offsets[face] + 2]];
        };
        for (Index f = 0; f < mesh.n_faces(); ++f) {
            if (parent.face_kinds[f] == FaceKind::Dart)
                level.face_kinds[child(f)] = FaceKind::Dart;
        }
        for (const auto& [face, vertex] : parent.spikes) {
            add_spike(level, child(face));
            rows.add(vertex, 1.0);
            rows.end_row();
        }
    } else {
        const Topology quads = split(mesh);
        std::vector<Index> borders;
        for (Index h = 0; h < quads.n_halfedges(); ++h) {
            if (quads.is_border(h) && !parent.is_gap(quads.edge[h] / 2))
                borders.push_back(h);
        }
        std::vector<bool> corner(quads.n_vertices(), false);
        for (Index v = 0; v < mesh.n_vertices(); ++v)
            corner[v] = parent.point_kinds[v] == PointKind::Pinned;
        const Topology strip = with_border_strip(quads, borders, corner);
        level.topology = dual(strip, &map);
        level.point_kinds.assign(mesh.n_halfedges(), PointKind::Inner);
        // Border curves: three quarters of the near end of the edge, one of the far one.
        for (const Index b : borders) {
            const Index start = quads.vertex[b];
            const bool first = start < mesh.n_vertices();
            const Index h = b / 4, edge = first ? h : mesh.prev(h);
            rows.add(mesh.vertex[edge], first ? 0.75 : 0.25);
            rows.add(mesh.to_vertex(edge), first ? 0.25 : 0.75);
            rows.end_row();
            level.point_kinds.push_back(PointKind::Curve);
        }
        for (Index f = rows.n_rows(); f < strip.n_faces(); ++f) {
            rows.add(strip.vertex[strip.face_offsets[f]], 1.0);
            rows.end_row();
            level.point_kinds.push_back(PointKind::Pinned);
        }
        level.face_kinds = face_kinds(level.topology, level.point_kinds);
        for (Index v = 0; v < mesh.n_vertices(); ++v) {
            const PointKind kind = parent.point_kinds[v];
            if (kind != PointKind::Dart && kind != PointKind::Spike)
                continue;
            const Index of_vertex = map[4 * mesh.vertex_halfedge[v]];
            if (of_vertex == kInvalidIndex)
                continue;  // beside a gap
            const Index face = level.topology.face[of_vertex];
            if (kind == PointKind::Dart) {
                level.face_kinds[face] = FaceKind::Dart;
            } else {
                add_spike(level, face);
                rows.add(v, 1.0);
                rows.end_row();
            }
        }
    }
    note_gaps(level);

    KnownRows known(parent.known);
    level.factors.push_back(known.filter(std::move(rows), {}));
    if (degree >= 4) {
        const std::vector<bool> beside_gap = vertices_beside_gaps(level);
        const StencilTable to_faces = face_rows(level);
        const StencilTable to_vertices = vertex_averages(level);
        for (int i = 0; i < (degree - 2) / 2; ++i) {
            level.factors.push_back(known.filter(to_faces, {}));
            level.factors.push_back(known.filter(to_vertices, beside_gap));
        }
    }
    level.known = known.take();

    // Quad h of split(parent) has the vertex of corner h at its corner 0, the face at 2.
    level.corner_halfedges.resize(mesh.n_halfedges());
    for (Index h = 0; h < mesh.n_halfedges(); ++h)
        level.corner_halfedges[h] = map[4 * h + (parent_is_base ? 0 : 2)];
    return level;
}

}  // namespace osdx::detail
