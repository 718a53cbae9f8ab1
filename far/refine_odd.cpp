// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <span>

#include "far/refine_step.h"
#include "far/stencil_rows.h"

namespace osdx::detail {
namespace {

/// The sharpness of the edges and vertices of split(t) after one step.
Features child_features(const Topology& t, const Features& f) {
    Features child;
    child.boundary = f.boundary;
    child.creases = f.creases;
    const auto lower = [](double s) {
        return s >= kInfinitelySharp ? s : std::max(s - 1, 0.0);
    };
    if (!f.vertex_sharpness.empty()) {
        child.vertex_sharpness.assign(t.n_vertices() + t.n_edges + t.n_faces(), 0.0);
        for (Index v = 0; v < t.n_vertices(); ++v)
            child.vertex_sharpness[v] = lower(f.vertex(v));
    }
    if (!f.hole.empty()) {
        for (Index h = 0; h < t.n_halfedges(); ++h)
            child.hole.push_back(f.hole[t.face[h]]);
    }
    if (f.edge_sharpness.empty())
        return child;

    child.edge_sharpness.assign(2 * t.n_edges + t.n_halfedges(), 0.0);
    if (f.creases == CreaseMethod::Uniform) {
        for_each_index(t.n_edges, [&](Index e) {
            child.edge_sharpness[2 * e] = child.edge_sharpness[2 * e + 1] =
                lower(f.edge(e));
        });
        return child;
    }
    std::vector<Index> first_vertex(t.n_edges);  // where half 2 e of edge e starts
    for (Index h = t.n_halfedges(); h-- > 0;)
        first_vertex[t.edge[h]] = t.vertex[h];
    for_each_index(t.n_vertices(), [&](Index v) {
        double sum = 0;
        int n_semi_sharp = 0;
        t.for_each_edge(v, [&](Index e, Index) {
            if (f.edge(e) > 0 && f.edge(e) < kInfinitelySharp) {
                sum += f.edge(e);
                ++n_semi_sharp;
            }
        });
        t.for_each_edge(v, [&](Index e, Index) {
            double s = f.edge(e);
            if (s > 0 && s < kInfinitelySharp && n_semi_sharp > 1)
                s = 0.75 * s + 0.25 * (sum - s) / (n_semi_sharp - 1);
            child.edge_sharpness[2 * e + (v == first_vertex[e] ? 0 : 1)] = lower(s);
        });
    });
    return child;
}

/// Writes the rows of an odd smoothing of the quads that split() made of a mesh.
///
/// Smooth: v' = (n-3)/n v + 2/n avg(edge neighbours) + 1/n avg(face-diagonal neighbours).
/// Right after split(), the vertices of edges become the average of their edge neighbours,
/// as in Catmull-Clark: the same between quads, but not next to other faces.
class OddSmoothing {
public:
    /// \param features, child  sharpness of the mesh before and after the step
    OddSmoothing(const Topology& mesh, const Features& features, const Topology& quads,
                 const Features& child)
        : mesh_(mesh), features_(features), quads_(quads), child_(child) {}

    /// Of all vertices but those of `skip`, whose rows are empty.
    StencilTable rows_after_split(const std::vector<bool>& skip) const {
        return make_rows(quads_.n_vertices(), [&](Index v, StencilTable& s) {
            if (skip.empty() || !skip[v])
                add_row(v, true, s);
        });
    }

    /// Of the vertices, but those of `skip`, all of whose inputs are known.
    StencilTable rows(const KnownRows& known, const std::vector<bool>& skip) const {
        return make_rows(quads_.n_vertices(), [&](Index v, StencilTable& s) {
            if (!skip.empty() && skip[v])
                return;
            const std::size_t begin = s.indices.size();
            add_row(v, false, s);
            if (!known.contains(std::span(s.indices).subspan(begin))) {
                s.indices.resize(begin);
                s.weights.resize(begin);
            }
        });
    }

private:
    bool is_edge_vertex(Index v) const {
        return v >= mesh_.n_vertices() && v < mesh_.n_vertices() + mesh_.n_edges;
    }
    double sharpness_before(Index edge) const {
        return edge < 2 * mesh_.n_edges ? features_.edge(edge / 2) : 0.0;
    }

