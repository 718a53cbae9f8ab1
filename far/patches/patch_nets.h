// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/build_patch_table.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

#include "far/patches/control_mesh.h"

/// The patches that could be laid on one level of refinement. PatchTableBuilder decides which
/// of them are, and numbers them.
namespace osdx::inline OSDX_ABI::detail {

/// A cell is the piece of surface of one quad of the control mesh (odd degrees, centred at a
/// face) or one 4-valent vertex (even degrees, centred at the vertex).
enum class Cover : std::uint8_t {
    Open,     ///< waits for a patch
    Covered,  ///< has a patch, or is no part of this level's work
    Hole,     ///< has no surface; patches may reach into it
};

/// A level before the patches are laid.
struct PatchLevel {
    const RefinedLevel& level;
    const ControlMesh& mesh;
    int index;  ///< 0: the base
    const PatchTableOptions& options;
    std::span<const Cover> cells;
    std::span<const Index> nodes;  ///< of the cells in the quadtrees, from level 1 on

    const Topology& topology() const noexcept { return level.topology; }
    bool odd() const noexcept { return options.degree % 2 == 1; }
    Index cell_of(Index h) const noexcept {
        return odd() ? topology().face(h) : topology().vertex[h];
    }
    /// Even degrees: corner 0 of a vertex' cell is the face of this halfedge.
    Index frame_halfedge(Index vertex) const noexcept {
        return index == 0 ? topology().vertex_halfedge[vertex]
                          : level.even->corner_halfedges[vertex];
    }
    /// Where the frame of a regular patch starts, for ControlGrid::walk_around().
    Index regular_start(Index cell) const noexcept;
};

/// A square of a quadtree that a patch covers.
struct CoveredCell {
    Index cell;  ///< face or vertex of the control mesh
    Index node;  ///< at level 0 the quarter
    PatchLeaf leaf;
};

/// Patches in flat arrays, in the order in which they were made.
struct PatchBatch {
    /// Marks a point that is a row of `mirrored`, not a vertex.
    static constexpr Index kMirrored = Index(1) << 31;

    struct Patch {
        PatchClass patch_class;
        std::size_t first_point, first_covered;
    };
    std::vector<Patch> patches;
    std::vector<Index> points;
    StencilTable mirrored;
    std::vector<CoveredCell> covered;

    std::span<const Index> points_of(std::size_t i) const noexcept {
        return range(points, i, &Patch::first_point);
    }
    std::span<const CoveredCell> covered_by(std::size_t i) const noexcept {
        return range(covered, i, &Patch::first_covered);
    }

private:
    template <class T>
    std::span<const T> range(const std::vector<T>& all, std::size_t i,
                             std::size_t Patch::*first) const noexcept {
        const std::size_t end =
            i + 1 < patches.size() ? patches[i + 1].*first : all.size();
        return std::span(all).subspan(patches[i].*first, end - patches[i].*first);
    }
};

/// Makes patches and adds them to a batch, as far as the neighbourhood allows them.
/// Threads: one object for each; they share the level.
class PatchNets {
public:
    PatchNets(const PatchLevel& level, PatchBatch& batch)
        : level_(level), batch_(batch), degree_(level.options.degree) {}

    void add_vertex_patch(const IrregularFan& fan);
    void add_face_patch(Index face);
    /// Beside borders and sharp edges; ControlMesh::inner_net() makes the others.
    /// \return whether there is one
    bool add_regular_patch(Index cell);
    void add_gregory_patch(Index face);

private:
    const Topology& topology() const noexcept { return level_.topology(); }

    void begin(const PatchClass& c);
    void drop();
    bool set_point(int i, const ControlGrid& grid, int x, int y);
    void set_terms(int i, const PointTerms& terms);

    void cover(Index cell, Index node, const PatchLeaf& leaf) {
        batch_.covered.push_back({cell, node, leaf});
    }
    void cover_sector(const PatchClass& c, int sector);
    void cover_quarters(const PatchClass& c, int sector);
    void cover_cells(const PatchClass& c, int sector);

    const PatchLevel& level_;
    PatchBatch& batch_;
    int degree_;
    std::vector<Index> corners_;       // of an EF patch
    std::vector<ControlGrid> grids_;   // sectors of a patch
    std::vector<ControlGrid> strips_;  // of an EF patch, beyond its sides
    PointTerms terms_;
};

}  // namespace osdx::inline OSDX_ABI::detail
