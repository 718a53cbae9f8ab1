// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <glm/common.hpp>

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

double channel_to_linear(double srgb) noexcept {
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

/// Even steps from the first control colour to the last, in sRGB.
Vec color_map(std::span<const Vec> controls, double x) noexcept {
    const auto n = static_cast<int>(controls.size()) - 1;
    const double at = n * std::clamp(x, 0.0, 1.0);
    const int i = std::min(static_cast<int>(at), n - 1);
    return to_linear(glm::mix(controls[i], controls[i + 1], at - i));
}

constexpr std::array<Vec, 7> kDiverging = {{{24, 48, 128},
                                            {48, 104, 190},
                                            {132, 178, 226},
                                            {246, 245, 242},
                                            {240, 158, 128},
                                            {200, 66, 62},
                                            {128, 12, 38}}};
constexpr std::array<Vec, 5> kSequential = {
    {{246, 246, 240}, {186, 221, 142}, {58, 168, 142}, {46, 98, 152}, {62, 16, 92}}};

}  // namespace

Vec to_linear(const Vec& srgb) noexcept {
    return {channel_to_linear(srgb.x / 255), channel_to_linear(srgb.y / 255),
            channel_to_linear(srgb.z / 255)};
}

Color to_color(const Vec& linear) noexcept {
    Color result;
    for (int c = 0; c < 3; ++c) {
        const double x = linear[c] > 0 ? std::min(linear[c], 1.0) : 0.0;
        const double s =
            x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
        result[c] = static_cast<std::uint8_t>(std::lround(255 * s));
    }
    return result;
}

Vec diverging_color(double x) noexcept {
    return color_map(kDiverging, x);
}

Vec sequential_color(double x) noexcept {
    return color_map(kSequential, x);
}

Vec group_color(PatchKind kind, int n_sectors, int level) noexcept {
    constexpr std::array<Vec, 8> regular = {{{214, 216, 220},
                                             {172, 193, 222},
                                             {128, 163, 210},
                                             {90, 132, 192},
                                             {62, 102, 166},
                                             {46, 78, 136},
                                             {34, 56, 106},
                                             {24, 38, 80}}};
    // By n: 3, 5, 6, 7, more.
    constexpr std::array<Vec, 5> ev = {
        {{250, 214, 90}, {242, 148, 62}, {222, 92, 66}, {188, 58, 92}, {136, 44, 104}}};
    constexpr std::array<Vec, 5> ef = {
        {{186, 220, 120}, {112, 190, 108}, {52, 152, 104}, {24, 118, 100}, {16, 84, 84}}};
    constexpr std::array<Vec, 5> gregory = {{{208, 178, 222},
                                             {176, 132, 204},
                                             {148, 96, 186},
                                             {116, 66, 162},
                                             {82, 40, 128}}};
    const int by_n = n_sectors <= 4 ? 0 : std::min(n_sectors - 4, 4);
    switch (kind) {
        case PatchKind::Regular:
            return to_linear(regular[std::clamp(level, 0, 7)]);
        case PatchKind::EV:
            return to_linear(ev[by_n]);
        case PatchKind::EF:
            return to_linear(ef[by_n]);
        case PatchKind::Gregory:
            return to_linear(gregory[by_n]);
    }
    return {};
}

}  // namespace osdx::render
