// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/even.h"

#include <algorithm>
#include <utility>

#include "far/mesh/topology_edits.h"
#include "far/refine/face_centres.h"
#include "far/refine/level_rows.h"
#include "far/refine/sharpness.h"

namespace osdx::inline OSDX_ABI::detail {
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

/// From the points of a level to the corners of its faces: corner x goes to the middle of x,
/// the face's centre and the middles of the edges at x. Beside a border curve's point half of
/// the edge is beyond the border, and its middle is that point.
StencilTable corner_rows(const RefinedLevel& level, const FaceCentres& centres,
                         const StepSharpness& step, bool is_base) {
    const Topology& t = level.topology;
    const auto kind = [&](Index v) {
        return is_base ? PointKind::Inner : level.even->point_kinds[v];
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
                row.add(level.even->rays[level.even->edge_rays[t.edge[e]]].point,
                        0.25 * sharp);
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
    level.even->point_kinds.push_back(PointKind::Pinned);
    return level.topology.n_vertices() - 1;
}

void note_gaps(RefinedLevel& level) {
    const Topology& t = level.topology;
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (!t.is_border(h) ||
            (level.even->point_kinds[t.vertex[h]] != PointKind::Inner &&
             level.even->point_kinds[t.to_vertex(h)] != PointKind::Inner))
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
          parent_even_(*parent.even),
          mesh_(parent.topology),
          is_base_(is_base),
          parent_step_(next_step(parent)),
          parent_centres_(parent, parent_step_),
          even_(level_.even.emplace()) {}

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
                even_.point_kinds.push_back(parent_even_.point_kinds[mesh_.vertex[h]]);
            even_.face_kinds = face_kinds(level_.topology, even_.point_kinds);
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
        even_.corner_halfedges.resize(mesh_.n_halfedges());
        for (Index h = 0; h < mesh_.n_halfedges(); ++h)
            even_.corner_halfedges[h] = map_[4 * h + (is_base_ ? 0 : 2)];
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
            corner[v] = parent_even_.point_kinds[v] == PointKind::Pinned;
        split_ = with_border_strip(quads, borders, corner);
        level_.topology = dual(split_, &map_);
        even_.point_kinds.assign(mesh_.n_halfedges(), PointKind::Inner);
        for (const Index b : borders) {
            const bool first = quads.vertex[b] < mesh_.n_vertices();
            add_curve_row(first ? b / 4 : mesh_.prev(b / 4), first);
            even_.point_kinds.push_back(PointKind::Curve);
        }
        for (Index f = rows_.n_rows(); f < split_.n_faces(); ++f) {
            rows_.add(split_.vertex[split_.face_offsets[f]], 1.0);
            rows_.end_row();
            even_.point_kinds.push_back(PointKind::Pinned);
        }
        even_.face_kinds = face_kinds(level_.topology, even_.point_kinds);
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
            const PointKind kind = parent_even_.point_kinds[v];
            if (kind == PointKind::Dart)
                even_.face_kinds[face] = FaceKind::Dart;
            else if (kind == PointKind::Spike)
                even_.face_kinds[face] = FaceKind::Spike;
            const BaseSharpness& s = parent_even_.base_sharpness[v];
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
            const BaseSharpness& at = parent_even_.base_sharpness[mesh_.vertex[h]];
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
            if (parent_even_.face_kinds[f] == FaceKind::Dart ||
                parent_even_.face_kinds[f] == FaceKind::Spike)
                even_.face_kinds[face_of_face(f)] = parent_even_.face_kinds[f];
        }
        for (const Junction& j : parent_even_.junctions) {
            Junction child = j;
            child.face = face_of_face(j.face);
            add_junction(std::move(child), j.point);
        }
    }

