// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>

#include <osdx/address.h>
#include <osdx/channels.h>
#include <osdx/dependents.h>
#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/patch_options.h>
#include <osdx/result.h>
#include <osdx/surface_jet.h>
#include <osdx/tessellation.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

class Evaluator;
class PatchTable;
struct ResolvedFeatures;
struct Topology;

/// A smooth surface over a polygon mesh, closed or open, with creases, corners and holes:
/// regular B-spline patches, and one multisided patch over each extraordinary region.
///
/// Build it once per connectivity; set_positions() moves the same mesh. All of it is linear
/// in the positions.
///
/// Units: those of the mesh. Threads: const members may run at the same time.
class OSDX_API Surface {
public:
    /// \return InvalidOption, or what build_topology, build_features and check_surface
    ///         return.
    static Result<Surface> build(const MeshData& mesh,
                                 const PatchTableOptions& options = {},
                                 const FeatureOptions& tags = {});

    /// From arrays of others, which are not kept.
    /// \param positions  three channels of mesh.n_vertices vertices
    /// \return besides, SizeMismatch for another number of channels, NonFinitePoint, and what
    ///         build_features() returns for a view
    static Result<Surface> build(const MeshView& mesh, Channels<const float> positions,
                                 const PatchTableOptions& options = {});
    static Result<Surface> build(const MeshView& mesh, Channels<const double> positions,
                                 const PatchTableOptions& options = {});

    Surface(Surface&&) noexcept;
    Surface& operator=(Surface&&) noexcept;
    ~Surface();

    const Topology& base() const noexcept;
    /// Borders, creases, corners and holes; see PatchTable::features().
    const ResolvedFeatures& features() const noexcept;
    const PatchTable& patches() const noexcept;
    const Evaluator& evaluator() const noexcept;
    /// The points of patches(): control points of all patches and what they are made from;
    /// the base vertices come first.
    std::span<const Vec3<double>> points() const noexcept;
    /// Vertices that no face uses, in ascending order: kept, without influence.
    std::span<const Index> unused_vertices() const noexcept;

    /// New positions for the same mesh.
    /// \return SizeMismatch or NonFinitePoint; then nothing has changed.
    Status set_positions(std::span<const Vec3<double>> positions);
    /// The same from an array of others: three channels of base().n_vertices() vertices.
    Status set_positions(Channels<const float> positions);
    Status set_positions(Channels<const double> positions);

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
                                Chart chart = Chart::BaseUV) const noexcept;

    /// Adds `scale` times the weights of the base vertices for derivative r of the surface
    /// (0: position, then du, dv, duu, duv, dvv) to `weights`: what the surface at this
    /// point does when a vertex moves. Allocates.
    /// \pre weights.size() == base().n_vertices()
    void add_base_weights(const Address& where, int r, double scale,
                          std::span<double> weights) const;

    /// \pre rate >= 1
    Tessellation tessellate(int rate) const;

private:
    struct Impl;
    explicit Surface(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

}  // namespace osdx::inline OSDX_ABI
