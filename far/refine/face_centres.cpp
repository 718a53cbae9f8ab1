// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/face_centres.h"

#include <algorithm>

#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI::detail {
namespace {

std::vector<Index> junction_faces(const RefinedLevel& level) {
    const std::vector<Junction>& junctions = level.even->junctions;
    std::vector<Index> of_face;
    if (!junctions.empty())
        of_face.assign(level.topology.n_faces(), kInvalidIndex);
    for (Index j = 0; j < junctions.size(); ++j)
        of_face[junctions[j].face] = j;
    return of_face;
}

}  // namespace

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

StepSharpness next_step(const RefinedLevel& level) {
    const EvenLevel& even = *level.even;
    StepSharpness step;
    const CreaseMethod method = level.features.creases;
    for (const Junction& j : even.junctions)
        step.junctions_after.push_back(next_junction(j, method));
    if (even.rays.empty())
        return step;
    const Topology& t = level.topology;
    const std::vector<Index> junction = junction_faces(level);
    step.before.assign(t.n_halfedges(), 0.0);
    step.after.assign(t.n_halfedges(), 0.0);
    std::vector<double> local;
    for (Index f = 0; f < t.n_faces(); ++f) {
        local.clear();
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
            const Index ray = even.edge_rays[t.edge[h]];
            if (ray == kInvalidIndex)
                continue;
            step.before[h] = even.rays[ray].sharpness;
            local.push_back(step.before[h]);
        }
        const bool meets = !junction.empty() && junction[f] != kInvalidIndex;
        const Meeting meeting =
            meeting_of(meets ? even.junctions[junction[f]].rays : local);
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
            step.after[h] = meeting.lowered(step.before[h], method);
    }
    return step;
}

FaceCentres::FaceCentres(const RefinedLevel& level, const StepSharpness& step)
    : t_(level.topology),
      even_(*level.even),
      step_(step),
      junction_(junction_faces(level)) {}

VertexRule FaceCentres::rule(Index face, const Junction* j,
                             const std::vector<double>& sharpness) const {
    if (!j) {
        std::size_t n = 0;
        for_each_halfedge(face, [&](Index h) { n += sharpness[h] > 0; });
        return vertex_rule(0, n);
    }
    const auto n_rays = std::ranges::count_if(j->rays, [](double s) { return s > 0; });
    return vertex_rule(j->vertex_sharpness,
                       static_cast<std::size_t>(j->n_sharp + n_rays));
}

}  // namespace osdx::inline OSDX_ABI::detail
