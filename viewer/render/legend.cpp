// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/legend.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <osdx/patch_class.h>

#include "viewer/render/color.h"
#include "viewer/render/patch_kind_name.h"

namespace osdx::render {
namespace {

constexpr Color kInk{40, 42, 48};

double text_scale(const PictureOptions& o) {
    return std::max(1.0, std::round(o.height / 360.0));
}

std::string group_name(const PatchGroup& g) {
    if (g.kind == PatchKind::Regular)
        return fmt::format("regular level {}: {}", g.level, g.n_patches);
    return fmt::format("{} {}: {}", name_of(g.kind, g.border).name, g.n_sectors,
                       g.n_patches);
}

void centred(Image& image, double x, double y, std::string_view text, double scale) {
    const double width = text_width(text, scale);
    draw_text(image, std::round(x - 0.5 * width), y, text, scale, kInk);
}

void draw_color_bar(const PictureOptions& o, const ValueMap& values, Image& image) {
    const double s = text_scale(o), line = s * kLineHeight;
    const double length = std::min(0.8 * o.width, 220 * s);
    const double x0 = std::round(0.5 * (o.width - length)),
                 y0 = std::round(o.height - 1.2 * line - 9 * s);
    const double lowest = values.lowest(), highest = values.highest();

    fill_box(image, {x0 - 1, y0 - 1, x0 + length + 1, y0 + 8 * s + 1}, kInk);
    for (int x = 0; x < length; ++x) {
        const double v = std::lerp(lowest, highest, (x + 0.5) / length);
        fill_box(image, {x0 + x, y0, std::min(x0 + x + 1, x0 + length), y0 + 8 * s},
                 to_color(values.color(v)));
    }
    const std::string caption = o.shade == Shade::Mean    ? "mean curvature x diagonal"
                                : o.shade == Shade::Gauss ? "Gauss curvature x diagonal^2"
                                                          : "distance / diagonal";
    centred(image, 0.5 * o.width, y0 - line + s, caption, s);
    const int n_ticks = lowest < 0 ? 5 : 3;
    for (int i = 0; i < n_ticks; ++i) {
        const double f = double(i) / (n_ticks - 1), x = x0 + f * length;
        fill_box(image, {x - 0.5 * s, y0 + 8 * s, x + 0.5 * s, y0 + 10 * s}, kInk);
        centred(image, x, y0 + 11 * s,
                fmt::format("{:.3g}", std::lerp(lowest, highest, f)), s);
    }
}

/// Rows of coloured squares with names, as many as fit below each other.
void draw_groups(const PictureInput& input, const PictureOptions& o, Image& image) {
    const double s = text_scale(o), row_height = s * kLineHeight;
    const double left = 6 * s, right = o.width - 6 * s, gap = 12 * s;
    const auto width = [&](const PatchGroup& g) {
        return row_height + text_width(group_name(g), s);
    };
    std::vector<std::vector<PatchGroup>> rows(1);
    double x = left;
    for (const PatchGroup& g : input.patch_groups) {
        if (x > left && x + width(g) > right) {
            rows.emplace_back();
            x = left;
        }
        rows.back().push_back(g);
        x += width(g) + gap;
    }
    double y = o.height - 4 * s - row_height * double(rows.size());
    for (const auto& row : rows) {
        x = left;
        for (const PatchGroup& g : row) {
            fill_box(image, {x, y, x + 8 * s, y + 8 * s}, kInk);
            fill_box(image, {x + 1, y + 1, x + 8 * s - 1, y + 8 * s - 1},
                     to_color(0.92 * group_color(g.kind, g.n_sectors, g.level)));
            draw_text(image, x + row_height, y, group_name(g), s, kInk);
            x += width(g) + gap;
        }
        y += row_height;
    }
}

}  // namespace

Margins picture_margins(const PictureOptions& o) {
    const double margin = 0.05 * std::min(o.width, o.height);
    if (!o.legend)
        return {margin, margin, margin, margin};
    const double line = text_scale(o) * kLineHeight;
    return {margin, margin, margin + std::min(line, 0.1 * o.height),
            margin + std::min(2.5 * line, 0.2 * o.height)};
}

void draw_legend(const PictureInput& input, const PictureOptions& o,
                 const ValueMap& values, Image& image) {
    const double s = text_scale(o);
    draw_text(image, 6 * s, 5 * s, input.title, s, kInk);
    if (ValueMap::is_for(o.shade))
        draw_color_bar(o, values, image);
    if (o.shade == Shade::Patches)
        draw_groups(input, o, image);
}

}  // namespace osdx::render
