// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <osdx/build_patch_table.h>
#include <osdx/patch_table.h>
#include <osdx/patch_table_view.h>

#include "far/mesh/topology_edits.h"
#include "far/parallel.h"
#include "far/patches/control_mesh.h"
#include "far/patches/isolation_bound.h"
#include "far/patches/patch_nets.h"
#include "far/refine/refinement.h"
#include "far/refine/stencil_rows.h"

namespace osdx::inline OSDX_ABI {

using detail::ControlMesh;
using detail::Cover;
using detail::CoveredCell;
using detail::Fan;
using detail::PatchBatch;
using detail::PatchLevel;
using detail::PatchNets;
using detail::Regularity;

/// Walks the levels of refinement and lays patches on each: those that PatchNets makes, as far
/// as they do not overlap. The nets are made on all threads, their numbers follow the order of
/// vertices and faces.
class PatchTableBuilder {
public:
    PatchTableBuilder(Topology base, Features features, const PatchTableOptions& options,
                      const detail::IsolationBound& bound)
        : options_(options),
          bound_(bound),
          table_(begin_table(base, features, options.degree)),
          refinement_(std::move(base), options.degree, std::move(features)) {}

    Result<PatchTable> build() {
        begin_base_level();
        while (true) {
            lay_patches();
            detail::part_done(1 - 1.0 / (level_ + 2));  // nobody knows how many will come
            const void* open =
                cells_.empty() ? nullptr
                               : std::memchr(cells_.data(), static_cast<int>(Cover::Open),
                                             cells_.size());
            if (!open)
                break;
            if (!may_refine())
                return not_isolated(
                    static_cast<Index>(static_cast<const Cover*>(open) - cells_.data()));
            refine();
        }
        place_points();
        table_.n_levels_ = refinement_.n_levels();
        if (odd()) {
            RefinedLevel base = refinement_.release(0);
            table_.base_ = std::move(base.topology);
            table_.features_ = std::move(base.features);
        }
        return std::move(table_);
    }

private:
    static PatchTable begin_table(const Topology& base, const Features& features,
                                  int degree) {
        PatchTable table;
        table.degree_ = degree;
        table.n_base_points_ = base.n_vertices();
        // Odd degrees: as they are in the refinement, from which they come in the end.
        if (degree % 2 == 0) {
            table.base_ = base;
            table.features_ = resolve(base, features);
        }
        return table;
    }

    /// Of the base mesh.
    const ResolvedFeatures& features() const {
        return odd() ? refinement_.level(0).features : table_.features_;
    }
    bool has_surface(Index face) const { return !features().is_hole(face); }
    const Topology& topology() const { return refinement_.topology(level_); }
    bool odd() const { return options_.degree % 2 == 1; }
    PatchLevel patch_level() const {
        return {refinement_.level(level_), *mesh_, level_, options_, cells_, node_};
    }

    // ------------------------------------------------------------------ levels

    void begin_base_level() {
        level_ = 0;
        detail::in_parallel(
            [&] { mesh_.emplace(refinement_.level(0), options_.degree, true); },
            [&] { begin_cells(); });
        wanted_.emplace_back();
        first_patch_.push_back(0);
    }

    void begin_cells() {
        const Topology& t = topology();
        // Cells of the base level have no node of their own but one root per quarter.
        const Topology& base = odd() ? t : table_.base_;
        table_.nodes_.resize(base.n_halfedges());
        if (!features().hole.empty()) {
            for (Index f = 0; f < base.n_faces(); ++f) {
                if (!has_surface(f))
                    std::fill_n(table_.nodes_.begin() + base.face_offsets[f],
                                base.face_size(f), kInvalidIndex);
            }
        }
        cells_.resize(odd() ? t.n_faces() : t.n_vertices());
        detail::for_each_index(cells_.size(), [&](Index cell) {
            bool open = odd() && has_surface(cell);
            if (!odd()) {
                t.for_each_outgoing(cell,
                                    [&](Index h) { open |= has_surface(t.face(h)); });
            }
            cells_[cell] = open ? Cover::Open : Cover::Hole;
        });
    }

