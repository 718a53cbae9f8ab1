// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>

#include <osdx/address.h>
#include <osdx/buffer.h>
#include <osdx/channels.h>
#include <osdx/dependents.h>
#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/patch_options.h>
#include <osdx/progress.h>
#include <osdx/result.h>
#include <osdx/surface_jet.h>
#include <osdx/tessellation.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

class Evaluator;
class PatchTable;
struct ResolvedFeatures;
struct TessellationRates;
struct Topology;

/// A smooth surface over a polygon mesh, closed or open, with creases, corners and holes:
/// regular B-spline patches, and one multisided patch over each extraordinary region.
///
/// Build it once per connectivity; set_positions() moves the same mesh. All of it is linear
/// in the positions.
///
/// A surface that was moved from has no vertices and no faces, until another is moved to it.
///
/// Units: those of the mesh, with coordinates up to 1e150, the largest at least 1e-150 or all zero.
/// Threads: const members may run at the same time.
class OSDX_API Surface {
public:
    /// \param progress  null, or to watch and cancel it: then Cancelled is returned
    /// \return InvalidOption, or what build_topology, build_features and check_surface
    ///         return.
    static Result<Surface> build(const MeshData& mesh,
                                 const PatchTableOptions& options = {},
                                 const FeatureOptions& tags = {},
                                 Progress* progress = nullptr);

    /// From arrays of others, which are not kept.
    /// \param positions  three channels of mesh.n_vertices vertices
    /// \return besides, SizeMismatch for another number of channels, NonFinitePoint, and what
    ///         build_features() returns for a view
    static Result<Surface> build(const MeshView& mesh, Channels<const float> positions,
                                 const PatchTableOptions& options = {},
                                 Progress* progress = nullptr);
    static Result<Surface> build(const MeshView& mesh, Channels<const double> positions,
                                 const PatchTableOptions& options = {},
                                 Progress* progress = nullptr);

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

    /// What depends on some vertices. For values of one's own, of which refresh() forms those at
    /// Change::points anew. The first call makes the tables for it, as move_vertices() does.
    /// \return IndexOutOfRange
    Result<Change> dependents(std::span<const Index> vertices);

    /// Values of any number of channels at points(), one point after the other, from those at
    /// the base vertices: colours, weights, velocities, positions of another time.
    Buffer<float> values(Channels<const float> vertices) const;
    Buffer<double> values(Channels<const double> vertices) const;
    /// The same into an array that is there already.
    /// \pre values.size() == points().size() vertices.n
    void refresh(Channels<const float> vertices, std::span<float> values) const;
    void refresh(Channels<const double> vertices, std::span<double> values) const;
    /// The same for some of the points, those of a Change.
    void refresh(Channels<const float> vertices, const Change& change,
                 std::span<const Index> moved, std::span<float> values) const;
    void refresh(Channels<const double> vertices, const Change& change,
                 std::span<const Index> moved, std::span<double> values) const;

    /// Position and derivatives at a point of a base face: clamped to it; NaN where there is
    /// none, of a face without surface, one that is not there, or at NaN.
    SurfaceJet<double> evaluate(const Address& where,
                                Chart chart = Chart::BaseUV) const noexcept;

    /// The same at many addresses in any order, by evaluate_addresses(): derivative r of
    /// coordinate c at address i goes to out[i][3 r + c].
    /// \param order  of the derivatives: 0, 1 or 2
    /// \pre out.n == 3 n_derivatives(order)
    AddressReport evaluate(std::span<const Address> where, int order,
                           Channels<double> out, Chart chart = Chart::BaseUV) const;
    /// The same of what values() has made: to out[i][n_channels r + c].
    /// \pre out.n == n_channels n_derivatives(order)
    AddressReport evaluate(std::span<const float> values, int n_channels,
                           std::span<const Address> where, int order, Channels<float> out,
                           Chart chart = Chart::BaseUV) const;
    AddressReport evaluate(std::span<const double> values, int n_channels,
                           std::span<const Address> where, int order,
                           Channels<double> out, Chart chart = Chart::BaseUV) const;

    /// Adds `scale` times the weights of the base vertices for derivative r of the surface
    /// (0: position, then du, dv, duu, duv, dvv) to `weights`: what the surface at this
    /// point does when a vertex moves. Allocates. Of many points: weights_at().
    /// Adds nothing where evaluate() gives NaN, for another r, and to another number of weights.
    void add_base_weights(const Address& where, int r, double scale,
                          std::span<double> weights) const;

    /// As osdx::tessellate() does; rates below 1 are 1.
    Tessellation tessellate(int rate) const;
    /// The same as work that may be cancelled.
    Result<Tessellation> tessellate(int rate, Progress& progress) const;
    Tessellation tessellate(const TessellationRates& rates) const;

private:
    struct Impl;
    explicit Surface(std::unique_ptr<Impl> impl) noexcept;
    const Impl& impl() const noexcept;
    std::unique_ptr<Impl> impl_;
};

}  // namespace osdx::inline OSDX_ABI
