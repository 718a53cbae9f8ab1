// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <osdx/query.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/topology.h>

#include "viewer/render/openness.h"

namespace osdx::render {
namespace {

using Vec = Vec3<double>;

constexpr int kCoarseRate = 4;

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

/// Makes a tessellation one in units of its diagonal.
UnitFrame to_unit(Tessellation& t) {
    const UnitFrame frame = unit_frame(t.positions);
    for (Vec& p : t.positions)
        p = frame.point(p);
    return frame;
}

/// An even number of segments on each edge of the base mesh: almost all facets get edges of
/// at most 5 pixels, and none is off the surface by more than a tenth of a pixel.
int choose_rate(const Topology& base, const Tessellation& coarse, const Camera& camera) {
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
        std::min(kCoarseRate * std::max(*long_one / 5, std::sqrt(most_off / 0.1)),
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

}  // namespace

const ResolvedFeatures& Scene::features() const noexcept {
    static const ResolvedFeatures none;
    return input_->features ? *input_->features : none;
}

Result<Scene> Scene::build(const PictureInput& input, const PictureOptions& options,
                           const Margins& margins) {
    const Topology& base = *input.base;
    Scene s(input);
    Tessellation coarse = tessellate(base, s.features(), kCoarseRate, input.surface);
    if (coarse.positions.empty())
        return fail(ErrorCode::EmptyMesh, "the surface has no faces");
    if (const Status finite = check_finite(coarse); !finite)
        return finite.error();
    to_unit(coarse);
    const int rate =
        choose_rate(base, coarse, make_camera(coarse.positions, options, margins));

    s.tessellation_ = tessellate(base, s.features(), rate, input.surface);
    if (const Status finite = check_finite(s.tessellation_); !finite)
        return finite.error();
    s.frame_ = to_unit(s.tessellation_);
    s.triangles_ = triangle_corners(s.tessellation_);
    Result<TessellatedScene> scene = TessellatedScene::build(s.tessellation_);
    if (!scene)
        return scene.error();
    s.scene_.emplace(std::move(*scene));
    s.camera_ = make_camera(s.tessellation_.positions, options, margins);
    if (options.shade == Shade::Phong)
        s.look_at_sky();
    return s;
}

/// A closed surface is seen from outside, wherever its normals point; of an open one the side
/// that faces the camera counts.
void Scene::look_at_sky() {
    const Topology& base = *input_->base;
    const bool closed = std::ranges::find(base.twin, kInvalidIndex) == base.twin.end() &&
                        std::ranges::find(features().hole, true) == features().hole.end();
    const bool inside_out = signed_volume() < 0;
    open_ = all_openness(rays(), tessellation_, [&](const Vec& p, const Vec& normal) {
        return closed ? inside_out : glm::dot(camera_.eye - p, normal) < 0;
    });
}

double Scene::signed_volume() const {
    double six_volumes = 0;
    for (const auto& t : triangles_)
        six_volumes += glm::dot(corner(t[0]), glm::cross(corner(t[1]), corner(t[2])));
    return six_volumes / 6;
}

/// The surface near the point of the facets that a ray met, moved to the ray where the facets
/// are off the surface.
Hit Scene::on_ray(const Address& start, const Vec& direction, double t) const {
    const SurfaceFunction surface = [this](const QuarterPoint& q) {
        return frame_.jet(input_->surface(q));
    };
    // Nobody sees a fiftieth of a pixel; two steps square the error twice.
    const RayPoint found = intersect_ray(*input_->base, surface, camera_.eye, direction,
                                         start, 0.02 * camera_.pixel * t, 2);
    Hit hit;
    hit.at = found.at;
    hit.jet = found.jet;
    hit.direction = direction;
    hit.t = found.t;
    return hit;
}

std::optional<Hit> Scene::find(double x, double y) const {
    const Vec direction = glm::normalize(camera_.direction(x, y));
    const auto found = scene_->rays().intersect({camera_.eye, direction});
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

}  // namespace osdx::render
