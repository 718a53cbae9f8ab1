// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <span>

#include "far/mesh/topology_edits.h"
#include "far/refine/refine_step.h"
#include "far/refine/sharpness.h"

namespace osdx::detail {
namespace {

/// Follows what is known through the factors of a level.
class KnownRows {
public:
    explicit KnownRows(Flags inputs) : known_(std::move(inputs)) {}

    /// The rows, but empty where an input is unknown or `unusable` says so.
    StencilTable filter(StencilTable rows, const Flags& unusable) {
        if (known_.empty() && unusable.empty())
            return rows;
        Flags known(rows.n_rows());
        StencilTable result = make_rows(rows.n_rows(), [&](Index r, StencilTable& table) {
            bool ok = unusable.empty() || !unusable[r];
            const std::size_t begin = rows.offsets[r], end = rows.offsets[r + 1];
            for (std::size_t k = begin; ok && k < end; ++k)
                ok = known_.empty() || known_[rows.indices[k]];
            for (std::size_t k = begin; ok && k < end; ++k)
                table.add(rows.indices[k], rows.weights[k]);
            known[r] = ok;
        });
        known_ = std::move(known);
        return result;
    }
    /// Empty: all are known.
    Flags take() { return std::move(known_); }

private:
    Flags known_;
};

/// Rows that were made beforehand.
class StoredRows : public LevelRows {
public:
    explicit StoredRows(std::vector<StencilTable> factors)
        : factors_(std::move(factors)) {}

    int n_factors() const override { return static_cast<int>(factors_.size()); }
    Index n_rows(int factor) const override { return factors_[factor].n_rows(); }
    void add(int factor, Index row, DenseRow&, StencilTable& table) const override {
        const StencilTable& rows = factors_[factor];
        for (std::size_t k = rows.offsets[row]; k < rows.offsets[row + 1]; ++k)
            table.add(rows.indices[k], rows.weights[k]);
    }

private:
    std::vector<StencilTable> factors_;
};

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

/// The sharpness of rays before and after a step, by halfedge; empty: there are none.
struct StepSharpness {
    std::vector<double> before, after;
    std::vector<Junction> junctions_after;  ///< those of the level, after the step
};

Meeting meeting_of(std::span<const double> rays) {
    Meeting meeting;
    for (const double s : rays)
        meeting.add(s);
    return meeting;
}

Junction next_junction(Junction j, CreaseMethod method) {
    const Meeting meeting = meeting_of(j.rays);
    for (double& s : j.rays)
        s = meeting.lowered(s, method);
    j.vertex_sharpness = lowered(j.vertex_sharpness);
    return j;
}

std::vector<Index> junction_faces(const RefinedLevel& level) {
    std::vector<Index> of_face;
    if (!level.junctions.empty())
        of_face.assign(level.topology.n_faces(), kInvalidIndex);
    for (Index j = 0; j < level.junctions.size(); ++j)
        of_face[level.junctions[j].face] = j;
    return of_face;
}

/// Where the middle of each face is: its centroid, or on the curve that runs through it, or at
/// the point where curves meet. Where sharpness ends, a mixture of what was and will be.
class FaceCentres {
public:
    FaceCentres(const RefinedLevel& level, const StepSharpness& step)
        : level_(level), step_(step), junction_(junction_faces(level)) {}

    /// Calls f(vertex, weight) for the vertices of the level that make up the centre.
    template <class F>
    void for_each(Index face, F&& f) const {
        const Junction *before = nullptr, *after = nullptr;
        if (!junction_.empty() && junction_[face] != kInvalidIndex) {
            before = &level_.junctions[junction_[face]];
            after = &step_.junctions_after[junction_[face]];
        } else if (step_.before.empty() || !has_rays(face)) {
            simple_centre(face, 1, f);
            return;
        }
        EndOfSharpness end;
        const VertexRule rule_before = rule(face, before, step_.before);
        const VertexRule rule_after = rule(face, after, step_.after);
        if (before) {
            for (std::size_t i = 0; i < before->rays.size(); ++i)
                end.note(before->rays[i], after->rays[i]);
            end.note(before->vertex_sharpness, after->vertex_sharpness);
        } else {
            for_each_halfedge(
                face, [&](Index h) { end.note(step_.before[h], step_.after[h]); });
        }
        const double w = rule_before == rule_after ? 1 : end.weight_before();
        centre(face, rule_before, before, step_.before, w, f);
        if (w < 1)
            centre(face, rule_after, before, step_.after, 1 - w, f);
    }

private:
    template <class F>
    void for_each_halfedge(Index face, F&& f) const {
        const Topology& t = level_.topology;
        for (Index h = t.face_offsets[face]; h < t.face_offsets[face + 1]; ++h)
            f(h);
    }

