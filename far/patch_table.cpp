// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/patch_table.h"

#include <algorithm>
#include <cassert>
#include <map>
#include <utility>

#include "far/refine.h"

namespace osdx {
namespace {

constexpr Index kLeafBit = Index(1) << 31;

/// The corner of the unit square in whose quarter a point lies, and the point in that
/// quarter's frame: corner at (0,0), x along the side that leaves it, unit side. On a middle
/// line `towards` decides; it is turned along.
int descend(Vec2<double>& p, Vec2<double>& towards) noexcept {
    const bool right = p.x > 0.5 || (p.x == 0.5 && towards.x > 0);
    const bool upper = p.y > 0.5 || (p.y == 0.5 && towards.y > 0);
    const int corner = upper ? (right ? 2 : 3) : (right ? 1 : 0);
    // The differences are exact, so that the cells' edges fit together exactly.
    p = turn(2.0 * (p - square_corner<double>(corner)), -corner);
    towards = turn(towards, -corner);
    return corner;
}

}  // namespace

/// Walks the levels of refinement and lays patches on each.
///
/// A cell is the piece of surface of one quad of the control mesh (odd degrees, centred at a
/// face) or one 4-valent vertex (even degrees, centred at the vertex).
class PatchTableBuilder {
public:
    PatchTableBuilder(Topology base, Features features, int degree)
        : degree_(degree), refinement_(base, degree, features) {
        table_.features_ = with_border(base, std::move(features));
        table_.degree_ = degree;
        table_.n_base_points_ = base.n_vertices();
        table_.nodes_.assign(base.n_halfedges(), kInvalidIndex);
        table_.base_ = std::move(base);
    }

    PatchTable build() {
        begin_base_level();
        while (true) {
            lay_patches();
            if (!refine())
                break;
        }
        place_points();
        table_.n_levels_ = refinement_.n_levels();
        return std::move(table_);
    }

private:
    using Leaf = PatchTable::Leaf;

    /// A sector of a patch: a square grid of quads, m vertices wide.
    struct Sector {
        int m;
        std::vector<Index> halfedges;  ///< (m-1)^2: leaves vertex (a, b) in direction a
        std::vector<Index> vertices;   ///< m^2

        Index halfedge(int a, int b) const { return halfedges[a * (m - 1) + b]; }
        Index vertex(int a, int b) const { return vertices[a * m + b]; }
    };

    const Topology& topology() const { return refinement_.topology(level_); }
    bool odd() const { return degree_ % 2 == 1; }

    // ------------------------------------------------------------------ levels

    void begin_base_level() {
        level_ = 0;
        const Topology& t = topology();
        note_irregular();
        // Cells of the base level have no node of their own but one root per quarter.
        active_.assign(odd() ? t.n_faces() : t.n_vertices(), true);
        for (Index v = 0; !odd() && v < t.n_vertices(); ++v)
            active_[v] = t.vertex_halfedge[v] != kInvalidIndex;
        point_of_.assign(t.n_vertices(), kInvalidIndex);
    }

    void note_irregular() {
        const Topology& t = topology();
        regular_.resize(t.n_vertices());
        for (Index v = 0; v < t.n_vertices(); ++v)
            regular_[v] = t.valence(v) == 4;
    }

    /// Cells that no patch covers yet go to the next level. \return false if there are none.
    bool refine() {
        if (std::ranges::find(active_, true) == active_.end())
            return false;
        assert(level_ < 16);  // the separation of irregular regions doubles at each level
        const Index n_children = topology().n_halfedges();
        refinement_.add_level();
        const Topology& parent = refinement_.topology(level_);
        std::vector<bool> active(n_children, false);
        std::vector<Index> node(n_children, kInvalidIndex);
        for (Index cell = 0; cell < active_.size(); ++cell) {
            if (!active_[cell])
                continue;
            Index child_node = kInvalidIndex;
            if (level_ > 0) {
                child_node = static_cast<Index>(table_.nodes_.size());
                table_.nodes_.resize(table_.nodes_.size() + 4, kInvalidIndex);
                table_.nodes_[node_[cell]] = child_node;
            }
            for_each_corner(parent, cell, [&](Index h) {
                active[h] = true;
                node[h] = level_ > 0 ? child_node++ : h;
            });
        }
        active_ = std::move(active);
        node_ = std::move(node);
        ++level_;
        note_irregular();
        point_of_.assign(topology().n_vertices(), kInvalidIndex);
        return true;
    }

    /// The corners of the control mesh in a cell, which are its children, in the order of
    /// the cell's frame.
    template <class F>
    void for_each_corner(const Topology& t, Index cell, F&& f) const {
        if (odd()) {
            for (Index h = t.face_offsets[cell]; h < t.face_offsets[cell + 1]; ++h)
                f(h);
            return;
        }
        const Index first = frame_halfedge(t, cell);
        Index h = first;
        do {
            f(h);
            h = t.ccw(h);
        } while (h != first);
    }

