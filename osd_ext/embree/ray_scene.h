// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>

#include <osdx/result.h>
#include <osdx/tessellation.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

struct Ray {
    Vec3<float> origin;
    Vec3<float> direction;  ///< need not be unit; RayHit::t is in multiples of it
    float t_near = 0.0f;
    float t_far = 1e30f;
};

/// A point of a triangle p0 p1 p2: (1 - u - v) p0 + u p1 + v p2.
struct RayHit {
    Index triangle = kInvalidIndex;
    float t = 0;  ///< of the ray; for nearest() the distance
    float u = 0, v = 0;
};

/// A bounding-volume hierarchy over triangles. Copies its input; Embree stays hidden.
/// Threads: const members may run at the same time.
class OSDX_API RayScene {
public:
    /// \return IndexOutOfRange (with the triangle), NonFinitePoint (with the point),
    ///         DeviceFailure, or NotBuilt without Embree.
    static Result<RayScene> build(std::span<const Vec3<float>> points,
                                  std::span<const std::array<Index, 3>> triangles);

    RayScene(RayScene&&) noexcept;
    RayScene& operator=(RayScene&&) noexcept;
    ~RayScene();

    std::optional<RayHit> intersect(const Ray& ray) const noexcept;

    /// The triangle point nearest to `point`; nothing for an empty scene.
    std::optional<RayHit> nearest(const Vec3<float>& point) const noexcept;

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

    /// The address of a hit, by interpolation of the (u, v) of the triangle's corners.
    /// \pre the tessellation has an even rate: facets stay in one quarter of a face
    Address address(const RayHit& hit) const noexcept;

private:
    explicit TessellatedScene(RayScene rays) : rays_(std::move(rays)) {}

    RayScene rays_;
    std::vector<Index> faces_;                          // per triangle
    std::vector<std::array<Vec2<double>, 3>> corners_;  // (u, v), per triangle
};

}  // namespace osdx::inline OSDX_ABI
