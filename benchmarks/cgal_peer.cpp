// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "benchmarks/peers.h"

#ifdef OSDX_HAS_CGAL
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/subdivision_method_3.h>
#endif

namespace osdx::bench {

#ifdef OSDX_HAS_CGAL

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Mesh refine(const MeshData& data, int levels) {
    auto mesh = add_faces<Mesh, Mesh::Vertex_index>(data);
    CGAL::Subdivision_method_3::CatmullClark_subdivision(
        mesh, CGAL::parameters::number_of_iterations(levels));
    return mesh;
}

}  // namespace

std::vector<RefineWay> cgal_refine(const BenchMesh& mesh, int levels) {
    const auto make = [&data = mesh.data, levels] { return refine(data, levels); };
    const auto points = [make] {
        const Mesh result = make();
        std::vector<Vec3<double>> p;
        for (const auto v : result.vertices())
            p.emplace_back(result.point(v).x(), result.point(v).y(), result.point(v).z());
        return p;
    };
    return {{{"CGAL", "CatmullClark_subdivision", [make] { make(); }}, points}};
}

#else

std::vector<RefineWay> cgal_refine(const BenchMesh&, int) {
    return {};
}

#endif

}  // namespace osdx::bench
