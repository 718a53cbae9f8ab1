// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/shade.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/render/color.h"
#include "viewer/render/footprint.h"

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

double hash_to_unit(std::uint32_t x) noexcept {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return (x ^ (x >> 16)) * 0x1p-32;
}

/// Enough to see the form, little enough to read colours: 1 where it faces the eye.
double faint(const Hit& hit) noexcept {
    const double facing = -glm::dot(hit.normal, hit.direction);
    return 0.62 + 0.38 * facing;
}

}  // namespace

Shader::Shader(const PictureInput& input, const PictureOptions& options,
               const Scene& scene, const ValueMap& values)
    : input_(input),
      o_(options),
      scene_(scene),
      camera_(scene.camera()),
      values_(values) {
    if (o_.shade == Shade::Phong)
        ground_ = GroundShadow(scene.rays(), scene.points(), static_cast<int>(o_.up));
}

Vec Shader::sample(double x, double y) const {
    const std::optional<Hit> hit = scene_.find(x, y);
    if (!hit)
        return background(x, y);
    switch (o_.shade) {
        case Shade::Phong:
            return clay(*hit);
        case Shade::Normals:
            return to_linear(127.5 * (hit->normal + 1.0));
        case Shade::Reflection:
            return tubes(*hit);
        case Shade::Mean:
        case Shade::Gauss:
        case Shade::Distance:
            return faint(*hit) * values_.color(values_.value(*hit));
        case Shade::Patches:
            return patches(*hit);
        case Shade::Checker:
            return checker(*hit);
        case Shade::Colors:
            return lit(*hit) *
                   to_linear(255.0 * glm::clamp(input_.color(hit->at), 0.0, 1.0));
    }
    return {};
}

Vec Shader::background(double x, double y) const {
    const Vec color = glm::mix(to_linear(Vec(247, 248, 250)),
                               to_linear(Vec(222, 225, 230)), y / o_.height);
    return (1 - 0.75 * ground_.at(camera_.eye, camera_.direction(x, y))) * color;
}

/// Towards a light: right, up and back in the camera's axes.
Vec Shader::towards(double right, double up, double back) const {
    return glm::normalize(right * camera_.right + up * camera_.up + back * camera_.back);
}

Vec Shader::clay(const Hit& hit) const {
    struct Light {
        Vec direction;
        Vec color;
        double wrap;  // reaches so far round the edge of the shadow
    };
    const Light lights[] = {
        {towards(-0.75, 0.6, 0.5), {0.82, 0.79, 0.74}, 0.15},  // key
        {towards(0.9, 0.1, 0.5), {0.24, 0.26, 0.30}, 0.4},     // fill
        {towards(0.35, 0.6, -0.75), {0.30, 0.32, 0.36}, 0.1},  // rim
    };
    const Vec albedo(0.74, 0.69, 0.63);
    const double open = hit.open;
    const double sky = 0.5 + 0.5 * hit.normal[static_cast<int>(o_.up)];
    Vec light = open * glm::mix(Vec(0.12, 0.11, 0.10), Vec(0.22, 0.24, 0.27), sky);
    double shine = 0;
    for (const Light& l : lights) {
        const double cosine = glm::dot(hit.normal, l.direction);
        light += (0.4 + 0.6 * open) * std::max(0.0, (cosine + l.wrap) / (1 + l.wrap)) *
                 l.color;
        const Vec half = glm::normalize(l.direction - hit.direction);
        const double h = std::max(0.0, glm::dot(hit.normal, half));
        if (cosine > 0)
            shine += l.color.x * std::pow(h, 40) * std::min(1.0, 8 * cosine);
    }
    return albedo * light + 0.22 * open * shine;
}

