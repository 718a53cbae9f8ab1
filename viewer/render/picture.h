// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <osdx/patch_class.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

#include "viewer/render/image.h"

namespace osdx::render {

/// What the colours of a picture show.
enum class Shade : std::uint8_t {
    Phong,       ///< matt clay under three lights, with soft shadows
    Normals,     ///< the unit normal n as red, green, blue = (n + 1) / 2
    Reflection,  ///< mirror images of rings of light about the vertical: they break where
                 ///< the normal jumps, and have kinks where the curvature does
    Mean,        ///< mean curvature times the diagonal, with the sign of curvature()
    Gauss,       ///< Gauss curvature times the square of the diagonal
    Patches,     ///< kind and level of the patches, and their edges
    Distance,    ///< to another surface, over the diagonal
    Checker,  ///< eight by eight squares in each unit of the texture coordinates, redder
              ///< along u and greener along v
    Colors,   ///< the mesh's own, taken for sRGB, under one light
};

/// Names of the shades, in their order.
inline constexpr std::array<std::string_view, 9> kShadeNames = {
    "phong",   "normals",  "reflection", "mean", "gauss",
    "patches", "distance", "checker",    "color"};

std::optional<Shade> parse_shade(std::string_view name);

/// Patches that share a name: all regular patches of a level, or all patches of another kind,
/// border and number of sectors.
struct PatchGroup {
    PatchKind kind = PatchKind::Regular;
    PatchBorder border = PatchBorder::None;
    int n_sectors = 4;
    int level = 0;  ///< 0 unless regular
    Index n_patches = 0;
};

/// The patch under a point, as Shade::Patches shows it.
struct PatchLook {
    PatchKind kind = PatchKind::Regular;
    int n_sectors = 4;
    int level = 0;
    Index patch = 0;  ///< neighbours of a kind differ a little in brightness by it
    /// Steps in u and in v of the base face to the nearest edges of the patch.
    Vec2<double> to_edge{1};
};

/// A surface to be painted. Functions are called from several threads at the same time.
struct PictureInput {
    const Topology* base = nullptr;
    const ResolvedFeatures* features =
        nullptr;              ///< as PatchTable::features(); null: it has none
    SurfaceFunction surface;  ///< with all derivatives
    std::string title;

    std::function<PatchLook(const QuarterPoint&)> patch;  ///< for Shade::Patches
    std::vector<PatchGroup> patch_groups;  ///< the legend of Shade::Patches
    /// For Shade::Distance; already divided by the diagonal.
    std::function<double(const SurfaceJet<double>&, const QuarterPoint&)> distance;
    std::function<TextureJet(const QuarterPoint&)> texture;  ///< for Shade::Checker
    /// Red, green, blue from 0 to 1; for Shade::Colors.
    std::function<Vec3<double>(const QuarterPoint&)> color;
};

/// Everything but title, distance, texture and colour. \pre the surface outlives it, unmoved
PictureInput picture_input(const Surface& surface);

enum class UpAxis : std::uint8_t { X, Y, Z };

struct PictureOptions {
    int width = 960, height = 720;  ///< in pixels, 1 to 16384
    Shade shade = Shade::Phong;
    /// Direction from which the camera looks: turned counter-clockwise about the up axis,
    /// from the axis that follows it (x follows z), and raised above the horizon.
    double azimuth_deg = 35, elevation_deg = 25;
    UpAxis up = UpAxis::Z;
    int samples = 2;  ///< n x n rays a pixel, 1 to 16
    /// Half range of the curvature maps, largest distance of the distance map. Default: 95 %
    /// of the visible surface are within it; the largest visible distance.
    std::optional<double> range;
    bool legend = true;  ///< title, colours and numbers; room is kept for them
};

/// Traces the surface with Embree; the camera moves to where the surface fills the picture.
///
/// Facets serve to find the point that a ray meets. Position, normal and curvature are those
/// of the surface there. "Diagonal" is that of the bounding box of the surface.
///
/// Threads: goes wide; the result does not depend on their number.
/// \return InvalidOption, also for a shade that the input has no function for (NoTexcoords for
///         Shade::Checker); EmptyMesh;
///         NonFinitePoint (with the face); what TessellatedScene::build returns: NotBuilt
///         without Embree
Result<Image> render_picture(const PictureInput& input,
                             const PictureOptions& options = {});

}  // namespace osdx::render
