// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cassert>
#include <vector>

#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>

#ifdef OSDX_HAS_OPENSUBDIV
#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/far/patchTable.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/ptexIndices.h>
#include <opensubdiv/far/stencilTable.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#endif

namespace osdx::inline OSDX_ABI {

#ifdef OSDX_HAS_OPENSUBDIV

namespace {

namespace Osd = OpenSubdiv::OPENSUBDIV_VERSION;

/// A point in the form that OpenSubdiv interpolates.
struct Point {
    Vec3<double> p{0};

    void Clear(void* = nullptr) { p = Vec3<double>(0); }
    void AddWithWeight(const Point& other, double weight) { p += weight * other.p; }
};

/// What resolve() makes of the border goes to OpenSubdiv as corners and holes: its own
/// rules for the border would make holes once more, of edges that are sharp by now.
std::unique_ptr<Osd::Far::TopologyRefiner> make_refiner(
    const Topology& base, const ResolvedFeatures& features) {
    std::vector<int> sizes(base.n_faces());
    std::vector<int> creases, corners, holes;
    std::vector<float> crease_sharpness, corner_sharpness;
    for (Index f = 0; f < base.n_faces(); ++f) {
        sizes[f] = static_cast<int>(base.face_size(f));
        if (features.is_hole(f))
            holes.push_back(static_cast<int>(f));
    }
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        const double s = features.edge(base.edge[h]);
        if (base.is_border(h) || base.twin[h] < h || s <= 0)
            continue;
        creases.push_back(static_cast<int>(base.vertex[h]));
        creases.push_back(static_cast<int>(base.to_vertex(h)));
        crease_sharpness.push_back(static_cast<float>(s));
    }
    for (Index v = 0; v < base.n_vertices(); ++v) {
        if (features.vertex(v) > 0) {
            corners.push_back(static_cast<int>(v));
            corner_sharpness.push_back(static_cast<float>(features.vertex(v)));
        }
    }
    const std::vector<int> vertices(base.vertex.begin(), base.vertex.end());

    Osd::Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(base.n_vertices());
    descriptor.numFaces = static_cast<int>(base.n_faces());
    descriptor.numVertsPerFace = sizes.data();
    descriptor.vertIndicesPerFace = vertices.data();
    descriptor.numCreases = static_cast<int>(crease_sharpness.size());
    descriptor.creaseVertexIndexPairs = creases.data();
    descriptor.creaseWeights = crease_sharpness.data();
    descriptor.numCorners = static_cast<int>(corner_sharpness.size());
    descriptor.cornerVertexIndices = corners.data();
    descriptor.cornerWeights = corner_sharpness.data();
    descriptor.numHoles = static_cast<int>(holes.size());
    descriptor.holeIndices = holes.data();

    using Sdc = Osd::Sdc::Options;
    Sdc options;
    options.SetVtxBoundaryInterpolation(Sdc::VTX_BOUNDARY_EDGE_ONLY);
    options.SetCreasingMethod(features.creases == CreaseMethod::Chaikin
                                  ? Sdc::CREASE_CHAIKIN
                                  : Sdc::CREASE_UNIFORM);
    options.SetTriangleSubdivision(features.smooth_triangles ? Sdc::TRI_SUB_SMOOTH
                                                             : Sdc::TRI_SUB_CATMARK);
    using Factory = Osd::Far::TopologyRefinerFactory<Osd::Far::TopologyDescriptor>;
    return std::unique_ptr<Osd::Far::TopologyRefiner>(
        Factory::Create(descriptor, Factory::Options(Osd::Sdc::SCHEME_CATMARK, options)));
}

}  // namespace

struct LimitSurface::Impl {
    const Topology* base = nullptr;
    std::unique_ptr<Osd::Far::PatchTable> table;
    std::unique_ptr<Osd::Far::PatchMap> map;
    std::vector<int> ptex_faces;  // per base face: the first
    std::vector<Point> points;    // of all levels, then those of the end caps
};