    void add_rays() {
        if (parent_even_.rays.empty())
            return;
        for (Index h = 0; h < mesh_.n_halfedges(); ++h) {
            if (!(parent_step_.before[h] > 0) ||
                !add_ray(4 * h + 1, parent_step_.before[h], parent_step_.after[h]))
                continue;
            RowSums row(rows_);
            row.add(parent_even_.rays[parent_even_.edge_rays[mesh_.edge[h]]].point, 0.5);
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
        even_.junctions.push_back(std::move(j));
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
        even_.edge_rays.resize(level_.topology.n_edges, kInvalidIndex);
        even_.edge_rays[level_.topology.edge[beyond]] =
            static_cast<Index>(even_.rays.size());
        even_.rays.push_back({add_loose_point(level_), before});
        rays_after_.push_back(after);
        return true;
    }

    /// Sharp rules while there was sharpness before the step, and at its end a mixture.
    void smooth(int n_times, KnownRows& known) {
        const Topology& t = level_.topology;
        StepSharpness step;
        step.junctions_after = junctions_after_;
        if (!even_.rays.empty()) {
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                const Index ray = even_.edge_rays[t.edge[h]];
                const bool none = ray == kInvalidIndex;
                step.before.push_back(none ? 0.0 : even_.rays[ray].sharpness);
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
        for (const Junction& j : even_.junctions) {
            junction[j.point] = to_faces.n_rows();
            to_faces.add(j.point, 1.0);
            to_faces.end_row();
        }
        std::vector<std::vector<Index>> ray_faces(even_.rays.size());
        for (Index h = 0; h < t.n_halfedges() && !even_.rays.empty(); ++h) {
            if (even_.edge_rays[t.edge[h]] != kInvalidIndex)
                ray_faces[even_.edge_rays[t.edge[h]]].push_back(t.face(h));
        }
        std::vector<Index> ray_of_point(t.n_vertices(), kInvalidIndex);
        for (Index r = 0; r < even_.rays.size(); ++r)
            ray_of_point[even_.rays[r].point] = r;
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
        for (Index r = 0; r < even_.rays.size() && !unusable.empty(); ++r)
            unusable[even_.rays[r].point] = ray_faces[r].size() < 2;
        for (int i = 0; i < n_times; ++i) {
            factors_.push_back(known.filter(to_faces, {}));
            factors_.push_back(known.filter(to_vertices, unusable));
        }
    }

    /// What has ended is forgotten.
    void end_sharpness() {
        for (std::size_t r = 0; r < even_.rays.size(); ++r)
            even_.rays[r].sharpness = rays_after_[r];
        for (Index& r : even_.edge_rays) {
            if (r != kInvalidIndex && !(rays_after_[r] > 0))
                r = kInvalidIndex;
        }
        if (std::ranges::none_of(rays_after_, [](double s) { return s > 0; })) {
            even_.rays.clear();
            even_.edge_rays.clear();
        }
        even_.junctions = std::move(junctions_after_);
        std::erase_if(even_.junctions, [](const Junction& j) {
            return !(j.vertex_sharpness > 0) &&
                   std::ranges::none_of(j.rays, [](double s) { return s > 0; });
        });
    }

    const RefinedLevel& parent_;
    const EvenLevel& parent_even_;
    const Topology& mesh_;
    bool is_base_;
    StepSharpness parent_step_;
    FaceCentres parent_centres_;

    RefinedLevel level_;
    EvenLevel& even_;
    Topology split_;
    std::vector<Index> map_;  // from halfedges of split_ to those of the level
    StencilTable rows_;
    std::vector<StencilTable> factors_;
    std::vector<double> rays_after_;
    std::vector<Junction> junctions_after_;
};

}  // namespace

RefinedLevel even_base(Topology base, const ResolvedFeatures& features) {
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
    EvenLevel& even = level.even.emplace();
    level.topology = cut(base, sharp, even.base_vertices);
    level.features = features;
    level.features.vertex_sharpness.clear();  // in base_sharpness
    if (!level.features.edge_sharpness.empty())
        level.features.edge_sharpness.resize(level.topology.n_edges, kInfinitelySharp);
    const Topology& t = level.topology;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        const BaseSharpness& s = at[even.base_vertices[v]];
        const Index h = t.vertex_halfedge[v];
        const bool open = h != kInvalidIndex && t.is_border(h);
        const bool pinned = is_pinned(s.vertex_sharpness, s.n_sharp);
        even.point_kinds.push_back(pinned  ? (open ? PointKind::Pinned : PointKind::Spike)
                                   : !open ? PointKind::Inner
                                   : s.n_sharp == 1 ? PointKind::Dart
                                                    : PointKind::Curve);
        even.base_sharpness.push_back(s);
    }
    return level;
}

void refine_even(const RefinedLevel& parent, const RefinedPart* part, int degree,
                 bool parent_is_base, RefinedLevel& level) {
    level = EvenStep(part ? part->level : parent, parent_is_base).build(degree, part);
}

}  // namespace osdx::inline OSDX_ABI::detail
