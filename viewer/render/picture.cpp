// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/picture.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/surface_function.h>

#include "far/parallel.h"
#include "viewer/render/color.h"
#include "viewer/render/legend.h"
#include "viewer/render/scene.h"
#include "viewer/render/shade.h"
#include "viewer/render/value_map.h"

namespace osdx::render {
namespace {

/// The mean of samples x samples rays for each pixel.
Image trace(const PictureOptions& o, const Shader& shader) {
    Image image{o.width, o.height,
                std::vector<Color>(static_cast<std::size_t>(o.width) * o.height)};
    const int n = o.samples;
    detail::for_each_task(o.height, [&](int y) {
        for (int x = 0; x < o.width; ++x) {
            Vec3<double> sum(0);
            for (int j = 0; j < n; ++j) {
                for (int i = 0; i < n; ++i)
                    sum += shader.sample(x + (i + 0.5) / n, y + (j + 0.5) / n);
            }
            image.at(x, y) = to_color(sum / double(n * n));
        }
    });
    return image;
}

Status check(const PictureInput& input, const PictureOptions& o) {
    const auto in = [](int x, int hi) { return x >= 1 && x <= hi; };
    if (!in(o.width, 16384) || !in(o.height, 16384)) {
        return fail(
            ErrorCode::InvalidOption,
            fmt::format("{} x {} pixels are not within 1 to 16384", o.width, o.height));
    }
    if (!in(o.samples, 16)) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("{} samples are not within 1 to 16", o.samples));
    }
    if (!std::isfinite(o.azimuth_deg) || !std::isfinite(o.elevation_deg))
        return fail(ErrorCode::InvalidOption, "an angle of the camera is not finite");
    if (o.range && !(*o.range > 0 && std::isfinite(*o.range))) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("the range {} is not positive", *o.range));
    }
    if (o.shade == Shade::Patches && !input.patch)
        return fail(ErrorCode::InvalidOption, "this surface has no patches to show");
    if (o.shade == Shade::Distance && !input.distance)
        return fail(ErrorCode::InvalidOption, "there is no surface to be distant from");
    if (o.shade == Shade::Checker && !input.texture)
        return fail(ErrorCode::NoTexcoords,
                    "the mesh has no texture coordinates to show");
    if (o.shade == Shade::Colors && !input.color)
        return fail(ErrorCode::InvalidOption, "the mesh has no colours to show");
    return ok();
}

}  // namespace

std::optional<Shade> parse_shade(std::string_view name) {
    const auto found = std::ranges::find(kShadeNames, name);
    if (found == kShadeNames.end())
        return std::nullopt;
    return static_cast<Shade>(found - kShadeNames.begin());
}

PictureInput picture_input(const Surface& surface) {
    PictureInput input;
    const PatchTable& table = surface.patches();
    input.base = &surface.base();
    input.features = &table.features();
    input.surface = surface_function(surface, Chart::Native);
    input.patch = [&table](const QuarterPoint& at) {
        const PatchPoint p = table.locate(at);
        const PatchClass& c = table.class_of(p.patch);
        PatchLook look{c.kind, c.n_sectors, table.patch(p.patch).level, p.patch, {}};
        // The edges of a multisided patch are at a = 1 and b = 1.
        const auto to_edge = [&](double x) {
            return (c.is_square() ? std::min(x, 1 - x) : 1 - x) / p.scale;
        };
        look.to_edge = {to_edge(p.a), to_edge(p.b)};
        if (p.quarter_turns % 2 != 0)
            std::swap(look.to_edge.x, look.to_edge.y);
        return look;
    };
    std::map<std::tuple<PatchKind, PatchBorder, int, int>, Index> counts;
    for (Index i = 0; i < table.n_patches(); ++i) {
        const PatchClass& c = table.class_of(i);
        const int level = c.kind == PatchKind::Regular ? table.patch(i).level : 0;
        ++counts[{c.kind, c.border, c.n_sectors, level}];
    }
    for (const auto& [key, count] : counts) {
        const auto& [kind, border, n_sectors, level] = key;
        input.patch_groups.push_back({kind, border, n_sectors, level, count});
    }
    return input;
}

Result<Image> render_picture(const PictureInput& input, const PictureOptions& options) {
    assert(input.base != nullptr && input.surface);
    if (const Status checked = check(input, options); !checked)
        return checked.error();
    const Result<Scene> scene = Scene::build(input, options, picture_margins(options));
    if (!scene)
        return scene.error();
    const ValueMap values(input, options, *scene);
    Image image = trace(options, Shader(input, options, *scene, values));
    if (options.legend)
        draw_legend(input, options, values, image);
    return image;
}

}  // namespace osdx::render