Vec Shader::checker(const Hit& hit) const {
    constexpr double n_cells = 8;
    const TextureJet uv = input_.texture(hit.at);
    Vec2<double> width(1e-6);  // of a sample, in pairs of cells; never zero
    for (const RayStep& step : ray_steps(camera_, o_.samples, hit)) {
        const Vec2<double> steps = in_uv(hit.jet, step.point);
        const Vec2<double> change =
            glm::abs(steps.x * uv.du + steps.y * uv.dv) * (0.5 * n_cells);
        if (std::isfinite(change.x) && std::isfinite(change.y))
            width += change;
    }
    const auto wave = [&](int k) {
        return 2 * square_wave(0.5 * n_cells * uv.p[k], width[k]) - 1;
    };
    const double light = 0.5 + 0.5 * wave(0) * wave(1);
    // Tiles that are smaller than a sample have their mean colour.
    const Vec2<double> in_tile =
        glm::mix(glm::fract(uv.p), Vec2<double>(0.5),
                 glm::min(width * (2 / n_cells), Vec2<double>(1)));
    const Vec tint = glm::mix(
        glm::mix(Vec(0.62, 0.64, 0.70), Vec(0.88, 0.42, 0.26), in_tile.x),
        glm::mix(Vec(0.26, 0.66, 0.40), Vec(0.92, 0.80, 0.30), in_tile.x), in_tile.y);
    return lit(hit) * std::lerp(0.16, 1.0, light) * tint;
}

/// Ring-shaped light tubes, parallel to each other about the camera's up axis: black and
/// white by the angle of the mirrored ray to the axis, averaged over the sample. Straight
/// tubes would differ by the angle about the axis, but all run into its two ends.
Vec Shader::tubes(const Hit& hit) const {
    constexpr int n_tubes = 12;
    const Vec r = glm::reflect(hit.direction, hit.normal);
    const double cosine = std::clamp(glm::dot(r, camera_.up), -1.0, 1.0);
    const double sine = std::sqrt(1 - cosine * cosine);
    // A quarter more: both poles are in the middle of a tube, which is even about them.
    const double at = 0.25 + n_tubes * std::acos(cosine) / std::numbers::pi;
    double width = 0.03;  // in tubes: edges as crisp as they can be, without stairs
    for (const Vec& dr : mirrored_steps(camera_, o_.samples, hit)) {
        // At the poles the quotient has no limit, but no angle changes by more than dr.
        const double along = std::abs(glm::dot(dr, camera_.up)), all = glm::length(dr);
        const double change = along < sine * all ? along / sine : all;
        if (std::isfinite(change))
            width += change * n_tubes / std::numbers::pi;
    }
    const double light = square_wave(at, width);
    const double facing = -glm::dot(hit.normal, hit.direction);
    return glm::mix(Vec(0.012, 0.014, 0.02), Vec(0.92, 0.93, 0.95), light) *
           (0.55 + 0.45 * facing);
}

/// Of matt colours.
double Shader::lit(const Hit& hit) const {
    const double key = std::max(0.0, glm::dot(hit.normal, towards(-0.4, 0.6, 0.7)));
    return 0.30 + 0.30 * -glm::dot(hit.normal, hit.direction) + 0.42 * key;
}

Vec Shader::patches(const Hit& hit) const {
    const PatchLook look = input_.patch(hit.at);
    Vec color = group_color(look.kind, look.n_sectors, look.level);
    color *= 0.92 + 0.16 * (hash_to_unit(look.patch) - 0.5);
    const double pixel = camera_.pixel * hit.t;
    // A step in u moves the line u = const by |du x dv| / |dv|; the eye sees these
    // vectors from the side. Lines do not grow to more than five times their width.
    const Vec &d = hit.direction, &u = hit.jet.du, &v = hit.jet.dv;
    const Vec area = glm::cross(u, v);
    const auto distance_to = [&](double steps, const Vec& along) {
        const Vec seen = along - glm::dot(along, d) * d;
        return steps * std::max(std::abs(glm::dot(area, d)) / glm::length(seen),
                                0.2 * glm::length(area) / glm::length(along));
    };
    const double distance =
        std::min(distance_to(look.to_edge.x, v), distance_to(look.to_edge.y, u));
    // Half of the line lies on this side.
    const double half_width = 0.6 * std::max(1.0, o_.height / 720.0) * pixel;
    const double line =
        std::clamp(0.5 + (half_width - distance) * o_.samples / pixel, 0.0, 1.0);
    if (std::isfinite(line))
        color = glm::mix(color, to_linear(Vec(38, 40, 48)), 0.85 * line);
    return color * lit(hit);
}

}  // namespace osdx::render
