// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/types.h>

#include "viewer/render/ground_shadow.h"
#include "viewer/render/picture.h"
#include "viewer/render/scene.h"
#include "viewer/render/value_map.h"

namespace osdx::render {

/// The colours of a picture, in linear light.
class Shader {
public:
    /// \pre all outlive it
    Shader(const PictureInput& input, const PictureOptions& options, const Scene& scene,
           const ValueMap& values);

    /// At the point (x, y) of the picture.
    Vec3<double> sample(double x, double y) const;

private:
    Vec3<double> background(double x, double y) const;
    Vec3<double> clay(const Hit& hit) const;
    Vec3<double> tubes(const Hit& hit) const;
    Vec3<double> patches(const Hit& hit) const;
    Vec3<double> checker(const Hit& hit) const;
    double lit(const Hit& hit) const;
    Vec3<double> towards(double right, double up, double back) const;

    const PictureInput& input_;
    const PictureOptions& o_;
    const Scene& scene_;
    const Camera& camera_;
    const ValueMap& values_;
    GroundShadow ground_;
};

}  // namespace osdx::render
