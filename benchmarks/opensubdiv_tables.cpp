// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <osdx/buffer.h>
#include <osdx/evaluator.h>

#include "benchmarks/peers.h"

#ifdef OSDX_HAS_OPENSUBDIV
#include <optional>
#include <shared_mutex>

#include <glm/geometric.hpp>
#include <omp.h>
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/tessellation.h>
#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/osd/ompEvaluator.h>

#include "benchmarks/opensubdiv_far.h"

namespace osdx::bench {
namespace opensubdiv {
namespace {

namespace Bfr = Pixar::Bfr;

Way build_way(std::string name, const MeshData& mesh, Points kind, bool counts) {
    struct Built {
        Patches patches;
        std::vector<Point<float, 3>> points;
    };
    const auto build = [&mesh, kind] {
        auto built = std::make_unique<Built>(Built{Patches(mesh, kIsolation, kind), {}});
        built->points = built->patches.points(mesh);
        return built;
    };
    double bytes;
    measured(build, bytes);
    return {kLibrary, std::move(name), [build] { build(); }, bytes, 0, counts};
}

template <int N, class Evaluator = Osd::CpuEvaluator>
UpdateWay update_way(std::string name, std::shared_ptr<const Patches> patches,
                     std::span<const Vec3<float>> positions, int threads) {
    const auto points =
        std::make_shared<std::vector<Point<float, N>>>(patches->n_points());
    const auto run = [patches, points, positions, threads] {
        omp_set_num_threads(threads);
        copy_points(positions, points->data());
        patches->refine<Evaluator>(points->data());
    };
    const auto evaluate = [patches, points](std::span<const Place> places) {
        const Far::PatchMap map(*patches->table);
        std::vector<Vec3<float>> result;
        for (const Place& p : places) {
            const auto handle = *map.FindPatch(static_cast<int>(p.face), p.u, p.v);
            float w[20];
            patches->table->EvaluateBasis(handle, p.u, p.v, w);
            const auto indices = patches->table->GetPatchVertices(handle);
            Vec3<float> sum(0);
            for (int k = 0; k < indices.size(); ++k) {
                const float* x = (*points)[static_cast<std::size_t>(indices[k])].x;
                sum += w[k] * Vec3<float>(x[0], x[1], x[2]);
            }
            result.push_back(sum);
        }
        return result;
    };
    return {{kLibrary, std::move(name), run}, evaluate};
}

struct Refined {
    Refiner refiner;
    Buffer<Point<double, 3>> points;  // of all levels
};

enum class By { Interpolation, Stencils };

Refined refine(const MeshData& mesh, int levels, bool full, By by) {
    Refined r{make_refiner(mesh), {}};
    Far::TopologyRefiner::UniformOptions uniform(static_cast<unsigned>(levels));
    uniform.fullTopologyInLastLevel = full;
    r.refiner->RefineUniform(uniform);
    r.points.resize(static_cast<std::size_t>(r.refiner->GetNumVerticesTotal()));
    copy_points(mesh.positions, r.points.data());
    if (by == By::Interpolation) {
        interpolate_levels(*r.refiner, r.points.data());
        return r;
    }
    using Factory = Far::StencilTableFactoryReal<double>;
    Factory::Options options;
    options.generateIntermediateLevels = false;
    const std::unique_ptr<const Far::StencilTableReal<double>> table(
        Factory::Create(*r.refiner, options));
    table->UpdateValues(r.points.data(),
                        r.points.data() + r.points.size() -
                            static_cast<std::size_t>(table->GetNumStencils()));
    return r;
}

RefineWay refine_way(std::string name, const MeshData& mesh, int levels, bool full,
                     By by) {
    const auto make = [&mesh, levels, full, by] {
        return refine(mesh, levels, full, by);
    };
    const auto points = [make] {
        const Refined r = make();
        const auto& last = r.refiner->GetLevel(r.refiner->GetMaxLevel());
        std::vector<Vec3<double>> p;
        for (auto it = r.points.end() - last.GetNumVertices(); it != r.points.end(); ++it)
            p.emplace_back(it->x[0], it->x[1], it->x[2]);
        return p;
    };
    return {{kLibrary, std::move(name), [make] { make(); }}, points};
}

/// As in OpenSubdiv's tutorials of Bfr: face by face, each with points of its own. Its
/// surface, points, normals and facets into flat arrays.
struct FaceTessellation {
    std::vector<float> positions, normals;
    std::vector<int> facets;  // four points each, or three and -1

