// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/patches/control_mesh.h"

#include <algorithm>
#include <atomic>

#include "far/parallel.h"
#include "far/refine/sharpness.h"

namespace osdx::inline OSDX_ABI::detail {

/// What the sorting of some vertices adds.
struct ControlMesh::Fans {
    std::vector<IrregularFan> irregular;
    std::vector<Index> ring;
};

// Vertices where something is sharp, or a border or gap runs, and those that no patch reads.
constexpr std::uint8_t kSmooth = 0, kSpecial = 1, kUnknown = 2;

ControlMesh::ControlMesh(const RefinedLevel& level, int degree, bool is_base)
    : level_(&level),
      degree_(degree),
      odd_(degree % 2 == 1),
      is_base_(is_base),
      midway_(!odd_ && !is_base),
      fans_(filled(level.topology.n_halfedges(), Fan::Inside)),
      settled_(filled(level.topology.n_vertices(), std::uint8_t(true))),
      incomplete_(incomplete_vertices()),
      regular_(level.topology.n_vertices()) {
    const Topology& t = topology();
    const auto at_cut = [&](Index v) {
        bool any = false;
        if (level.sharp[v])
            t.for_each_edge(v, [&](Index e, Index) {
                any |= is_infinitely_sharp(level.features.edge(e));
            });
        return any;
    };
    has_cuts_ = kInvalidIndex !=
                (odd_ ? first_index(level.sharp.size(), at_cut)
                      : first_index(t.n_halfedges(), [&](Index h) { return is_cut(h); }));
    all_quads_ = !level.has_face_kinds() && (t.quads_only || has_only_quads(t));
    const std::vector<std::uint8_t> special = special_vertices();
    std::vector<Fans> chunks(n_chunks(t.n_vertices(), kSmallChunk));
    for_each_chunk(t.n_vertices(), kSmallChunk,
                   [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                       for (auto v = static_cast<Index>(begin); v < end; ++v) {
                           regular_[v] = Regularity::None;
                           if (t.vertex_halfedge[v] == kInvalidIndex)
                               settled_[v] = false;
                           else if (special.empty() || special[v] == kSmooth)
                               sort_fans(v, chunks[chunk]);
                           else
                               sort_special_fans(v, special[v], chunks[chunk]);
                       }
                   });
    for (const Fans& fans : chunks)
        irregular_.insert(irregular_.end(), fans.irregular.begin(), fans.irregular.end());
}

/// By vertex, or empty where all are smooth.
std::vector<std::uint8_t> ControlMesh::special_vertices() const {
    const Topology& t = topology();
    const RefinedLevel& level = *level_;
    std::vector<std::uint8_t> special = level.sharp;
    const auto mark = [&](std::uint8_t& vertex, std::uint8_t what) {
        std::atomic_ref(vertex).store(what, std::memory_order_relaxed);
    };
    const auto mark_edges = [&](auto&& is) {
        special.resize(t.n_vertices());
        for_each_index(t.n_halfedges(), [&](Index h) {
            if (!is(h))
                return;
            mark(special[t.vertex[h]], kSpecial);
            mark(special[t.to_vertex(h)], kSpecial);
        });
    };
    const auto mark_vertices = [&](auto&& is) {
        special.resize(t.n_vertices());
        for_each_index(t.n_vertices(), [&](Index v) {
            if (is(v))
                special[v] = kSpecial;
        });
    };
    // Of odd degrees the vertices at gaps are not known, and what is sharp is.
    if (!odd_) {
        if (!level.gap.empty())
            mark_edges([&](Index h) { return level.gap[t.edge[h]]; });
        if (has_cuts_)
            mark_edges([&](Index h) { return is_cut(h); });
        mark_vertices([&](Index v) {
            return level.even->point_kinds[v] != PointKind::Inner ||
                   (is_base_ && (!level.even->base_sharpness[v].rays.empty() ||
                                 level.even->base_sharpness[v].vertex_sharpness > 0));
        });
    }
    if (!level.known.empty()) {
        special.resize(t.n_vertices());
        for_each_index(t.n_vertices(), [&](Index v) {
            if (!level.known[v])
                special[v] = kUnknown;
        });
    }
    // Even degrees: where sharpness still changes the rules.
    const auto skip_face = [&](Index f) {
        special.resize(t.n_vertices());
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
            special[t.vertex[h]] = kUnknown;
    };
    if (odd_)
        return special;
    for (Index h = 0; h < t.n_halfedges() && !level.even->rays.empty(); ++h) {
        if (level.even->edge_rays[t.edge[h]] != kInvalidIndex)
            skip_face(t.face(h));
    }
    for (const Junction& j : level.even->junctions) {
        if (!is_infinitely_sharp(j.vertex_sharpness))
            skip_face(j.face);
    }
    return special;
}

bool ControlMesh::is_cut(Index h) const noexcept {
    const Index edge = topology().edge[h];
    return odd_ ? is_infinitely_sharp(level_->features.edge(edge))
                : topology().is_border(h) && !level_->is_gap(edge);
}

bool ControlMesh::is_quad(Index face) const noexcept {
    if (topology().face_size(face) != 4)
        return false;
    const FaceKind kind = level_->face_kind(face);
    return kind != FaceKind::Dart && kind != FaceKind::Spike;
}

void ControlMesh::sort_fans(Index v, Fans& out) {
    const Topology& t = topology();
    const int n = static_cast<int>(t.valence(v));
    if (n != 4) {
        t.for_each_outgoing(v, [&](Index h) { fans_[h] = Fan::Irregular; });
        out.irregular.push_back({t.vertex_halfedge[v], n, PatchBorder::None, true});
    } else {
        regular_[v] = is_inside(v) ? Regularity::Inside : Regularity::Beside;
    }
}

void ControlMesh::sort_special_fans(Index v, std::uint8_t special, Fans& out) {
    const Topology& t = topology();
    // Of most of them one of these remains.
    t.for_each_outgoing(v, [&](Index h) { fans_[h] = Fan::Irregular; });
    settled_[v] = false;
    if (special == kUnknown)
        return;
    std::vector<Index>& ring = out.ring;
    ring.clear();
    t.for_each_outgoing(v, [&](Index h) { ring.push_back(h); });
    bool blocked = false;  // semi-sharp, or beside a gap
    std::size_t n_cuts = 0;
    t.for_each_edge(v, [&](Index e, Index) {
        const double s = odd_ ? level_->features.edge(e) : 0.0;
        blocked |= is_semi_sharp(s) || level_->is_gap(e);
        n_cuts += is_infinitely_sharp(s);
    });
    bool pinned = false, dart = false;
    if (odd_) {
        const double s = level_->features.vertex(v);
        blocked |= is_semi_sharp(s);
        pinned = is_pinned(s, n_cuts);
        dart = n_cuts == 1;
    } else {
        const PointKind kind = level_->even->point_kinds[v];
        if (is_base_) {
            const BaseSharpness& s = level_->even->base_sharpness[v];
            blocked |= !s.rays.empty() || is_semi_sharp(s.vertex_sharpness);
        }
        pinned = kind == PointKind::Pinned || kind == PointKind::Spike;
        dart = kind == PointKind::Dart;
    }
    if (blocked)
        return;
    settled_[v] = true;

    const auto first = std::ranges::find_if(ring, [&](Index h) { return is_cut(h); });
    const bool open = first != ring.end();
    if (open)
        std::rotate(ring.begin(), first, ring.end());
    for (std::size_t begin = 0, end; begin < ring.size(); begin = end) {
        for (end = begin + 1; end < ring.size() && !is_cut(ring[end]);)
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
            fans_[ring[i]] = fan;
        if (fan != Fan::Irregular)
            regular_[v] = fan == Fan::Inside && is_inside(v) ? Regularity::Inside
                                                             : Regularity::Beside;
        if (fan == Fan::Irregular) {
            out.irregular.push_back(
                {ring[begin], n,
                 !open            ? (pinned ? PatchBorder::Spike : PatchBorder::None)
                 : pinned || dart ? PatchBorder::Pinned
                                  : PatchBorder::Smooth,
                 !dart && (open || !pinned)});
        }
    }
}

/// Control points are known, and not on a border that runs midway.
Flags ControlMesh::incomplete_vertices() const {
    if (!midway_)
        return level_->known.empty() ? Flags()
                                     : vertices_beside_unknown(topology(), level_->known);
    Flags points(topology().n_vertices());
    for_each_index(points.size(), [&](Index v) {
        points[v] =
            level_->is_known(v) && level_->even->point_kinds[v] == PointKind::Inner;
    });
    return vertices_beside_unknown(topology(), points);
}

/// The points around are control points of whole quads.
bool ControlMesh::is_inside(Index v) const {
    bool inside = incomplete_.empty() || !incomplete_[v];
    if (!all_quads_)
        topology().for_each_outgoing(
            v, [&](Index h) { inside &= is_quad(topology().face(h)); });
    return inside;
}

Buffer<Regularity> ControlMesh::regular_cells() const {
    const Topology& t = topology();
    Buffer<Regularity> vertices = regular_, faces(t.n_faces());
    // A ring less with each step.
    for (int i = 1; i <= degree_ / 2; ++i) {
        if (i == degree_ / 2 && !odd_)
            break;
        for_each_index(t.n_faces(), [&](Index f) {
            Regularity lowest = Regularity::Inside;
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
                lowest = std::min(lowest, vertices[t.vertex[h]]);
            faces[f] = lowest;
        });
        if (i == degree_ / 2)
            break;
        // Patches may end at those that are not inside: nothing passes them.
        for_each_index(t.n_vertices(), [&](Index v) {
            if (vertices[v] != Regularity::Inside)
                return;
            t.for_each_outgoing(v, [&](Index h) {
                vertices[v] = std::min(vertices[v], faces[t.face(h)]);
            });
        });
    }
    return odd_ ? faces : vertices;
}

void ControlMesh::inner_net(Index h, Index* out) const noexcept {
    if (!topology().quads_only)
        inner_net_of<false>(h, out);
    else if (degree_ == 3)
        inner_net_of_cubic(h, out);
    else
        inner_net_of<true>(h, out);
}

/// Outwards from the four sides of the cell: no step waits for more than two others.
void ControlMesh::inner_net_of_cubic(Index h, Index* out) const noexcept {
    const Topology& t = topology();
    constexpr int kCorner[5] = {5, 6, 10, 9, 5};  // in the net of 4 x 4
    constexpr int kOut[5] = {-4, 1, 4, -1, -4};   // across the sides that start there
    const Index first = h & ~Index(3);
    for (Index k = 0; k < 4; ++k) {
        const int start = kCorner[k], end = kCorner[k + 1];
        const Index side = first + ((h + k) & 3),
                    across = t.twin[side],  // from the end of the side to its start
            back = (across & ~Index(3)) + ((across + 3) & 3),
                    diagonal = t.twin[back];  // in the quad beyond the end
        out[start] = t.vertex[side];
        out[start + kOut[k]] = t.vertex[across ^ 2];
        out[end + kOut[k]] = t.vertex[back];
        out[end + kOut[k] + kOut[k + 1]] = t.vertex[diagonal ^ 2];
    }
}

template <bool kQuadsOnly>
void ControlMesh::inner_net_of(Index h, Index* out) const noexcept {
    const Topology& t = topology();
    const int d = degree_;
    // The n-th next halfedge of a quad.
    const auto step = [&t](Index from, Index n) {
        const Index first = kQuadsOnly ? from & ~Index(3) : t.face_offsets[t.face(from)];
        return first + ((from - first + n) & 3);
    };
    for (int i = 0; i < d / 2; ++i) {
        h = step(t.twin[step(h, 3)], 3);
        h = step(t.twin[h], 2);
    }
    for (int y = 0; y < d; ++y) {
        Index right = h;
        for (int x = 0; x < d; ++x) {
            *out++ = t.vertex[right];
            right = step(right, 1);
            if (x == d - 1)
                *out++ = t.vertex[right];
            else
                right = step(t.twin[right], 1);
        }
        if (y < d - 1)
            h = t.twin[step(h, 2)];
    }
    // The upper sides of the last row of quads.
    for (int x = 0; x < d; ++x) {
        *out++ = t.vertex[step(h, 3)];
        if (x == d - 1)
            *out++ = t.vertex[step(h, 2)];
        else
            h = step(t.twin[step(h, 1)], 1);
    }
}

bool ControlGrid::extent(const ControlMesh& mesh, Index h, int axis, int wanted) {
    const Topology& t = mesh.topology();
    end_[axis] = false;
    for (n_[axis] = 0; n_[axis] < wanted;) {
        if (t.face_size(t.face(h)) != 4)
            return false;
        ++n_[axis];
        const Index ahead = axis == 0 ? t.next(h) : t.next(t.next(h));
        if (mesh.is_cut(ahead)) {
            // Where the border runs midway, its curve points are no control points.
            end_[axis] = n_[axis] < wanted || midway_;
            return true;
        }
        if (n_[axis] == wanted)
            return true;
        if (t.is_border(ahead))
            return false;
        h = axis == 0 ? t.next(t.twin[ahead]) : t.twin[ahead];
    }
    return true;
}

/// Edges inside are no borders, and those at a border are all.
bool ControlGrid::fits(const ControlMesh& mesh, Index ahead, int axis, int at) const {
    const bool last = at == n_[axis];
    return mesh.is_cut(ahead) ? last && (end_[axis] || !midway_) : !last || !end_[axis];
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
            if (!mesh.is_quad(t.face(h)))
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
            if (t.face_size(t.face(h)) != 4)
                return false;
            const Index behind = axis == 0 ? t.prev(h) : h;
            if (mesh.is_cut(behind)) {
                if (steps[axis] < -lo || mesh.border_is_midway())
                    begin[axis] = Begin::Border;
                break;
            }
            if (steps[axis] == -lo)
                break;
            if (t.is_border(behind))
                return false;
            h = axis == 0 ? t.prev(t.twin[behind]) : t.next(t.next(t.twin[behind]));
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

bool ControlGrid::is_vertex(int axis, int i) const noexcept {
    return i >= (begin_[axis] == Begin::Border && midway_) &&
           i <= n_[axis] - (end_[axis] && midway_);
}

Index ControlGrid::point(int x, int y) const noexcept {
    x += origin_[0];
    y += origin_[1];
    return is_vertex(0, x) && is_vertex(1, y) ? vertex(x, y) : kInvalidIndex;
}

bool ControlGrid::line_terms(int axis, int i, double weight, Line& terms) const {
    const int n = n_[axis];
    const bool begin = begin_[axis] == Begin::Border;
    const int lo = begin && midway_ ? 1 : 0, hi = end_[axis] && midway_ ? n - 1 : n;
    if (is_vertex(axis, i)) {
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

}  // namespace osdx::inline OSDX_ABI::detail
