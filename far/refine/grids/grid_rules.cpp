// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/grids/grid_rules.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "far/refine/sharpness.h"
#include "far/refine/smoothing.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

/// Values of some of many vertices.
template <class T>
class OfVertices {
public:
    explicit OfVertices(Index n_vertices) : place_(n_vertices, kInvalidIndex) {}

    T& operator[](Index v) {
        if (place_[v] == kInvalidIndex) {
            place_[v] = static_cast<Index>(values_.size());
            values_.emplace_back();
        }
        return values_[place_[v]];
    }
    /// f(vertex, value) for those that have been asked for, in the order of the vertices.
    template <class F>
    void for_each(F&& f) const {
        for (Index v = 0; v < place_.size(); ++v) {
            if (place_[v] != kInvalidIndex)
                f(v, values_[place_[v]]);
        }
    }

private:
    std::vector<Index> place_;
    std::vector<T> values_;
};

/// The creases that meet at a vertex: how many, and where two of them go.
struct Creases {
    std::size_t n = 0;
    EdgeEnd ends[2] = {};
    void add(const EdgeEnd& end) {
        if (n < 2)
            ends[n] = end;
        ++n;
    }
};

}  // namespace

GridRules rules_after_split(const GridRules& rules, const Topology& mesh) {
    // Quad h of split() runs from corner h out along its edge and, last, back to the corner.
    const auto first_half = [](Index h) { return 4 * h; };
    const auto second_half = [&](Index h) { return 4 * mesh.next(h) + 3; };
    GridRules result;
    for (SharpVertex v : rules.vertices) {
        for (EdgeEnd& e : v.ends)
            e.halfedge = e.at_end ? second_half(e.halfedge) : first_half(e.halfedge);
        result.vertices.push_back(v);
    }
    for (const SharpEdge& e : rules.edges) {
        const double crease =
            e.weights == SharpEdge::kAll ? 1 : rules.crease_weights[e.weights];
        result.vertices.push_back(
            {mesh.n_vertices() + mesh.edge[e.halfedge],
             0,
             crease,
             1 - crease,
             {{first_half(e.halfedge), true}, {second_half(e.halfedge), false}}});
    }
    return result;
}

GridSharpness::GridSharpness(const Topology& mesh, const ResolvedFeatures& f)
    : method_(f.creases), smooth_triangles_(f.smooth_triangles) {
    for (Index h = 0; h < mesh.n_halfedges() && !f.edge_sharpness.empty(); ++h) {
        if (h < mesh.twin[h] && f.edge(mesh.edge[h]) > 0)
            edges_.push_back({h, {f.edge(mesh.edge[h])}});
    }
    for (Index v = 0; v < f.vertex_sharpness.size(); ++v) {
        if (f.vertex(v) > 0)
            vertices_.push_back({v, f.vertex(v)});
    }
}

std::vector<GridSharpness::Edge> GridSharpness::finer_edges(const QuadGrids& g) const {
    std::vector<Edge> finer = edges_;
    if (method_ == CreaseMethod::Uniform) {
        for (Edge& e : finer)
            std::ranges::transform(e.segments, e.segments.begin(),
                                   [](double s) { return lowered(s); });
        return finer;
    }
    OfVertices<Meeting> meetings(g.roots.n_vertices());
    for (const Edge& e : edges_) {
        meetings[g.roots.vertex[e.halfedge]].add(e.at(0));
        meetings[g.roots.to_vertex(e.halfedge)].add(e.at(g.size - 1));
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) {
        const Edge& e = edges_[i];
        const auto meeting = [&](Index t) {  // at vertex t of the edge
            if (t == 0)
                return meetings[g.roots.vertex[e.halfedge]];
            if (t == g.size)
                return meetings[g.roots.to_vertex(e.halfedge)];
            Meeting m;
            m.add(e.at(t - 1));
            m.add(e.at(t));
            return m;
        };
        if (is_infinitely_sharp(e.at(0)))
            continue;
        finer[i].segments.clear();
        for (Index t = 0; t < 2 * g.size; ++t)
            finer[i].segments.push_back(
                meeting((t + 1) / 2).lowered(e.at(t / 2), method_));
    }
    return finer;
}

