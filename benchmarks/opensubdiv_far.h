// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#include <opensubdiv/osd/cpuEvaluator.h>

#include <osdx/evaluator.h>
#include <osdx/mesh_data.h>
#include <osdx/patch_table.h>

#include "benchmarks/meshes.h"

/// OpenSubdiv, set up for the same surface as ours: what its ways have in common.
namespace osdx::bench::opensubdiv {

// The namespace with the version in its name; OpenSubdiv::Osd is one of its parts.
namespace Pixar = OpenSubdiv::OPENSUBDIV_VERSION;
namespace Far = Pixar::Far;
namespace Osd = Pixar::Osd;

inline constexpr const char* kLibrary = "OpenSubdiv";

using Refiner = std::unique_ptr<Far::TopologyRefiner>;

inline Refiner make_refiner(const MeshData& mesh) {
    // Far copies the arrays, whose numbers it wants signed.
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(mesh.positions.size());
    descriptor.numFaces = static_cast<int>(mesh.face_sizes.size());
    descriptor.numVertsPerFace = reinterpret_cast<const int*>(mesh.face_sizes.data());
    descriptor.vertIndicesPerFace =
        reinterpret_cast<const int*>(mesh.face_vertices.data());
    Pixar::Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Pixar::Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    return Refiner(Factory::Create(
        descriptor, Factory::Options(Pixar::Sdc::SCHEME_CATMARK, options)));
}

/// A point of N numbers, of which the first three are used: Osd has a fast path for four.
template <class T, int N>
struct Point {
    T x[N];

    void Clear(void* = nullptr) { std::fill_n(x, N, T(0)); }
    void AddWithWeight(const Point& other, T weight) {
        for (int c = 0; c < N; ++c)
            x[c] += weight * other.x[c];
    }
};

template <class T, int N, class Positions>
void copy_points(const Positions& positions, Point<T, N>* out) {
    for (const auto& p : positions) {
        out->Clear();
        for (int c = 0; c < 3; ++c)
            out->x[c] = static_cast<T>(p[c]);
        ++out;
    }
}

/// The points of all levels, one after the other, from those of the first.
template <class T, int N>
void interpolate_levels(const Far::TopologyRefiner& refiner, Point<T, N>* points) {
    const Far::PrimvarRefinerReal<T> primvar(refiner);
    for (int level = 1; level <= refiner.GetMaxLevel(); ++level) {
        Point<T, N>* next = points + refiner.GetLevel(level - 1).GetNumVertices();
        primvar.Interpolate(level, points, next);
        points = next;
    }
}

/// How the points of patches come from the base.
enum class Points {
    Stencils,  ///< over the base vertices
    Chained,   ///< stencils over the points of the level before
    Levels,    ///< interpolated level by level; stencils for the end caps alone
};

/// What Far makes of a mesh so that patches can be evaluated.
struct Patches {
    Refiner refiner;
    std::unique_ptr<const Far::PatchTable> table;
    /// Of the refined points, and with Points::Stencils of those of the end caps.
    std::unique_ptr<const Far::StencilTable> stencils;
    Points kind;
    int n_base, n_refined;

    /// \param isolation  0: a patch over each face
    Patches(const MeshData& mesh, int isolation, Points points)
        : refiner(make_refiner(mesh)), kind(points) {
        Far::PatchTableFactory::Options options(static_cast<unsigned>(isolation));
        options.SetEndCapType(Far::PatchTableFactory::Options::ENDCAP_GREGORY_BASIS);
        // On by default: patches that are pinned to smooth corners of the border.
        options.generateLegacySharpCornerPatches = false;
        refiner->RefineAdaptive(options.GetRefineAdaptiveOptions());
        table.reset(Far::PatchTableFactory::Create(*refiner, options));
        n_base = refiner->GetLevel(0).GetNumVertices();
        n_refined = refiner->GetNumVerticesTotal();
        if (points == Points::Levels)
            return;
        const bool factorize = points == Points::Stencils;
        Far::StencilTableFactory::Options stencil_options;
        stencil_options.factorizeIntermediateLevels = factorize;
        stencil_options.generateOffsets = true;
        stencils.reset(Far::StencilTableFactory::Create(*refiner, stencil_options));
        if (factorize && has_local_points()) {
            stencils.reset(Far::StencilTableFactory::AppendLocalPointStencilTable(
                *refiner, stencils.get(), table->GetLocalPointStencilTable()));
        }
    }

    bool has_local_points() const { return table->GetNumLocalPoints() > 0; }
    std::size_t n_points() const {
        return static_cast<std::size_t>(n_refined + table->GetNumLocalPoints());
    }

    /// All points, of the base points at their start.
    template <class Evaluator = Osd::CpuEvaluator, int N>
    void refine(Point<float, N>* points) const {
        const auto apply = [&](const Far::StencilTable& t, int first) {
            if (t.GetNumStencils() == 0)
                return;
            Evaluator::EvalStencils(points->x, Osd::BufferDescriptor(0, N, N), points->x,
                                    Osd::BufferDescriptor(first * N, N, N),
                                    t.GetSizes().data(), t.GetOffsets().data(),
                                    t.GetControlIndices().data(), t.GetWeights().data(),
                                    0, t.GetNumStencils());
        };
        if (stencils)
            apply(*stencils, n_base);
        else
            interpolate_levels(*refiner, points);
        if (kind != Points::Stencils && has_local_points())
            apply(*table->GetLocalPointStencilTable(), n_refined);
    }

    std::vector<Point<float, 3>> points(const MeshData& mesh) const {
        std::vector<Point<float, 3>> p(n_points());
        copy_points(mesh.positions, p.data());
        refine(p.data());
        return p;
    }
};

}  // namespace osdx::bench::opensubdiv
