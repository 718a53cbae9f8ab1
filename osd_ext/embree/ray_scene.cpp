// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <osdx/embree/ray_scene.h>
#include <osdx/surface_jet.h>

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

/// Where the triangles are around the origin, with coordinates of at most 1.
struct Frame {
    Vec3<double> centre{0};
    int exponent = 0;  ///< lengths are divided by 2 to this power

    static Frame around(std::span<const Vec3<double>> points) noexcept {
        Frame frame;
        if (points.empty())
            return frame;
        Vec3<double> lo = points[0], hi = points[0];
        for (const Vec3<double>& p : points) {
            lo = glm::min(lo, p);
            hi = glm::max(hi, p);
        }
        frame.centre = 0.5 * lo + 0.5 * hi;
        const Vec3<double> half = 0.5 * hi - 0.5 * lo;
        const double size = std::max({half.x, half.y, half.z});
        if (size > 0)
            frame.exponent = std::ilogb(size) + 1;
        return frame;
    }
    Vec3<double> scaled(const Vec3<double>& d) const noexcept {
        return detail::in_units(d, exponent);
    }
    Vec3<double> point(const Vec3<double>& p) const noexcept {
        return scaled(p - centre);
    }
};

/// A ray in a Frame, with the axes in an order in which the last one, z, is the longest of its
/// direction, and sheared along z.
struct ShearedRay {
    int x, y, z;
    Vec3<double> origin, shear;

    ShearedRay(const Vec3<double>& from, const Vec3<double>& d) noexcept : origin(from) {
        const Vec3<double> size = glm::abs(d);
        z = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        x = (z + 1) % 3;
        y = (z + 2) % 3;
        shear = {d[x] / d[z], d[y] / d[z], 1 / d[z]};
    }

    /// What depends on a point alone is the same for all triangles at it. In x and y as floats:
    /// products of two are doubles without rounding.
    Vec3<double> point(const Vec3<float>& p) const noexcept {
        const Vec3<double> d = Vec3<double>(p) - origin;
        return {static_cast<float>(d[x] - shear.x * d[z]),
                static_cast<float>(d[y] - shear.y * d[z]), shear.z * d[z]};
    }

    /// The sign of this is right, and that of (b, a) the other one.
    static double edge(const Vec3<double>& a, const Vec3<double>& b) noexcept {
        return a.x * b.y - a.y * b.x;
    }

    /// With the ray's t in the Frame; nothing where it runs along the triangle.
    std::optional<RayHit> meet(const Vec3<float>& p0, const Vec3<float>& p1,
                               const Vec3<float>& p2) const noexcept {
        const Vec3<double> a = point(p0), b = point(p1), c = point(p2);
        const double at_a = edge(b, c), at_b = edge(c, a), at_c = edge(a, b);
        if ((at_a < 0 || at_b < 0 || at_c < 0) && (at_a > 0 || at_b > 0 || at_c > 0))
            return std::nullopt;
        const double sum = at_a + at_b + at_c;
        if (sum == 0)
            return std::nullopt;
        RayHit hit;
        hit.u = at_b / sum;
        hit.v = at_c / sum;
        hit.t = (at_a * a.z + at_b * b.z + at_c * c.z) / sum;
        return hit;
    }
};

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
    static void bounds(const RTCBoundsFunctionArguments* args) noexcept;
    static void meet(const RTCIntersectFunctionNArguments* args) noexcept;

    Device device;
    Scene scene;
    Frame frame;
    std::vector<Vec3<float>> points;  // in the frame
    std::vector<std::array<Index, 3>> triangles;
};

namespace {

/// Larger than what rounding moves floats in the box around a Frame, of the points, of the
/// sheared ones and of the ray that Embree takes through its boxes.
constexpr float kPad = 4e-6f;

/// What a callback knows of its ray.
struct RayContext {
#if RTC_VERSION_MAJOR >= 4
    RTCRayQueryContext embree;
#else
    RTCIntersectContext embree;
#endif
    ShearedRay ray;
    double near, far;
    std::optional<RayHit> hit;
};

}  // namespace

