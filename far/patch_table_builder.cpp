// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <map>
#include <optional>
#include <utility>

#include "far/control_mesh.h"
#include "far/gregory_points.h"
#include "far/patch_table.h"
#include "far/refine.h"

namespace osdx {

using detail::ControlGrid;
using detail::ControlMesh;
using detail::Fan;
using detail::IrregularFan;
using detail::PointTerms;
using Begin = ControlGrid::Begin;

/// Walks the levels of refinement and lays patches on each.
///
/// A cell is the piece of surface of one quad of the control mesh (odd degrees, centred at a
/// face) or one 4-valent vertex (even degrees, centred at the vertex).
class PatchTableBuilder {
public:
    PatchTableBuilder(Topology base, Features features, const PatchTableOptions& options)
        : degree_(options.degree),
          family_(options.family),
          levels_(options.levels),
          uniform_(options.uniform),
          gregory_{.tangents = options.paper_tangents ? paper_tangents : tuned_tangents,
                   .centre = !options.normalised},
          isolation_(options.isolation),
          isolate_corners_(options.isolate_corners),
          refinement_(base, options.degree, features) {
        table_.degree_ = degree_;
        table_.n_base_points_ = base.n_vertices();
        table_.nodes_.assign(base.n_halfedges(), kInvalidIndex);
        table_.features_ = with_border(base, std::move(features));
        table_.base_ = std::move(base);
    }

    Result<PatchTable> build() {
        begin_base_level();
        while (true) {
            lay_patches();
            const auto open = std::ranges::find(cells_, Cover::Open);
            if (open == cells_.end())
                break;
            if (level_ == kMaxLevel)
                return not_isolated(static_cast<Index>(open - cells_.begin()));
            refine();
        }
        place_points();
        table_.n_levels_ = refinement_.n_levels();
        return std::move(table_);
    }

private:
    using Leaf = PatchTable::Leaf;

    // The distance between irregular regions doubles at each level, and sharpness ends after
    // ten: what a sound mesh needs is far less.
    static constexpr int kMaxLevel = 40;

    enum class Cover : std::uint8_t {
        Open,     ///< waits for a patch
        Covered,  ///< has a patch, or is no part of this level's work
        Hole,     ///< has no surface; patches may reach into it
    };

    const Topology& topology() const { return refinement_.topology(level_); }
    bool odd() const { return degree_ % 2 == 1; }

    // ------------------------------------------------------------------ levels

    void begin_base_level() {
        level_ = 0;
        mesh_.emplace(refinement_.level(0), degree_, true);
        const Topology& t = topology();
        // Cells of the base level have no node of their own but one root per quarter.
        cells_.assign(odd() ? t.n_faces() : t.n_vertices(), Cover::Hole);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            if (table_.has_surface(t.face[h]))
                cells_[odd() ? t.face[h] : t.vertex[h]] = Cover::Open;
        }
        point_of_.assign(t.n_vertices(), kInvalidIndex);
    }