    /// Open cells and what they need around them.
    Flags faces_to_refine() const {
        const Topology& t = topology();
        Flags faces(t.n_faces());
        detail::for_each_index(t.n_faces(), [&](Index f) {
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h)
                faces[f] |= cells_[odd() ? f : t.vertex[h]] == Cover::Open;
        });
        // Control nets on the next level reach d/2 of its edges beyond these cells, and what is
        // known ends (d-1)/2 edges inside of the part: so much is d/2 faces of this level. Nets
        // that begin in a hole reach d edges further; semi-sharp edges that end beside a gap
        // do not know of all that they meet there.
        const int reach = plain_ ? options_.degree / 2 : options_.degree;
        return grown(t, std::move(faces), reach + bound_.more_rings);
    }

    struct SemiSharp {
        std::size_t n = 0;
        double most = 0;
        void add(double s) {
            if (is_semi_sharp(s)) {
                ++n;
                most = std::max(most, s);
            }
        }
        void merge(const SemiSharp& other) {
            n += other.n;
            most = std::max(most, other.most);
        }
    };
    static SemiSharp semi_sharp(const std::vector<double>& sharpness) {
        return detail::sum_over<SemiSharp>(
            sharpness.size(), detail::kChunk,
            [&](std::size_t begin, std::size_t end, SemiSharp& sum) {
                for (std::size_t i = begin; i < end; ++i)
                    sum.add(sharpness[i]);
            });
    }
    /// What the base mesh has that decides how far to refine, and how much.
    void look_at_features() {
        const Features& f = features();
        semi_sharp_ = semi_sharp(f.edge_sharpness);
        plain_ =
            f.hole.empty() && semi_sharp_.n == 0 && semi_sharp(f.vertex_sharpness).n == 0;
    }

    /// As long as no more is open than may be.
    bool may_refine() {
        const bool uniform =
            options_.family == PatchFamily::Gregory && options_.gregory.uniform;
        const int first = uniform ? options_.gregory.levels : 0;
        if (level_ == 0)
            look_at_features();
        if (level_ == first)
            n_first_corners_ = n_open_corners();
        if (level_ < first)
            return true;
        const auto n_open = sum_of(
            cells_.size(), [&](Index cell) { return cells_[cell] == Cover::Open; });
        const std::size_t n_semi_sharp = level_ < semi_sharp_.most ? semi_sharp_.n : 0;
        return level_ < bound_.last_level &&
               double(n_open) <=
                   bound_.most_cells(level_, n_first_corners_, n_semi_sharp);
    }

    std::size_t n_open_corners() const {
        const Topology& t = topology();
        return sum_of(cells_.size(), [&](Index cell) -> std::size_t {
            if (cells_[cell] != Cover::Open)
                return 0;
            return odd() ? t.face_size(cell) : t.valence(cell);
        });
    }

    template <class Count>
    static std::size_t sum_of(std::size_t n, Count&& count) {
        std::atomic<std::size_t> sum = 0;
        detail::for_each_chunk(n, detail::kChunk,
                               [&](std::size_t, std::size_t begin, std::size_t end) {
                                   std::size_t part = 0;
                                   for (std::size_t i = begin; i < end; ++i)
                                       part += count(static_cast<Index>(i));
                                   sum += part;
                               });
        return sum;
    }