    /// Even degrees: corner 0 of a vertex' cell is the face of this halfedge.
    Index frame_halfedge(const Topology& t, Index vertex) const {
        return level_ == 0 ? t.vertex_halfedge[vertex]
                           : refinement_.level(level_).corner_halfedges[vertex];
    }

    // ------------------------------------------------------------------ patches

    void lay_patches() {
        const Topology& t = topology();
        // After the first step odd degrees have quads only, even degrees valence 4 only.
        if (level_ == 0 || odd()) {
            for (Index v = 0; v < t.n_vertices(); ++v) {
                if (!regular_[v] && t.vertex_halfedge[v] != kInvalidIndex)
                    lay_vertex_patch(v);
            }
        }
        if (level_ == 0 || !odd()) {
            for (Index f = 0; f < t.n_faces(); ++f) {
                if (t.face_size(f) != 4)
                    lay_face_patch(f);
            }
        }
        for (Index cell = 0; cell < active_.size(); ++cell) {
            if (!active_[cell])
                continue;
            if (odd() && t.face_size(cell) == 4)
                lay_face_patch(cell);
            else if (!odd() && regular_[cell])
                lay_vertex_patch(cell);
        }
    }

    void lay_vertex_patch(Index v) {
        const Topology& t = topology();
        starts_.clear();
        const Index first = odd() ? t.vertex_halfedge[v] : frame_halfedge(t, v);
        Index h = first;
        do {
            starts_.push_back(h);
            h = t.ccw(h);
        } while (h != first);
        lay_patch(true, regular_[v] ? degree_ / 2 + 1 : degree_);
    }

