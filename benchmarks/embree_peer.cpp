// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "benchmarks/peers.h"

#ifdef OSDX_HAS_EMBREE
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <memory>
#include <type_traits>
#endif

namespace osdx::bench {

#ifdef OSDX_HAS_EMBREE

namespace {

/// A subdivision geometry in a committed scene, as rtcInterpolate wants it.
class Geometry {
public:
    explicit Geometry(const MeshData& mesh) {
        device_.reset(rtcNewDevice(nullptr));
        scene_.reset(rtcNewScene(device_.get()));
        geometry_.reset(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_SUBDIVISION));
        fill(RTC_BUFFER_TYPE_FACE, mesh.face_sizes);
        fill(RTC_BUFFER_TYPE_INDEX, mesh.face_vertices);
        // Sixteen bytes a vertex: Embree reads the padding, which has to be finite.
        auto* vertices = static_cast<float*>(
            rtcSetNewGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX, 0,
                                    RTC_FORMAT_FLOAT3, 16, mesh.positions.size()));
        for (const Vec3<double>& p : mesh.positions) {
            for (int c = 0; c < 3; ++c)
                *vertices++ = static_cast<float>(p[c]);
            *vertices++ = 0;
        }
        // Tessellation is for rays, of which there are none.
        rtcSetGeometryTessellationRate(geometry_.get(), 1);
        rtcSetGeometrySubdivisionMode(geometry_.get(), 0,
                                      RTC_SUBDIVISION_MODE_SMOOTH_BOUNDARY);
        rtcCommitGeometry(geometry_.get());
        rtcAttachGeometry(scene_.get(), geometry_.get());
        rtcCommitScene(scene_.get());
    }

    RTCGeometry get() const { return geometry_.get(); }

private:
    void fill(RTCBufferType type, const std::vector<Index>& values) {
        std::ranges::copy(values, static_cast<Index*>(rtcSetNewGeometryBuffer(
                                      geometry_.get(), type, 0, RTC_FORMAT_UINT,
                                      sizeof(Index), values.size())));
    }

    template <class T, void (*kRelease)(T)>
    struct Release {
        void operator()(T t) const { kRelease(t); }
    };
    template <class T, void (*kRelease)(T)>
    using Handle = std::unique_ptr<std::remove_pointer_t<T>, Release<T, kRelease>>;
    Handle<RTCDevice, rtcReleaseDevice> device_;
    Handle<RTCScene, rtcReleaseScene> scene_;
    Handle<RTCGeometry, rtcReleaseGeometry> geometry_;
};

/// Position, du and dv padded to sixteen bytes, as the call writes them.
SampleWay one_by_one(std::shared_ptr<const Geometry> geometry,
                     std::span<const Place> places) {
    const auto evaluate = [geometry, places](std::size_t first, std::size_t last,
                                             float* out) {
        for (std::size_t i = first; i < last; ++i, out += 12) {
            rtcInterpolate1(geometry->get(), places[i].face, places[i].u, places[i].v,
                            RTC_BUFFER_TYPE_VERTEX, 0, out, out + 4, out + 8, 3);
        }
    };
    const auto read = [](const float* out, std::size_t i, std::size_t) {
        const float* x = out + 12 * i;
        return SurfaceJet<float>{
            {x[0], x[1], x[2]}, {x[4], x[5], x[6]}, {x[8], x[9], x[10]}};
    };
    return {"Embree", "rtcInterpolate1", 12, evaluate, read};
}

/// The grid of a face at once, each coordinate in an array of its own.
SampleWay by_face(std::shared_ptr<const Geometry> geometry,
                  std::span<const Place> places) {
    struct Arrays {
        std::vector<Index> faces;
        std::vector<float> u, v;
    };
    const auto arrays = std::make_shared<Arrays>();
    for (const Place& p : places) {
        arrays->faces.push_back(p.face);
        arrays->u.push_back(p.u);
        arrays->v.push_back(p.v);
    }
    const auto evaluate = [geometry, arrays](std::size_t first, std::size_t last,
                                             float* out) {
        for (std::size_t i = first; i < last; i += kGridSize, out += 9 * kGridSize) {
            RTCInterpolateNArguments a{};
            a.geometry = geometry->get();
            a.primIDs = arrays->faces.data() + i;
            a.u = arrays->u.data() + i;
            a.v = arrays->v.data() + i;
            a.N = kGridSize;
            a.bufferType = RTC_BUFFER_TYPE_VERTEX;
            a.P = out;
            a.dPdu = out + 3 * kGridSize;
            a.dPdv = out + 6 * kGridSize;
            a.valueCount = 3;
            rtcInterpolateN(&a);
        }
    };
    const auto read = [](const float* out, std::size_t i, std::size_t) {
        const float* x = out + i / kGridSize * 9 * kGridSize + i % kGridSize;
        const auto vector = [&](std::size_t r) {
            return Vec3<float>(x[3 * r * kGridSize], x[(3 * r + 1) * kGridSize],
                               x[(3 * r + 2) * kGridSize]);
        };
        return SurfaceJet<float>{vector(0), vector(1), vector(2)};
    };
    return {"Embree", "rtcInterpolateN", 9, evaluate, read};
}

}  // namespace

std::vector<SampleWay> embree_grid(const BenchMesh& mesh, std::span<const Place> places) {
    const auto geometry = std::make_shared<const Geometry>(mesh.data);
    return {one_by_one(geometry, places), by_face(geometry, places)};
}

std::vector<SampleWay> embree_points(const BenchMesh& mesh,
                                     std::span<const Place> places) {
    return {one_by_one(std::make_shared<const Geometry>(mesh.data), places)};
}

#else

std::vector<SampleWay> embree_grid(const BenchMesh&, std::span<const Place>) {
    return {};
}
std::vector<SampleWay> embree_points(const BenchMesh&, std::span<const Place>) {
    return {};
}

#endif

}  // namespace osdx::bench