    bool has_rays(Index face) const {
        bool any = false;
        for_each_halfedge(face, [&](Index h) { any |= step_.before[h] > 0; });
        return any;
    }

    PointKind kind(Index h) const {
        return level_.point_kinds[level_.topology.vertex[h]];
    }

    /// Of the curves that meet in the face.
    VertexRule rule(Index face, const Junction* j,
                    const std::vector<double>& sharpness) const {
        if (!j) {
            std::size_t n = 0;
            for_each_halfedge(face, [&](Index h) { n += sharpness[h] > 0; });
            return vertex_rule(0, n);
        }
        const auto n_rays =
            std::ranges::count_if(j->rays, [](double s) { return s > 0; });
        return vertex_rule(j->vertex_sharpness,
                           static_cast<std::size_t>(j->n_sharp + n_rays));
    }

    template <class F>
    void centre(Index face, VertexRule rule, const Junction* j,
                const std::vector<double>& sharpness, double weight, F&& f) const {
        if (rule == VertexRule::Corner) {
            f(j->point, weight);
        } else if (rule == VertexRule::Crease) {
            // On the curve: both neighbours on it are border points, or in middles of edges.
            int n = 0;
            const auto add = [&](Index v) {
                if (n++ < 2)
                    f(v, 0.5 * weight);
            };
            int n_border = j ? j->n_sharp : 0;
            for_each_halfedge(face, [&](Index h) {
                if (kind(h) == PointKind::Curve && n_border-- > 0)
                    add(level_.topology.vertex[h]);
            });
            for_each_halfedge(face, [&](Index h) {
                if (!sharpness.empty() && sharpness[h] > 0)
                    add(level_.rays[level_.edge_rays[level_.topology.edge[h]]].point);
            });
        } else {
            mean(face, PointKind::Inner, weight, f);
        }
    }

    template <class F>
    void simple_centre(Index face, double weight, F&& f) const {
        const FaceKind kind =
            level_.face_kinds.empty() ? FaceKind::Plain : level_.face_kinds[face];
        mean(face,
             kind == FaceKind::Border   ? PointKind::Curve
             : kind == FaceKind::Pinned ? PointKind::Pinned
                                        : PointKind::Inner,
             weight, f);
    }

    template <class F>
    void mean(Index face, PointKind which, double weight, F&& f) const {
        const bool all = level_.face_kinds.empty();  // level 0
        int n = 0;
        for_each_halfedge(face, [&](Index h) { n += all || kind(h) == which; });
        for_each_halfedge(face, [&](Index h) {
            if (all || kind(h) == which)
                f(level_.topology.vertex[h], weight / n);
        });
    }