    void lay_face_patch(Index f) {
        const Topology& t = topology();
        starts_.clear();
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
            if (!regular_[t.vertex[h]])
                return;
            starts_.push_back(t.ccw(t.ccw(h)));  // the edge that goes on away from side i
        }
        const int m = t.face_size(f) == 4 ? (degree_ + 1) / 2 : degree_;
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
            if (!is_strip(h, m - 1))
                return;
        }
        lay_patch(false, m);
    }

    /// The n faces that follow each other across the edge of h are quads: they lie between
    /// the sectors of a patch that is centred at the face of h.
    bool is_strip(Index h, int n) const {
        const Topology& t = topology();
        for (int i = 0; i < n; ++i) {
            h = t.twin[h];
            if (t.face_size(t.face[h]) != 4)
                return false;
            h = t.next(t.next(h));
        }
        return true;
    }

    /// Lays the patch whose sectors start at the halfedges `starts_` and are m vertices
    /// wide, if its neighbourhood is regular and no patch covers it yet.
    void lay_patch(bool at_vertex, int m) {
        const int n = static_cast<int>(starts_.size());
        sectors_.resize(starts_.size());
        for (int i = 0; i < n; ++i) {
            if (!walk_sector(starts_[i], m, sectors_[i]))
                return;
        }
        const PatchKind kind = n == 4      ? PatchKind::Regular
                               : at_vertex ? PatchKind::EV
                                           : PatchKind::EF;
        const PatchClass patch_class{kind, degree_, n};
        covered_.clear();
        for (int i = 0; i < n; ++i) {
            if (level_ == 0)
                cover_quarters(patch_class, at_vertex, i);
            else
                cover_cells(patch_class, at_vertex, i);
        }
        if (commit_cover())
            add_patch(patch_class, at_vertex);
    }

    bool walk_sector(Index start, int m, Sector& s) const {
        const Topology& t = topology();
        s.m = m;
        s.halfedges.resize((m - 1) * (m - 1));
        s.vertices.resize(m * m);
        Index first = start;  // of column a
        for (int a = 0; a < m - 1; ++a) {
            Index h = first;
            for (int b = 0; b < m - 1; ++b) {
                if (t.face_size(t.face[h]) != 4)
                    return false;
                if ((a > 0 || b > 0) && !regular_[t.vertex[h]])
                    return false;
                const Index right = t.next(h), top = t.next(right);
                s.halfedges[a * (m - 1) + b] = h;
                s.vertices[a * m + b] = t.vertex[h];
                s.vertices[(a + 1) * m + b] = t.vertex[right];
                s.vertices[(a + 1) * m + b + 1] = t.vertex[top];
                s.vertices[a * m + b + 1] = t.vertex[t.next(top)];
                h = t.twin[top];
            }
            first = t.next(t.twin[t.next(first)]);
        }
        return true;
    }

    // ------------------------------------------------------------------ leaves

    struct Covered {
        Index cell;  ///< face or vertex of the control mesh
        Index node;
        Leaf leaf;
    };

    /// Sector i of a regular patch lies in the patch's frame turned about its centre.
    static Leaf leaf_at(const PatchClass& c, int sector, Vec2<int> origin, int turns,
                        int size) {
        if (c.kind == PatchKind::Regular) {
            origin = Vec2<int>(1, 1) + turn(origin, sector + 2);
            turns += sector + 2;
            sector = 0;
        }
        return {kInvalidIndex,
                static_cast<Index>(sector),
                static_cast<std::int16_t>(origin.x),
                static_cast<std::int16_t>(origin.y),
                static_cast<std::uint8_t>(size),
                static_cast<std::uint8_t>(turns & 3)};
    }

    /// Base level: the quarters of base faces about each vertex of the sector, as far as
    /// they lie in the sector.
    void cover_quarters(const PatchClass& c, bool at_vertex, int i) {
        const Topology& t = topology();
        const Sector& s = sectors_[i];
        const int extent = c.kind == PatchKind::Regular ? 1 : c.extent();
        for (int a = 0; a < s.m - 1; ++a) {
            for (int b = 0; b < s.m - 1; ++b) {
                const Vec2<int> p = 2 * Vec2<int>(a, b) + (at_vertex ? 0 : 1);
                Index h = s.halfedge(a, b);
                for (int k = 0; k < 4; ++k) {
                    const Vec2<int> q = p + turn(Vec2<int>(1, 1), k);
                    if (std::min(q.x, q.y) < 0 || std::max({p.x, p.y, q.x, q.y}) > extent)
                        continue;
                    Index corner = h;
                    for (int r = 0; r < k; ++r)
                        corner = t.ccw(corner);
                    covered_.push_back({odd() ? t.face[corner] : t.vertex[corner], corner,
                                        leaf_at(c, i, p, k, 1)});
                }
            }
        }
    }

    /// Later levels: whole cells, of faces (a, b) for odd and of vertices for even degrees.
    void cover_cells(const PatchClass& c, bool at_vertex, int i) {
        const Topology& t = topology();
        const Sector& s = sectors_[i];
        if (c.kind == PatchKind::Regular) {
            if (i == 0) {
                const Index cell =
                    at_vertex ? t.vertex[starts_[0]] : t.face[twice_cw(starts_[0])];
                covered_.push_back({cell, node_[cell], {kInvalidIndex, 0, 0, 0, 2, 0}});
            }
            return;
        }
        const int width = c.extent() / 2;
        for (int a = 0; a < width; ++a) {
            for (int b = 0; b < width; ++b) {
                const Index h = s.halfedge(a, b);
                const Vec2<int> p = 2 * Vec2<int>(a, b);
                if (odd()) {
                    const Index face = t.face[h];
                    const int turns = static_cast<int>(t.face_offsets[face] + 4 - h) & 3;
                    covered_.push_back(
                        {face, node_[face],
                         leaf_at(c, i, p + 2 * square_corner<int>(turns), turns, 2)});
                } else {
                    const Index vertex = t.vertex[h];
                    const Index frame = frame_halfedge(t, vertex);
                    int k = 0;
                    for (Index g = h; g != frame; g = t.ccw(g))
                        ++k;
                    covered_.push_back(
                        {vertex, node_[vertex],
                         leaf_at(c, i, p + 1 + turn(Vec2<int>(1, 1), k), k + 2, 2)});
                }
            }
        }
    }

    /// Undoes the two turns by which lay_face_patch left the face.
    Index twice_cw(Index h) const {
        const Topology& t = topology();
        h = t.next(t.twin[h]);
        return t.next(t.twin[h]);
    }

    /// Gives the covered nodes to the patch that comes next, unless one is taken already.
    bool commit_cover() {
        for (const Covered& c : covered_) {
            if (!active_[c.cell])
                return false;
        }
        for (Covered& c : covered_) {
            assert(table_.nodes_[c.node] == kInvalidIndex);
            c.leaf.patch = table_.n_patches();
            table_.nodes_[c.node] = kLeafBit | static_cast<Index>(table_.leaves_.size());
            table_.leaves_.push_back(c.leaf);
        }
        for (const Covered& c : covered_)
            active_[c.cell] = false;
        return true;
    }

    void add_patch(const PatchClass& c, bool at_vertex) {
        const auto [it, is_new] =
            class_index_.try_emplace(c, static_cast<Index>(table_.classes_.size()));
        if (is_new)
            table_.classes_.push_back(c);
        const std::size_t first = table_.points_.size();
        table_.patches_.push_back(
            {it->second, static_cast<Index>(first), static_cast<std::uint8_t>(level_)});
        table_.points_.resize(first + c.n_points(), kInvalidIndex);
        for (int i = 0; i < c.n_sides; ++i) {
            const Sector& s = sectors_[i];
            for (int a = 0; a < s.m; ++a) {
                for (int b = 0; b < s.m; ++b) {
                    const int local = c.kind == PatchKind::EV ? c.ev_point(i, a, b)
                                      : c.kind == PatchKind::EF
                                          ? c.ef_point(i, a, b)
                                          : grid_point(at_vertex, i, a, b);
                    table_.points_[first + local] = point(s.vertex(a, b));
                }
            }
        }
    }

    int grid_point(bool at_vertex, int sector, int a, int b) const {
        const Vec2<int> origin = Vec2<int>(degree_ / 2) +
                                 (at_vertex ? Vec2<int>(0) : square_corner<int>(sector));
        const Vec2<int> p = origin + turn(Vec2<int>(a, b), sector + 2);
        return p.y * (degree_ + 1) + p.x;
    }

    // ------------------------------------------------------------------ points

    /// The number of a vertex of this level among those that patches use; place_points()
    /// turns it into the place of its point.
    Index point(Index vertex) {
        Index& p = point_of_[vertex];
        if (p == kInvalidIndex) {
            p = static_cast<Index>(used_.size());
            used_.emplace_back(level_, vertex);
        }
        return p;
    }

    void place_points() {
        std::vector<std::vector<bool>> wanted;
        for (int l = 0; l < refinement_.n_levels(); ++l)
            wanted.emplace_back(refinement_.topology(l).n_vertices(), false);
        for (const auto& [level, vertex] : used_)
            wanted[level][vertex] = true;
        Refinement::Chain chain = refinement_.chain(std::move(wanted));
        for (Index& p : table_.points_) {
            const auto& [level, vertex] = used_[p];
            p = chain.place[level][vertex];
        }
        table_.refined_points_ = std::move(chain.rows);
    }

    int degree_;
    Refinement refinement_;
    PatchTable table_;
    std::map<PatchClass, Index> class_index_;
    std::vector<std::pair<int, Index>> used_;  // level, vertex of each control point

    int level_ = 0;
    std::vector<bool> regular_;    // per vertex of this level: valence 4
    std::vector<bool> active_;     // per cell of this level: not covered yet
    std::vector<Index> node_;      // per cell of this level, from level 1 on
    std::vector<Index> point_of_;  // per vertex of this level

    std::vector<Index> starts_;
    std::vector<Sector> sectors_;
    std::vector<Covered> covered_;
};

