// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/address.h>
#include <osdx/buffer.h>
#include <osdx/patch_class.h>
#include <osdx/resolved_features.h>
#include <osdx/stencil_table.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

/// One patch, as a view into the table that owns it.
struct PatchRef {
    Index patch_class;  ///< index into PatchTable::classes()
    int level;          ///< of refinement; 0: its control points are base vertices, and
                        ///< mirror images of such at a border
    std::span<const Index> points;  ///< control points in the order of PatchClass
};

/// A point of a patch, and how the (u, v) of its base face run there.
///
/// Regular: (a, b) is (s, t) of [0,1]^2 and sector is 0. EV and EF: (a, b) of [0,1]^2 are the
/// bilinear coordinates of the sector's quad in the regular n-gon: centre (0,0), middle of
/// side i (1,0), corner i (1,1), middle of side i+1 (0,1).
/// d(a, b)/d(u, v) is `scale` times the rotation by `quarter_turns` times 90 degrees.
struct PatchPoint {
    Index patch = kInvalidIndex;
    Index sector = 0;
    double a = 0, b = 0;
    int quarter_turns = 0;
    double scale = 1;
};

/// Some points of one leaf: a PatchPoint each, of the same patch, sector, turns and scale.
struct PatchPlaces {
    Index patch = kInvalidIndex;
    Index sector = 0;
    int quarter_turns = 0;
    double scale = 1;
    std::span<const double> a, b;

    PatchPoint operator[](std::size_t i) const noexcept {
        return {patch, sector, a[i], b[i], quarter_turns, scale};
    }
};

/// A square of a quarter that lies in one patch: a leaf of the quarter's quadtree.
struct Cell {
    Index quarter;
    Index patch;
    Vec2<double> origin;  ///< of the cell's frame, in the quarter
    Vec2<double> x_axis;  ///< its first side; the second is this, turned by 90 degrees
    /// The same square in the chart of the patch, whose unit is half an edge of the control
    /// mesh (PatchClass::extent): the frame's origin, and its first side by length and turns.
    Index sector;
    Vec2<int> chart_origin;
    int chart_size, chart_turns;
};

/// Where a leaf of a quadtree lies in the chart of its patch.
struct PatchLeaf {
    Index patch;
    Index sector;
    std::int8_t x, y;   ///< origin of the leaf's frame, in half-edges of the control mesh
    std::uint8_t size;  ///< of the leaf, in half-edges: 1 or 2
    std::uint8_t turns;  ///< quarter turns of the leaf's frame
    bool operator==(const PatchLeaf&) const = default;
};

struct PatchRecord {
    Index class_and_level;  ///< the level in the lowest 8 bits
    Index first_point;      ///< of its control points, among those of all patches
    Index patch_class() const noexcept { return class_and_level >> 8; }
    int level() const noexcept { return static_cast<int>(class_and_level & 255); }
    bool operator==(const PatchRecord&) const = default;
};

struct PatchTableView;

/// The patches of a mesh, in flat arrays: topology and stencils, no positions.
///
/// Each base face is cut into quarters, each quarter is the root of a quadtree whose leaves
/// are cells of patches. So every point of a face lies in one patch, and patches of any
/// levels may meet.
///
/// A point index below n_base_points() is a vertex of the base mesh; the others are points
/// of refined meshes, or their mirror images beyond a border: fixed affine combinations
/// (stencils) of the points before them.
///
/// Threads: const members may run at the same time.
class OSDX_API PatchTable {
public:
    bool operator==(const PatchTable&) const = default;

