// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/picture.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <tuple>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <osdx/embree/ray_scene.h>

#include "far/parallel.h"
#include "viewer/cli/report.h"

namespace osdx {
namespace {

using Vec = Vec3<double>;

// ---- Colours: linear light inside, sRGB at the doors ----

double to_linear(double srgb) noexcept {
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

/// From sRGB in 0..255.
Vec to_linear(const Vec& srgb) noexcept {
    return {to_linear(srgb.x / 255), to_linear(srgb.y / 255), to_linear(srgb.z / 255)};
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

/// Even steps from the first control colour to the last, in sRGB.
Vec color_map(std::span<const Vec> controls, double x) noexcept {
    const auto n = static_cast<int>(controls.size()) - 1;
    const double at = n * std::clamp(x, 0.0, 1.0);
    const int i = std::min(static_cast<int>(at), n - 1);
    return to_linear(glm::mix(controls[i], controls[i + 1], at - i));
}

/// Blue, white, red: equal steps of lightness on both sides of zero.
constexpr std::array<Vec, 7> kDiverging = {{{24, 48, 128},
                                            {48, 104, 190},
                                            {132, 178, 226},
                                            {246, 245, 242},
                                            {240, 158, 128},
                                            {200, 66, 62},
                                            {128, 12, 38}}};
/// White, green, blue, violet: darker with distance, so that the form shows where it is 0.
constexpr std::array<Vec, 5> kSequential = {
    {{246, 246, 240}, {186, 221, 142}, {58, 168, 142}, {46, 98, 152}, {62, 16, 92}}};

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

std::string group_name(const PatchGroup& g) {
    if (g.kind == PatchKind::Regular)
        return fmt::format("regular level {}: {}", g.level, g.n_patches);
    return fmt::format("{} {}: {}", patch_name(g.kind, g.border), g.n_sectors,
                       g.n_patches);
}

// ---- Camera ----

/// Space around the surface, in pixels.
struct Margins {
    double left, right, top, bottom;
};

struct Camera {
    Vec eye;
    Vec right, up, back;  // unit; it looks along -back
    int width, height;
    double pixel;  // size of a pixel at distance 1

    /// Through the point (x, y) of the picture; -1 along `back`.
    Vec direction(double x, double y) const noexcept {
        return pixel * (x - 0.5 * width) * right + pixel * (0.5 * height - y) * up - back;
    }
};

/// 28 degrees across the smaller side: little distortion, and still depth.
const double kTanHalfView = std::tan(14 * std::numbers::pi / 180);

/// The nearest camera with this direction that has all points within the margins.
Camera make_camera(std::span<const Vec> points, const PictureOptions& o,
                   const Margins& margins) {
    const int z = static_cast<int>(o.up);
    Vec x_axis(0), y_axis(0), z_axis(0);
    z_axis[z] = x_axis[(z + 1) % 3] = y_axis[(z + 2) % 3] = 1;
    const double azimuth = o.azimuth_deg * std::numbers::pi / 180,
                 elevation = o.elevation_deg * std::numbers::pi / 180;
    const Vec away = std::cos(azimuth) * x_axis + std::sin(azimuth) * y_axis;

    Camera c{};
    c.right = -std::sin(azimuth) * x_axis + std::cos(azimuth) * y_axis;
    c.back = std::cos(elevation) * away + std::sin(elevation) * z_axis;
    c.up = glm::cross(c.back, c.right);
    c.width = o.width;
    c.height = o.height;
    c.pixel = 2 * kTanHalfView / std::min(o.width, o.height);

    // A point (x, y, z) in these axes is left of the right border if
    // x - eye.x <= tan_right (eye.z - z), and so on: the largest x + tan_right z decides.
    const double tans[4] = {c.pixel * (0.5 * o.width - margins.right),
                            c.pixel * (0.5 * o.width - margins.left),
                            c.pixel * (0.5 * o.height - margins.top),
                            c.pixel * (0.5 * o.height - margins.bottom)};
    double most[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    double nearest = -INFINITY;
    for (const Vec& p : points) {
        const double px = glm::dot(p, c.right), py = glm::dot(p, c.up),
                     pz = glm::dot(p, c.back);
        most[0] = std::max(most[0], px + tans[0] * pz);
        most[1] = std::max(most[1], -px + tans[1] * pz);
        most[2] = std::max(most[2], py + tans[2] * pz);
        most[3] = std::max(most[3], -py + tans[3] * pz);
        nearest = std::max(nearest, pz);
    }
    // Never inside: 0.05 of the diagonal keeps off even a flat sheet seen from its edge.
    const double ez =
        std::max({(most[0] + most[1]) / (tans[0] + tans[1]),
                  (most[2] + most[3]) / (tans[2] + tans[3]), nearest + 0.05});
    // The middle of what the borders leave free.
    const double ex = 0.5 * (most[0] - tans[0] * ez + tans[1] * ez - most[1]);
    const double ey = 0.5 * (most[2] - tans[2] * ez + tans[3] * ez - most[3]);
    c.eye = ex * c.right + ey * c.up + ez * c.back;
    return c;
}

// ---- The surface, in units of its diagonal ----

/// Moves the centre of the bounding box to the origin and makes its diagonal 1, so that no
/// tolerance depends on the size of the model, nor float rays on its place.
struct UnitFrame {
    Vec centre{0};
    double diagonal = 1;

    Vec point(const Vec& p) const noexcept { return (p - centre) / diagonal; }
    SurfaceJet<double> jet(const SurfaceJet<double>& s) const noexcept {
        return {point(s.p),       s.du / diagonal,  s.dv / diagonal,
                s.duu / diagonal, s.duv / diagonal, s.dvv / diagonal};
    }
};

UnitFrame unit_frame(std::span<const Vec> points) {
    Vec lo(INFINITY), hi(-INFINITY);
    for (const Vec& p : points) {
        lo = glm::min(lo, p);
        hi = glm::max(hi, p);
    }
    const Vec size = hi - lo;
    const double diagonal = std::hypot(size.x, size.y, size.z);
    return {0.5 * lo + 0.5 * hi, diagonal > 0 ? diagonal : 1};
}

/// An even number of segments on each edge of the base mesh: almost all facets get edges of
/// at most 5 pixels, and none is off the surface by more than a tenth of a pixel.
int choose_rate(const Topology& base, const Tessellation& coarse, int coarse_rate,
                const Camera& camera) {
    std::vector<double> lengths;
    double most_off = 0;
    std::size_t first = 0;
    for (const Index n : coarse.facet_sizes) {
        for (Index i = 0; i < n; ++i) {
            const std::size_t a = first + i, b = first + (i + 1) % n;
            const Vec &p = coarse.positions[coarse.facet_points[a]],
                      &q = coarse.positions[coarse.facet_points[b]];
            const double depth = glm::dot(camera.eye - p, camera.back);
            const double length = glm::length(q - p) / (depth * camera.pixel);
            lengths.push_back(length);
            // The height of an arc over its chord is chord times angle over 8.
            const double angle = glm::length(coarse.normals[coarse.facet_normals[b]] -
                                             coarse.normals[coarse.facet_normals[a]]);
            most_off = std::max(most_off, length * angle / 8);
        }
        first += n;
    }
    const auto long_one =
        lengths.begin() + static_cast<std::ptrdiff_t>(0.95 * double(lengths.size()));
    std::ranges::nth_element(lengths, long_one);
    // The height falls with the square of the rate. rate^2 / 2 triangles a corner of a face.
    const double rate =
        std::min(coarse_rate * std::max(*long_one / 5, std::sqrt(most_off / 0.1)),
                 std::sqrt(2 * 1.5e6 / base.n_halfedges()));
    return std::max(2 * static_cast<int>(rate / 2), 2);
}

Status check_finite(const Tessellation& t) {
    for (std::size_t i = 0; i < t.positions.size(); ++i) {
        const Vec& p = t.positions[i];
        if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
            continue;
        const Index face = t.addresses[i].face;
        return fail(ErrorCode::NonFinitePoint,
                    fmt::format("the surface on face {} is not finite everywhere", face),
                    face);
    }
    return ok();
}

// ---- Shadows ----

double hash_to_unit(std::uint32_t x) noexcept {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return (x ^ (x >> 16)) * 0x1p-32;
}

double radical_inverse(std::uint32_t i) noexcept {
    double result = 0, digit = 0.5;
    for (; i != 0; i >>= 1, digit /= 2)
        result += digit * (i & 1);
    return result;
}

/// How much light of an even sky arrives at a point: the part of `n_rays` rays about the
/// normal that meets nothing within `reach`.
double openness(const RayScene& scene, const Vec& p, const Vec& n, int n_rays,
                double reach, std::size_t seed) {
    const Vec helper = std::abs(n.z) < 0.9 ? Vec(0, 0, 1) : Vec(1, 0, 0);
    const Vec s = glm::normalize(glm::cross(helper, n)), t = glm::cross(n, s);
    // Rotated so that points with neighbouring seeds complement each other: multiples of
    // powers of the plastic number's inverse (Roberts' R2 sequence).
    const Vec2<double> shift(glm::fract(0.7548776662466927 * double(seed)),
                             glm::fract(0.5698402909980532 * double(seed)));
    // Off the surface by more than the facets are off it.
    const Vec3<float> origin(p + 5e-4 * n);
    int n_free = 0;
    for (int i = 0; i < n_rays; ++i) {
        const double r2 = (i + shift.x) / n_rays;
        const double turns = radical_inverse(i) + shift.y;
        const double angle = 2 * std::numbers::pi * turns;
        const Vec d = std::sqrt(r2) * (std::cos(angle) * s + std::sin(angle) * t) +
                      std::sqrt(1 - r2) * n;
        n_free +=
            !scene.intersect({origin, Vec3<float>(d), 0.0f, static_cast<float>(reach)});
    }
    return double(n_free) / n_rays;
}

/// The openness at all normals of a tessellation, smoothed along its edges.
/// \param is_inside  whether the normal at a point leads away from where it is seen
template <class F>
std::vector<double> all_openness(const RayScene& scene, const Tessellation& t,
                                 F&& is_inside) {
    const std::size_t n = t.normals.size();
    std::vector<Index> point(n);
    for (std::size_t c = 0; c < t.facet_normals.size(); ++c)
        point[t.facet_normals[c]] = t.facet_points[c];
    const int n_rays = static_cast<int>(std::clamp(2.5e6 / double(n), 4.0, 32.0));
    std::vector<double> open(n);
    detail::for_each_range(n, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec& p = t.positions[point[i]];
            const Vec normal = is_inside(p, t.normals[i]) ? -t.normals[i] : t.normals[i];
            open[i] = normal == Vec(0) ? 1 : openness(scene, p, normal, n_rays, 0.35, i);
        }
    });
    // Few rays are noisy; forty passes average over some hundred points, and blur the
    // shadows by about six.
    std::vector<double> sum(n), weight(n);
    for (int pass = 0; pass < 40; ++pass) {
        for (std::size_t i = 0; i < n; ++i) {
            sum[i] = 2 * open[i];
            weight[i] = 2;
        }
        const Index* corner = t.facet_normals.data();
        for (const Index size : t.facet_sizes) {
            for (Index i = 0; i < size; ++i) {
                const Index a = corner[i], b = corner[(i + 1) % size];
                sum[a] += open[b];
                sum[b] += open[a];
                ++weight[a];
                ++weight[b];
            }
            corner += size;
        }
        for (std::size_t i = 0; i < n; ++i)
            open[i] = sum[i] / weight[i];
    }
    return open;
}

/// Soft shadow of the surface on a plane below it, on a grid.
class GroundShadow {
public:
    GroundShadow() = default;
    GroundShadow(const RayScene& scene, std::span<const Vec> points, int up) : up_(up) {
        lo_ = Vec(INFINITY);
        Vec hi(-INFINITY);
        for (const Vec& p : points) {
            lo_ = glm::min(lo_, p);
            hi = glm::max(hi, p);
        }
        // Half a diagonal further the shadow has faded.
        const double height = lo_[up] - 1e-3;
        lo_ -= Vec(0.5);
        lo_[up] = height;
        step_ = (hi + Vec(0.5) - lo_) / double(kSize - 1);
        shade_.resize(kSize * kSize);
        Vec normal(0);
        normal[up] = 1;
        detail::for_each_task(kSize, [&](int j) {
            for (int i = 0; i < kSize; ++i) {
                Vec p = lo_;
                p[(up + 1) % 3] += i * step_[(up + 1) % 3];
                p[(up + 2) % 3] += j * step_[(up + 2) % 3];
                shade_[j * kSize + i] =
                    1 - openness(scene, p, normal, 48, 1.0,
                                 static_cast<std::size_t>(j * kSize + i));
            }
        });
        for (int pass = 0; pass < 4; ++pass)
            blur();
    }

    /// The shadow where a ray meets the plane, 0 to 1.
    double at(const Vec& eye, const Vec& direction) const noexcept {
        if (shade_.empty() || direction[up_] >= 0 || eye[up_] <= lo_[up_])
            return 0;
        const Vec p = eye + (lo_[up_] - eye[up_]) / direction[up_] * direction;
        const double x = (p[(up_ + 1) % 3] - lo_[(up_ + 1) % 3]) / step_[(up_ + 1) % 3],
                     y = (p[(up_ + 2) % 3] - lo_[(up_ + 2) % 3]) / step_[(up_ + 2) % 3];
        if (!(x >= 0 && y >= 0 && x < kSize - 1 && y < kSize - 1))
            return 0;
        const int i = static_cast<int>(x), j = static_cast<int>(y);
        const double* s = &shade_[j * kSize + i];
        const double fx = x - i, fy = y - j;
        const double value = std::lerp(std::lerp(s[0], s[1], fx),
                                       std::lerp(s[kSize], s[kSize + 1], fx), fy);
        // Ends with the grid, and without a line at the horizon.
        const auto fade = [](double f) {
            return std::min({1.0, f / 16, (kSize - 1 - f) / 16});
        };
        const double steep = -direction[up_] / glm::length(direction);
        return value * fade(x) * fade(y) * std::min(1.0, 6 * steep);
    }

private:
    static constexpr int kSize = 128;

    void blur() {
        std::vector<double> next(shade_);
        for (int j = 1; j + 1 < kSize; ++j) {
            for (int i = 1; i + 1 < kSize; ++i) {
                const double* s = &shade_[j * kSize + i];
                next[j * kSize + i] =
                    (4 * s[0] + 2 * (s[-1] + s[1] + s[-kSize] + s[kSize]) +
                     s[-kSize - 1] + s[-kSize + 1] + s[kSize - 1] + s[kSize + 1]) /
                    16;
            }
        }
        shade_ = std::move(next);
    }

    int up_ = 2;
    Vec lo_{0}, step_{1};
    std::vector<double> shade_;
};

// ---- The renderer ----

/// Where a ray meets the surface.
struct Hit {
    QuarterPoint at;
    SurfaceJet<double> original;  // in units of the mesh
    SurfaceJet<double> jet;       // in units of the diagonal
    Vec direction;                // of the ray, unit
    double t;                     // distance from the eye
    Vec normal;                   // unit, towards the eye; of the facet if there is none
    bool regular;                 // the surface has a normal
    double open;
};

class Renderer {
public:
    Renderer(const PictureInput& input, const PictureOptions& options)
        : input_(input),
          o_(options),
          text_scale_(std::max(1.0, std::round(o_.height / 360.0))) {}

    Status prepare() {
        const Topology& base = *input_.base;
        constexpr int coarse_rate = 4;
        const ResolvedFeatures none;
        const ResolvedFeatures& features = input_.features ? *input_.features : none;
        Tessellation coarse = tessellate(base, features, coarse_rate, input_.surface);
        if (coarse.positions.empty())
            return fail(ErrorCode::EmptyMesh, "the surface has no faces");
        if (const Status finite = check_finite(coarse); !finite)
            return finite;
        const UnitFrame coarse_frame = unit_frame(coarse.positions);
        for (Vec& p : coarse.positions)
            p = coarse_frame.point(p);
        const int rate = choose_rate(base, coarse, coarse_rate,
                                     make_camera(coarse.positions, o_, margins()));

        tessellation_ = tessellate(base, features, rate, input_.surface);
        if (const Status finite = check_finite(tessellation_); !finite)
            return finite;
        frame_ = unit_frame(tessellation_.positions);
        for (Vec& p : tessellation_.positions)
            p = frame_.point(p);
        triangles_ = triangle_corners(tessellation_);
        Result<TessellatedScene> scene = TessellatedScene::build(tessellation_);
        if (!scene)
            return scene.error();
        scene_.emplace(std::move(*scene));
        camera_ = make_camera(tessellation_.positions, o_, margins());

        if (o_.shade == Shade::Phong) {
            // A closed surface is seen from outside, wherever its normals point; of an open
            // one the side that faces the camera counts.
            const bool closed =
                std::ranges::find(base.twin, kInvalidIndex) == base.twin.end() &&
                std::ranges::find(features.hole, true) == features.hole.end();
            const bool inside_out = signed_volume() < 0;
            open_ = all_openness(
                scene_->rays(), tessellation_, [&](const Vec& p, const Vec& normal) {
                    return closed ? inside_out : glm::dot(camera_.eye - p, normal) < 0;
                });
            ground_ = GroundShadow(scene_->rays(), tessellation_.positions,
                                   static_cast<int>(o_.up));
        }
        range_ = choose_range();
        return ok();
    }

    Image render() const {
        Image image{o_.width, o_.height,
                    std::vector<Color>(static_cast<std::size_t>(o_.width) * o_.height)};
        const int n = o_.samples;
        detail::for_each_task(o_.height, [&](int y) {
            for (int x = 0; x < o_.width; ++x) {
                Vec sum(0);
                for (int j = 0; j < n; ++j) {
                    for (int i = 0; i < n; ++i)
                        sum += sample(x + (i + 0.5) / n, y + (j + 0.5) / n);
                }
                image.at(x, y) = to_color(sum / double(n * n));
            }
        });
        if (o_.legend)
            draw_legend(image);
        return image;
    }

private:
    Margins margins() const {
        const double margin = 0.05 * std::min(o_.width, o_.height);
        if (!o_.legend)
            return {margin, margin, margin, margin};
        const double line = text_scale_ * kLineHeight;
        return {margin, margin, margin + std::min(line, 0.1 * o_.height),
                margin + std::min(2.5 * line, 0.2 * o_.height)};
    }

    const Vec& corner(Index c) const {
        return tessellation_.positions[tessellation_.facet_points[c]];
    }

    double signed_volume() const {
        double six_volumes = 0;
        for (const auto& t : triangles_)
            six_volumes += glm::dot(corner(t[0]), glm::cross(corner(t[1]), corner(t[2])));
        return six_volumes / 6;
    }

    /// The surface near the point of the facets that a ray met, moved to the ray by Newton's
    /// method where the facets are off the surface.
    Hit on_ray(Address at, const Vec& direction, double t) const {
        Hit hit{};
        hit.direction = direction;
        const auto evaluate = [&](const Address& a) {
            hit.at = to_quarter(*input_.base, a);
            hit.original = input_.surface(hit.at);
            hit.jet = frame_.jet(hit.original);
            hit.t = glm::dot(hit.jet.p - camera_.eye, direction);
            return hit.jet.p - camera_.eye - hit.t * direction;
        };
        Vec off = evaluate(at);
        // Nobody sees a fiftieth of a pixel; two steps square the error twice.
        for (int step = 0; step < 2 && glm::length(off) > 0.02 * camera_.pixel * t;
             ++step) {
            // off + du a + dv b + direction c = 0.
            const Vec &u = hit.jet.du, &v = hit.jet.dv;
            const Vec n = glm::cross(u, v);
            const double det = glm::dot(n, direction);
            const Address next{at.face,
                               at.u - glm::dot(glm::cross(off, v), direction) / det,
                               at.v - glm::dot(glm::cross(u, off), direction) / det};
            const Hit before = hit;
            const Vec after = std::isfinite(next.u) && std::isfinite(next.v)
                                  ? evaluate(next)
                                  : Vec(INFINITY);
            if (!(glm::length(after) < glm::length(off))) {
                hit = before;
                break;
            }
            off = after;
            at = next;
        }
        return hit;
    }

    std::optional<Hit> find(double x, double y) const {
        const Vec direction = glm::normalize(camera_.direction(x, y));
        const auto found =
            scene_->rays().intersect({Vec3<float>(camera_.eye), Vec3<float>(direction)});
        if (!found)
            return std::nullopt;
        Hit hit = on_ray(scene_->address(*found), direction, found->t);

        const auto& [a, b, c] = triangles_[found->triangle];
        Vec facet = glm::cross(corner(b) - corner(a), corner(c) - corner(a));
        const double length = glm::length(facet);
        facet = length > 0 ? facet / length : -direction;
        // Seen from behind, both turn round.
        const double side = glm::dot(facet, direction) > 0 ? -1 : 1;
        hit.normal = side * osdx::normal(hit.jet);
        hit.regular = hit.normal != Vec(0);
        if (!hit.regular)
            hit.normal = side * facet;
        // On the silhouette, where the facet still shows, it may look away by a hair.
        const double away = glm::dot(hit.normal, direction);
        if (away > 0) {
            const Vec bent = hit.normal - away * direction;
            const double size = glm::length(bent);
            hit.normal = size > 0.1 ? bent / size : side * facet;
        }
        const auto& at = tessellation_.facet_normals;
        hit.open = open_.empty() ? 1
                                 : (1 - found->u - found->v) * open_[at[a]] +
                                       found->u * open_[at[b]] + found->v * open_[at[c]];
        return hit;
    }

    // ---- Values and their ranges ----

    bool has_map() const noexcept {
        return o_.shade == Shade::Mean || o_.shade == Shade::Gauss ||
               o_.shade == Shade::Distance;
    }

    double value(const Hit& hit) const {
        if (o_.shade == Shade::Distance)
            return input_.distance(hit.original, hit.at);
        const Curvature<double> k = curvature(hit.jet);
        return o_.shade == Shade::Mean ? k.mean : k.gauss;
    }

    Vec map(double v) const noexcept {
        if (!std::isfinite(v))
            return to_linear(Vec(150));
        if (o_.shade == Shade::Distance)
            return color_map(kSequential, v / range_);
        return color_map(kDiverging, 0.5 + 0.5 * v / range_);
    }

    /// Rounded up to two digits, the second even: the legend tells it and its half.
    double choose_range() const {
        if (!has_map())
            return 1;
        if (o_.range)
            return *o_.range;
        // Some 40000 points of the picture are enough for a percentile.
        const double area = double(o_.width) * o_.height;
        const int step = std::max(1, static_cast<int>(std::sqrt(area / 40000)));
        const int n_rows = (o_.height + step - 1) / step;
        std::vector<std::vector<double>> rows(n_rows);
        detail::for_each_task(n_rows, [&](int row) {
            for (int x = 0; x < o_.width; x += step) {
                if (const auto hit = find(x + 0.5, row * step + 0.5)) {
                    const double v = std::abs(value(*hit));
                    if (std::isfinite(v))
                        rows[row].push_back(v);
                }
            }
        });
        std::vector<double> values;
        for (const auto& row : rows)
            values.insert(values.end(), row.begin(), row.end());
        if (values.empty())
            return 1;
        const double part = o_.shade == Shade::Distance ? 1 : 0.95;
        const auto at = values.begin() +
                        static_cast<std::ptrdiff_t>(part * double(values.size() - 1));
        std::ranges::nth_element(values, at);
        // Below this the curvature of a plane is rounding, and so is a distance.
        const double least = o_.shade == Shade::Distance ? 1e-15 : 1e-6;
        const double range = std::max(*at, least);
        const double unit = std::pow(10, std::floor(std::log10(range)) - 1) * 2;
        return unit * std::ceil(range / unit * (1 - 1e-9));
    }

    // ---- Shading, in linear light ----

    Vec sample(double x, double y) const {
        const std::optional<Hit> hit = find(x, y);
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
                return faint(*hit) * map(value(*hit));
            case Shade::Patches:
                return patches(*hit);
            case Shade::Checker:
                return checker(*hit);
        }
        return {};
    }

    Vec background(double x, double y) const {
        const Vec color = glm::mix(to_linear(Vec(247, 248, 250)),
                                   to_linear(Vec(222, 225, 230)), y / o_.height);
        return (1 - 0.75 * ground_.at(camera_.eye, camera_.direction(x, y))) * color;
    }

    /// Towards a light: right, up and back in the camera's axes.
    Vec towards(double right, double up, double back) const {
        return glm::normalize(right * camera_.right + up * camera_.up +
                              back * camera_.back);
    }

    Vec clay(const Hit& hit) const {
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
            light += (0.4 + 0.6 * open) *
                     std::max(0.0, (cosine + l.wrap) / (1 + l.wrap)) * l.color;
            const Vec half = glm::normalize(l.direction - hit.direction);
            const double h = std::max(0.0, glm::dot(hit.normal, half));
            if (cosine > 0)
                shine += l.color.x * std::pow(h, 40) * std::min(1.0, 8 * cosine);
        }
        return albedo * light + 0.22 * open * shine;
    }

