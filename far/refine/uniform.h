// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The last level of uniform subdivision of any degree: the surface of Refinement, as quickly
/// as it can be had. OddGrids and EvenGrids do the work, and Refinement what grids do not
/// take: semi-sharp features of even degrees, and their level 0.
///
/// Numbers are those of the grids; of Refinement they are its own, without the vertices of its
/// last level that no face uses, which are the points of creases between faces.
///
/// Const after construction; no result depends on the number of threads.
class UniformRefinement {
public:
    /// \pre kMinDegree <= degree <= kMaxDegree; check_refinement(); n_levels >= 0; the last
    ///      level has fewer than kInvalidIndex halfedges
    UniformRefinement(Topology base, int degree, int n_levels,
                      const Features& features = {});
    UniformRefinement(UniformRefinement&&) noexcept;
    UniformRefinement& operator=(UniformRefinement&&) noexcept;
    ~UniformRefinement();

    Index n_base_points() const;
    Index n_vertices() const;
    Index n_faces() const;
    Index n_halfedges() const;
    Index n_border_edges() const;  ///< edges with one face

    /// The faces as MeshData holds them.
    /// \pre sizes.size() == n_faces(); vertices.size() == n_halfedges()
    void faces(std::span<Index> sizes, std::span<Index> vertices) const;

    /// What is left of the features on the last level; see to_tags().
    std::vector<Tag> tags() const;

    /// The corner in faces() of a halfedge of the base mesh that was split() n_levels times.
    /// \pre the degree is odd
    Index corner_of_split(Index halfedge) const;

    /// The face of the base mesh in which each face lies.
    /// \pre parents.size() == n_faces(); the degree is odd
    void parents(std::span<Index> parents) const;

    /// The points of the last level. V is Vec2 or Vec3 of float or double.
    /// \pre base.size() == n_base_points(); out.size() == n_vertices(); no overlap
    template <class V>
    void points(std::span<const V> base, std::span<V> out) const;

private:
    struct Engine;
    std::unique_ptr<const Engine> engine_;
};

}  // namespace osdx::inline OSDX_ABI
