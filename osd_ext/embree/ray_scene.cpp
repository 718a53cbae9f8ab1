// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <osdx/embree/ray_scene.h>

#ifdef OSDX_HAS_EMBREE
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#endif

namespace osdx::inline OSDX_ABI {

#ifdef OSDX_HAS_EMBREE

namespace {

struct Release {
    void operator()(RTCDevice device) const noexcept { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const noexcept { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const noexcept { rtcReleaseGeometry(geometry); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release>;

void trace(RTCScene scene, RTCRayHit& ray_hit) noexcept {
#if RTC_VERSION_MAJOR >= 4
    rtcIntersect1(scene, &ray_hit);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &ray_hit);
#endif
}

/// The point of a triangle nearest to p, as (u, v) of RayHit, by the regions of Ericson,
/// Real-Time Collision Detection (2005), 5.1.5.
Vec2<double> nearest_in_triangle(const Vec3<double>& p, const Vec3<double>& a,
                                 const Vec3<double>& b, const Vec3<double>& c) noexcept {
    const Vec3<double> ab = b - a, ac = c - a;
    const double d1 = glm::dot(ab, p - a), d2 = glm::dot(ac, p - a);
    if (d1 <= 0 && d2 <= 0)
        return {0, 0};
    const double d3 = glm::dot(ab, p - b), d4 = glm::dot(ac, p - b);
    if (d3 >= 0 && d4 <= d3)
        return {1, 0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0)
        return {d1 / (d1 - d3), 0};
    const double d5 = glm::dot(ab, p - c), d6 = glm::dot(ac, p - c);
    if (d6 >= 0 && d5 <= d6)
        return {0, 1};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0)
        return {0, d2 / (d2 - d6)};
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {1 - w, w};
    }
    const double inverse = 1 / (va + vb + vc);
    return {vb * inverse, vc * inverse};
}

}  // namespace

struct RayScene::Impl {
    Device device;
    Scene scene;
    std::vector<Vec3<float>> points;
    std::vector<std::array<Index, 3>> triangles;
};

Result<RayScene> RayScene::build(std::span<const Vec3<float>> points,
                                 std::span<const std::array<Index, 3>> triangles) {
    for (Index i = 0; i < points.size(); ++i) {
        const auto& p = points[i];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
            return fail(ErrorCode::NonFinitePoint,
                        fmt::format("point {} is ({}, {}, {})", i, p.x, p.y, p.z), i);
        }
    }
    for (Index i = 0; i < triangles.size(); ++i) {
        if (std::ranges::max(triangles[i]) >= points.size()) {
            return fail(ErrorCode::IndexOutOfRange,
                        fmt::format("triangle {} names a missing point", i), i);
        }
    }

    auto impl = std::make_unique<Impl>();
    impl->points.assign(points.begin(), points.end());
    impl->triangles.assign(triangles.begin(), triangles.end());
    impl->device.reset(rtcNewDevice(nullptr));
    if (!impl->device)
        return fail(ErrorCode::DeviceFailure, "Embree has no device on this machine");
    impl->scene.reset(rtcNewScene(impl->device.get()));
    // Robust: no ray slips through the common edge of two triangles.
    rtcSetSceneFlags(impl->scene.get(), RTC_SCENE_FLAG_ROBUST);