void RayScene::Impl::bounds(const RTCBoundsFunctionArguments* args) noexcept {
    const auto& impl = *static_cast<const Impl*>(args->geometryUserPtr);
    const auto& t = impl.triangles[args->primID];
    const Vec3<float>&a = impl.points[t[0]], &b = impl.points[t[1]],
          &c = impl.points[t[2]];
    const Vec3<float> lo = glm::min(glm::min(a, b), c) - kPad,
                      hi = glm::max(glm::max(a, b), c) + kPad;
    RTCBounds& box = *args->bounds_o;
    box.lower_x = lo.x;
    box.lower_y = lo.y;
    box.lower_z = lo.z;
    box.upper_x = hi.x;
    box.upper_y = hi.y;
    box.upper_z = hi.z;
}

void RayScene::Impl::meet(const RTCIntersectFunctionNArguments* args) noexcept {
    const auto& impl = *static_cast<const Impl*>(args->geometryUserPtr);
    auto& context = *reinterpret_cast<RayContext*>(args->context);
    const auto& t = impl.triangles[args->primID];
    std::optional<RayHit> hit =
        context.ray.meet(impl.points[t[0]], impl.points[t[1]], impl.points[t[2]]);
    if (!hit || !(hit->t >= context.near && hit->t <= context.far))
        return;
    // Of hits at one place the first triangle, whatever order Embree visits them in.
    if (context.hit && hit->t == context.far && args->primID > context.hit->triangle)
        return;
    hit->triangle = args->primID;
    context.far = hit->t;
    context.hit = hit;
    auto& ray_hit = *reinterpret_cast<RTCRayHit*>(args->rayhit);
    // Boxes that the hit touches are still visited.
    ray_hit.ray.tfar = static_cast<float>(hit->t) + kPad;
    ray_hit.hit.geomID = args->geomID;
    ray_hit.hit.primID = args->primID;
}

Result<RayScene> RayScene::build(std::span<const Vec3<float>> points,
                                 std::span<const std::array<Index, 3>> triangles) {
    const std::vector<Vec3<double>> copy(points.begin(), points.end());
    return build(copy, triangles);
}

Result<RayScene> RayScene::build(std::span<const Vec3<double>> points,
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
    impl->frame = Frame::around(points);
    impl->points.reserve(points.size());
    for (const Vec3<double>& p : points)
        impl->points.emplace_back(impl->frame.point(p));
    impl->triangles.assign(triangles.begin(), triangles.end());
    impl->device.reset(rtcNewDevice(nullptr));
    if (!impl->device)
        return fail(ErrorCode::DeviceFailure, "Embree has no device on this machine");
    impl->scene.reset(rtcNewScene(impl->device.get()));
    // Robust: no ray misses a box that it touches.
    rtcSetSceneFlags(impl->scene.get(), RTC_SCENE_FLAG_ROBUST);

    const Geometry geometry(rtcNewGeometry(impl->device.get(), RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(),
                                     static_cast<unsigned>(triangles.size()));
    rtcSetGeometryUserData(geometry.get(), impl.get());
    rtcSetGeometryBoundsFunction(geometry.get(), Impl::bounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), Impl::meet);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(impl->scene.get(), geometry.get());
    rtcCommitScene(impl->scene.get());
    if (rtcGetDeviceError(impl->device.get()) != RTC_ERROR_NONE)
        return fail(ErrorCode::DeviceFailure, "Embree could not build the hierarchy");
    return RayScene(std::move(impl));
}

std::optional<RayHit> RayScene::intersect(const Ray& ray) const noexcept {
    if (!impl_)
        return std::nullopt;
    const Frame& frame = impl_->frame;
    const double longest = std::max({std::abs(ray.direction.x), std::abs(ray.direction.y),
                                     std::abs(ray.direction.z)});
    if (!(longest > 0) || !std::isfinite(longest))
        return std::nullopt;
    // The direction gets a length of 1 to 2, so that t counts units of the frame.
    const int exponent = std::ilogb(longest);
    const Vec3<double> d = detail::in_units(ray.direction, exponent);
    const Vec3<double> origin = frame.point(ray.origin);
    // From where it comes close to the box of the points on.
    double start = -INFINITY;
    for (int i = 0; i < 3; ++i) {
        if (!std::isfinite(origin[i]))
            return std::nullopt;
        if (d[i] != 0)
            start = std::max(start, (-std::copysign(2.0, d[i]) - origin[i]) / d[i]);
        else if (std::abs(origin[i]) > 2)
            return std::nullopt;
    }
    start = std::max(start, 0.0);
    const Vec3<double> from = origin + start * d;
    if (!(std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z)}) < 4))
        return std::nullopt;
    const auto to_frame = [&](double t) {
        return std::ldexp(t, exponent - frame.exponent) - start;
    };
    RayContext context{
        {}, ShearedRay(from, d), to_frame(ray.t_near), to_frame(ray.t_far), std::nullopt};
    RTCRayHit r{};
    r.ray.org_x = static_cast<float>(from.x);
    r.ray.org_y = static_cast<float>(from.y);
    r.ray.org_z = static_cast<float>(from.z);
    r.ray.tnear = std::max(0.0f, static_cast<float>(context.near) - kPad);
    r.ray.dir_x = static_cast<float>(d.x);
    r.ray.dir_y = static_cast<float>(d.y);
    r.ray.dir_z = static_cast<float>(d.z);
    r.ray.tfar = static_cast<float>(std::min(context.far, 64.0)) + kPad;
    r.ray.mask = ~0u;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    rtcInitRayQueryContext(&context.embree);
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context.embree;
    rtcIntersect1(impl_->scene.get(), &r, &arguments);
