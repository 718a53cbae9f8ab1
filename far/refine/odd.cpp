// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/odd.h"

#include <algorithm>
#include <span>

#include <osdx/topology.h>

#include "far/mesh/topology_edits.h"
#include "far/parallel.h"
#include "far/refine/level_rows.h"
#include "far/refine/sharpness.h"
#include "far/refine/smoothing.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

/// The sharpness of the edges and vertices of split(t) after one step.
ResolvedFeatures child_features(const Topology& t, const ResolvedFeatures& f) {
    ResolvedFeatures child;
    child.boundary = f.boundary;
    child.creases = f.creases;
    if (!f.vertex_sharpness.empty()) {
        child.vertex_sharpness.assign(t.n_vertices() + t.n_edges + t.n_faces(), 0.0);
        for_each_index(t.n_vertices(), [&](Index v) {
            child.vertex_sharpness[v] = lowered(f.vertex(v));
        });
    }
    if (!f.hole.empty()) {
        for (Index h = 0; h < t.n_halfedges(); ++h)
            child.hole.push_back(f.hole[t.face(h)]);
    }
    if (f.edge_sharpness.empty())
        return child;

    child.edge_sharpness.assign(2 * t.n_edges + t.n_halfedges(), 0.0);
    if (f.creases == CreaseMethod::Uniform) {
        for_each_index(t.n_edges, [&](Index e) {
            child.edge_sharpness[2 * e] = child.edge_sharpness[2 * e + 1] =
                lowered(f.edge(e));
        });
        return child;
    }
    std::vector<Index> first_vertex(t.n_edges);  // where half 2 e of edge e starts
    for (Index h = t.n_halfedges(); h-- > 0;)
        first_vertex[t.edge[h]] = t.vertex[h];
    for_each_index(t.n_vertices(), [&](Index v) {
        Meeting meeting;
        t.for_each_edge(v, [&](Index e, Index) { meeting.add(f.edge(e)); });
        t.for_each_edge(v, [&](Index e, Index) {
            child.edge_sharpness[2 * e + (v == first_vertex[e] ? 0 : 1)] =
                meeting.lowered(f.edge(e), f.creases);
        });
    });
    return child;
}

/// A row of few entries.
struct PlainRow {
    static constexpr Index kMost = 16;
    Index n = 0;
    Index vertices[kMost];
    double weights[kMost];

    void add(Index vertex, double weight) {
        vertices[n] = vertex;
        weights[n++] = weight;
    }
    /// Entries in ascending order of their vertices.
    /// \return false if some vertex is there twice
    bool sort() {
        // Each goes where the number of those below says: so few are compared with all others
        // sooner than branches would tell them apart.
        const PlainRow row = *this;
        Index sum = 0;
        for (Index i = 0; i < n; ++i) {
            Index rank = 0;
            for (Index k = 0; k < n; ++k)
                rank += row.vertices[k] < row.vertices[i];
            vertices[rank] = row.vertices[i];
            weights[rank] = row.weights[i];
            sum += rank;
        }
        return 2 * sum == n * (n - 1);
    }
};

/// Writes the rows of an odd smoothing of the quads that split() made of a mesh.
///
/// Smooth: v' = (n-3)/n v + 2/n avg(edge neighbours) + 1/n avg(face-diagonal neighbours).
/// Right after split(), the vertices of edges become the average of their edge neighbours,
/// as in Catmull-Clark: the same between quads, but not next to other faces.
class OddSmoothing {
public:
    /// From a level to the next one.
    OddSmoothing(const RefinedLevel& from, const RefinedLevel& to)
        : mesh_(from.topology),
          features_(from.features),
          quads_(to.topology),
          child_(to.features) {
        if (from.sharp.empty())
            return;
        sharp_ = from.sharp;
        sharp_.resize(quads_.n_vertices());
        for_each_index(mesh_.n_halfedges(), [&](Index h) {
            if (from.sharp[mesh_.vertex[h]] && features_.edge(mesh_.edge[h]) > 0)
                set_flag(sharp_[mesh_.n_vertices() + mesh_.edge[h]]);
        });
    }

    /// Vertices of the quads where something was sharp before the step; empty: none.
    const Flags& sharp() const { return sharp_; }