PatchTable build_patch_table(Topology base, Features features,
                             const PatchTableOptions& options) {
    return PatchTableBuilder(std::move(base), std::move(features), options.degree)
        .build();
}

PatchRef PatchTable::patch(Index i) const noexcept {
    const Record& r = patches_[i];
    const auto n = static_cast<std::size_t>(classes_[r.patch_class].n_points());
    return {r.patch_class, r.level, std::span(points_).subspan(r.first_point, n)};
}

PatchPoint PatchTable::locate(const QuarterPoint& point,
                              Vec2<double> towards) const noexcept {
    Vec2<double> p(point.x, point.y);
    Index node = nodes_[point.quarter];
    int turns = quarter_turns(base_, point.quarter);
    double scale = 2;
    while (!(node & kLeafBit)) {
        const int corner = descend(p, towards);
        node = nodes_[node + corner];
        turns -= corner;
        scale *= 2;
    }
    const Leaf& leaf = leaves_[node & ~kLeafBit];
    const int extent = class_of(leaf.patch).extent();
    p = Vec2<double>(leaf.x, leaf.y) + double(leaf.size) * turn(p, leaf.turns);
    return {leaf.patch,
            leaf.sector,
            p.x / extent,
            p.y / extent,
            (turns + leaf.turns) & 3,
            scale * leaf.size / extent};
}

PatchPoint PatchTable::locate(const Address& address) const noexcept {
    return locate(to_quarter(base_, address));
}

std::vector<Cell> PatchTable::cells() const {
    struct Frame {
        Index node;
        Vec2<double> origin, x_axis;
    };
    std::vector<Cell> cells;
    std::vector<Frame> stack;
    for (Index quarter = 0; quarter < base_.n_halfedges(); ++quarter) {
        stack.push_back({nodes_[quarter], {0, 0}, {1, 0}});
        while (!stack.empty()) {
            const Frame f = stack.back();
            stack.pop_back();
            if (f.node & kLeafBit) {
                const Leaf& leaf = leaves_[f.node & ~kLeafBit];
                cells.push_back({quarter, leaf.patch, f.origin, f.x_axis});
                continue;
            }
            const Vec2<double> y_axis = turn(f.x_axis, 1);
            for (int k = 3; k >= 0; --k) {
                const auto c = square_corner<double>(k);
                stack.push_back({nodes_[f.node + k],
                                 f.origin + c.x * f.x_axis + c.y * y_axis,
                                 0.5 * turn(f.x_axis, k)});
            }
        }
    }
    return cells;
}

}  // namespace osdx