GridRules GridSharpness::step(const QuadGrids& coarse) {
    GridRules rules;
    std::vector<Edge> finer = finer_edges(coarse);
    const Index n = 2 * coarse.size;

    struct Around {  // a vertex
        double before = 0, after = 0;
        Creases creases_before, creases_after;
        EndOfSharpness end;
    };
    OfVertices<Around> around(coarse.roots.n_vertices());
    for (std::size_t i = 0; i < edges_.size(); ++i) {
        const Index h = edges_[i].halfedge;
        const auto before = [&](Index t) { return edges_[i].at(t / 2); };
        const auto after = [&](Index t) { return finer[i].at(t); };
        for (const bool at_end : {false, true}) {
            Around& a =
                around[at_end ? coarse.roots.to_vertex(h) : coarse.roots.vertex[h]];
            const Index t = at_end ? n - 1 : 0;
            if (before(t) > 0)
                a.creases_before.add({h, at_end});
            if (after(t) > 0)
                a.creases_after.add({h, at_end});
            a.end.note(before(t), after(t));
        }
        // Inner points are on two segments: on a crease, or smooth.
        const std::size_t first = rules.crease_weights.size();
        bool all = true, none = true;
        for (Index t = 1; t < n; ++t) {
            EndOfSharpness end;
            for (const Index segment : {t - 1, t})
                end.note(before(segment), after(segment));
            const bool was = before(t - 1) > 0 && before(t) > 0,
                       is = after(t - 1) > 0 && after(t) > 0;
            const double weight = was == is ? was : end.weight_before();
            rules.crease_weights.push_back(weight);
            all = all && weight == 1;
            none = none && weight == 0;
        }
        if (all || none)
            rules.crease_weights.resize(first);
        if (!none)
            rules.edges.push_back({h, all ? SharpEdge::kAll : first});
    }
    for (auto& [v, s] : vertices_) {
        Around& a = around[v];
        a.before = s;
        a.after = s = lowered(s);
        a.end.note(a.before, a.after);
    }
    around.for_each([&](Index v, const Around& a) {
        const VertexRule from = vertex_rule(a.before, a.creases_before.n),
                         to = vertex_rule(a.after, a.creases_after.n);
        const double w = from == to ? 1 : a.end.weight_before();
        SharpVertex rule{v};
        for (const auto& [which, weight, creases] :
             {std::tuple(to, 1 - w, &a.creases_after),
              std::tuple(from, w, &a.creases_before)}) {
            if (weight == 0)
                continue;
            if (which == VertexRule::Crease)
                std::ranges::copy(creases->ends, rule.ends);
            (which == VertexRule::Corner   ? rule.corner
             : which == VertexRule::Crease ? rule.crease
                                           : rule.smooth) += weight;
        }
        if (rule.smooth < 1)
            rules.vertices.push_back(rule);
    });
    if (smooth_triangles_) {
        const Topology& t = coarse.roots;
        rules.face_weights.assign(t.n_edges, 0.0);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            rules.face_weights[t.edge[h]] +=
                half_face_weight(t.face_size(t.face(h)) == 3);
        }
        smooth_triangles_ = false;
    }
    edges_ = std::move(finer);
    std::erase_if(edges_, [](const Edge& e) {
        return std::ranges::all_of(e.segments, [](double s) { return s <= 0; });
    });
    std::erase_if(vertices_, [](const auto& v) { return v.second <= 0; });
    return rules;
}

void GridSharpness::split_edges(const Topology& mesh, const Topology& split) {
    std::vector<Index> lower(split.n_edges);
    for (Index h = split.n_halfedges(); h-- > 0;)
        lower[split.edge[h]] = h;
    std::vector<Edge> halves;
    for (const Edge& e : edges_) {
        for (const Index half : {0u, 1u}) {
            if (e.at(half) > 0)
                halves.push_back({lower[2 * mesh.edge[e.halfedge] + half], {e.at(half)}});
        }
    }
    edges_ = std::move(halves);
}

void GridSharpness::write(const QuadGrids& g, ResolvedFeatures& f) const {
    f.smooth_triangles = smooth_triangles_;
    f.edge_sharpness.clear();
    f.vertex_sharpness.clear();
    if (!edges_.empty())
        f.edge_sharpness.assign(g.n_edges(), 0.0);
    for (const Edge& e : edges_) {
        for (Index t = 0; t < g.size; ++t)
            f.edge_sharpness[g.size * g.roots.edge[e.halfedge] + t] = e.at(t);
    }
    if (!vertices_.empty())
        f.vertex_sharpness.assign(g.n_vertices(), 0.0);
    for (const auto& [v, s] : vertices_)
        f.vertex_sharpness[v] = s;
}

}  // namespace osdx::inline OSDX_ABI::detail
