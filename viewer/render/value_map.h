// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/types.h>

#include "viewer/render/picture.h"
#include "viewer/render/scene.h"

namespace osdx::render {

/// The numbers that Shade::Mean, Gauss and Distance show, and their colours.
class ValueMap {
public:
    /// Chooses the range where the options do not, from what the picture shows.
    /// \pre all outlive it
    ValueMap(const PictureInput& input, const PictureOptions& options,
             const Scene& scene);

    static bool is_for(Shade shade) noexcept {
        return shade == Shade::Mean || shade == Shade::Gauss || shade == Shade::Distance;
    }
    double highest() const noexcept { return range_; }
    double lowest() const noexcept { return is_distance() ? 0 : -range_; }

    double value(const Hit& hit) const;
    /// In linear light; grey for what is not finite.
    Vec3<double> color(double value) const noexcept;

private:
    bool is_distance() const noexcept { return o_.shade == Shade::Distance; }
    double choose_range(const Scene& scene) const;

    const PictureInput& input_;
    const PictureOptions& o_;
    double range_ = 1;
};

}  // namespace osdx::render