#else
    rtcInitIntersectContext(&context.embree);
    rtcIntersect1(impl_->scene.get(), &context.embree, &r);
#endif
    if (context.hit)
        context.hit->t = std::ldexp(context.hit->t + start, frame.exponent - exponent);
    return context.hit;
}

std::optional<RayHit> RayScene::nearest(const Vec3<double>& point) const noexcept {
    if (!impl_)
        return std::nullopt;
    const Frame& frame = impl_->frame;
    Vec3<double> at = frame.point(point);
    const double away = std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)});
    if (!std::isfinite(away))
        return std::nullopt;
    // From further away the scene is a point to all floats.
    constexpr double kMost = 1e6;
    if (away > kMost)
        at *= kMost / away;
    struct Search {
        const Impl* impl;
        Vec3<double> point;
        double distance;
        RayHit hit;
    } search{impl_.get(), at, INFINITY, {}};

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
        s.hit = {args->primID, d, uv.x, uv.y};
        args->query->radius =
            std::nextafter(static_cast<float>(d) * (1 + 4e-7f), INFINITY);
        return true;  // the radius has changed
    };
    RTCPointQuery query{};
    query.x = static_cast<float>(at.x);
    query.y = static_cast<float>(at.y);
    query.z = static_cast<float>(at.z);
    query.radius = INFINITY;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(impl_->scene.get(), &query, &context, visit, &search);
    if (search.hit.triangle == kInvalidIndex)
        return std::nullopt;
    if (away > kMost) {
        const auto& t = impl_->triangles[search.hit.triangle];
        const Vec3<double> a(impl_->points[t[0]]), b(impl_->points[t[1]]),
            c(impl_->points[t[2]]);
        const Vec3<double> p =
            a + search.hit.u * (b - a) + search.hit.v * (c - a) - frame.point(point);
        search.hit.t = std::hypot(p.x, p.y, p.z);
    }
    search.hit.t = std::ldexp(search.hit.t, frame.exponent);
    return search.hit;
}

#else

struct RayScene::Impl {};

Result<RayScene> RayScene::build(std::span<const Vec3<float>>,
                                 std::span<const std::array<Index, 3>>) {
    return fail(ErrorCode::NotBuilt, "osdx was built without Embree");
}
Result<RayScene> RayScene::build(std::span<const Vec3<double>>,
                                 std::span<const std::array<Index, 3>>) {
    return fail(ErrorCode::NotBuilt, "osdx was built without Embree");
}
std::optional<RayHit> RayScene::intersect(const Ray&) const noexcept {
    return {};
}
std::optional<RayHit> RayScene::nearest(const Vec3<double>&) const noexcept {
    return {};
}

#endif

RayScene::RayScene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;

Result<TessellatedScene> TessellatedScene::build(const Tessellation& t) {
    const auto tris = triangles(t);
    Result<RayScene> rays =
        RayScene::build(std::span<const Vec3<double>>(t.positions), tris);
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
    if (hit.triangle >= corners_.size())
        return {kInvalidIndex, 0, 0};
    const auto& c = corners_[hit.triangle];
    const double u = hit.u, v = hit.v;
    const Vec2<double> p = (1 - u - v) * c[0] + u * c[1] + v * c[2];
    return {faces_[hit.triangle], p.x, p.y};
}

}  // namespace osdx::inline OSDX_ABI