    /// Calls add(vertex, weight) for the entries of a row, over the vertices of the quads.
    template <class Add>
    void for_each_entry(Index v, bool right_after_split, Add&& add) const {
        if (!is_sharp(v)) {
            return add_rule(VertexRule::Smooth, v, 1, right_after_split, add,
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
        add_rule(from, v, w, right_after_split, add,
                 [&](Index e) { return sharpness_before(e) > 0; });
        if (w < 1) {
            add_rule(to, v, 1 - w, right_after_split, add,
                     [&](Index e) { return child_.edge(e) > 0; });
        }
    }

    /// The row of a vertex right after split() over the vertices of the mesh, where that is of
    /// quads and nothing is sharp: to the last bit what the sums are, without summing up.
    /// \return false where it is not so, or a vertex is met twice
    bool plain_row(Index v, PlainRow& row) const {
        if (!mesh_.quads_only || is_sharp(v))
            return false;
        const Index first_edge = mesh_.n_vertices(),
                    first_face = first_edge + mesh_.n_edges;
        if (v >= first_face) {
            for (Index h = 4 * (v - first_face), k = 0; k < 4; ++k)
                row.add(mesh_.vertex[h + k], 0.25);
        } else if (v >= first_edge) {
            const Index h = edge_halfedge(v), twin = mesh_.twin[h];
            if (twin == kInvalidIndex)
                return false;
            for (Index side : {h, twin}) {
                row.add(mesh_.vertex[side], 0.375);
                for (int k = 0; k < 2; ++k) {
                    side = mesh_.next(side);
                    row.add(mesh_.to_vertex(side), 0.0625);
                }
            }
        } else {
            Index n = 0;
            bool open = false;
            mesh_.for_each_outgoing(v, [&](Index h) {
                ++n;
                open = open || mesh_.is_border(h);
            });
            if (open || n == 0 || 2 * n + 1 > PlainRow::kMost)
                return false;
            // In the order of the sums over vertices, middles of edges and of faces.
            const SmoothWeights w = smooth_weights(n, true);
            const double edge = w.beside * 0.5, face = w.diagonal * 0.25;
            double own = w.own;
            mesh_.for_each_outgoing(v, [&](Index h) {
                own += edge;
                own += face;
                const Index next = mesh_.next(h);
                row.add(mesh_.vertex[next], edge + face + face);
                row.add(mesh_.to_vertex(next), face);
            });
            if (own != 0)
                row.add(v, own);
        }
        return row.sort();
    }

    /// Calls add(vertex, weight) for what split() makes a vertex of, over those of the mesh.
    template <class Add>
    void for_each_split_entry(Index v, Add&& add) const {
        const Index first_edge = mesh_.n_vertices(),
                    first_face = first_edge + mesh_.n_edges;
        if (v < first_edge) {
            add(v, 1.0);
        } else if (v < first_face) {
            const Index h = edge_halfedge(v);
            add(mesh_.vertex[h], 0.5);
            add(mesh_.to_vertex(h), 0.5);
        } else {
            const Index f = v - first_face;
            const double w = 1.0 / mesh_.face_size(f);
            for (Index h = mesh_.face_offsets[f]; h < mesh_.face_offsets[f + 1]; ++h)
                add(mesh_.vertex[h], w);
        }
    }

private:
    /// Something sharp ends or runs there before the step.
    bool is_sharp(Index v) const { return !sharp_.empty() && sharp_[v]; }
    bool is_edge_vertex(Index v) const {
        return v >= mesh_.n_vertices() && v < mesh_.n_vertices() + mesh_.n_edges;
    }
    /// Of the edge in whose middle a vertex is.
    Index edge_halfedge(Index v) const {
        // Quad q has the middle of the edge that leaves halfedge q at its corner 1, and at
        // corner 3 that of the edge before.
        const Index corner = quads_.vertex_halfedge[v], q = corner / 4;
        return corner % 4 == 1 ? q : mesh_.prev(q);
    }
    double sharpness_before(Index edge) const {
        return edge < 2 * mesh_.n_edges ? features_.edge(edge / 2) : 0.0;
    }

    template <class Add, class IsSharp>
    void add_rule(VertexRule rule, Index v, double w, bool right_after_split, Add&& add,
                  IsSharp&& is_sharp) const {
        switch (rule) {
            case VertexRule::Corner:
                add(v, w);
                break;
            case VertexRule::Crease:
                add(v, 0.5 * w);
                quads_.for_each_edge(v, [&](Index e, Index to) {
                    if (is_sharp(e))
                        add(to, 0.25 * w);
                });
                break;
            case VertexRule::Smooth:
                if (right_after_split && is_edge_vertex(v))
                    add_edge_point(v, w, add);
                else
                    add_smooth(v, w, right_after_split, add);
                break;
        }
    }

    /// See half_face_weight().
    template <class Add>
    void add_edge_point(Index v, double w, Add&& add) const {
        const Index first_face = mesh_.n_vertices() + mesh_.n_edges;
        double f = 0;
        quads_.for_each_edge(v, [&](Index, Index to) {
            if (to >= first_face) {
                const bool triangle =
                    features_.smooth_triangles && mesh_.face_size(to - first_face) == 3;
                f += half_face_weight(triangle);
            }
        });
        quads_.for_each_edge(
            v, [&](Index, Index to) { add(to, w * (to >= first_face ? f : 0.5 - f)); });
    }

    template <class Add>
    void add_smooth(Index v, double w, bool right_after_split, Add&& add) const {
        const double n = quads_.valence(v);
        if (n == 0) {
            add(v, w);
            return;
        }
        const SmoothWeights weights = smooth_weights(n, right_after_split);
        if (weights.own != 0)
            add(v, w * weights.own);
        quads_.for_each_outgoing(v, [&](Index h) {
            const Index to = quads_.next(h);
            add(quads_.vertex[to], w * weights.beside);
            add(quads_.vertex[quads_.next(to)], w * weights.diagonal);
        });
    }

    const Topology& mesh_;
    const ResolvedFeatures& features_;
    const Topology& quads_;
    const ResolvedFeatures& child_;
    Flags sharp_;
};

/// The rows of a level: linear subdivision with a first smoothing, and further smoothings.
class OddRows : public LevelRows {
public:
    /// \param mesh  that was refined: `parent`, or the part of it
    OddRows(const RefinedLevel& mesh, std::shared_ptr<const RefinedPart> part, int degree,
            const RefinedLevel& level)
        : part_(std::move(part)),
          mesh_(&mesh.topology),
          quads_(&level.topology),
          smoothing_(mesh, level),
          known_(std::size_t(degree - 1) / 2) {
        const Flags beside_gap = vertices_beside_gaps(level);
        if (beside_gap.empty() && mesh.known.empty())
            return;
        for (std::size_t f = 0; f < known_.size(); ++f)
            find_known(f, f > 0 ? known_[f - 1] : mesh.known, beside_gap);
    }

    int n_factors() const override { return static_cast<int>(known_.size()); }
    Index n_rows(int) const override { return quads_->n_vertices(); }
    void add(int factor, Index row, DenseRow& sums, StencilTable& table) const override {
        const Flags& known = known_[factor];
        if (!known.empty() && !known[row])
            return;
        if (factor > 0) {
            smoothing_.for_each_entry(row, false,
                                      [&](Index v, double w) { table.add(v, w); });
            return;
        }
        const auto point = [&](Index v) { return part_ ? part_->vertices[v] : v; };
        PlainRow plain;
        if (smoothing_.plain_row(row, plain)) {
            const std::size_t first = table.indices.size();
            table.indices.resize(first + plain.n);
            table.weights.resize(first + plain.n);
            for (Index i = 0; i < plain.n; ++i) {
                table.indices[first + i] = point(plain.vertices[i]);
                table.weights[first + i] = plain.weights[i];
            }
            return;
        }
        sums.fit(mesh_->n_vertices());
        for_each_entry_after_split(row, [&](Index v, double w) { sums.add(v, w); });
        sums.take([&](Index v, double w) { table.add(point(v), w); });
    }
    const OddSmoothing& smoothing() const { return smoothing_; }
    /// Of the points of the level; empty: all.
    const Flags& known() const { return known_.back(); }

private:
    template <class Add>
    void for_each_entry_after_split(Index row, Add&& add) const {
        smoothing_.for_each_entry(row, true, [&](Index q, double w) {
            smoothing_.for_each_split_entry(q, [&](Index v, double x) { add(v, w * x); });
        });
    }

    /// Rows are known where all inputs are, but not beside gaps. Either may be empty.
    void find_known(std::size_t factor, const Flags& inputs, const Flags& beside_gap) {
        // Far from what is unknown there is nothing to look for.
        const Flags beside = inputs.empty() ? Flags()
                                            : vertices_beside_unknown(
                                                  factor > 0 ? *quads_ : *mesh_, inputs);
        Flags& known = known_[factor];
        known.resize(quads_->n_vertices());
        for_each_index(known.size(), [&](Index v) {
            bool all = beside_gap.empty() || !beside_gap[v], close = false;
            const auto look = [&](Index i, double) { close = close || beside[i]; };
            const auto read = [&](Index i, double) { all = all && inputs[i]; };
            if (all && !inputs.empty()) {
                if (factor > 0)
                    close = beside[v];
                else
                    smoothing_.for_each_split_entry(v, look);
            }
            if (close && factor > 0)
                smoothing_.for_each_entry(v, false, read);
            else if (close)
                for_each_entry_after_split(v, read);
            known[v] = all;
        });
    }

    std::shared_ptr<const RefinedPart> part_;
    const Topology *mesh_, *quads_;
    OddSmoothing smoothing_;
    std::vector<Flags> known_;  // by factor, of its rows; empty: all
};

}  // namespace

void refine_odd(const RefinedLevel& parent, std::shared_ptr<const RefinedPart> part,
                int degree, RefinedLevel& level) {
    const RefinedLevel& refined = part ? part->level : parent;
    const Topology& mesh = refined.topology;
    level.topology = split(mesh);
    level.features = child_features(mesh, refined.features);
    if (!refined.gap.empty()) {
        level.gap.resize(level.topology.n_edges);
        for_each_index(mesh.n_edges, [&](Index e) {
            level.gap[2 * e] = level.gap[2 * e + 1] = refined.gap[e];
        });
    }
    const auto rows = std::make_shared<OddRows>(refined, std::move(part), degree, level);
    level.sharp = rows->smoothing().sharp();
    keep_sharp(level);
    level.known = rows->known();
    level.rows = rows;
}

void keep_sharp(RefinedLevel& level) {
    const Topology& t = level.topology;
    const ResolvedFeatures& f = level.features;
    for_each_index(level.sharp.size(), [&](Index v) {
        if (!level.sharp[v])
            return;
        bool any = f.vertex(v) > 0;
        t.for_each_edge(v, [&](Index e, Index) { any |= f.edge(e) > 0; });
        level.sharp[v] = any;
    });
}

}  // namespace osdx::inline OSDX_ABI::detail
