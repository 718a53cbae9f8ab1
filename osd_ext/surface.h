// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include <osdx/buffer.h>
#include <osdx/build_patch_table.h>
#include <osdx/dependents.h>
#include <osdx/evaluator.h>
#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/resolved_features.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

namespace osdx {

/// A smooth surface over a polygon mesh, closed or open, with creases, corners and holes:
/// regular B-spline patches, and one multisided patch over each extraordinary region.
///
/// Build it once per connectivity; set_positions() moves the same mesh. All of it is linear
/// in the positions.
///
/// Units: those of the mesh. Threads: const members may run at the same time.
class Surface {
public:
    /// \return InvalidOption, or what build_topology, build_features and check_surface
    ///         return.
    static Result<Surface> build(const MeshData& mesh,
                                 const PatchTableOptions& options = {},
                                 const FeatureOptions& tags = {});

    const Topology& base() const noexcept { return table_->base(); }
    /// Borders, creases, corners and holes; see PatchTable::features().
    const ResolvedFeatures& features() const noexcept { return table_->features(); }
    const PatchTable& patches() const noexcept { return *table_; }
    const Evaluator& evaluator() const noexcept { return *evaluator_; }
    /// The points of patches(): control points of all patches and what they are made from;
    /// the base vertices come first.
    std::span<const Vec3<double>> points() const noexcept { return points_; }
    /// Vertices that no face uses, in ascending order: kept, without influence.
    std::span<const Index> unused_vertices() const noexcept { return unused_vertices_; }

    /// New positions for the same mesh.
    /// \return SizeMismatch or NonFinitePoint; then nothing has changed.
    Status set_positions(std::span<const Vec3<double>> positions);

    /// New positions for some vertices, for the price of what depends on them. The result is
    /// that of set_positions() to the last bit. The first call makes the tables for it, in
    /// linear time; see Dependents.
    /// \return what has changed; SizeMismatch, IndexOutOfRange or NonFinitePoint, and then
    ///         nothing has
    Result<Change> move_vertices(std::span<const Index> vertices,
                                 std::span<const Vec3<double>> positions);

    /// Position and derivatives at a point of a base face.
    /// \pre where.face < base().n_faces()
    SurfaceJet<double> evaluate(const Address& where,
                                Chart chart = Chart::BaseUV) const noexcept {
        return evaluator_->evaluate<double>(points_, where, chart);
    }

    /// Adds `scale` times the weights of the base vertices for derivative r of the surface
    /// (0: position, then du, dv, duu, duv, dvv) to `weights`: what the surface at this
    /// point does when a vertex moves. Allocates.
    /// \pre weights.size() == base().n_vertices()
    void add_base_weights(const Address& where, int r, double scale,
                          std::span<double> weights) const;

    /// The surface as a function, with all derivatives. Chart::Native gives normals and
    /// curvature also where (u, v) is singular, at smooth border vertices of one face.
    /// \pre the surface outlives it, unmoved
    SurfaceFunction function(Chart chart = Chart::BaseUV) const;

    /// \pre rate >= 1
    Tessellation tessellate(int rate) const;

private:
    Surface() = default;

    std::unique_ptr<const PatchTable> table_;  // stays put: the evaluator refers to it
    std::unique_ptr<const Evaluator> evaluator_;
    std::unique_ptr<const Dependents> dependents_;  // from the first use on
    Buffer<Vec3<double>> points_;
    std::vector<Index> unused_vertices_;
};

}  // namespace osdx
