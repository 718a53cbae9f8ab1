// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <osdx/evaluator.h>
#include <osdx/patch_table.h>

#include "benchmarks/peers.h"

#ifdef OSDX_HAS_OPENSUBDIV
#include <numeric>

#include <fmt/format.h>
#include <omp.h>
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/osd/cpuPatchTable.h>
#include <opensubdiv/osd/ompEvaluator.h>

#include "benchmarks/opensubdiv_far.h"

namespace osdx::bench {
namespace opensubdiv {
namespace {

namespace Bfr = Pixar::Bfr;

/// The points that Osd reads, by four floats where it has a fast path for them.
template <int N>
std::vector<Point<float, N>> base_points(const MeshData& mesh) {
    std::vector<Point<float, N>> points(mesh.positions.size());
    copy_points(mesh.positions, points.data());
    return points;
}

/// A face of four corners is one Ptex face, in the same order.
std::vector<Far::PatchTable::PatchHandle> find_patches(const Far::PatchTable& table,
                                                       std::span<const Place> places) {
    const Far::PatchMap map(table);
    std::vector<Far::PatchTable::PatchHandle> handles;
    handles.reserve(places.size());
    for (const Place& p : places)
        handles.push_back(*map.FindPatch(static_cast<int>(p.face), p.u, p.v));
    return handles;
}

template <class Evaluator>
SampleWay eval_patches(std::string name, std::shared_ptr<const Patches> patches,
                       const MeshData& mesh, std::span<const Place> places, int threads) {
    struct State {
        std::shared_ptr<const Patches> patches;
        Osd::CpuPatchTable table;
        std::vector<Point<float, 3>> points;
        std::vector<Osd::PatchCoord> coords;
    };
    const auto state = std::make_shared<State>(State{
        patches, Osd::CpuPatchTable(patches->table.get()), patches->points(mesh), {}});
    const auto handles = find_patches(*patches->table, places);
    for (std::size_t i = 0; i < places.size(); ++i)
        state->coords.emplace_back(handles[i], places[i].u, places[i].v);
    const auto evaluate = [state, threads](std::size_t first, std::size_t last,
                                           float* out) {
        omp_set_num_threads(threads);
        const auto part = [](int r) { return Osd::BufferDescriptor(3 * r, 3, 9); };
        Evaluator::EvalPatches(
            state->points[0].x, Osd::BufferDescriptor(0, 3, 3), out, part(0), out,
            part(1), out, part(2), static_cast<int>(last - first),
            state->coords.data() + first, state->table.GetPatchArrayBuffer(),
            state->table.GetPatchIndexBuffer(), state->table.GetPatchParamBuffer());
    };
    SampleWay way{kLibrary, std::move(name), 9, evaluate};
    way.is_wide = threads > 1;
    return way;
}

using LimitStencils = std::shared_ptr<const Far::LimitStencilTable>;

LimitStencils make_limit_stencils(const Patches& patches, std::span<const Place> places) {
    std::vector<float> u(places.size()), v(places.size());
    Far::LimitStencilTableFactory::LocationArrayVec locations;
    for (std::size_t i = 0; i < places.size(); ++i) {
        u[i] = places[i].u;
        v[i] = places[i].v;
        if (i == 0 || places[i].face != places[i - 1].face) {
            Far::LimitStencilTableFactory::LocationArray& l = locations.emplace_back();
            l.ptexIdx = static_cast<int>(places[i].face);
            l.s = &u[i];
            l.t = &v[i];
        }
        ++locations.back().numLocations;
    }
    return LimitStencils(Far::LimitStencilTableFactory::Create(
        *patches.refiner, locations, nullptr, patches.table.get()));
}

/// Derivatives in the same pass, or three passes of plain stencils, since only these have the
/// fast path for four floats. Positions, du and dv in arrays of their own, as it wants them.
template <int N, bool kOnePass>
SampleWay limit_stencils(std::string name, LimitStencils table, const MeshData& mesh) {
    const auto evaluate = [table, points = base_points<N>(mesh)](
                              std::size_t first, std::size_t last, float* out) {
        const Osd::BufferDescriptor d(0, N, N);
        float* const du = out + (last - first) * N;
        float* const dv = du + (last - first) * N;
        // From stencil 0 on: the fast path adds a start to the output as well.
        const auto at = table->GetOffsets()[first];
        const int* sizes = table->GetSizes().data() + first;
        const int* offsets = table->GetOffsets().data();
        const int* indices = table->GetControlIndices().data() + at;
        const float* w = table->GetWeights().data() + at;
        const float* wu = table->GetDuWeights().data() + at;
        const float* wv = table->GetDvWeights().data() + at;
        const auto n = static_cast<int>(last - first);
        if constexpr (kOnePass) {
            Osd::CpuEvaluator::EvalStencils(points[0].x, d, out, d, du, d, dv, d, sizes,
                                            offsets, indices, w, wu, wv, 0, n);
        } else {
            const std::pair<float*, const float*> passes[] = {
                {out, w}, {du, wu}, {dv, wv}};
            for (const auto& [to, weights] : passes) {
                Osd::CpuEvaluator::EvalStencils(points[0].x, d, to, d, sizes, offsets,
                                                indices, weights, 0, n);
            }
        }
    };
    const auto read = [](const float* out, std::size_t i, std::size_t n) {
        const auto vector = [&](std::size_t r) {
            const float* x = out + (r * n + i) * N;
            return Vec3<float>(x[0], x[1], x[2]);
        };
        return SurfaceJet<float>{vector(0), vector(1), vector(2)};
    };
    return {kLibrary, std::move(name), 3 * N, evaluate, read};
}

/// The surface of each face, its points prepared.
struct BfrSurfaces {
    Refiner refiner;
    std::unique_ptr<Bfr::RefinerSurfaceFactory<>> factory;
    std::vector<Bfr::Surface<float>> surfaces;  // by face; those of no place are empty
    std::vector<std::size_t> first_point;
    std::vector<Point<float, 3>> points;       // of the patches
    std::vector<Point<float, 3>> mesh_points;  // of the base

