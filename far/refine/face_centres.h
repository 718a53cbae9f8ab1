// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/topology.h>

#include "far/refine/level.h"
#include "far/refine/sharpness.h"

/// Even degrees: the middles of faces, and the sharpness that rules them.
namespace osdx::inline OSDX_ABI::detail {

Meeting meeting_of(std::span<const double> rays);

/// What is left of a junction after a step.
Junction next_junction(Junction j, CreaseMethod method);

/// The sharpness of rays before and after a step, by halfedge; empty: there are none.
struct StepSharpness {
    std::vector<double> before, after;
    std::vector<Junction> junctions_after;  ///< those of the level, after the step
};

/// Of a level's rays and junctions, and after the next step.
StepSharpness next_step(const RefinedLevel& level);

/// Where the middle of each face is: its centroid, or on the curve that runs through it, or at
/// the point where curves meet. Where sharpness ends, a mixture of what was and will be.
class FaceCentres {
public:
    FaceCentres(const RefinedLevel& level, const StepSharpness& step);

    /// Calls f(vertex, weight) for the vertices of the level that make up the centre.
    template <class F>
    void for_each(Index face, F&& f) const {
        const Junction *before = nullptr, *after = nullptr;
        if (!junction_.empty() && junction_[face] != kInvalidIndex) {
            before = &even_.junctions[junction_[face]];
            after = &step_.junctions_after[junction_[face]];
        } else if (is_pinned(face) || step_.before.empty() || !has_rays(face)) {
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
        for (Index h = t_.face_offsets[face]; h < t_.face_offsets[face + 1]; ++h)
            f(h);
    }

    /// Whatever else meets there, the centre stays where it is.
    bool is_pinned(Index face) const {
        return !even_.face_kinds.empty() && even_.face_kinds[face] == FaceKind::Pinned;
    }
    bool has_rays(Index face) const {
        bool any = false;
        for_each_halfedge(face, [&](Index h) { any |= step_.before[h] > 0; });
        return any;
    }

    PointKind kind(Index h) const { return even_.point_kinds[t_.vertex[h]]; }

    /// Of the curves that meet in the face.
    VertexRule rule(Index face, const Junction* j,
                    const std::vector<double>& sharpness) const;

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
                    add(t_.vertex[h]);
            });
            for_each_halfedge(face, [&](Index h) {
                if (!sharpness.empty() && sharpness[h] > 0)
                    add(even_.rays[even_.edge_rays[t_.edge[h]]].point);
            });
        } else {
            mean(face, PointKind::Inner, weight, f);
        }
    }

    template <class F>
    void simple_centre(Index face, double weight, F&& f) const {
        const FaceKind kind =
            even_.face_kinds.empty() ? FaceKind::Plain : even_.face_kinds[face];
        mean(face,
             kind == FaceKind::Border   ? PointKind::Curve
             : kind == FaceKind::Pinned ? PointKind::Pinned
                                        : PointKind::Inner,
             weight, f);
    }

    template <class F>
    void mean(Index face, PointKind which, double weight, F&& f) const {
        const bool all = even_.face_kinds.empty();  // level 0
        int n = 0;
        for_each_halfedge(face, [&](Index h) { n += all || kind(h) == which; });
        for_each_halfedge(face, [&](Index h) {
            if (all || kind(h) == which)
                f(t_.vertex[h], weight / n);
        });
    }

    const Topology& t_;
    const EvenLevel& even_;
    const StepSharpness& step_;
    std::vector<Index> junction_;  // by face: its own or kInvalidIndex; empty: none
};

}  // namespace osdx::inline OSDX_ABI::detail
