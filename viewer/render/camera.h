// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include <osdx/types.h>

#include "viewer/render/picture.h"

namespace osdx::render {

/// Space around the surface, in pixels.
struct Margins {
    double left, right, top, bottom;
};

struct Camera {
    Vec3<double> eye;
    Vec3<double> right, up, back;  // unit; it looks along -back
    int width, height;
    double pixel;  // size of a pixel at distance 1

    /// Through the point (x, y) of the picture; -1 along `back`.
    Vec3<double> direction(double x, double y) const noexcept {
        return pixel * (x - 0.5 * width) * right + pixel * (0.5 * height - y) * up - back;
    }
};

/// The nearest camera with this direction that has all points within the margins.
Camera make_camera(std::span<const Vec3<double>> points, const PictureOptions& options,
                   const Margins& margins);

}  // namespace osdx::render