    /// Open cells and what they need around them.
    std::vector<bool> faces_to_refine() const {
        const Topology& t = topology();
        std::vector<bool> faces(t.n_faces(), false);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            if (cells_[odd() ? t.face[h] : t.vertex[h]] == Cover::Open)
                faces[t.face[h]] = true;
        }
        // Control nets on the next level reach d of its edges far, its smoothings (d-1)/2
        // more: less than d faces of this one.
        return grown(t, std::move(faces), degree_);
    }

    /// Open cells go to the next level.
    void refine() {
        refinement_.add_level(faces_to_refine());
        const Topology& parent = refinement_.topology(level_);
        const RefinedLevel& child = refinement_.level(level_ + 1);
        const Index n_cells =
            odd() ? child.topology.n_faces() : child.topology.n_vertices();
        std::vector<Cover> cells(n_cells, Cover::Covered);
        std::vector<Index> node(n_cells, kInvalidIndex);
        const auto pass_on = [&](Index cell, auto&& for_each_corner) {
            Index child_node = kInvalidIndex;
            if (level_ > 0 && cells_[cell] == Cover::Open) {
                child_node = static_cast<Index>(table_.nodes_.size());
                table_.nodes_.resize(table_.nodes_.size() + 4, kInvalidIndex);
                table_.nodes_[node_[cell]] = child_node;
            }
            for_each_corner([&](Index h) {
                const Index c = child.children[h];
                if (c != kInvalidIndex) {
                    const bool hole = level_ == 0 && !table_.has_surface(parent.face[h]);
                    cells[c] = hole ? Cover::Hole : cells_[cell];
                    node[c] = level_ == 0 ? h : child_node;
                }
                if (child_node != kInvalidIndex)
                    ++child_node;
            });
        };
        for (Index cell = 0; cell < cells_.size(); ++cell) {
            if (cells_[cell] == Cover::Covered)
                continue;
            pass_on(cell, [&](auto&& f) {
                if (odd()) {
                    for (Index h = parent.face_offsets[cell];
                         h < parent.face_offsets[cell + 1]; ++h)
                        f(h);
                } else {
                    for_each_corner(parent, cell, f);
                }
            });
        }
        cells_ = std::move(cells);
        node_ = std::move(node);
        ++level_;
        mesh_.emplace(child, degree_, false);
        point_of_.assign(topology().n_vertices(), kInvalidIndex);
        mirrored_.clear();
    }

    /// Even degrees: the corners at a vertex, in the order of its cell's frame.
    template <class F>
    void for_each_corner(const Topology& t, Index vertex, F&& f) const {
        const Index first = frame_halfedge(vertex);
        Index h = first;
        while (h != kInvalidIndex) {
            f(h);
            h = t.ccw(h);
            if (h == first)
                break;
        }
    }

    /// Even degrees: corner 0 of a vertex' cell is the face of this halfedge.
    Index frame_halfedge(Index vertex) const {
        return level_ == 0 ? topology().vertex_halfedge[vertex]
                           : refinement_.level(level_).corner_halfedges[vertex];
    }

    Error not_isolated(Index cell) const {
        // The quarter whose quadtree the cell is in: from parent to parent.
        Index node = node_[cell];
        while (node >= table_.base_.n_halfedges()) {
            const auto parent = std::ranges::find_if(table_.nodes_, [&](Index first) {
                return first <= node && node < first + 4;
            });
            node = static_cast<Index>(parent - table_.nodes_.begin());
        }
        const Index face = table_.base_.face[node];
        return fail(
            ErrorCode::NotIsolated,
            fmt::format("the surroundings of face {} do not become regular", face), face);
    }

    // ------------------------------------------------------------------ patches

    void lay_patches() {
        const Topology& t = topology();
        if (family_ == PatchFamily::Gregory) {
            for (Index face = 0; face < cells_.size(); ++face) {
                if (cells_[face] == Cover::Open && (!uniform_ || level_ >= levels_))
                    lay_regular_patch(face);
            }
            if (level_ >= levels_) {
                const std::vector<bool> ready = faces_for_gregory();
                for (Index face = 0; face < cells_.size(); ++face) {
                    if (ready[face])
                        lay_gregory_patch(face);
                }
            }
            return;
        }
        for (const IrregularFan& fan : mesh_->irregular_fans()) {
            const bool waits =
                !fan.exact || (isolate_corners_ && fan.border == PatchBorder::Pinned);
            if (!waits || level_ >= isolation_)
                lay_vertex_patch(fan);
        }
        for (Index f = 0; f < t.n_faces(); ++f) {
            if (level_ == 0 || !odd())
                lay_face_patch(f);
        }
        for (Index cell = 0; cell < cells_.size(); ++cell) {
            if (cells_[cell] == Cover::Open)
                lay_regular_patch(cell);
        }
    }

    void lay_vertex_patch(const IrregularFan& fan) {
        // Even degrees: from level 1 on irregular vertices have become faces.
        if (!odd() && level_ > 0)
            return;
        const Topology& t = topology();
        const PatchClass c{PatchKind::EV, degree_, fan.n_faces, fan.border};
        const int n = fan.n_faces, width = degree_ - 1;
        grids_.resize(std::size_t(n));
        Index h = fan.start;
        for (int i = 0; i < n; ++i, h = t.ccw(h)) {
            ControlGrid& grid = grids_[i];
            const bool first = c.is_open() && i == 0, last = c.is_open() && i == n - 1;
            if (!grid.walk(*mesh_, h, width, width, last ? Begin::Border : Begin::Inside,
                           first ? Begin::Border : Begin::Inside) ||
                !grid.is_regular(*mesh_, true))
                return;
            // A border must not come closer than the patch reaches.
            if ((grid.ends_at_border(0) && 2 * grid.n_x() < width) ||
                (grid.ends_at_border(1) && 2 * grid.n_y() < width))
                return;
        }
        for (int i = c.is_open() ? 1 : 0; i < n; ++i) {
            if (!same_extent(grids_[i], 0, grids_[(i + n - 1) % n], 1))
                return;
        }
        begin_net(c);
        for (int i = 0; i < n; ++i) {
            for (int a = 0; a < degree_; ++a) {
                for (int b = 0; b < degree_; ++b) {
                    if (!set_point(c.ev_point(i, a, b), grids_[i], a, b))
                        return;
                }
            }
            cover_sector(c, i);
        }
        commit(c);
    }

    void lay_face_patch(Index f) {
        const Topology& t = topology();
        const RefinedLevel& level = refinement_.level(level_);
        const FaceKind kind =
            level.face_kinds.empty() ? FaceKind::Plain : level.face_kinds[f];
        if (kind == FaceKind::Plain && mesh_->is_quad(f))
            return;
        if (level_ == 0 && t.face_size(f) == 3 && level.features.smooth_triangles)
            return;  // refinement treats them in a way of its own
        const bool exact = kind != FaceKind::Dart && kind != FaceKind::Spike;
        const bool waits = !exact || (isolate_corners_ && kind == FaceKind::Pinned);
        if (waits && level_ < isolation_)
            return;
        PatchClass c{PatchKind::EF, degree_, 0, PatchBorder::None};
        if (kind == FaceKind::Border)
            c.border = PatchBorder::Smooth;
        else if (kind == FaceKind::Pinned || kind == FaceKind::Dart)
            c.border = PatchBorder::Pinned;
        else if (kind == FaceKind::Spike)
            c.border = PatchBorder::Spike;

        // The corners from the first that follows the border on.
        corners_.clear();
        Index centre = kInvalidIndex;
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
            if (!c.is_open() || level.point_kinds[t.vertex[h]] == PointKind::Inner)
                corners_.push_back(h);
            else if (level.point_kinds[t.vertex[h]] == PointKind::Pinned)
                centre = t.vertex[h];
        }
        if (c.is_open()) {
            const auto first = std::ranges::find_if(corners_, [&](Index h) {
                return level.point_kinds[t.vertex[t.prev(h)]] == PointKind::Curve;
            });
            std::rotate(corners_.begin(), first, corners_.end());
        }
        const int n = c.n_sectors = static_cast<int>(corners_.size());
        if ((c.border == PatchBorder::Smooth && n == 2) ||
            (c.border == PatchBorder::Pinned && n == 1 && exact))
            return;  // regular

        const int width = degree_ - 1, n_sides = c.is_open() ? n + 1 : n;
        grids_.resize(std::size_t(n));
        strips_.resize(std::size_t(n_sides));
        for (int i = 0; i < n_sides; ++i) {
            const Index side = i < n ? t.prev(corners_[i]) : corners_[n - 1];
            if (t.is_border(side))
                return;
            const bool first = c.is_open() && i == 0, last = i == n;
            ControlGrid& strip = strips_[i];
            if (!strip.walk(*mesh_, t.next(t.twin[side]), width, 1, Begin::Inside,
                            first ? Begin::Border : Begin::Outer) ||
                !strip.is_regular(*mesh_) || (last && !strip.ends_at_border(1)))
                return;
        }
        for (int i = 0; i < n; ++i) {
            if (mesh_->fan(corners_[i]) != Fan::Inside)
                return;
            ControlGrid& grid = grids_[i];
            if (!grid.walk(*mesh_, t.ccw(t.ccw(corners_[i])), width, width, Begin::Inside,
                           Begin::Inside) ||
                !grid.is_regular(*mesh_) || !same_extent(grid, 0, strips_[i], 0) ||
                !same_extent(grid, 1, strips_[(i + 1) % n_sides], 0))
                return;
        }
        begin_net(c);
        for (int i = 0; i < n; ++i) {
            for (int p = 0; p < degree_; ++p) {
                for (int q = 0; q < degree_; ++q) {
                    if (!set_point(c.ef_point(i, p, q), grids_[i], p, q))
                        return;
                }
            }
            cover_sector(c, i);
        }
        for (int p = 0; p < degree_ && c.is_open(); ++p) {
            // The strips are one quad wide; the border is the row on its outer side.
            if (!set_curve_point(c.ef_curve(0, p), strips_[0], p, 0) ||
                !set_curve_point(c.ef_curve(1, p), strips_[n], p, 1))
                return;
        }
        if (kind == FaceKind::Pinned) {
            net_[c.ef_centre()] = {{centre, 1.0}};
        } else if (kind == FaceKind::Spike) {
            const auto spike = std::ranges::find(level.junctions, f, &Junction::face);
            net_[c.ef_centre()] = {{spike->point, 1.0}};
        } else if (kind == FaceKind::Dart) {
            for (const Index h : corners_)
                net_[c.ef_centre()].emplace_back(t.vertex[h], 1.0 / n);
        }
        commit(c);
    }

    void lay_regular_patch(Index cell) {
        const Topology& t = topology();
        Index h;
        int lo = -(degree_ / 2), hi = degree_ / 2;
        if (odd()) {
            h = t.face_offsets[cell];
            hi += 1;
        } else if (level_ == 0) {
            h = t.vertex_halfedge[cell];
        } else {
            // The cell's frame starts in the face of its first corner: opposite.
            h = t.ccw(t.ccw(frame_halfedge(cell)));
        }
        grids_.resize(1);
        ControlGrid& grid = grids_[0];
        if (!grid.walk_around(*mesh_, h, lo, hi) || !grid.is_regular(*mesh_))
            return;
        const PatchClass c{PatchKind::Regular, degree_, 4};
        begin_net(c);
        for (int y = lo; y <= hi; ++y) {
            for (int x = lo; x <= hi; ++x) {
                if (!set_point((y - lo) * (degree_ + 1) + x - lo, grid, x, y))
                    return;
            }
        }
        if (odd()) {
            cover_face(c, cell);
        } else if (level_ > 0) {
            covered_.push_back({cell, node_[cell], {kInvalidIndex, 0, 0, 0, 2, 0}});
        } else {
            Index corner = h;
            int k = 0;
            do {
                covered_.push_back({cell, corner, leaf(0, Vec2<int>(1, 1), k++, 1)});
                corner = t.ccw(corner);
            } while (corner != h && corner != kInvalidIndex);
        }
        commit(c);
    }

    /// Open faces whose corners are settled. At a vertex that is not regular the edges of
    /// patches are no pieces of the limit surface, so that all of its faces wait for each other:
    /// patches of different levels would not meet there.
    std::vector<bool> faces_for_gregory() const {
        const Topology& t = topology();
        const bool smooth_triangles = refinement_.level(level_).features.smooth_triangles;
        std::vector<bool> ready(t.n_faces()), regular(t.n_vertices(), true);
        for (Index f = 0; f < t.n_faces(); ++f) {
            // Refinement treats smooth triangles in a way of its own.
            ready[f] =
                cells_[f] == Cover::Open && !(smooth_triangles && t.face_size(f) == 3);
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
                if (mesh_->fan(h) == Fan::Irregular || t.face_size(f) != 4)
                    regular[t.vertex[h]] = false;
                if (!mesh_->is_settled(t.vertex[h]))
                    ready[f] = false;
            }
        }
        std::vector<Index> waiting;
        for (Index f = 0; f < t.n_faces(); ++f) {
            if (cells_[f] == Cover::Open && !ready[f])
                waiting.push_back(f);
        }
        while (!waiting.empty()) {
            const Index f = waiting.back();
            waiting.pop_back();
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
                if (regular[t.vertex[h]])
                    continue;
                t.for_each_outgoing(t.vertex[h], [&](Index out) {
                    if (!ready[t.face[out]])
                        return;
                    ready[t.face[out]] = false;
                    waiting.push_back(t.face[out]);
                });
            }
        }
        return ready;
    }

    void lay_gregory_patch(Index face) {
        const Topology& t = topology();
        const RefinedLevel& level = refinement_.level(level_);
        const int n = static_cast<int>(t.face_size(face));
        const StencilTable rows = gregory_points(t, level.features, face, gregory_);
        const PatchClass c{PatchKind::Gregory, degree_, n, PatchBorder::None,
                           n != 4 && !gregory_.centre};
        begin_net(c);
        for (Index r = 0; r < rows.n_rows(); ++r) {
            for (std::size_t k = rows.offsets[r]; k < rows.offsets[r + 1]; ++k)
                net_[r].emplace_back(rows.indices[k], rows.weights[k]);
        }
        cover_face(c, face);
        commit(c);
    }

    /// All of a face by one patch in its frame.
    void cover_face(const PatchClass& c, Index face) {
        const int n = static_cast<int>(topology().face_size(face));
        if (level_ > 0) {
            covered_.push_back({face, node_[face], {kInvalidIndex, 0, 0, 0, 2, 0}});
            return;
        }
        const Index first = topology().face_offsets[face];
        for (int k = 0; k < n; ++k) {
            covered_.push_back({face, first + k,
                                c.is_square() ? leaf(0, 2 * square_corner<int>(k), k, 1)
                                              : leaf(k, {1, 1}, 2, 1)});
        }
    }

    static bool same_extent(const ControlGrid& a, int axis_a, const ControlGrid& b,
                            int axis_b) {
        const auto n = [](const ControlGrid& g, int axis) {
            return axis == 0 ? g.n_x() : g.n_y();
        };
        return n(a, axis_a) == n(b, axis_b) &&
               a.ends_at_border(axis_a) == b.ends_at_border(axis_b);
    }

    // ------------------------------------------------------------------ cover

    struct Covered {
        Index cell;  ///< face or vertex of the control mesh
        Index node;
        Leaf leaf;
    };

    static Leaf leaf(int sector, Vec2<int> origin, int turns, int size) {
        return {kInvalidIndex,
                static_cast<Index>(sector),
                static_cast<std::int16_t>(origin.x),
                static_cast<std::int16_t>(origin.y),
                static_cast<std::uint8_t>(size),
                static_cast<std::uint8_t>(turns & 3)};
    }

    void cover_sector(const PatchClass& c, int sector) {
        if (level_ == 0)
            cover_quarters(c, sector);
        else
            cover_cells(c, sector);
    }

    /// Base level: the quarters of the faces of a sector, as far as they lie in the patch. An
    /// EF's sector has the face itself and the strips beside its sides as well.
    void cover_quarters(const PatchClass& c, int sector) {
        const Topology& t = topology();
        const ControlGrid& grid = grids_[sector];
        const bool at_face = c.kind == PatchKind::EF;
        const int extent = c.extent();
        // The quad to the upper right of grid point (a, b), from its corner at `h`.
        const auto cover_quad = [&](int a, int b, Index h, int corner) {
            for (int k = 0; k < 4; ++k, h = t.next(h), corner = (corner + 1) & 3) {
                const Vec2<int> p =
                    2 * (Vec2<int>(a, b) + square_corner<int>(corner)) + int(at_face);
                const Vec2<int> q = p + turn(Vec2<int>(1, 1), corner);
                if (std::min({p.x, p.y, q.x, q.y}) < 0 ||
                    std::max({p.x, p.y, q.x, q.y}) > extent)
                    continue;
                covered_.push_back(
                    {odd() ? t.face[h] : t.vertex[h], h, leaf(sector, p, corner, 1)});
            }
        };
        for (int a = 0; a < grid.n_x(); ++a) {
            for (int b = 0; b < grid.n_y(); ++b)
                cover_quad(a, b, grid.halfedge(a, b), 0);
        }
        if (!at_face)
            return;
        for (int a = 0; a < grid.n_x(); ++a)
            cover_quad(a, -1, t.twin[grid.halfedge(a, 0)], 2);
        for (int b = 0; b < grid.n_y(); ++b)
            cover_quad(-1, b, t.twin[t.prev(grid.halfedge(0, b))], 1);
        covered_.push_back({odd() ? t.face[corners_[sector]] : t.vertex[corners_[sector]],
                            corners_[sector], leaf(sector, {1, 1}, 2, 1)});
    }

    /// Later levels: whole cells, of faces (a, b) for odd and of vertices for even degrees.
    void cover_cells(const PatchClass& c, int sector) {
        const Topology& t = topology();
        const ControlGrid& grid = grids_[sector];
        const int width = c.extent() / 2;
        for (int a = 0; a < width; ++a) {
            for (int b = 0; b < width; ++b) {
                const Index h = grid.halfedge(a, b);
                const Vec2<int> p = 2 * Vec2<int>(a, b);
                if (odd()) {
                    const Index face = t.face[h];
                    const int turns = static_cast<int>(t.face_offsets[face] + 4 - h) & 3;
                    covered_.push_back(
                        {face, node_[face],
                         leaf(sector, p + 2 * square_corner<int>(turns), turns, 2)});
                } else {
                    const Index vertex = t.vertex[h];
                    const Index frame = frame_halfedge(vertex);
                    int k = 0;
                    for (Index g = h; g != frame; g = t.ccw(g))
                        ++k;
                    covered_.push_back(
                        {vertex, node_[vertex],
                         leaf(sector, p + 1 + turn(Vec2<int>(1, 1), k), k + 2, 2)});
                }
            }
        }
    }

    void begin_net(const PatchClass& c) {
        net_.assign(std::size_t(c.n_points()), {});
        covered_.clear();
    }

    bool set_point(int i, const ControlGrid& grid, int x, int y) {
        return !net_[i].empty() || grid.point(x, y, net_[i]);
    }

    /// The border's points are between the rows of the grid: mirrored at its ends alone.
    bool set_curve_point(int i, const ControlGrid& strip, int x, int y) {
        return strip.row_point(x, y, net_[i]);
    }

    /// Adds the patch, unless a part of it is covered already or nothing of it is open.
    void commit(const PatchClass& c) {
        bool any_open = false;
        for (const Covered& cover : covered_) {
            if (cells_[cover.cell] == Cover::Covered)
                return;
            any_open |= cells_[cover.cell] == Cover::Open;
        }
        if (!any_open)
            return;
        for (Covered& cover : covered_) {
            if (cells_[cover.cell] == Cover::Hole || is_hole_quarter(cover.node))
                continue;
            assert(table_.nodes_[cover.node] == kInvalidIndex);
            cover.leaf.patch = table_.n_patches();
            table_.nodes_[cover.node] =
                PatchTable::kLeafBit | static_cast<Index>(table_.leaves_.size());
            table_.leaves_.push_back(cover.leaf);
        }
        for (const Covered& cover : covered_) {
            if (cells_[cover.cell] == Cover::Open)
                cells_[cover.cell] = Cover::Covered;
        }
        const auto [it, is_new] =
            class_index_.try_emplace(c, static_cast<Index>(table_.classes_.size()));
        if (is_new)
            table_.classes_.push_back(c);
        table_.patches_.push_back({it->second, static_cast<Index>(table_.points_.size()),
                                   static_cast<std::uint8_t>(level_)});
        for (const PointTerms& terms : net_)
            table_.points_.push_back(control_point(terms));
    }

    /// Even degrees: a vertex' cell at level 0 may be a hole in part.
    bool is_hole_quarter(Index node) const {
        return level_ == 0 && !table_.has_surface(table_.base_.face[node]);
    }

    // ------------------------------------------------------------------ points

    /// The number of a control point; place_points() turns it into the place of the point.
    Index control_point(const PointTerms& terms) {
        if (terms.size() == 1 && terms[0].second == 1) {
            Index& p = point_of_[terms[0].first];
            if (p == kInvalidIndex) {
                p = static_cast<Index>(used_.size());
                used_.push_back({level_, terms});
            }
            return p;
        }
        const auto [it, is_new] =
            mirrored_.try_emplace(terms, static_cast<Index>(used_.size()));
        if (is_new)
            used_.push_back({level_, terms});
        return it->second;
    }

    void place_points() {
        std::vector<std::vector<bool>> wanted;
        for (int l = 0; l < refinement_.n_levels(); ++l)
            wanted.emplace_back(refinement_.topology(l).n_vertices(), false);
        for (const Used& used : used_) {
            for (const auto& [vertex, weight] : used.terms)
                wanted[used.level][vertex] = true;
        }
        Refinement::Chain chain = refinement_.chain(std::move(wanted));
        std::vector<Index> place(used_.size());
        for (std::size_t i = 0; i < used_.size(); ++i) {
            const auto& places = chain.place[used_[i].level];
            const PointTerms& terms = used_[i].terms;
            if (terms.size() == 1 && terms[0].second == 1) {
                place[i] = places[terms[0].first];
                continue;
            }
            place[i] = refinement_.n_base_points() + chain.rows.n_rows();
            for (const auto& [vertex, weight] : terms)
                chain.rows.add(places[vertex], weight);
            chain.rows.end_row();
        }
        for (Index& p : table_.points_)
            p = place[p];
        table_.refined_points_ = std::move(chain.rows);
    }

    int degree_;
    PatchFamily family_;
    int levels_;
    bool uniform_;
    GregoryOptions gregory_;
    int isolation_;
    bool isolate_corners_;
    Refinement refinement_;
    PatchTable table_;
    std::map<PatchClass, Index> class_index_;

    int level_ = 0;
    std::optional<ControlMesh> mesh_;
    std::vector<Cover> cells_;              // per cell of this level
    std::vector<Index> node_;               // per cell of this level, from level 1 on
    std::vector<Index> point_of_;           // per vertex of this level: its number
    std::map<PointTerms, Index> mirrored_;  // of this level: their numbers
    struct Used {
        int level;
        PointTerms terms;
    };
    std::vector<Used> used_;  // control points by their numbers

    std::vector<Index> corners_;       // of an EF patch
    std::vector<ControlGrid> grids_;   // sectors of a patch
    std::vector<ControlGrid> strips_;  // of an EF patch, beyond its sides
    std::vector<PointTerms> net_;
    std::vector<Covered> covered_;
};

Result<PatchTable> build_patch_table(Topology base, Features features,
                                     const PatchTableOptions& options) {
    if (options.degree < kMinDegree || options.degree > kMaxDegree) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("degree {} is not in {}..{}", options.degree, kMinDegree,
                                kMaxDegree));
    }
    if (options.family == PatchFamily::Gregory && options.degree != 3) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("Gregory patches have degree 3, not {}", options.degree));
    }
    if (options.levels < 0 || options.levels > 10) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("{} levels are not in 0..10", options.levels));
    }
    if (options.isolation < 0 || options.isolation > 16) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("isolation {} is not in 0..16", options.isolation));
    }
    return PatchTableBuilder(std::move(base), std::move(features), options).build();
}

}  // namespace osdx
