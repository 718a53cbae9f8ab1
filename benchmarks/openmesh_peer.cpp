// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/Traits.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/CatmullClarkT.hh>

#include "benchmarks/peers.h"

namespace osdx::bench {
namespace {

struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
};
using Mesh = OpenMesh::PolyMesh_ArrayKernelT<Traits>;

Mesh refine(const MeshData& data, int levels) {
    auto mesh = add_faces<Mesh, Mesh::VertexHandle>(data);
    OpenMesh::Subdivider::Uniform::CatmullClarkT<Mesh> subdivider;
    subdivider.attach(mesh);
    subdivider(static_cast<std::size_t>(levels));
    subdivider.detach();
    return mesh;
}

}  // namespace

std::vector<RefineWay> openmesh_refine(const BenchMesh& mesh, int levels) {
    const auto make = [&data = mesh.data, levels] { return refine(data, levels); };
    const auto points = [make] {
        const Mesh result = make();
        std::vector<Vec3<double>> p;
        for (const auto v : result.vertices())
            p.emplace_back(result.point(v)[0], result.point(v)[1], result.point(v)[2]);
        return p;
    };
    // At borders (1, 4, 1) / 6 instead of (1, 6, 1) / 8.
    return {{{"OpenMesh", "CatmullClarkT", [make] { make(); }}, points, false}};
}

}  // namespace osdx::bench