    BfrSurfaces(const MeshData& mesh, std::span<const Place> places)
        : refiner(make_refiner(mesh)), mesh_points(base_points<3>(mesh)) {
        Bfr::SurfaceFactory::Options options;
        options.EnableCaching(true);
        options.SetApproxLevelSmooth(kIsolation);
        factory = std::make_unique<Bfr::RefinerSurfaceFactory<>>(*refiner, options);
        surfaces.resize(mesh.face_sizes.size());
        first_point.resize(mesh.face_sizes.size());
        for (const Place& p : places) {
            Bfr::Surface<float>& s = surfaces[p.face];
            if (s.IsValid())
                continue;
            factory->InitVertexSurface(static_cast<int>(p.face), &s);
            first_point[p.face] = points.size();
            points.resize(points.size() +
                          static_cast<std::size_t>(s.GetNumPatchPoints()));
            s.PreparePatchPoints(mesh_points[0].x, 3, points[first_point[p.face]].x, 3);
        }
    }
};

SampleWay bfr(std::shared_ptr<const BfrSurfaces> state, std::span<const Place> places) {
    const auto evaluate = [state, places](std::size_t first, std::size_t last,
                                          float* out) {
        for (std::size_t i = first; i < last; ++i, out += 9) {
            const Place& p = places[i];
            const float uv[2] = {p.u, p.v};
            state->surfaces[p.face].Evaluate(uv,
                                             state->points[state->first_point[p.face]].x,
                                             3, out, out + 3, out + 6);
        }
    };
    return {kLibrary, "Bfr::Surface::Evaluate", 9, evaluate};
}

/// Weights of the control points kept for every place.
SampleWay bfr_stencils(std::shared_ptr<const BfrSurfaces> state,
                       std::span<const Place> places) {
    struct Weights {
        std::vector<std::size_t> first;
        std::vector<float> values;
    };
    const auto weights = std::make_shared<Weights>();
    for (const Place& p : places) {
        const Bfr::Surface<float>& s = state->surfaces[p.face];
        const float uv[2] = {p.u, p.v};
        const auto n = static_cast<std::size_t>(s.GetNumControlPoints());
        const std::size_t at = weights->values.size();
        weights->first.push_back(at);
        weights->values.resize(at + 3 * n);
        float* w = weights->values.data() + at;
        s.EvaluateStencil(uv, w, w + n, w + 2 * n);
    }
    const auto evaluate = [state, places, weights](std::size_t first, std::size_t last,
                                                   float* out) {
        for (std::size_t i = first; i < last; ++i) {
            const Bfr::Surface<float>& s = state->surfaces[places[i].face];
            const float* w = weights->values.data() + weights->first[i];
            for (int r = 0; r < 3; ++r, w += s.GetNumControlPoints(), out += 3)
                s.ApplyStencilFromMesh(w, state->mesh_points[0].x, 3, out);
        }
    };
    return {kLibrary, "Bfr stencils", 9, evaluate};
}

SampleWay evaluate_basis(std::shared_ptr<const Patches> patches, const MeshData& mesh,
                         std::span<const Place> places) {
    const auto evaluate = [patches, places, points = patches->points(mesh),
                           handles = find_patches(*patches->table, places)](
                              std::size_t first, std::size_t last, float* out) {
        for (std::size_t i = first; i < last; ++i, out += 9) {
            float w[3][20];
            patches->table->EvaluateBasis(handles[i], places[i].u, places[i].v, w[0],
                                          w[1], w[2]);
            const auto indices = patches->table->GetPatchVertices(handles[i]);
            float sum[9] = {};
            for (int k = 0; k < indices.size(); ++k) {
                const float* x = points[indices[k]].x;
                for (int r = 0; r < 3; ++r) {
                    for (int c = 0; c < 3; ++c)
                        sum[3 * r + c] += w[r][k] * x[c];
                }
            }
            std::copy_n(sum, 9, out);
        }
    };
    return {kLibrary, "Far EvaluateBasis", 9, evaluate};
}

}  // namespace
}  // namespace opensubdiv

std::vector<SampleWay> opensubdiv_grid(const BenchMesh& mesh,
                                       std::span<const Place> places, int threads) {
    using namespace opensubdiv;
    std::vector<SampleWay> ways;
    double patch_bytes, surface_bytes, table_bytes;
    const auto add = [&](double shared_bytes, const auto& make) {
        double bytes;
        ways.push_back(measured(make, bytes));
        ways.back().bytes = bytes + shared_bytes;
    };
    const auto patches = measured(
        [&] {
            return std::make_shared<const Patches>(mesh.data, kIsolation,
                                                   Points::Stencils);
        },
        patch_bytes);
    add(patch_bytes, [&] {
        return eval_patches<Osd::CpuEvaluator>("Osd EvalPatches", patches, mesh.data,
                                               places, 1);
    });
    if (threads > 1) {
        add(patch_bytes, [&] {
            return eval_patches<Osd::OmpEvaluator>("Osd EvalPatches (OpenMP)", patches,
                                                   mesh.data, places, threads);
        });
    }
    const auto surfaces =
        measured([&] { return std::make_shared<const BfrSurfaces>(mesh.data, places); },
                 surface_bytes);
    add(surface_bytes, [&] { return bfr(surfaces, places); });
    add(surface_bytes, [&] { return bfr_stencils(surfaces, places); });
    const LimitStencils table =
        measured([&] { return make_limit_stencils(*patches, places); }, table_bytes);
    add(table_bytes, [&] {
        return limit_stencils<3, true>("limit stencils, 3 floats", table, mesh.data);
    });
    add(table_bytes, [&] {
        return limit_stencils<4, true>("limit stencils, 4 floats", table, mesh.data);
    });
    add(table_bytes, [&] {
        return limit_stencils<4, false>("limit stencils, 4 floats, 3 passes", table,
                                        mesh.data);
    });
    return ways;
}

std::vector<SampleWay> opensubdiv_gregory_grid(const BenchMesh& mesh,
                                               std::span<const Place> places) {
    using namespace opensubdiv;
    const auto patches = std::make_shared<const Patches>(mesh.data, 0, Points::Levels);
    return {eval_patches<Osd::CpuEvaluator>("Osd EvalPatches, Gregory", patches,
                                            mesh.data, places, 1)};
}

std::vector<SampleWay> opensubdiv_points(const BenchMesh& mesh,
                                         std::span<const Place> places, int isolation) {
    using namespace opensubdiv;
    return {evaluate_basis(
        std::make_shared<const Patches>(mesh.data, isolation, Points::Levels), mesh.data,
        places)};
}

}  // namespace osdx::bench

#else

namespace osdx::bench {

std::vector<SampleWay> opensubdiv_grid(const BenchMesh&, std::span<const Place>, int) {
    return {};
}
std::vector<SampleWay> opensubdiv_gregory_grid(const BenchMesh&, std::span<const Place>) {
    return {};
}
std::vector<SampleWay> opensubdiv_points(const BenchMesh&, std::span<const Place>, int) {
    return {};
}

}  // namespace osdx::bench

#endif