    /// Enough to see the form, little enough to read colours: 1 where it faces the eye.
    double faint(const Hit& hit) const noexcept {
        const double facing = -glm::dot(hit.normal, hit.direction);
        return 0.62 + 0.38 * facing;
    }

    /// Change of the ray's direction, and of the point where it meets the tangent plane, over
    /// one sample.
    struct Step {
        Vec direction, point;
    };

    /// To the right and down.
    /// Source: Igehy, Tracing ray differentials (1999).
    std::array<Step, 2> ray_steps(const Hit& hit) const noexcept {
        const Vec &d = hit.direction, &n = hit.normal;
        const double cosine = std::min(glm::dot(d, n), -1e-3);
        // d is (direction of Camera) / length, whose part along -back is 1.
        const double step = -camera_.pixel / o_.samples * glm::dot(d, camera_.back);
        std::array<Step, 2> result;
        for (int axis = 0; axis < 2; ++axis) {
            const Vec side = axis == 0 ? camera_.right : -camera_.up;
            const Vec dd = step * (side - glm::dot(d, side) * d);
            result[axis] = {dd, hit.t * (dd - glm::dot(dd, n) / cosine * d)};
        }
        return result;
    }

    /// A vector of the tangent plane as steps along du and dv; zero where these are parallel.
    static Vec2<double> in_uv(const SurfaceJet<double>& jet, const Vec& dp) noexcept {
        const Vec &u = jet.du, &v = jet.dv;
        const double E = glm::dot(u, u), F = glm::dot(u, v), G = glm::dot(v, v);
        const double pu = glm::dot(dp, u), pv = glm::dot(dp, v), det = E * G - F * F;
        if (!(det > 0))
            return {0, 0};
        return {(G * pu - F * pv) / det, (E * pv - F * pu) / det};
    }

