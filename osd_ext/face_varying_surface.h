// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <string>

#include <osdx/address.h>
#include <osdx/buffer.h>
#include <osdx/channels.h>
#include <osdx/dependents.h>
#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

class Surface;
struct FaceVarying;
struct Tessellation;
struct TessellationRates;

/// Values that face corners name, at the addresses of a surface: texture coordinates, colours,
/// any number of channels.
///
/// FaceVaryingRule::All interpolates linearly: bilinear in the (u, v) of a quad, and in each
/// quarter of another polygon between its corner, the middles of its edges and the centroid.
/// The other rules evaluate a surface of the same degree over the values, by patches on the
/// mesh cut open along its seams. So the values follow the points of the surface as the mesh's
/// own coordinates would. Multisided patches go through them at a pace of their own: those at
/// pinned vertices of several faces (rule Boundaries: all vertices of seams) are laid on the
/// fourth level of refinement only, MultisidedOptions::isolate_corners.
///
/// One of these serves all channels that name the same values at their corners. Derivatives are
/// those in the (u, v) of the base face.
///
/// Threads: const members may run at the same time.
class OSDX_API FaceVaryingSurface {
public:
    /// From what the surface has linked already: its topology, features and degree, which are
    /// read here and not referred to later.
    /// \param corners  such as one of MeshView::face_varying; not kept
    /// \return what check_face_varying(), build_face_varying(), check_surface() and
    ///         build_patch_table() return
    static Result<FaceVaryingSurface> build(const Surface& surface,
                                            const FaceVaryingView& corners);

    FaceVaryingSurface(FaceVaryingSurface&&) noexcept;
    FaceVaryingSurface& operator=(FaceVaryingSurface&&) noexcept;
    ~FaceVaryingSurface();

    /// The topology, cut open, and its features.
    const FaceVarying& channel() const noexcept;
    Index n_values() const noexcept;  ///< as `corners` had it
    /// Control points: the vertices of channel().topology come first.
    Index n_points() const noexcept;

    /// Channels at the control points, one point after the other, from those of the values.
    Buffer<float> values(Channels<const float> values) const;
    Buffer<double> values(Channels<const double> values) const;
    /// The same into an array that is there already.
    /// \pre points.size() == n_points() values.n
    void refresh(Channels<const float> values, std::span<float> points) const;
    void refresh(Channels<const double> values, std::span<double> points) const;

    /// What depends on some of the values. The first call makes the tables for it, in linear
    /// time; see Dependents.
    /// \return IndexOutOfRange
    Result<Change> dependents(std::span<const Index> moved);
    /// Control points anew where values have moved, with the same result as of all of them to
    /// the last bit.
    /// \param change  dependents(moved)
    void refresh(Channels<const float> values, const Change& change,
                 std::span<const Index> moved, std::span<float> points) const;
    void refresh(Channels<const double> values, const Change& change,
                 std::span<const Index> moved, std::span<double> points) const;

    /// At one point, of what values() has made: derivative r of channel c to
    /// out[r * n_channels + c]. NaN at an address without a point, as Surface::evaluate() has
    /// it; others are clamped to their face. Does not allocate.
    /// \param order  of the derivatives: 0, 1 or 2
    /// \pre points.size() == n_points() n_channels; out.size() == n_derivatives(order) n_channels
    void evaluate(std::span<const float> points, int n_channels, const Address& where,
                  int order, std::span<float> out) const noexcept;
    void evaluate(std::span<const double> points, int n_channels, const Address& where,
                  int order, std::span<double> out) const noexcept;
    /// \pre besides, the point is on a face that is no hole
    void evaluate(std::span<const float> points, int n_channels,
                  const QuarterPoint& where, int order,
                  std::span<float> out) const noexcept;
    void evaluate(std::span<const double> points, int n_channels,
                  const QuarterPoint& where, int order,
                  std::span<double> out) const noexcept;

    /// The same at many addresses in any order: those of address i to out[i]. Goes wide; the
    /// result does not depend on the number of threads.
    /// \pre out.n == n_derivatives(order) n_channels
    AddressReport evaluate(std::span<const float> points, int n_channels,
                           std::span<const Address> where, int order,
                           Channels<float> out) const;
    AddressReport evaluate(std::span<const double> points, int n_channels,
                           std::span<const Address> where, int order,
                           Channels<double> out) const;

    /// Appends channels to Tessellation::face_varying.
    /// \pre the tessellation is one of the same mesh, with the same holes, at these rates
    void add_to(Tessellation& tessellation, std::string name,
                std::span<const float> points, int n_channels,
                const TessellationRates& rates) const;
    void add_to(Tessellation& tessellation, std::string name,
                std::span<const double> points, int n_channels,
                const TessellationRates& rates) const;
    void add_to(Tessellation& tessellation, std::string name,
                std::span<const float> points, int n_channels, int rate) const;
    void add_to(Tessellation& tessellation, std::string name,
                std::span<const double> points, int n_channels, int rate) const;

private:
    struct Impl;
    explicit FaceVaryingSurface(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

}  // namespace osdx::inline OSDX_ABI