    const Geometry geometry(
        rtcNewGeometry(impl->device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    // Embree owns both buffers, and pads the last point to the 16 bytes that it reads.
    void* p =
        rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0,
                                RTC_FORMAT_FLOAT3, sizeof(Vec3<float>), points.size());
    void* t = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0,
                                      RTC_FORMAT_UINT3, sizeof(std::array<Index, 3>),
                                      triangles.size());
    if (rtcGetDeviceError(impl->device.get()) != RTC_ERROR_NONE)
        return fail(ErrorCode::DeviceFailure, "Embree has no memory for the mesh");
    std::ranges::copy(points, static_cast<Vec3<float>*>(p));
    std::ranges::copy(triangles, static_cast<std::array<Index, 3>*>(t));
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(impl->scene.get(), geometry.get());
    rtcCommitScene(impl->scene.get());
    if (rtcGetDeviceError(impl->device.get()) != RTC_ERROR_NONE)
        return fail(ErrorCode::DeviceFailure, "Embree could not build the hierarchy");
    return RayScene(std::move(impl));
}

std::optional<RayHit> RayScene::intersect(const Ray& ray) const noexcept {
    RTCRayHit r{};
    r.ray.org_x = ray.origin.x;
    r.ray.org_y = ray.origin.y;
    r.ray.org_z = ray.origin.z;
    r.ray.tnear = ray.t_near;
    r.ray.dir_x = ray.direction.x;
    r.ray.dir_y = ray.direction.y;
    r.ray.dir_z = ray.direction.z;
    r.ray.tfar = ray.t_far;
    r.ray.mask = ~0u;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    trace(impl_->scene.get(), r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return std::nullopt;
    return RayHit{r.hit.primID, r.ray.tfar, r.hit.u, r.hit.v};
}

std::optional<RayHit> RayScene::nearest(const Vec3<float>& point) const noexcept {
    struct Search {
        const Impl* impl;
        Vec3<double> point;
        double distance;
        RayHit hit;
    } search{impl_.get(), Vec3<double>(point), INFINITY, {}};

    const auto visit = [](RTCPointQueryFunctionArguments* args) -> bool {
        auto& s = *static_cast<Search*>(args->userPtr);
        const auto& t = s.impl->triangles[args->primID];
        const Vec3<double> a(s.impl->points[t[0]]), b(s.impl->points[t[1]]),
            c(s.impl->points[t[2]]);
        const Vec2<double> uv = nearest_in_triangle(s.point, a, b, c);
        const double d = glm::length(a + uv.x * (b - a) + uv.y * (c - a) - s.point);
        if (d >= s.distance)
            return false;
        s.distance = d;
        s.hit = {args->primID, static_cast<float>(d), static_cast<float>(uv.x),
                 static_cast<float>(uv.y)};
        args->query->radius = static_cast<float>(d);
        return true;  // the radius has changed
    };
    RTCPointQuery query{};
    query.x = point.x;
    query.y = point.y;
    query.z = point.z;
    query.radius = INFINITY;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(impl_->scene.get(), &query, &context, visit, &search);
    if (search.hit.triangle == kInvalidIndex)
        return std::nullopt;
    return search.hit;
}

#else

struct RayScene::Impl {};

Result<RayScene> RayScene::build(std::span<const Vec3<float>>,
                                 std::span<const std::array<Index, 3>>) {
    return fail(ErrorCode::NotBuilt, "osdx was built without Embree");
}
std::optional<RayHit> RayScene::intersect(const Ray&) const noexcept {
    return {};
}
std::optional<RayHit> RayScene::nearest(const Vec3<float>&) const noexcept {
    return {};
}

#endif

RayScene::RayScene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;

Result<TessellatedScene> TessellatedScene::build(const Tessellation& t) {
    const std::vector<Vec3<float>> points(t.positions.begin(), t.positions.end());
    const auto tris = triangles(t);
    Result<RayScene> rays = RayScene::build(points, tris);
    if (!rays)
        return rays.error();
    TessellatedScene scene(std::move(*rays));
    scene.faces_.reserve(tris.size());
    scene.corners_.reserve(tris.size());
    const Vec2<double>* uv = t.facet_uvs.data();
    for (Index f = 0; f < t.facet_sizes.size(); ++f) {
        for (Index c = 2; c < t.facet_sizes[f]; ++c) {
            scene.faces_.push_back(t.facet_faces[f]);
            scene.corners_.push_back({uv[0], uv[c - 1], uv[c]});
        }
        uv += t.facet_sizes[f];
    }
    return scene;
}

Address TessellatedScene::address(const RayHit& hit) const noexcept {
    const auto& c = corners_[hit.triangle];
    const double u = hit.u, v = hit.v;
    const Vec2<double> p = (1 - u - v) * c[0] + u * c[1] + v * c[2];
    return {faces_[hit.triangle], p.x, p.y};
}

}  // namespace osdx::inline OSDX_ABI
