// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>

#include <osdx/address.h>
#include <osdx/features.h>
#include <osdx/result.h>
#include <osdx/surface_function.h>
#include <osdx/surface_jet.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

/// The Catmull-Clark limit surface of a mesh as OpenSubdiv evaluates it, at the same addresses
/// as Surface.
///
/// Far's patches, not Bfr's surfaces: Bfr 3.5 stops refining at a level of its own, whatever
/// is asked for. Around an extraordinary vertex the patches are exact down to the isolation
/// level; what is inside is one Gregory patch, whose error isolation_error() of
/// osdx/analysis/comparison.h measures. Along borders and infinitely sharp creases they are exact,
/// along semi-sharp ones if the sharpness is at most the isolation level: beyond it the crease
/// is taken as smooth. Sharpness is kept in float.
///
/// At darts (one infinitely sharp edge ends at a smooth vertex) OpenSubdiv's end caps take the
/// limit point of a smooth vertex, which is another.
///
/// Threads: const members may run at the same time.
class OSDX_API LimitSurface {
public:
    /// The deepest level that OpenSubdiv takes.
    static constexpr int kMaxIsolation = 10;

    /// \param features  of base, resolved or not
    /// \param isolation  level to which irregular regions are refined, 1 to kMaxIsolation
    /// \pre base outlives the surface; positions.size() == base.n_vertices()
    /// \return NotBuilt without OpenSubdiv, or DeviceFailure where it refuses the mesh
    static Result<LimitSurface> build(const Topology& base, const Features& features,
                                      std::span<const Vec3<double>> positions,
                                      int isolation = 8);

    LimitSurface(LimitSurface&&) noexcept;
    LimitSurface& operator=(LimitSurface&&) noexcept;
    ~LimitSurface();

    Index n_patches() const noexcept;  ///< of all levels

    /// Position and first and second derivatives in (u, v).
    /// \pre where.face is no hole of resolve()
    SurfaceJet<double> evaluate(const Address& where) const noexcept;

private:
    struct Impl;
    explicit LimitSurface(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// The limit surface as a SurfaceFunction. \pre both outlive it
OSDX_API SurfaceFunction surface_function(const Topology& base,
                                          const LimitSurface& limit);

}  // namespace osdx::inline OSDX_ABI