    void add_row(Index v, bool right_after_split, StencilTable& s) const {
        if (features_.edge_sharpness.empty() && features_.vertex_sharpness.empty()) {
            return add_rule(VertexRule::Smooth, v, 1, right_after_split, s,
                            [](Index) { return false; });
        }
        std::size_t n_before = 0, n_after = 0;
        EndOfSharpness end;
        quads_.for_each_edge(v, [&](Index e, Index) {
            n_before += sharpness_before(e) > 0;
            n_after += child_.edge(e) > 0;
            end.note(sharpness_before(e), child_.edge(e));
        });
        const double before = v < mesh_.n_vertices() ? features_.vertex(v) : 0.0;
        end.note(before, child_.vertex(v));

        const VertexRule from = vertex_rule(before, n_before),
                         to = vertex_rule(child_.vertex(v), n_after);
        const double w = from == to ? 1 : end.weight_before();
        add_rule(from, v, w, right_after_split, s,
                 [&](Index e) { return sharpness_before(e) > 0; });
        if (w < 1) {
            add_rule(to, v, 1 - w, right_after_split, s,
                     [&](Index e) { return child_.edge(e) > 0; });
        }
    }

    template <class IsSharp>
    void add_rule(VertexRule rule, Index v, double w, bool right_after_split,
                  StencilTable& s, IsSharp&& is_sharp) const {
        switch (rule) {
            case VertexRule::Corner:
                s.add(v, w);
                break;
            case VertexRule::Crease:
                s.add(v, 0.5 * w);
                quads_.for_each_edge(v, [&](Index e, Index to) {
                    if (is_sharp(e))
                        s.add(to, 0.25 * w);
                });
                break;
            case VertexRule::Smooth:
                if (right_after_split && is_edge_vertex(v))
                    add_edge_point(v, w, s);
                else
                    add_smooth(v, w, right_after_split, s);
                break;
        }
    }

    /// The point of an edge between faces F0 and F1: f (F0 + F1) + (1/2 - f) (V0 + V1).
    void add_edge_point(Index v, double w, StencilTable& s) const {
        const Index first_face = mesh_.n_vertices() + mesh_.n_edges;
        double f = 0;
        quads_.for_each_edge(v, [&](Index, Index to) {
            if (to >= first_face) {
                const bool triangle =
                    features_.smooth_triangles && mesh_.face_size(to - first_face) == 3;
                f += 0.5 * (triangle ? kSmoothTriangle : 0.25);
            }
        });
        quads_.for_each_edge(
            v, [&](Index, Index to) { s.add(to, w * (to >= first_face ? f : 0.5 - f)); });
    }

    void add_smooth(Index v, double w, bool right_after_split, StencilTable& s) const {
        const double n = quads_.valence(v);
        if (n == 0) {
            s.add(v, w);
            return;
        }
        const SmoothWeights weights = smooth_weights(n, right_after_split);
        if (weights.own != 0)
            s.add(v, w * weights.own);
        quads_.for_each_outgoing(v, [&](Index h) {
            const Index to = quads_.next(h);
            s.add(quads_.vertex[to], w * weights.beside);
            s.add(quads_.vertex[quads_.next(to)], w * weights.diagonal);
        });
    }

    const Topology& mesh_;
    const Features& features_;
    const Topology& quads_;
    const Features& child_;
};

}  // namespace

RefinedLevel refine_odd(const RefinedLevel& parent, int degree) {
    const Topology& mesh = parent.topology;
    RefinedLevel level;
    level.topology = split(mesh);
    level.features = child_features(mesh, parent.features);
    if (!parent.gap.empty()) {
        level.gap.assign(level.topology.n_edges, false);
        for (Index e = 0; e < mesh.n_edges; ++e)
            level.gap[2 * e] = level.gap[2 * e + 1] = parent.gap[e];
    }
    const OddSmoothing smoothing(mesh, parent.features, level.topology, level.features);
    KnownRows known(parent.known);
    const std::vector<bool> beside_gap = vertices_beside_gaps(level);
    StencilTable first = compose(smoothing.rows_after_split(beside_gap),
                                 split_stencils(mesh), mesh.n_vertices());
    if (parent.known.empty()) {
        known.follow(first, beside_gap);
        level.factors.push_back(std::move(first));
    } else {
        level.factors.push_back(known.filter(std::move(first), beside_gap));
    }
    for (int i = 0; i < (degree - 3) / 2; ++i) {
        level.factors.push_back(smoothing.rows(known, beside_gap));
        known.follow(level.factors.back(), beside_gap);
    }
    level.known = known.take();
    return level;
}

}  // namespace osdx::detail