    /// Open cells go to the next level.
    void refine() {
        refinement_.add_level(faces_to_refine());
        const Topology& parent = refinement_.topology(level_);
        const RefinedLevel& child = refinement_.level(level_ + 1);
        const Index n_cells =
            odd() ? child.topology.n_faces() : child.topology.n_vertices();
        auto cells = detail::filled(n_cells, Cover::Covered);
        auto node = detail::filled(n_cells, kInvalidIndex);
        const auto for_each_corner_of = [&](Index cell, auto&& f) {
            if (!odd())
                return for_each_corner(parent, cell, f);
            for (Index h = parent.face_offsets[cell]; h < parent.face_offsets[cell + 1];
                 ++h)
                f(h);
        };
        // From level 1 on each open cell gets a node for each of its four corners.
        const auto has_children = [&](std::size_t cell) {
            return level_ > 0 && cells_[cell] == Cover::Open;
        };
        const std::size_t first_node = table_.nodes_.size();
        detail::for_each_numbered(
            cells_.size(), detail::kSmallChunk,
            [&](std::size_t begin, std::size_t end) {
                std::size_t n = 0;
                for (std::size_t cell = begin; cell < end; ++cell)
                    n += 4 * has_children(cell);
                return n;
            },
            [&](std::size_t n) { table_.nodes_.resize(first_node + n); },
            [&](std::size_t next, std::size_t begin, std::size_t end) {
                Index child_node = static_cast<Index>(first_node + next);
                for (auto cell = static_cast<Index>(begin); cell < end; ++cell) {
                    if (cells_[cell] == Cover::Covered)
                        continue;
                    if (has_children(cell)) {
                        std::fill_n(table_.nodes_.begin() + child_node, 4, kInvalidIndex);
                        table_.nodes_[node_[cell]] = child_node;
                    }
                    Index k = child_node;
                    for_each_corner_of(cell, [&](Index h) {
                        const Index c = child.children[h];
                        if (c != kInvalidIndex) {
                            const bool hole = level_ == 0 && !has_surface(parent.face(h));
                            cells[c] = hole ? Cover::Hole : cells_[cell];
                            node[c] = level_ == 0          ? h
                                      : has_children(cell) ? k
                                                           : kInvalidIndex;
                        }
                        ++k;
                    });
                    if (has_children(cell))
                        child_node += 4;
                }
            });
        cells_ = std::move(cells);
        node_ = std::move(node);
        ++level_;
        mesh_.emplace(child, options_.degree, false);
        first_patch_.push_back(table_.n_patches());
        wanted_.emplace_back(topology().n_vertices());
        mirrored_.forget();
    }

    /// Even degrees: the corners at a vertex, in the order of its cell's frame.
    template <class F>
    void for_each_corner(const Topology& t, Index vertex, F&& f) const {
        const Index first = patch_level().frame_halfedge(vertex);
        Index h = first;
        while (h != kInvalidIndex) {
            f(h);
            h = t.ccw(h);
            if (h == first)
                break;
        }
    }

    Error not_isolated(Index cell) const {
        // The quarter whose quadtree the cell is in: from parent to parent.
        const Topology& base = refinement_.topology(0);
        Index node = level_ > 0 ? node_[cell]
                     : odd()    ? base.face_offsets[cell]
                                : base.vertex_halfedge[cell];
        while (node >= base.n_halfedges()) {
            const auto parent = std::ranges::find_if(table_.nodes_, [&](Index first) {
                return first <= node && node < first + 4;
            });
            node = static_cast<Index>(parent - table_.nodes_.begin());
        }
        const Index face = base.face(node);
        return fail(
            ErrorCode::NotIsolated,
            fmt::format("the surroundings of face {} do not become regular", face), face);
    }

    // ------------------------------------------------------------------ patches

    void lay_patches() {
        if (options_.family == PatchFamily::Gregory) {
            if (!options_.gregory.uniform || level_ >= options_.gregory.levels)
                lay_regular_patches(mesh_->regular_cells());
            if (level_ >= options_.gregory.levels) {
                const std::vector<bool> ready = faces_for_gregory();
                add_patches(make_patches(ready.size(), [&](PatchNets& nets, Index face) {
                    if (ready[face])
                        nets.add_gregory_patch(face);
                }));
            }
            return;
        }
        const auto fans = mesh_->irregular_fans();
        const auto vertex_patches = make_patches(
            fans.size(),
            [&](PatchNets& nets, Index i) { nets.add_vertex_patch(fans[i]); });
        Buffer<Regularity> regular;
        detail::in_parallel([&] { add_patches(vertex_patches); },
                            [&] { regular = mesh_->regular_cells(); });
        if (mesh_->has_irregular_faces()) {
            add_patches(make_patches(
                topology().n_faces(),
                [&](PatchNets& nets, Index face) { nets.add_face_patch(face); }));
        }
        lay_regular_patches(regular);
    }