    /// Change of the mirrored direction over one sample to the right and one down, with the
    /// normal's change from the second derivatives (Weingarten).
    std::array<Vec, 2> mirrored_steps(const Hit& hit) const noexcept {
        const Vec &d = hit.direction, &n = hit.normal;
        const Vec &u = hit.jet.du, &v = hit.jet.dv;
        const double E = glm::dot(u, u), F = glm::dot(u, v), G = glm::dot(v, v);
        const double L = glm::dot(n, hit.jet.duu), M = glm::dot(n, hit.jet.duv),
                     N = glm::dot(n, hit.jet.dvv), det = E * G - F * F;
        const std::array<Step, 2> steps = ray_steps(hit);
        std::array<Vec, 2> result;
        for (int axis = 0; axis < 2; ++axis) {
            const auto& [dd, dp] = steps[axis];
            Vec dn(0);
            if (hit.regular && det > 0) {
                const Vec2<double> uv = in_uv(hit.jet, dp);
                const double nu = -(L * uv.x + M * uv.y), nv = -(M * uv.x + N * uv.y);
                dn = (G * nu - F * nv) / det * u + (E * nv - F * nu) / det * v;
            }
            result[axis] = dd - 2.0 * (glm::dot(d, n) * dn +
                                       (glm::dot(dd, n) + glm::dot(d, dn)) * n);
        }
        return result;
    }