    const RefinedLevel& level_;
    const StepSharpness& step_;
    std::vector<Index> junction_;
};

/// The sharpness of a level's rays and junctions after the next step.
StepSharpness next_step(const RefinedLevel& level) {
    StepSharpness step;
    const CreaseMethod method = level.features.creases;
    for (const Junction& j : level.junctions)
        step.junctions_after.push_back(next_junction(j, method));
    if (level.rays.empty())
        return step;
    const Topology& t = level.topology;
    const std::vector<Index> junction = junction_faces(level);
    step.before.assign(t.n_halfedges(), 0.0);
    step.after.assign(t.n_halfedges(), 0.0);
    std::vector<double> local;
    for (Index f = 0; f < t.n_faces(); ++f) {
        local.clear();
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
            const Index ray = level.edge_rays[t.edge[h]];
            if (ray == kInvalidIndex)
                continue;
            step.before[h] = level.rays[ray].sharpness;
            local.push_back(step.before[h]);
        }
        const bool meets = !junction.empty() && junction[f] != kInvalidIndex;
        const Meeting meeting =
            meeting_of(meets ? level.junctions[junction[f]].rays : local);
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
            step.after[h] = meeting.lowered(step.before[h], method);
    }
    return step;
}

/// From the points of a level to the corners of its faces: corner x goes to the middle of x,
/// the face's centre and the middles of the edges at x. Beside a border curve's point half of
/// the edge is beyond the border, and its middle is that point.
StencilTable corner_rows(const RefinedLevel& level, const FaceCentres& centres,
                         const StepSharpness& step, bool is_base) {
    const Topology& t = level.topology;
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
            centres.for_each(t.face(h),
                             [&](Index v, double w) { row.add(v, to_centre * w); });
        }
        if (kind(x) != PointKind::Inner) {
            row.add(x, 1 - to_centre);
            row.end_row();
            continue;
        }
        row.add(x, 0.25);
        for (const Index e : {h, t.prev(h)}) {
            const Index y = e == h ? t.to_vertex(h) : t.vertex[e];
            if (kind(y) == PointKind::Curve) {
                row.add(y, 0.25);
                continue;
            }
            double sharp = 0;  // of the middle: on the crease that crosses the edge
            if (!step.before.empty() && step.before[e] > 0) {
                EndOfSharpness end;
                end.note(step.before[e], step.after[e]);
                sharp = end.weight_before();
                row.add(level.rays[level.edge_rays[t.edge[e]]].point, 0.25 * sharp);
            }
            if (sharp < 1) {
                row.add(x, 0.125 * (1 - sharp));
                row.add(y, 0.125 * (1 - sharp));
            }
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
        FaceKind& kind = kinds[t.face(h)];
        if (points[t.vertex[h]] == PointKind::Pinned)
            kind = FaceKind::Pinned;
        else if (points[t.vertex[h]] == PointKind::Curve && kind == FaceKind::Plain)
            kind = FaceKind::Border;
    }
    return kinds;
}