    /// On all threads.
    template <class Make>
    std::vector<PatchBatch> make_patches(std::size_t n, Make&& make) const {
        constexpr std::size_t kSize = 16;
        std::vector<PatchBatch> batches(detail::n_chunks(n, kSize));
        const PatchLevel level = patch_level();
        detail::for_each_chunk(
            n, kSize, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                PatchNets nets(level, batches[chunk]);
                for (std::size_t i = begin; i < end; ++i)
                    make(nets, static_cast<Index>(i));
            });
        return batches;
    }

    /// Those that fit, one after the other.
    void add_patches(const std::vector<PatchBatch>& batches) {
        for (const PatchBatch& batch : batches) {
            for (std::size_t i = 0; i < batch.patches.size(); ++i)
                add_patch(batch, i);
        }
    }

    /// These cover a cell each, so that all of them fit.
    /// \param regular  ControlMesh::regular_cells()
    void lay_regular_patches(const Buffer<Regularity>& regular) {
        const PatchLevel level = patch_level();
        constexpr std::size_t kSize = detail::kSmallChunk;
        const std::size_t n_cells = cells_.size(),
                          n_chunks = detail::n_chunks(n_cells, kSize);
        // Beside borders and sharp edges the nets of a chunk wait for their numbers.
        std::vector<PatchBatch> batches(n_chunks);
        std::vector<Index> first(n_chunks + 1);
        detail::for_each_chunk(
            n_cells, kSize, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                PatchNets nets(level, batches[chunk]);
                Index n = 0;
                for (auto cell = static_cast<Index>(begin); cell < end; ++cell) {
                    if (cells_[cell] == Cover::Open)
                        n += regular[cell] == Regularity::Inside ||
                             (regular[cell] == Regularity::Beside && mesh_->has_cuts() &&
                              nets.add_regular_patch(cell));
                }
                first[chunk + 1] = n;
            });
        const Index first_patch = table_.n_patches();
        const std::size_t first_point = table_.points_.size();
        const PatchClass c{PatchKind::Regular, options_.degree, 4};
        const auto n_points = static_cast<std::size_t>(c.n_points());
        for (std::size_t chunk = 0; chunk < n_chunks; ++chunk) {
            first[chunk + 1] += first[chunk];
            for (std::size_t i = 0;
                 i < batches[chunk].points.size() && batches[chunk].mirrored.n_rows() > 0;
                 ++i)
                batches[chunk].points[i] =
                    control_point(batches[chunk], batches[chunk].points[i]);
        }
        if (first.back() == 0)
            return;
        const Index number = class_index(c);
        table_.patches_.resize(first_patch + first.back());
        table_.points_.resize(first_point + n_points * first.back());
        std::vector<std::vector<Index>> mirrored(n_chunks);
        detail::for_each_chunk(
            n_cells, kSize, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                const PatchBatch& batch = batches[chunk];
                std::size_t next_in_batch = 0;
                Index patch = first_patch + first[chunk];
                std::size_t point = first_point + n_points * first[chunk];
                for (auto cell = static_cast<Index>(begin); cell < end; ++cell) {
                    if (cells_[cell] != Cover::Open)
                        continue;
                    const std::span<Index> net(table_.points_.data() + point, n_points);
                    if (regular[cell] == Regularity::Inside) {
                        __builtin_prefetch(net.data() + 12 * n_points, 1);
                        mesh_->inner_net(level.regular_start(cell), net.data());
                    } else if (next_in_batch < batch.patches.size() &&
                               batch.covered[next_in_batch].cell == cell) {
                        std::ranges::copy(batch.points_of(next_in_batch++), net.begin());
                        if (has_mirrored(net))
                            mirrored[chunk].push_back(patch);
                    } else {
                        continue;
                    }
                    want(net);
                    table_.patches_[patch] = record(number, point);
                    cover_cell(cell, patch++);
                    point += n_points;
                }
            });
        for (const auto& patches : mirrored)
            mirrored_patches_.insert(mirrored_patches_.end(), patches.begin(),
                                     patches.end());
    }

    /// All of a cell by one square patch in its frame.
    void cover_cell(Index cell, Index patch) {
        const Topology& t = topology();
        const auto cover = [&](Index node, Index quarter) {
            table_.nodes_[node] = square_node(patch, quarter);
        };
        cells_[cell] = Cover::Covered;
        if (level_ > 0) {
            cover(node_[cell], 0);
        } else if (odd()) {
            for (Index k = 0; k < 4; ++k)
                cover(t.face_offsets[cell] + k, k);
        } else {
            Index k = 0;
            t.for_each_outgoing(cell, [&](Index h) {
                if (has_surface(t.face(h)))
                    cover(h, k);
                ++k;
            });
        }
    }

    static Index square_node(Index patch, Index quarter) {
        assert(patch <= PatchTableView::kPatchMask);
        return PatchTableView::kLeafBit | PatchTableView::kSquareBit |
               quarter << PatchTableView::kCornerShift | patch;
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
                    if (!ready[t.face(out)])
                        return;
                    ready[t.face(out)] = false;
                    waiting.push_back(t.face(out));
                });
            }
        }
        return ready;
    }

    /// Adds a patch, unless a part of it is covered already or nothing of it is open.
    void add_patch(const PatchBatch& batch, std::size_t i) {
        bool any_open = false;
        for (const CoveredCell& cover : batch.covered_by(i)) {
            if (cells_[cover.cell] == Cover::Covered)
                return;
            any_open |= cells_[cover.cell] == Cover::Open;
        }
        if (!any_open)
            return;
        const PatchClass& c = batch.patches[i].patch_class;
        const Index patch = table_.n_patches();
        for (const CoveredCell& cover : batch.covered_by(i)) {
            if (cells_[cover.cell] == Cover::Hole || is_hole_quarter(cover.node))
                continue;
            if (c.is_square()) {
                table_.nodes_[cover.node] =
                    square_node(patch, level_ == 0 ? cover.leaf.turns : 0);
                continue;
            }
            table_.nodes_[cover.node] =
                PatchTableView::kLeafBit | static_cast<Index>(table_.leaves_.size());
            table_.leaves_.push_back(cover.leaf);
            table_.leaves_.back().patch = patch;
        }
        for (const CoveredCell& cover : batch.covered_by(i)) {
            if (cells_[cover.cell] == Cover::Open)
                cells_[cover.cell] = Cover::Covered;
        }
        table_.patches_.push_back(record(class_index(c), table_.points_.size()));
        const std::size_t first_point = table_.points_.size();
        const auto points = batch.points_of(i);
        table_.points_.insert(table_.points_.end(), points.begin(), points.end());
        const auto net = std::span(table_.points_).subspan(first_point);
        if (has_mirrored(net)) {
            mirrored_patches_.push_back(patch);
            for (Index& p : net)
                p = control_point(batch, p);
        }
        want(net);
    }

    PatchRecord record(Index patch_class, std::size_t first_point) const {
        return {patch_class << 8 | static_cast<Index>(level_),
                static_cast<Index>(first_point)};
    }

    Index class_index(const PatchClass& c) {
        const auto [it, is_new] =
            class_index_.try_emplace(c, static_cast<Index>(table_.classes_.size()));
        if (is_new)
            table_.classes_.push_back(c);
        return it->second;
    }

    /// Even degrees: a vertex' cell at level 0 may be a hole in part.
    bool is_hole_quarter(Index node) const {
        return level_ == 0 && !has_surface(topology().face(node));
    }

    // ------------------------------------------------------------------ points

    /// What stands in the table until place_points(): a vertex of the patch's level, or the
    /// number of a mirror image, in the order of their first uses.
    Index control_point(const PatchBatch& batch, Index point) {
        if (!(point & PatchBatch::kMirrored))
            return point;
        const Index row =
            mirrored_.find_or_add(batch.mirrored, point & ~PatchBatch::kMirrored);
        mirrored_levels_.resize(mirrored_.rows().n_rows(), level_);
        return PatchBatch::kMirrored | row;
    }

    static bool has_mirrored(std::span<const Index> net) {
        return std::ranges::any_of(net,
                                   [](Index p) { return p & PatchBatch::kMirrored; });
    }

    /// Notes the points of a refined level that a patch reads.
    void want(std::span<const Index> net) {
        if (level_ == 0)
            return;
        for (const Index p : net) {
            if (!(p & PatchBatch::kMirrored))
                detail::set_flag(wanted_[level_][p]);
        }
    }

    void place_points() {
        first_patch_.push_back(table_.n_patches());
        const StencilTable& mirrored = mirrored_.rows();
        for (Index r = 0; r < mirrored.n_rows(); ++r) {
            const int l = mirrored_levels_[r];
            for (auto k = mirrored.offsets[r]; l > 0 && k < mirrored.offsets[r + 1]; ++k)
                wanted_[l][mirrored.indices[k]] = true;
        }
        Refinement::Chain chain = refinement_.chain(std::move(wanted_), mirrored_.rows());
        const Index first_mirrored = refinement_.n_base_points() + chain.rows.n_rows();
        const std::size_t first_entry = chain.rows.indices.size(),
                          first_offset = chain.rows.offsets.size();
        chain.rows.indices.resize(first_entry + mirrored.indices.size());
        chain.rows.weights.resize(first_entry + mirrored.indices.size());
        chain.rows.offsets.resize(first_offset + mirrored.n_rows());
        detail::for_each_index(mirrored.n_rows(), [&](Index r) {
            const auto& place = chain.place[mirrored_levels_[r]];
            for (auto k = mirrored.offsets[r]; k < mirrored.offsets[r + 1]; ++k) {
                chain.rows.indices[first_entry + k] = place[mirrored.indices[k]];
                chain.rows.weights[first_entry + k] = mirrored.weights[k];
            }
            chain.rows.offsets[first_offset + r] = first_entry + mirrored.offsets[r + 1];
        });
        const auto set_place = [&](Index& p, const Buffer<Index>& place) {
            p = p & PatchBatch::kMirrored ? first_mirrored + (p & ~PatchBatch::kMirrored)
                                          : place[p];
        };
        // Base vertices are in place, as long as the base is not cut.
        const bool in_place = refinement_.base_vertices().empty();
        for (const Index patch : mirrored_patches_) {
            if (!in_place || patch >= first_patch_[1])
                break;
            const std::size_t first = table_.patches_[patch].first_point,
                              n = table_.patch(patch).points.size();
            for (std::size_t i = first; i < first + n; ++i)
                set_place(table_.points_[i], chain.place[0]);
        }
        for (int l = in_place; l < refinement_.n_levels(); ++l)
            for_each_point_of(l, [&](Index& p) { set_place(p, chain.place[l]); });
        // Mirror images come last: they read points of all levels, but no mirror images.
        if (mirrored.n_rows() > 0)
            chain.groups.push_back(chain.rows.n_rows());
        table_.refined_points_ = std::move(chain.rows);
        table_.row_groups_ = std::move(chain.groups);
    }

    /// The control points of the patches of a level, on all threads.
    template <class F>
    void for_each_point_of(int level, F&& f) {
        const auto point_of = [&](Index patch) {
            return patch < table_.n_patches() ? table_.patches_[patch].first_point
                                              : table_.points_.size();
        };
        const std::size_t begin = point_of(first_patch_[level]),
                          end = point_of(first_patch_[level + 1]);
        detail::for_each_index(
            end - begin, [&](Index i) { f(table_.points_[begin + i]); }, 16384);
    }

    const PatchTableOptions& options_;
    const detail::IsolationBound bound_;
    PatchTable table_;
    Refinement refinement_;
    // As soon as something is open:
    bool plain_ = false;               // no holes and nothing semi-sharp
    SemiSharp semi_sharp_;             // edges
    std::size_t n_first_corners_ = 0;  // see IsolationBound
    std::map<PatchClass, Index> class_index_;

    int level_ = 0;
    std::optional<ControlMesh> mesh_;
    Buffer<Cover> cells_;             // per cell of this level
    Buffer<Index> node_;              // per cell of this level, from level 1 on
    std::vector<Flags> wanted_;       // per level and vertex: read by a patch
    std::vector<Index> first_patch_;  // per level
    detail::DistinctRows mirrored_;   // of all levels, over the vertices of their levels
    std::vector<int> mirrored_levels_;
    std::vector<Index> mirrored_patches_;  // those with mirror images among their points
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
    const int levels = options.gregory.levels, ends = options.multisided.crease_end_level;
    if (levels < 0 || levels > 10) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("{} levels are not in 0..10", levels));
    }
    if (ends < 0 || ends > 16) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("level {} of crease ends is not in 0..16", ends));
    }
    return detail::build_patch_table(std::move(base), std::move(features), options,
                                     detail::IsolationBound(options));
}

Result<PatchTable> detail::build_patch_table(Topology base, Features features,
                                             const PatchTableOptions& options,
                                             const IsolationBound& bound) {
    return PatchTableBuilder(std::move(base), std::move(features), options, bound)
        .build();
}

}  // namespace osdx::inline OSDX_ABI
