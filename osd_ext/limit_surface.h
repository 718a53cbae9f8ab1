// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>

#include "eval/surface_jet.h"
#include "far/address.h"
#include "far/result.h"

namespace osdx {

/// The Catmull-Clark limit surface of a mesh as OpenSubdiv's Bfr evaluates it, at the same
/// addresses as Surface.
///
/// Around an extraordinary vertex Bfr is exact down to the isolation level and approximates
/// what is inside with one patch; isolation_error() in osd_ext/comparison.h measures that.
/// Threads: const members may run at the same time.
class LimitSurface {
public:
    /// \param isolation  level to which irregular regions are refined, 1 to 15
    /// \pre base outlives the surface; positions.size() == base.n_vertices()
    /// \return NotBuilt without OpenSubdiv, or DeviceFailure where it refuses the mesh
    static Result<LimitSurface> build(const Topology& base,
                                      std::span<const Vec3<double>> positions,
                                      int isolation = 10);

    LimitSurface(LimitSurface&&) noexcept;
    LimitSurface& operator=(LimitSurface&&) noexcept;
    ~LimitSurface();

    /// Position and first and second derivatives in (u, v).
    SurfaceJet<double> evaluate(const Address& where) const noexcept;

private:
    struct Impl;
    explicit LimitSurface(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace osdx
