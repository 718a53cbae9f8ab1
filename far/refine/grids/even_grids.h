// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/features.h>
#include <osdx/topology.h>
#include <osdx/types.h>

#include "far/refine/refinement.h"

namespace osdx::inline OSDX_ABI {

/// Uniform subdivision of even degree on grids: the surface of Refinement, at the speed of
/// memory and without its tables. The counterpart of OddGrids; all borders and
/// infinitely sharp features, but no semi-sharp ones.
///
/// The vertices of a level are the cells of size x size grids, size = 2^(levels - 1), one grid
/// for each quarter of a base face (halfedge h, as in osdx/address.h): cell (i, j) of it lies at
/// ((i + 1/2)/size, (j + 1/2)/size). Infinitely sharp edges are cut, and along all borders run
/// the points of their curves, size for each half of an edge.
///
/// Numbers, with s = size, H halfedges and B border halfedges of base(), in ascending order:
///   vertices  s^2 h + s j + i, cell (i, j) of quarter h;
///             s^2 H + 2 s b + t, on border b, from the start of its edge to the middle;
///             s^2 H + 2 s b + s + t, from the end to the middle;
///             s^2 H + 2 s B + p, where the surface is pinned to the end of border curves
///   faces     (s-1)^2 quads inside each quarter, row by row; s-1 quads on each quarter's side
///             x = 1 and s-1 on its side y = 0, from the corner of the base face outwards; s-1
///             on the second half of each border; one polygon in the middle of each base face,
///             one quad in that of each base edge, one polygon around each base vertex with faces
///
/// Const after construction; points() and faces() take all threads of the caller's arena, and
/// no result depends on their number.
class EvenGrids {
public:
    /// Nothing semi-sharp.
    static bool takes(const Features& features);

    /// \pre degree is even and in kMinDegree .. kMaxDegree; check_refinement(); takes();
    ///      n_levels >= 1; the last level has fewer than kInvalidIndex halfedges
    EvenGrids(Topology base, int degree, int n_levels, const Features& features = {});

    int degree() const noexcept { return degree_; }
    int n_levels() const noexcept { return n_levels_; }
    Index n_base_points() const noexcept { return n_base_points_; }
    /// The base mesh, cut along infinitely sharp edges.
    const Topology& base() const noexcept { return base_; }
    Index size() const noexcept { return size_; }

    Index n_vertices() const noexcept {
        return first_curve(size_) + 2 * size_ * n_borders() +
               static_cast<Index>(pinned_.size());
    }
    Index n_quads() const noexcept {
        const Index m = size_ - 1;
        return m * ((m + 2) * base_.n_halfedges() + n_borders());
    }
    Index n_faces() const noexcept { return n_quads() + n_polygons_; }
    Index n_halfedges() const noexcept { return 4 * n_quads() + n_polygon_corners_; }
    /// Edges with one face.
    Index n_border_edges() const noexcept {
        return 2 * size_ * n_borders() + static_cast<Index>(pinned_.size());
    }

    /// Those of the last level: its borders, which is what was sharp, have none by number.
    Features features() const;
    std::vector<Tag> tags() const { return to_tags(base_, features()); }

    /// The cell (i, j) of a quarter.
    Index cell(Index quarter, Index i, Index j) const noexcept {
        return size_ * (size_ * quarter + j) + i;
    }

    /// The faces as MeshData holds them.
    /// \pre sizes.size() == n_faces(); vertices.size() == n_halfedges()
    void faces(std::span<Index> sizes, std::span<Index> vertices) const;

    /// The points of the last level. V is Vec2 or Vec3 of float or double. While it runs
    /// it holds as many points again, a quarter of them at degree 2.
    /// \pre base.size() == n_base_points(); out.size() == n_vertices(); no overlap
    template <class V>
    void points(std::span<const V> base, std::span<V> out) const;

private:
    template <class T, int C>
    class Level;
    template <class T, int C, bool kRefines>
    class Step;

    Index n_borders() const noexcept { return static_cast<Index>(borders_.size()); }
    Index first_curve(Index size) const noexcept {
        return size * size * base_.n_halfedges();
    }
    bool is_used(Index v) const noexcept {
        return base_.vertex_halfedge[v] != kInvalidIndex;
    }
    /// The numbers of the border that starts at a border vertex and of the one that ends there.
    Index border_out(Index v) const noexcept {
        return border_number_[base_.vertex_halfedge[v]];
    }
    Index border_in(Index v) const noexcept { return border_before_[border_out(v)]; }

    int degree_, n_levels_;
    BoundaryRule boundary_;
    CreaseMethod creases_;
    Index size_ = 1, n_base_points_, n_polygons_ = 0, n_polygon_corners_ = 0;
    Topology base_;
    std::vector<Index> base_vertices_;  ///< by vertex of base(): that of the mesh
    std::vector<PointKind> kinds_;      ///< by vertex of base()
    std::vector<Index> borders_;        ///< halfedges
    std::vector<Index> border_number_;  ///< by halfedge
    std::vector<Index> border_before_;  ///< the one that ends where a border starts
    std::vector<Index> pinned_;  ///< vertices of base() with a pinned vertex beyond
    std::vector<Index> pinned_number_;  ///< by vertex of base()
};

}  // namespace osdx::inline OSDX_ABI
