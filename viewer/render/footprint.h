// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>

#include <osdx/surface_jet.h>
#include <osdx/types.h>

#include "viewer/render/camera.h"
#include "viewer/render/scene.h"

/// What one sample of the picture covers of the surface and of what is mirrored in it.
namespace osdx::render {

/// Change of the ray's direction, and of the point where it meets the tangent plane, over
/// one sample.
struct RayStep {
    Vec3<double> direction, point;
};

/// To the right and down.
/// \param samples  in a row of a pixel
/// Source: Igehy, Tracing ray differentials (1999).
std::array<RayStep, 2> ray_steps(const Camera& camera, int samples,
                                 const Hit& hit) noexcept;

/// A vector of the tangent plane as steps along du and dv; zero where these are parallel.
Vec2<double> in_uv(const SurfaceJet<double>& jet, const Vec3<double>& dp) noexcept;

/// Change of the mirrored direction over one sample to the right and one down, with the
/// normal's change from the second derivatives (Weingarten).
std::array<Vec3<double>, 2> mirrored_steps(const Camera& camera, int samples,
                                           const Hit& hit) noexcept;

/// The mean, over the width, of the square wave that is 1 on the first half of each whole
/// number.
double square_wave(double at, double width) noexcept;

}  // namespace osdx::render
