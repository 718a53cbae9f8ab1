// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"

namespace osdx::bench {

void tessellate_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    constexpr int kRate = 8;
    if (!suite.wants("tessellate"))
        return;
    for (const BenchMesh& mesh : meshes) {
        if (mesh.n_faces() > kLargestForStencils)
            continue;
        const FloatSurface surface = make_surface(mesh, {.degree = 3});
        const auto n_facets =
            double(surface.surface.tessellate(kRate).facet_sizes.size());
        std::vector<Way> ways;
        for (const TessellateWay& peer : opensubdiv_tessellate(mesh, kRate)) {
            suite.check(mesh.name + ": " + peer.way.name + ", number of facets",
                        std::abs(double(peer.n_facets()) - n_facets), 0);
            ways.push_back(peer.way);
        }
        for (const int threads : {1, 2}) {
            suite.compare(
                {"tessellate", mesh.name, mesh.n_faces(), 3, threads, n_facets, "facets"},
                {kOurs, "Surface::tessellate",
                 [&] { (void)surface.surface.tessellate(kRate); }},
                ways);
        }
    }
}

}  // namespace osdx::bench