/// Adds a vertex without faces: a point of a ray or a junction.
Index add_loose_point(RefinedLevel& level) {
    level.topology.vertex_halfedge.push_back(kInvalidIndex);
    level.point_kinds.push_back(PointKind::Pinned);
    return level.topology.n_vertices() - 1;
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

/// One step of refinement.
class EvenStep {
public:
    /// \param parent  what is refined: a level, or a part of one
    EvenStep(const RefinedLevel& parent, bool is_base)
        : parent_(parent),
          mesh_(parent.topology),
          is_base_(is_base),
          parent_step_(next_step(parent)),
          parent_centres_(parent, parent_step_) {}

    /// \param part  null: the whole level
    RefinedLevel build(int degree, const RefinedPart* part) {
        level_.features.boundary = parent_.features.boundary;
        level_.features.creases = parent_.features.creases;
        rows_ = corner_rows(parent_, parent_centres_, parent_step_, is_base_);
        if (is_base_) {
            add_curves_of_base();
            name_faces_of_base();
            add_rays_of_base();
        } else {
            split_ = split(mesh_);
            level_.topology = dual(split_, &map_);
            for (Index h = 0; h < mesh_.n_halfedges(); ++h)
                level_.point_kinds.push_back(parent_.point_kinds[mesh_.vertex[h]]);
            level_.face_kinds = face_kinds(level_.topology, level_.point_kinds);
            name_faces();
            add_rays();
        }
        note_gaps(level_);
        KnownRows known(parent_.known);
        factors_.push_back(known.filter(std::move(rows_), {}));
        if (degree >= 4)
            smooth((degree - 2) / 2, known);
        level_.known = known.take();
        end_sharpness();
        if (part) {
            for (Index& i : factors_.front().indices)
                i = part->vertices[i];
        }
        level_.rows = std::make_shared<StoredRows>(std::move(factors_));

        // Quad h of split(parent) has the vertex of corner h at its corner 0, the face at 2.
        level_.corner_halfedges.resize(mesh_.n_halfedges());
        for (Index h = 0; h < mesh_.n_halfedges(); ++h)
            level_.corner_halfedges[h] = map_[4 * h + (is_base_ ? 0 : 2)];
        return std::move(level_);
    }

private:
    // ---------------------------------------------------------------- from level 0

    void add_curves_of_base() {
        const Topology quads = split(mesh_);
        std::vector<Index> borders;
        for (Index h = 0; h < quads.n_halfedges(); ++h) {
            if (quads.is_border(h) && !parent_.is_gap(quads.edge[h] / 2))
                borders.push_back(h);
        }
        std::vector<bool> corner(quads.n_vertices(), false);
        for (Index v = 0; v < mesh_.n_vertices(); ++v)
            corner[v] = parent_.point_kinds[v] == PointKind::Pinned;
        split_ = with_border_strip(quads, borders, corner);
        level_.topology = dual(split_, &map_);
        level_.point_kinds.assign(mesh_.n_halfedges(), PointKind::Inner);
        for (const Index b : borders) {
            const bool first = quads.vertex[b] < mesh_.n_vertices();
            add_curve_row(first ? b / 4 : mesh_.prev(b / 4), first);
            level_.point_kinds.push_back(PointKind::Curve);
        }
        for (Index f = rows_.n_rows(); f < split_.n_faces(); ++f) {
            rows_.add(split_.vertex[split_.face_offsets[f]], 1.0);
            rows_.end_row();
            level_.point_kinds.push_back(PointKind::Pinned);
        }
        level_.face_kinds = face_kinds(level_.topology, level_.point_kinds);
    }

    /// Three quarters of the near end of an edge, one of the far one.
    void add_curve_row(Index edge_halfedge, bool near_start) {
        rows_.add(mesh_.vertex[edge_halfedge], near_start ? 0.75 : 0.25);
        rows_.add(mesh_.to_vertex(edge_halfedge), near_start ? 0.25 : 0.75);
        rows_.end_row();
    }

    /// The face that a vertex of level 0 became; kInvalidIndex beside a gap.
    Index face_of_vertex(Index v) const {
        const Index h = mesh_.vertex_halfedge[v];
        return h == kInvalidIndex || map_[4 * h] == kInvalidIndex
                   ? kInvalidIndex
                   : level_.topology.face(map_[4 * h]);
    }

    void name_faces_of_base() {
        for (Index v = 0; v < mesh_.n_vertices(); ++v) {
            const Index face = face_of_vertex(v);
            if (face == kInvalidIndex)
                continue;
            const PointKind kind = parent_.point_kinds[v];
            if (kind == PointKind::Dart)
                level_.face_kinds[face] = FaceKind::Dart;
            else if (kind == PointKind::Spike)
                level_.face_kinds[face] = FaceKind::Spike;
            const BaseSharpness& s = parent_.base_sharpness[v];
            if (kind == PointKind::Pinned ||
                (s.rays.empty() && !(s.vertex_sharpness > 0)))
                continue;
            add_junction({face, 0, s.n_sharp, s.vertex_sharpness, s.rays}, v);
        }
    }

    void add_rays_of_base() {
        for (Index h = 0; h < mesh_.n_halfedges(); ++h) {
            const double s = parent_.features.edge(mesh_.edge[h]);
            if (!is_semi_sharp(s))
                continue;
            const BaseSharpness& at = parent_.base_sharpness[mesh_.vertex[h]];
            if (!add_ray(4 * h, s,
                         meeting_of(at.rays).lowered(s, parent_.features.creases)))
                continue;
            add_curve_row(h, true);
        }
    }

    // ---------------------------------------------------------------- later

    Index face_of_face(Index face) const {
        return level_.topology.face(map_[4 * mesh_.face_offsets[face] + 2]);
    }

    void name_faces() {
        for (Index f = 0; f < mesh_.n_faces(); ++f) {
            if (parent_.face_kinds[f] == FaceKind::Dart ||
                parent_.face_kinds[f] == FaceKind::Spike)
                level_.face_kinds[face_of_face(f)] = parent_.face_kinds[f];
        }
        for (const Junction& j : parent_.junctions) {
            Junction child = j;
            child.face = face_of_face(j.face);
            add_junction(std::move(child), j.point);
        }
    }

    void add_rays() {
        if (parent_.rays.empty())
            return;
        for (Index h = 0; h < mesh_.n_halfedges(); ++h) {
            if (!(parent_step_.before[h] > 0) ||
                !add_ray(4 * h + 1, parent_step_.before[h], parent_step_.after[h]))
                continue;
            RowSums row(rows_);
            row.add(parent_.rays[parent_.edge_rays[mesh_.edge[h]]].point, 0.5);
            parent_centres_.for_each(mesh_.face(h),
                                     [&](Index v, double w) { row.add(v, 0.5 * w); });
            row.end_row();
        }
    }

    // ---------------------------------------------------------------- both

    /// With the sharpness before the step; the row of its point is that of `vertex`.
    void add_junction(Junction j, Index vertex) {
        junctions_after_.push_back(next_junction(j, parent_.features.creases));
        j.point = junctions_after_.back().point = add_loose_point(level_);
        rows_.add(vertex, 1.0);
        rows_.end_row();
        level_.junctions.push_back(std::move(j));
    }

    /// On the edge that crosses the edge of a halfedge of split_. \return false if there is
    /// none, beside a gap
    bool add_ray(Index halfedge, double before, double after) {
        if (split_.is_border(halfedge))
            return false;
        // One of the faces that it parts may be left out: the other still needs the ray.
        Index beyond = map_[split_.next(split_.twin[halfedge])];
        if (beyond == kInvalidIndex)
            beyond = map_[split_.next(halfedge)];
        if (beyond == kInvalidIndex)
            return false;
        level_.edge_rays.resize(level_.topology.n_edges, kInvalidIndex);
        level_.edge_rays[level_.topology.edge[beyond]] =
            static_cast<Index>(level_.rays.size());
        level_.rays.push_back({add_loose_point(level_), before});
        rays_after_.push_back(after);
        return true;
    }

    /// Sharp rules while there was sharpness before the step, and at its end a mixture.
    void smooth(int n_times, KnownRows& known) {
        const Topology& t = level_.topology;
        StepSharpness step;
        step.junctions_after = junctions_after_;
        if (!level_.rays.empty()) {
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                const Index ray = level_.edge_rays[t.edge[h]];
                const bool none = ray == kInvalidIndex;
                step.before.push_back(none ? 0.0 : level_.rays[ray].sharpness);
                step.after.push_back(none ? 0.0 : rays_after_[ray]);
            }
        }
        const FaceCentres centres(level_, step);
        StencilTable to_faces, to_vertices;
        for (Index f = 0; f < t.n_faces(); ++f) {
            RowSums row(to_faces);
            centres.for_each(f, [&](Index v, double w) { row.add(v, w); });
            row.end_row();
        }
        // Points of junctions are handed through behind the faces.
        std::vector<Index> junction(t.n_vertices(), kInvalidIndex);
        for (const Junction& j : level_.junctions) {
            junction[j.point] = to_faces.n_rows();
            to_faces.add(j.point, 1.0);
            to_faces.end_row();
        }
        std::vector<std::vector<Index>> ray_faces(level_.rays.size());
        for (Index h = 0; h < t.n_halfedges() && !level_.rays.empty(); ++h) {
            if (level_.edge_rays[t.edge[h]] != kInvalidIndex)
                ray_faces[level_.edge_rays[t.edge[h]]].push_back(t.face(h));
        }
        std::vector<Index> ray_of_point(t.n_vertices(), kInvalidIndex);
        for (Index r = 0; r < level_.rays.size(); ++r)
            ray_of_point[level_.rays[r].point] = r;
        for (Index v = 0; v < t.n_vertices(); ++v) {
            if (junction[v] != kInvalidIndex) {
                to_vertices.add(junction[v], 1.0);
            } else if (ray_of_point[v] != kInvalidIndex) {
                const auto& faces = ray_faces[ray_of_point[v]];
                for (const Index f : faces)
                    to_vertices.add(f, 1.0 / double(faces.size()));
            } else {
                const double w = 1.0 / t.valence(v);
                t.for_each_outgoing(v, [&](Index h) { to_vertices.add(t.face(h), w); });
            }
            to_vertices.end_row();
        }
        Flags unusable = vertices_beside_gaps(level_);
        for (Index r = 0; r < level_.rays.size() && !unusable.empty(); ++r)
            unusable[level_.rays[r].point] = ray_faces[r].size() < 2;
        for (int i = 0; i < n_times; ++i) {
            factors_.push_back(known.filter(to_faces, {}));
            factors_.push_back(known.filter(to_vertices, unusable));
        }
    }

    /// What has ended is forgotten.
    void end_sharpness() {
        for (std::size_t r = 0; r < level_.rays.size(); ++r)
            level_.rays[r].sharpness = rays_after_[r];
        for (Index& r : level_.edge_rays) {
            if (r != kInvalidIndex && !(rays_after_[r] > 0))
                r = kInvalidIndex;
        }
        if (std::ranges::none_of(rays_after_, [](double s) { return s > 0; })) {
            level_.rays.clear();
            level_.edge_rays.clear();
        }
        level_.junctions = std::move(junctions_after_);
        std::erase_if(level_.junctions, [](const Junction& j) {
            return !(j.vertex_sharpness > 0) &&
                   std::ranges::none_of(j.rays, [](double s) { return s > 0; });
        });
    }

    const RefinedLevel& parent_;
    const Topology& mesh_;
    bool is_base_;
    StepSharpness parent_step_;
    FaceCentres parent_centres_;

    RefinedLevel level_;
    Topology split_;
    std::vector<Index> map_;  // from halfedges of split_ to those of the level
    StencilTable rows_;
    std::vector<StencilTable> factors_;
    std::vector<double> rays_after_;
    std::vector<Junction> junctions_after_;
};

}  // namespace

