// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <span>
#include <vector>

#include <osdx/address.h>
#include <osdx/features.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>
#include <osdx/types.h>

#include "far/refine/grids/grid_rules.h"
#include "far/refine/grids/quad_grids.h"

namespace osdx::inline OSDX_ABI {

/// Uniform subdivision of odd degree on grids: the surface of Refinement, at the speed of
/// memory and without its tables.
///
/// The faces of the base mesh, or where they are not all quads those of its first level, are
/// the roots of grids. Sharp features, borders and extraordinary vertices lie on edges and
/// vertices of the roots, so that the inside of every grid is refined row by row as a uniform
/// B-spline; edges and vertices follow from the grids beside them, each computed once.
///
/// Const after construction; points() takes all threads of the caller's arena, and no result
/// depends on their number.
class OddGrids {
public:
    /// \pre degree is odd and in kMinDegree .. kMaxDegree; n_levels >= 0; the last level has
    ///      fewer than kInvalidIndex halfedges
    OddGrids(Topology base, int degree, int n_levels, const Features& features = {});

    int degree() const noexcept { return degree_; }
    int n_levels() const noexcept { return n_levels_; }
    Index n_base_points() const noexcept { return base().n_vertices(); }

    /// The connectivity of the last level, and the numbers of its elements: a view of this.
    QuadGrids grids() const noexcept { return {roots_, size_}; }
    Index n_vertices() const noexcept { return grids().n_vertices(); }
    Index n_faces() const noexcept { return grids().n_faces(); }
    Index n_halfedges() const noexcept { return grids().n_halfedges(); }
    Index n_border_edges() const;  ///< edges with one face

    /// The features of the last level by those numbers; the border is infinitely sharp.
    ResolvedFeatures features() const;
    std::vector<Tag> tags() const;  ///< to_tags() of the last level

    /// The faces as MeshData holds them.
    /// \pre sizes.size() == n_faces(); vertices.size() == n_halfedges()
    void faces(std::span<Index> sizes, std::span<Index> vertices) const;

    /// The face of the base mesh in which each face lies.
    /// \pre parents.size() == n_faces()
    void parents(std::span<Index> parents) const;

    /// Point (x size, y size) of a root on the base mesh; 0 <= x, y <= 1.
    /// \pre n_levels() > 0 or the base mesh is of quads
    Address address(Index root, double x, double y) const noexcept;

    /// The number of a halfedge that Refinement gives to it on this level.
    Index from_split(Index halfedge) const noexcept {
        return grids().from_split(halfedge);
    }

    /// The points of the last level by those numbers. V is Vec2 or Vec3 of float or
    /// double. While it runs it holds the points of the level above as well, for degrees from
    /// 5 on as many points again as those of the last.
    /// \pre base.size() == n_base_points(); out.size() == n_vertices(); no overlap
    template <class V>
    void points(std::span<const V> base, std::span<V> out) const;

private:
    const Topology& base() const noexcept { return polygons_ ? *polygons_ : roots_; }

    int degree_, n_levels_;
    std::optional<Topology> polygons_;  ///< the base mesh where it is not the roots
    Topology roots_;
    Index size_ = 1;
    std::vector<detail::GridRules> rules_;  ///< of each step
    detail::GridRules rules_after_polygons_;
    ResolvedFeatures features_;        ///< without sharpness; holes by root
    detail::GridSharpness sharpness_;  ///< of the last level
};

}  // namespace osdx::inline OSDX_ABI