    FaceTessellation(const MeshData& mesh, const Bfr::RefinerSurfaceFactory<>& factory,
                     std::span<const Point<float, 3>> base, int rate) {
        Bfr::Surface<float> surface;
        std::vector<float> uv, patch_points;
        for (int f = 0; f < static_cast<int>(mesh.face_sizes.size()); ++f) {
            if (!factory.InitVertexSurface(f, &surface))
                continue;
            Bfr::Tessellation::Options options;
            options.SetFacetSize(4).PreserveQuads(true);
            Bfr::Tessellation pattern(surface.GetParameterization(), rate, options);
            const auto n = static_cast<std::size_t>(pattern.GetNumCoords());
            uv.resize(2 * n);
            pattern.GetCoords(uv.data());
            patch_points.resize(3 *
                                static_cast<std::size_t>(surface.GetNumPatchPoints()));
            surface.PreparePatchPoints(base[0].x, 3, patch_points.data(), 3);
            const std::size_t first = positions.size();
            positions.resize(first + 3 * n);
            normals.resize(first + 3 * n);
            for (std::size_t i = 0; i < n; ++i) {
                float du[3], dv[3];
                surface.Evaluate(&uv[2 * i], patch_points.data(), 3,
                                 &positions[first + 3 * i], du, dv);
                const Vec3<float> normal = glm::normalize(glm::cross(
                    Vec3<float>(du[0], du[1], du[2]), Vec3<float>(dv[0], dv[1], dv[2])));
                std::copy_n(&normal.x, 3, &normals[first + 3 * i]);
            }
            const std::size_t first_facet = facets.size();
            facets.resize(first_facet +
                          4 * static_cast<std::size_t>(pattern.GetNumFacets()));
            pattern.GetFacets(&facets[first_facet]);
            pattern.TransformFacetCoordIndices(&facets[first_facet],
                                               static_cast<int>(first / 3));
        }
    }
};

}  // namespace
}  // namespace opensubdiv

std::vector<Way> opensubdiv_build(const BenchMesh& mesh) {
    using namespace opensubdiv;
    return {build_way("Far, stencils", mesh.data, Points::Stencils, true),
            build_way("Far, chained stencils", mesh.data, Points::Chained, true),
            build_way("Far, no stencils", mesh.data, Points::Levels, false)};
}

std::vector<UpdateWay> opensubdiv_update(const BenchMesh& mesh,
                                         std::span<const Vec3<float>> positions,
                                         int threads) {
    using namespace opensubdiv;
    const auto make = [&](Points kind) {
        return std::make_shared<const Patches>(mesh.data, kIsolation, kind);
    };
    const auto stencils = make(Points::Stencils), chained = make(Points::Chained),
               levels = make(Points::Levels);
    std::vector<UpdateWay> ways = {
        update_way<3>("Osd stencils, 3 floats", stencils, positions, threads),
        update_way<4>("Osd stencils, 4 floats", stencils, positions, threads),
        update_way<3>("Osd chained stencils, 3 floats", chained, positions, threads),
        update_way<4>("Osd chained stencils, 4 floats", chained, positions, threads),
        update_way<3>("Far PrimvarRefiner, 3 floats", levels, positions, threads),
        update_way<4>("Far PrimvarRefiner, 4 floats", levels, positions, threads)};
    if (threads > 1) {
        ways.push_back(update_way<4, Osd::OmpEvaluator>("Osd stencils, 4 floats (OpenMP)",
                                                        stencils, positions, threads));
    }
    return ways;
}

std::vector<RefineWay> opensubdiv_refine(const BenchMesh& mesh, int levels, bool full) {
    using namespace opensubdiv;
    std::vector<RefineWay> ways = {
        refine_way("Far PrimvarRefiner", mesh.data, levels, full, By::Interpolation)};
    // Of many levels stencils are slower by far, and too large.
    if (std::size_t(mesh.n_faces()) << (2 * levels) < 1'000'000)
        ways.push_back(refine_way("Far stencils", mesh.data, levels, full, By::Stencils));
    return ways;
}

std::vector<TessellateWay> opensubdiv_tessellate(const BenchMesh& mesh, int rate) {
    using namespace opensubdiv;
    struct State {
        Refiner refiner;
        std::optional<Bfr::RefinerSurfaceFactory<>> factory;
        std::vector<Point<float, 3>> points;
    };
    const auto state = std::make_shared<State>();
    state->refiner = make_refiner(mesh.data);
    state->factory.emplace(*state->refiner);
    state->points.resize(mesh.data.positions.size());
    copy_points(mesh.data.positions, state->points.data());
    const auto make = [state, &mesh, rate] {
        return FaceTessellation(mesh.data, *state->factory, state->points, rate);
    };
    return {{{kLibrary, "Bfr::Tessellation", [make] { make(); }},
             [make] { return static_cast<Index>(make().facets.size() / 4); }}};
}

}  // namespace osdx::bench

#else

namespace osdx::bench {

std::vector<Way> opensubdiv_build(const BenchMesh&) {
    return {};
}
std::vector<UpdateWay> opensubdiv_update(const BenchMesh&, std::span<const Vec3<float>>,
                                         int) {
    return {};
}
std::vector<RefineWay> opensubdiv_refine(const BenchMesh&, int, bool) {
    return {};
}
std::vector<TessellateWay> opensubdiv_tessellate(const BenchMesh&, int) {
    return {};
}

}  // namespace osdx::bench

#endif
