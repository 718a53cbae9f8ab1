// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "viewer/render/camera.h"
#include "viewer/render/image.h"
#include "viewer/render/picture.h"
#include "viewer/render/value_map.h"

namespace osdx::render {

/// Around the surface, with room for the legend where there is one.
Margins picture_margins(const PictureOptions& options);

/// Title, colours and numbers.
void draw_legend(const PictureInput& input, const PictureOptions& options,
                 const ValueMap& values, Image& image);

}  // namespace osdx::render