Result<LimitSurface> LimitSurface::build(const Topology& base, const Features& features,
                                         std::span<const Vec3<double>> positions,
                                         int isolation) {
    const auto refiner = make_refiner(base, resolve(base, features));
    if (!refiner)
        return fail(ErrorCode::DeviceFailure, "OpenSubdiv refuses the mesh");
    Osd::Far::PatchTableFactory::Options options(static_cast<unsigned>(isolation));
    options.SetPatchPrecision<double>();
    options.SetEndCapType(Osd::Far::PatchTableFactory::Options::ENDCAP_GREGORY_BASIS);
    // Off by default: patches that end at an infinitely sharp crease, exact at any level.
    options.useInfSharpPatch = true;
    // On by default: patches that are pinned to smooth corners of the border.
    options.generateLegacySharpCornerPatches = false;
    refiner->RefineAdaptive(options.GetRefineAdaptiveOptions());

    auto impl = std::make_unique<Impl>();
    impl->base = &base;
    impl->table.reset(Osd::Far::PatchTableFactory::Create(*refiner, options));
    if (!impl->table)
        return fail(ErrorCode::DeviceFailure, "OpenSubdiv makes no patches of the mesh");
    impl->map = std::make_unique<Osd::Far::PatchMap>(*impl->table);

    const int n_refined = refiner->GetNumVerticesTotal();
    impl->points.resize(n_refined + impl->table->GetNumLocalPoints());
    for (std::size_t v = 0; v < positions.size(); ++v)
        impl->points[v].p = positions[v];
    const Osd::Far::PrimvarRefinerReal<double> primvar(*refiner);
    Point* source = impl->points.data();
    for (int level = 1; level <= refiner->GetMaxLevel(); ++level) {
        Point* target = source + refiner->GetLevel(level - 1).GetNumVertices();
        primvar.Interpolate(level, source, target);
        source = target;
    }
    if (const auto* local = impl->table->GetLocalPointStencilTable<double>())
        local->UpdateValues(impl->points.data(), impl->points.data() + n_refined);

    const Osd::Far::PtexIndices ptex(*refiner);
    for (Index f = 0; f < base.n_faces(); ++f)
        impl->ptex_faces.push_back(ptex.GetFaceId(static_cast<int>(f)));
    return LimitSurface(std::move(impl));
}

Index LimitSurface::n_patches() const noexcept {
    return static_cast<Index>(impl_->table->GetNumPatchesTotal());
}

SurfaceJet<double> LimitSurface::evaluate(const Address& where) const noexcept {
    // A quad is one Ptex face; another polygon has one per corner, which is our quarter. Its
    // coordinates are those of the quarter, but Far scales derivatives to the (u, v) of the
    // face, where a quarter is half as wide.
    int ptex = impl_->ptex_faces[where.face];
    double u = where.u, v = where.v;
    if (impl_->base->face_size(where.face) != 4) {
        const QuarterPoint q = to_quarter(*impl_->base, where);
        ptex += static_cast<int>(q.quarter - impl_->base->face_offsets[where.face]);
        u = q.x;
        v = q.y;
    }
    const auto* handle = impl_->map->FindPatch(ptex, u, v);
    assert(handle);
    double w[6][20];
    impl_->table->EvaluateBasis(*handle, u, v, w[0], w[1], w[2], w[3], w[4], w[5]);
    const auto indices = impl_->table->GetPatchVertices(*handle);
    SurfaceJet<double> s;
    for (int i = 0; i < indices.size(); ++i) {
        const Vec3<double>& p = impl_->points[indices[i]].p;
        s.p += w[0][i] * p;
        s.du += w[1][i] * p;
        s.dv += w[2][i] * p;
        s.duu += w[3][i] * p;
        s.duv += w[4][i] * p;
        s.dvv += w[5][i] * p;
    }
    return s;
}

#else

struct LimitSurface::Impl {};

Result<LimitSurface> LimitSurface::build(const Topology&, const Features&,
                                         std::span<const Vec3<double>>, int) {
    return fail(ErrorCode::NotBuilt, "osdx was built without OpenSubdiv");
}
Index LimitSurface::n_patches() const noexcept {
    return 0;
}
SurfaceJet<double> LimitSurface::evaluate(const Address&) const noexcept {
    return {};
}

#endif

LimitSurface::LimitSurface(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LimitSurface::LimitSurface(LimitSurface&&) noexcept = default;
LimitSurface& LimitSurface::operator=(LimitSurface&&) noexcept = default;
LimitSurface::~LimitSurface() = default;

SurfaceFunction surface_function(const Topology& base, const LimitSurface& limit) {
    return [&base, &limit](const QuarterPoint& q) {
        return limit.evaluate(to_address(base, q));
    };
}

}  // namespace osdx::inline OSDX_ABI
