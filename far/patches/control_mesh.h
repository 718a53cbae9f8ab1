// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <utility>
#include <vector>

#include <osdx/patch_class.h>
#include <osdx/topology.h>

#include "far/refine/refinement.h"

/// A level of refinement as PatchTableBuilder sees it: regular grids of control points, with
/// mirror images beyond borders.
namespace osdx::inline OSDX_ABI::detail {

/// A control point as an affine combination of vertices of one level.
using PointTerms = std::vector<std::pair<Index, double>>;

/// The faces around a vertex between sharp edges, or all around it.
enum class Fan : std::uint8_t {
    Irregular,
    Inside,  ///< four faces all around
    Border,  ///< two faces at a border curve
    Corner,  ///< one face at a pinned vertex
};

/// An irregular fan over which one patch can be laid.
struct IrregularFan {
    Index start;  ///< the first of its halfedges counter-clockwise
    int n_faces;
    PatchBorder border;
    /// Where a crease ends and at spikes a patch is an approximation that is small only where
    /// the fan is.
    bool exact;
};

/// Whether the control points of a regular patch are there; what is lower rules what is beside.
enum class Regularity : std::uint8_t {
    None,    ///< something irregular is too close
    Beside,  ///< perhaps: a border or what is not known is near
    Inside,  ///< all, without mirror images
};

/// Fans and borders of a level. Sharp edges are borders of both sides.
class ControlMesh {
public:
    /// \pre the level outlives this
    ControlMesh(const RefinedLevel& level, int degree, bool is_base);

    const Topology& topology() const noexcept { return level_->topology; }
    const RefinedLevel& level() const noexcept { return *level_; }
    /// Borders run midway between points and their mirror images; Curve points lie on them.
    bool border_is_midway() const noexcept { return midway_; }

    bool is_cut(Index h) const noexcept;
    /// Of the fan that the face of h is in, at the vertex where h starts.
    Fan fan(Index h) const noexcept { return fans_[h]; }
    std::span<const IrregularFan> irregular_fans() const noexcept { return irregular_; }
    /// The point and all faces around are known, and no sharpness will end here.
    bool is_settled(Index vertex) const noexcept { return settled_[vertex]; }
    /// A quad without anything in its middle.
    bool is_quad(Index face) const noexcept;
    bool has_irregular_faces() const noexcept { return !all_quads_; }
    /// There are borders or sharp edges.
    bool has_cuts() const noexcept { return has_cuts_; }

    /// By face (odd degrees) or vertex (even degrees), of its patch.
    Buffer<Regularity> regular_cells() const;
    /// The control points of such a patch, row by row.
    /// \param h  of the cell: where the frame starts, as for ControlGrid::walk_around()
    /// \pre out has room for (d + 1)^2 vertices
    void inner_net(Index h, Index* out) const noexcept;

private:
    struct Fans;
    std::vector<std::uint8_t> special_vertices() const;
    Flags incomplete_vertices() const;
    void sort_fans(Index vertex, Fans& out);
    void sort_special_fans(Index vertex, std::uint8_t special, Fans& out);
    bool is_inside(Index vertex) const;
    template <bool kQuadsOnly>
    void inner_net_of(Index h, Index* out) const noexcept;
    void inner_net_of_cubic(Index h, Index* out) const noexcept;

    const RefinedLevel* level_;
    int degree_;
    bool odd_, is_base_, midway_;
    bool has_cuts_, all_quads_;
    Buffer<Fan> fans_;  // per halfedge
    Buffer<std::uint8_t> settled_;
    Flags
        incomplete_;  // vertices of faces with vertices that are no control points; or empty
    Buffer<Regularity> regular_;  // of the vertices for themselves
    std::vector<IrregularFan> irregular_;
};

/// A rectangle of quads of a control mesh: x along the halfedge where it starts, y to the left.
class ControlGrid {
public:
    /// What the first row or column is.
    enum class Begin : std::uint8_t {
        Outer,   ///< the outermost points of a control net: nothing is asked of them
        Inside,  ///< a spoke, with quads on the other side
        Border,
    };

    /// From the quad at `start` as far as \p wanted_x and \p wanted_y quads, or to a border.
    /// \return false if that is no grid of quads, or not all of it is known.
    bool walk(const ControlMesh& mesh, Index start, int wanted_x, int wanted_y,
              Begin begin_x, Begin begin_y);
    /// Around the quad at h, points x and y from `lo` to `hi` of its frame.
    bool walk_around(const ControlMesh& mesh, Index h, int lo, int hi);

    /// All vertices but the outermost have regular fans, and so has the border.
    /// \param but_first  nothing is asked of (0, 0)
    bool is_regular(const ControlMesh& mesh, bool but_first = false) const;

    int n_x() const noexcept { return n_[0]; }  ///< quads
    int n_y() const noexcept { return n_[1]; }
    bool ends_at_border(int axis) const noexcept { return end_[axis]; }
    Index halfedge(int x, int y) const noexcept { return halfedges_[x * n_[1] + y]; }
    Index vertex(int x, int y) const noexcept { return vertices_[x * (n_[1] + 1) + y]; }

    /// The control point (x, y), of walk_around() in its frame, where that is a vertex;
    /// kInvalidIndex where it is a mirror image or beyond the grid.
    Index point(int x, int y) const noexcept;
    /// The control point (x, y), of walk_around() in its frame: a vertex, or a mirror image.
    /// \return false if that would lie beyond the grid
    bool point(int x, int y, PointTerms& terms) const;
    /// The vertex (x, y), or a mirror image along its row: y counts vertices.
    bool row_point(int x, int y, PointTerms& terms) const;

private:
    using Line = std::vector<std::pair<int, double>>;
    bool is_vertex(int axis, int i) const noexcept;
    bool line_terms(int axis, int i, double weight, Line& terms) const;
    void combine(const Line& along_x, const Line& along_y, PointTerms& terms) const;
    bool fits(const ControlMesh& mesh, Index ahead, int axis, int at) const;
    bool extent(const ControlMesh& mesh, Index start, int axis, int wanted);

    int n_[2], origin_[2];
    bool end_[2];
    Begin begin_[2];
    bool midway_;
    std::vector<Index> halfedges_, vertices_;
};

}  // namespace osdx::inline OSDX_ABI::detail
