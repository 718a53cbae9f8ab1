// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "osd_ext/limit_surface.h"

#include <vector>

#ifdef OSDX_HAS_OPENSUBDIV
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#endif

namespace osdx {

#ifdef OSDX_HAS_OPENSUBDIV

namespace Osd = OpenSubdiv::OPENSUBDIV_VERSION;

struct LimitSurface::Impl {
    const Topology* base = nullptr;
    std::unique_ptr<Osd::Far::TopologyRefiner> refiner;
    std::unique_ptr<Osd::Bfr::RefinerSurfaceFactory<>> factory;
    std::vector<Osd::Bfr::Surface<double>> surfaces;  // per face
    std::vector<std::size_t> offsets;                 // of each face's patch points
    std::vector<double> patch_points;
};

Result<LimitSurface> LimitSurface::build(const Topology& base,
                                         std::span<const Vec3<double>> positions,
                                         int isolation) {
    std::vector<int> sizes(base.n_faces());
    for (Index f = 0; f < base.n_faces(); ++f)
        sizes[f] = static_cast<int>(base.face_size(f));
    const std::vector<int> vertices(base.vertex.begin(), base.vertex.end());

    Osd::Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(base.n_vertices());
    descriptor.numFaces = static_cast<int>(base.n_faces());
    descriptor.numVertsPerFace = sizes.data();
    descriptor.vertIndicesPerFace = vertices.data();
    Osd::Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Osd::Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
    using Factory = Osd::Far::TopologyRefinerFactory<Osd::Far::TopologyDescriptor>;

    auto impl = std::make_unique<Impl>();
    impl->base = &base;
    impl->refiner.reset(
        Factory::Create(descriptor, Factory::Options(Osd::Sdc::SCHEME_CATMARK, options)));
    if (!impl->refiner)
        return fail(ErrorCode::DeviceFailure, "OpenSubdiv refuses the mesh");
    impl->factory = std::make_unique<Osd::Bfr::RefinerSurfaceFactory<>>(
        *impl->refiner,
        Osd::Bfr::SurfaceFactory::Options().SetApproxLevelSmooth(isolation));

    const double* points = &positions[0].x;
    impl->surfaces.resize(base.n_faces());
    for (Index f = 0; f < base.n_faces(); ++f) {
        auto& surface = impl->surfaces[f];
        if (!impl->factory->InitVertexSurface(static_cast<int>(f), &surface)) {
            return fail(ErrorCode::DeviceFailure,
                        "OpenSubdiv has no limit surface for a face", f);
        }
        const std::size_t first = impl->patch_points.size();
        impl->offsets.push_back(first);
        impl->patch_points.resize(first + 3 * surface.GetNumPatchPoints());
        surface.PreparePatchPoints(points, 3, impl->patch_points.data() + first, 3);
    }
    return LimitSurface(std::move(impl));
}

SurfaceJet<double> LimitSurface::evaluate(const Address& where) const noexcept {
    const double uv[2] = {where.u, where.v};
    SurfaceJet<double> s;
    impl_->surfaces[where.face].Evaluate(
        uv, impl_->patch_points.data() + impl_->offsets[where.face], 3, &s.p.x, &s.du.x,
        &s.dv.x, &s.duu.x, &s.duv.x, &s.dvv.x);
    return s;
}

#else

struct LimitSurface::Impl {};

Result<LimitSurface> LimitSurface::build(const Topology&, std::span<const Vec3<double>>,
                                         int) {
    return fail(ErrorCode::NotBuilt, "osdx was built without OpenSubdiv");
}
SurfaceJet<double> LimitSurface::evaluate(const Address&) const noexcept {
    return {};
}

#endif

LimitSurface::LimitSurface(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LimitSurface::LimitSurface(LimitSurface&&) noexcept = default;
LimitSurface& LimitSurface::operator=(LimitSurface&&) noexcept = default;
LimitSurface::~LimitSurface() = default;

}  // namespace osdx