    Index n_base_points() const noexcept { return n_base_points_; }
    Index n_points() const noexcept { return n_base_points_ + refined_points_.n_rows(); }
    Index n_patches() const noexcept { return static_cast<Index>(patches_.size()); }
    int n_levels() const noexcept { return n_levels_; }  ///< with level 0, the base
    int degree() const noexcept { return degree_; }
    const Topology& base() const noexcept { return base_; }
    /// Of the base mesh: borders and infinitely sharp edges have
    /// kInfinitelySharp, faces without surface are holes.
    const ResolvedFeatures& features() const noexcept { return features_; }
    bool has_surface(Index face) const noexcept { return !features_.is_hole(face); }
    /// Whether there is a point of the surface: what locate() asks for.
    bool has_point(const Address& at) const noexcept {
        return at.face < base_.n_faces() && has_surface(at.face) && at.u == at.u &&
               at.v == at.v;
    }
    std::span<const PatchClass> classes() const noexcept { return classes_; }
    PatchRef patch(Index i) const noexcept {
        // Control points follow one another in the order of the patches.
        const PatchRecord& r = patches_[i];
        const std::size_t end =
            i + 1 < n_patches() ? patches_[i + 1].first_point : points_.size();
        return {r.patch_class(),
                r.level(),
                {points_.data() + r.first_point, points_.data() + end}};
    }
    const PatchClass& class_of(Index patch) const noexcept {
        return classes_[patches_[patch].patch_class()];
    }
    /// Stencils of the points from n_base_points() on, each over the points before it.
    const StencilTable& refined_points() const noexcept { return refined_points_; }

    /// Where groups of these begin, and the end: rows of a group read none of their own group,
    /// so that they may be formed at the same time.
    std::span<const Index> row_groups() const noexcept { return row_groups_; }

    /// The first n_base_points() of `points` are the base positions; fills the others, on all
    /// threads. T: float or double.
    /// \pre points.size() == n_points()
    template <class T>
    void refresh_points(std::span<Vec3<T>> points) const {
        refresh_channels(3, std::span(&points.data()->x, 3 * points.size()));
    }
    /// The same for values of any number of channels, stored one point after the other.
    /// \pre values.size() == n_points() n_channels
    template <class T>
    void refresh_channels(int n_channels, std::span<T> values) const;
    /// The same for some of the points alone, with the same result to the last bit.
    /// \param which  in ascending order, from n_base_points() on
    template <class T>
    void refresh_channels(int n_channels, std::span<T> values,
                          std::span<const Index> which) const noexcept {
        for (const Index p : which) {
            const Index row = p - n_base_points_;
            refined_points_.extend(n_base_points_, n_channels, values, row, row + 1);
        }
    }

    /// The patch under a point; addresses out of range are clamped (see to_quarter).
    /// \pre has_point(address)
    PatchPoint locate(const Address& address) const noexcept;
    /// Where several cells meet, \p towards points into the one that is meant.
    PatchPoint locate(const QuarterPoint& point,
                      Vec2<double> towards = {-1, -1}) const noexcept;

    /// The square patch that covers a quad alone, its domain in the frame of the quad;
    /// kInvalidIndex where there is none.
    Index whole_patch(Index face) const noexcept;

    /// Every leaf with its place in its quarter.
    std::vector<Cell> cells() const;
    /// Appends those of one quarter, in the order of its quadtree: squares that make up a larger
    /// one follow one another. None in faces without surface.
    void add_cells(Index quarter, std::vector<Cell>& cells) const;

    /// The arrays themselves, for back ends: <osdx/patch_table_view.h>.
    PatchTableView view() const noexcept;

private:
    friend class PatchTableBuilder;

    int degree_ = 3;
    int n_levels_ = 0;
    Index n_base_points_ = 0;
    Topology base_;
    ResolvedFeatures features_;
    StencilTable refined_points_;
    std::vector<Index> row_groups_;
    std::vector<PatchClass> classes_;
    Buffer<PatchRecord> patches_;
    Buffer<Index> points_;  // of all patches, from first_point on
    std::vector<PatchLeaf> leaves_;
    Buffer<Index> nodes_;  // roots first: one per quarter
};

}  // namespace osdx::inline OSDX_ABI
