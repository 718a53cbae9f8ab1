// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/patch_class.h>
#include <osdx/types.h>

#include "viewer/render/image.h"

/// Colours: linear light inside, sRGB at the doors.
namespace osdx::render {

/// From sRGB in 0..255.
Vec3<double> to_linear(const Vec3<double>& srgb) noexcept;
Color to_color(const Vec3<double>& linear) noexcept;

/// Blue, white, red for x from 0 to 1: equal steps of lightness on both sides of 1/2.
Vec3<double> diverging_color(double x) noexcept;
/// White, green, blue, violet for x from 0 to 1: darker with distance, so that the form shows
/// where it is 0.
Vec3<double> sequential_color(double x) noexcept;

/// Of the patches of a kind; regular ones by their level, the others by their sectors.
Vec3<double> group_color(PatchKind kind, int n_sectors, int level) noexcept;

}  // namespace osdx::render