RefinedLevel even_base(Topology base, const Features& features) {
    std::vector<bool> sharp(base.n_edges);
    std::vector<BaseSharpness> at(base.n_vertices());
    for (Index v = 0; v < base.n_vertices(); ++v) {
        at[v].vertex_sharpness = features.vertex(v);
        base.for_each_edge(v, [&](Index e, Index) {
            sharp[e] = is_infinitely_sharp(features.edge(e));
            at[v].n_sharp += sharp[e];
            if (is_semi_sharp(features.edge(e)))
                at[v].rays.push_back(features.edge(e));
        });
    }
    RefinedLevel level;
    level.topology = cut(base, sharp, level.base_vertices);
    level.features = features;
    level.features.vertex_sharpness.clear();  // in base_sharpness
    if (!level.features.edge_sharpness.empty())
        level.features.edge_sharpness.resize(level.topology.n_edges, kInfinitelySharp);
    const Topology& t = level.topology;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        const BaseSharpness& s = at[level.base_vertices[v]];
        const Index h = t.vertex_halfedge[v];
        const bool open = h != kInvalidIndex && t.is_border(h);
        const bool pinned = is_pinned(s.vertex_sharpness, s.n_sharp);
        level.point_kinds.push_back(pinned ? (open ? PointKind::Pinned : PointKind::Spike)
                                    : !open          ? PointKind::Inner
                                    : s.n_sharp == 1 ? PointKind::Dart
                                                     : PointKind::Curve);
        level.base_sharpness.push_back(s);
    }
    return level;
}

void refine_even(const RefinedLevel& parent, std::shared_ptr<const RefinedPart> part,
                 int degree, bool parent_is_base, RefinedLevel& level) {
    level =
        EvenStep(part ? part->level : parent, parent_is_base).build(degree, part.get());
}

}  // namespace osdx::detail
