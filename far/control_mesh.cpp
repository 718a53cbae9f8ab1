// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/control_mesh.h"

#include <algorithm>

namespace osdx::detail {

ControlMesh::ControlMesh(const RefinedLevel& level, int degree, bool is_base)
    : level_(&level),
      odd_(degree % 2 == 1),
      is_base_(is_base),
      midway_(!odd_ && !is_base),
      fans_(level.topology.n_halfedges(), Fan::Irregular),
      settled_(level.topology.n_vertices(), false) {
    std::vector<bool> sharp = vertices_at_sharp_faces();
    for (Index v = 0; v < level.topology.n_vertices(); ++v) {
        if (!sharp.empty() && sharp[v])
            continue;
        if (level.topology.vertex_halfedge[v] != kInvalidIndex && level.is_known(v))
            sort_fans(v);
    }
}

/// Even degrees: where sharpness still changes the rules; empty: nowhere.
std::vector<bool> ControlMesh::vertices_at_sharp_faces() const {
    const Topology& t = topology();
    std::vector<bool> vertices;
    const auto add_face = [&](Index f) {
        vertices.resize(t.n_vertices());
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
            vertices[t.vertex[h]] = true;
    };
    for (Index h = 0; h < t.n_halfedges() && !level_->rays.empty(); ++h) {
        if (level_->edge_rays[t.edge[h]] != kInvalidIndex)
            add_face(t.face[h]);
    }
    for (const Junction& j : level_->junctions) {
        if (j.vertex_sharpness < kInfinitelySharp)
            add_face(j.face);
    }
    return vertices;
}

bool ControlMesh::is_cut(Index h) const noexcept {
    const Index edge = topology().edge[h];
    return odd_ ? level_->features.edge(edge) >= kInfinitelySharp
                : topology().is_border(h) && !level_->is_gap(edge);
}

bool ControlMesh::is_quad(Index face) const noexcept {
    if (topology().face_size(face) != 4)
        return false;
    return level_->face_kinds.empty() || (level_->face_kinds[face] != FaceKind::Dart &&
                                          level_->face_kinds[face] != FaceKind::Spike);
}

void ControlMesh::sort_fans(Index v) {
    const Topology& t = topology();
    bool blocked = false;  // semi-sharp, or beside a gap
    int n_cuts = 0;
    t.for_each_edge(v, [&](Index e, Index) {
        const double s = odd_ ? level_->features.edge(e) : 0.0;
        blocked |= (s > 0 && s < kInfinitelySharp) || level_->is_gap(e);
        n_cuts += s >= kInfinitelySharp;
    });
    bool pinned = false, dart = false;
    if (odd_) {
        const double s = level_->features.vertex(v);
        blocked |= s > 0 && s < kInfinitelySharp;
        pinned = s >= kInfinitelySharp || n_cuts > 2;
        dart = n_cuts == 1;
    } else {
        const PointKind kind = level_->point_kinds[v];
        if (is_base_) {
            const BaseSharpness& s = level_->base_sharpness[v];
            blocked |= !s.rays.empty() ||
                       (s.vertex_sharpness > 0 && s.vertex_sharpness < kInfinitelySharp);
        }
        pinned = kind == PointKind::Pinned || kind == PointKind::Spike;
        dart = kind == PointKind::Dart;
    }
    if (blocked)
        return;
    settled_[v] = true;

    ring_.clear();
    t.for_each_outgoing(v, [&](Index h) { ring_.push_back(h); });
    const auto first = std::ranges::find_if(ring_, [&](Index h) { return is_cut(h); });
    const bool open = first != ring_.end();
    if (open)
        std::rotate(ring_.begin(), first, ring_.end());
    for (std::size_t begin = 0, end; begin < ring_.size(); begin = end) {
        for (end = begin + 1; end < ring_.size() && !is_cut(ring_[end]);)
            ++end;
        const int n = static_cast<int>(end - begin);
        Fan fan = Fan::Irregular;
        if (!open)
            fan = n == 4 && !pinned ? Fan::Inside : Fan::Irregular;
        else if (n == 2 && !pinned && !dart)
            fan = Fan::Border;
        else if (n == 1 && pinned)
            fan = Fan::Corner;
        for (std::size_t i = begin; i < end; ++i)
            fans_[ring_[i]] = fan;
        if (fan == Fan::Irregular) {
            irregular_.push_back({ring_[begin], n,
                                  !open
                                      ? (pinned ? PatchBorder::Spike : PatchBorder::None)
                                  : pinned || dart ? PatchBorder::Pinned
                                                   : PatchBorder::Smooth,
                                  !dart && (open || !pinned)});
        }
    }
}

bool ControlGrid::extent(const ControlMesh& mesh, Index h, int axis, int wanted) {
    const Topology& t = mesh.topology();
    end_[axis] = false;
    for (n_[axis] = 0; n_[axis] < wanted;) {
        if (t.face_size(t.face[h]) != 4)
            return false;
        ++n_[axis];
        const Index far = axis == 0 ? t.next(h) : t.next(t.next(h));
        if (mesh.is_cut(far)) {
            // Where the border runs midway, its curve points are no control points.
            end_[axis] = n_[axis] < wanted || midway_;
            return true;
        }
        if (n_[axis] == wanted)
            return true;
        if (t.is_border(far))
            return false;
        h = axis == 0 ? t.next(t.twin[far]) : t.twin[far];
    }
    return true;
}

/// Edges inside are no borders, and those at a border are all.
bool ControlGrid::fits(const ControlMesh& mesh, Index far, int axis, int at) const {
    const bool last = at == n_[axis];
    return mesh.is_cut(far) ? last && (end_[axis] || !midway_) : !last || !end_[axis];
}

bool ControlGrid::walk(const ControlMesh& mesh, Index start, int wanted_x, int wanted_y,
                       Begin begin_x, Begin begin_y) {
    const Topology& t = mesh.topology();
    midway_ = mesh.border_is_midway();
    origin_[0] = origin_[1] = 0;
    begin_[0] = begin_x;
    begin_[1] = begin_y;
    if (!extent(mesh, start, 0, wanted_x) || !extent(mesh, start, 1, wanted_y))
        return false;
    halfedges_.resize(std::size_t(n_[0] * n_[1]));
    vertices_.resize(std::size_t((n_[0] + 1) * (n_[1] + 1)));
    Index first = start;
    for (int x = 0; x < n_[0]; ++x) {
        Index h = first;
        for (int y = 0; y < n_[1]; ++y) {
            if (!mesh.is_quad(t.face[h]))
                return false;
            const Index right = t.next(h), top = t.next(right);
            halfedges_[x * n_[1] + y] = h;
            const int stride = n_[1] + 1;
            vertices_[x * stride + y] = t.vertex[h];
            vertices_[(x + 1) * stride + y] = t.vertex[right];
            vertices_[(x + 1) * stride + y + 1] = t.vertex[top];
            vertices_[x * stride + y + 1] = t.vertex[t.next(top)];
            if (!fits(mesh, right, 0, x + 1) || !fits(mesh, top, 1, y + 1))
                return false;
            if (y + 1 < n_[1]) {
                if (t.is_border(top))
                    return false;
                h = t.twin[top];
            }
        }
        if (x + 1 < n_[0])
            first = t.next(t.twin[t.next(first)]);
    }
    return std::ranges::all_of(vertices_,
                               [&](Index v) { return mesh.level().is_known(v); });
}

bool ControlGrid::walk_around(const ControlMesh& mesh, Index h, int lo, int hi) {
    const Topology& t = mesh.topology();
    int steps[2] = {0, 0};
    Begin begin[2] = {Begin::Outer, Begin::Outer};
    for (int axis = 0; axis < 2; ++axis) {
        while (true) {
            if (t.face_size(t.face[h]) != 4)
                return false;
            const Index near = axis == 0 ? t.prev(h) : h;
            if (mesh.is_cut(near)) {
                if (steps[axis] < -lo || mesh.border_is_midway())
                    begin[axis] = Begin::Border;
                break;
            }
            if (steps[axis] == -lo)
                break;
            if (t.is_border(near))
                return false;
            h = axis == 0 ? t.prev(t.twin[near]) : t.next(t.next(t.twin[near]));
            ++steps[axis];
        }
    }
    if (!walk(mesh, h, steps[0] + hi, steps[1] + hi, begin[0], begin[1]))
        return false;
    origin_[0] = steps[0];
    origin_[1] = steps[1];
    return true;
}

bool ControlGrid::is_regular(const ControlMesh& mesh, bool but_first) const {
    for (int x = 0; x <= n_[0]; ++x) {
        for (int y = 0; y <= n_[1]; ++y) {
            if (x == 0 && y == 0 && but_first)
                continue;
            const int at[2] = {x, y};
            int n_borders = 0;
            bool outermost = false;
            for (int axis = 0; axis < 2; ++axis) {
                const bool begins = at[axis] == 0, ends = at[axis] == n_[axis];
                const bool border =
                    (begins && begin_[axis] == Begin::Border) || (ends && end_[axis]);
                n_borders += border;
                outermost |= !border && ((begins && begin_[axis] == Begin::Outer) ||
                                         (ends && !end_[axis]));
            }
            if (outermost)
                continue;
            // The corner of a face of the grid at this vertex.
            Index h = halfedge(std::min(x, n_[0] - 1), std::min(y, n_[1] - 1));
            const Topology& t = mesh.topology();
            while (t.vertex[h] != vertex(x, y))
                h = t.next(h);
            const Fan expected = n_borders == 0   ? Fan::Inside
                                 : n_borders == 1 ? Fan::Border
                                                  : Fan::Corner;
            if (mesh.fan(h) != expected)
                return false;
        }
    }
    return true;
}

bool ControlGrid::line_terms(int axis, int i, double weight, Line& terms) const {
    const int n = n_[axis];
    const bool begin = begin_[axis] == Begin::Border;
    const int lo = begin && midway_ ? 1 : 0, hi = end_[axis] && midway_ ? n - 1 : n;
    if (i >= lo && i <= hi) {
        terms.emplace_back(i, weight);
        return true;
    }
    if (lo > hi)
        return false;
    // 2 P(border) - P(mirrored)
    const bool beyond_end = i > hi;
    if (beyond_end ? !end_[axis] : !begin)
        return false;
    terms.emplace_back(beyond_end ? n : 0, 2 * weight);
    return line_terms(axis, (beyond_end ? 2 * n - midway_ : int(midway_)) - i, -weight,
                      terms);
}

bool ControlGrid::point(int x, int y, PointTerms& terms) const {
    Line along_x, along_y;
    if (!line_terms(0, origin_[0] + x, 1, along_x) ||
        !line_terms(1, origin_[1] + y, 1, along_y))
        return false;
    combine(along_x, along_y, terms);
    return true;
}

bool ControlGrid::row_point(int x, int y, PointTerms& terms) const {
    Line along_x;
    if (!line_terms(0, origin_[0] + x, 1, along_x))
        return false;
    combine(along_x, {{y, 1.0}}, terms);
    return true;
}

void ControlGrid::combine(const Line& along_x, const Line& along_y,
                          PointTerms& terms) const {
    terms.clear();
    for (const auto& [i, wi] : along_x) {
        for (const auto& [j, wj] : along_y) {
            const Index v = vertex(i, j);
            const auto found =
                std::ranges::find(terms, v, &PointTerms::value_type::first);
            if (found == terms.end())
                terms.emplace_back(v, wi * wj);
            else
                found->second += wi * wj;
        }
    }
    std::erase_if(terms, [](const auto& t) { return t.second == 0; });
    std::ranges::sort(terms);
}

}  // namespace osdx::detail