    /// The mean, over the width, of the square wave that is 1 on the first half of each whole
    /// number.
    static double square_wave(double at, double width) noexcept {
        const auto integral = [](double s) {
            const double whole = std::floor(s);
            return 0.5 * whole + std::min(s - whole, 0.5);
        };
        width = std::min(width, 1e6);
        return (integral(at + 0.5 * width) - integral(at - 0.5 * width)) / width;
    }

    Vec checker(const Hit& hit) const {
        constexpr double n_cells = 8;
        const TextureJet uv = input_.texture(hit.at);
        Vec2<double> width(1e-6);  // of a sample, in pairs of cells; never zero
        for (const Step& step : ray_steps(hit)) {
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
    Vec tubes(const Hit& hit) const {
        constexpr int n_tubes = 12;
        const Vec r = glm::reflect(hit.direction, hit.normal);
        const double cosine = std::clamp(glm::dot(r, camera_.up), -1.0, 1.0);
        const double sine = std::sqrt(1 - cosine * cosine);
        // A quarter more: both poles are in the middle of a tube, which is even about them.
        const double at = 0.25 + n_tubes * std::acos(cosine) / std::numbers::pi;
        double width = 0.03;  // in tubes: edges as crisp as they can be, without stairs
        for (const Vec& dr : mirrored_steps(hit)) {
            // At the poles the quotient has no limit, but no angle changes by more than dr.
            const double along = std::abs(glm::dot(dr, camera_.up)),
                         all = glm::length(dr);
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
    double lit(const Hit& hit) const {
        const double key = std::max(0.0, glm::dot(hit.normal, towards(-0.4, 0.6, 0.7)));
        return 0.30 + 0.30 * -glm::dot(hit.normal, hit.direction) + 0.42 * key;
    }

    Vec patches(const Hit& hit) const {
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

    // ---- Legend ----

    void draw_legend(Image& image) const {
        const double s = text_scale_;
        draw_text(image, 6 * s, 5 * s, input_.title, s, kInk);
        if (has_map())
            draw_color_bar(image);
        if (o_.shade == Shade::Patches)
            draw_groups(image);
    }

    void draw_color_bar(Image& image) const {
        const double s = text_scale_, line = s * kLineHeight;
        const double length = std::min(0.8 * o_.width, 220 * s);
        const double x0 = std::round(0.5 * (o_.width - length)),
                     y0 = std::round(o_.height - 1.2 * line - 9 * s);
        const bool signed_values = o_.shade != Shade::Distance;
        const double lowest = signed_values ? -range_ : 0;

        fill_box(image, {x0 - 1, y0 - 1, x0 + length + 1, y0 + 8 * s + 1}, kInk);
        for (int x = 0; x < length; ++x) {
            const double v = std::lerp(lowest, range_, (x + 0.5) / length);
            fill_box(image, {x0 + x, y0, std::min(x0 + x + 1, x0 + length), y0 + 8 * s},
                     to_color(map(v)));
        }
        const std::string caption = o_.shade == Shade::Mean ? "mean curvature x diagonal"
                                    : o_.shade == Shade::Gauss
                                        ? "Gauss curvature x diagonal^2"
                                        : "distance / diagonal";
        centred(image, 0.5 * o_.width, y0 - line + s, caption);
        const int n_ticks = signed_values ? 5 : 3;
        for (int i = 0; i < n_ticks; ++i) {
            const double f = double(i) / (n_ticks - 1), x = x0 + f * length;
            fill_box(image, {x - 0.5 * s, y0 + 8 * s, x + 0.5 * s, y0 + 10 * s}, kInk);
            centred(image, x, y0 + 11 * s,
                    fmt::format("{:.3g}", std::lerp(lowest, range_, f)));
        }
    }

    void centred(Image& image, double x, double y, std::string_view text) const {
        const double width = text_width(text, text_scale_);
        draw_text(image, std::round(x - 0.5 * width), y, text, text_scale_, kInk);
    }

    /// Rows of coloured squares with names, as many as fit below each other.
    void draw_groups(Image& image) const {
        const double s = text_scale_, row_height = s * kLineHeight;
        const double left = 6 * s, right = o_.width - 6 * s, gap = 12 * s;
        const auto width = [&](const PatchGroup& g) {
            return row_height + text_width(group_name(g), s);
        };
        std::vector<std::vector<PatchGroup>> rows(1);
        double x = left;
        for (const PatchGroup& g : input_.patch_groups) {
            if (x > left && x + width(g) > right) {
                rows.emplace_back();
                x = left;
            }
            rows.back().push_back(g);
            x += width(g) + gap;
        }
        double y = o_.height - 4 * s - row_height * double(rows.size());
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

    static constexpr Color kInk{40, 42, 48};

    const PictureInput& input_;
    const PictureOptions& o_;
    double text_scale_;
    Tessellation tessellation_;                    // in units of the diagonal
    std::vector<std::array<Index, 3>> triangles_;  // of facet corners
    UnitFrame frame_;
    std::optional<TessellatedScene> scene_;
    Camera camera_{};
    std::vector<double> open_;  // per normal
    GroundShadow ground_;
    double range_ = 1;
};

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
    input.surface = surface.function(Chart::Native);
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
    Renderer renderer(input, options);
    if (const Status prepared = renderer.prepare(); !prepared)
        return prepared.error();
    return renderer.render();
}

}  // namespace osdx
