// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <osdx/result.h>
#include <osdx/tessellation.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

struct Ray {
    Vec3<double> origin;
    Vec3<double> direction;  ///< need not be unit; RayHit::t is in multiples of it
    double t_near = 0;
    double t_far = std::numeric_limits<double>::infinity();
};

/// A point of a triangle p0 p1 p2: (1 - u - v) p0 + u p1 + v p2.
struct RayHit {
    Index triangle = kInvalidIndex;
    double t = 0;  ///< of the ray; for nearest() the distance
    double u = 0, v = 0;
};

/// A bounding-volume hierarchy over triangles. Copies its input; Embree stays hidden.
///
/// Where the triangles are and how large is all the same: they are moved to the origin and
/// scaled by a power of two before they become floats, and rays start at the box around them.
/// So points of the scene are right to 1e-7 of its size, and details below that are lost.
///
/// Watertight: where triangles share points, no ray passes between them, at their common
/// vertices neither, by the test of Woop, Benthin and Wald, Watertight Ray/Triangle
/// Intersection (2013). A triangle that a ray runs along within is not met.
///
/// Threads: const members may run at the same time.
class OSDX_API RayScene {
public:
    /// \return IndexOutOfRange (with the triangle), NonFinitePoint (with the point),
    ///         DeviceFailure, or NotBuilt without Embree.
    static Result<RayScene> build(std::span<const Vec3<float>> points,
                                  std::span<const std::array<Index, 3>> triangles);
    static Result<RayScene> build(std::span<const Vec3<double>> points,
                                  std::span<const std::array<Index, 3>> triangles);

    RayScene(RayScene&&) noexcept;
    RayScene& operator=(RayScene&&) noexcept;
    ~RayScene();

    /// The first hit; nothing for a ray that is not finite, and in a scene that was moved from.
    std::optional<RayHit> intersect(const Ray& ray) const noexcept;

    /// The triangle point nearest to `point`; nothing for an empty scene or one that was moved
    /// from, and for a point that is not finite.
    std::optional<RayHit> nearest(const Vec3<double>& point) const noexcept;

private:
    struct Impl;
    explicit RayScene(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// A ray scene of a tessellation that knows the surface address of its hits.
class OSDX_API TessellatedScene {
public:
    /// \return what RayScene::build returns
    static Result<TessellatedScene> build(const Tessellation& tessellation);

    const RayScene& rays() const noexcept { return rays_; }

    /// The address of a hit, by interpolation of the (u, v) of the triangle's corners; of no
    /// face if it is none of this scene.
    /// \pre the tessellation has an even rate: facets stay in one quarter of a face
    Address address(const RayHit& hit) const noexcept;

private:
    explicit TessellatedScene(RayScene rays) : rays_(std::move(rays)) {}

    RayScene rays_;
    std::vector<Index> faces_;                          // per triangle
    std::vector<std::array<Vec2<double>, 3>> corners_;  // (u, v), per triangle
};

}  // namespace osdx::inline OSDX_ABI
