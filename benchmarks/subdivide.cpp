// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"
#include "far/features.h"
#include "far/mesh.h"
#include "far/refine.h"

namespace osdx::bench {
namespace {

/// From arrays, as the peers.
std::vector<Vec3<double>> refine(const MeshData& mesh, int degree, int levels) {
    Topology base = build_topology(*build_mesh(mesh));
    Features features = *build_features(
        mesh, base, {.ignore_tags = true, .boundary = BoundaryRule::EdgeOnly});
    Refinement refinement(std::move(base), degree, std::move(features));
    for (int i = 0; i < levels; ++i)
        refinement.add_level();
    return refinement.points(mesh.positions);
}

}  // namespace

void subdivide_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    if (!suite.wants("subdivide"))
        return;
    for (const BenchMesh& mesh : meshes) {
        // Four levels, or as many as give some six million faces.
        int levels = 4;
        while (levels > 1 && std::size_t(mesh.n_faces()) << (2 * levels) > 7'000'000)
            --levels;
        // Checked on fewer levels where there are too many points to look for.
        int checked = levels;
        while (checked > 1 && std::size_t(mesh.n_faces()) << (2 * checked) > 500'000)
            --checked;
        const auto peers = [&](int n) {
            std::vector<RefineWay> ways;
            for (const auto& of : {opensubdiv_refine, openmesh_refine, cgal_refine})
                std::ranges::move(of(mesh, n), std::back_inserter(ways));
            return ways;
        };
        if (checked <= levels && mesh.n_faces() <= kLargestForPeers) {
            const auto expected = refine(mesh.data, 3, checked);
            const double size = diagonal(mesh.data);
            for (const RefineWay& peer : peers(checked)) {
                // In double on both sides.
                suite.check(fmt::format("{}: {}, points after {} levels", mesh.name,
                                        peer.way.name, checked),
                            set_distance(peer.points(), expected, 1e-9 * size) / size,
                            1e-9);
            }
        }
        std::vector<Way> ways;
        for (RefineWay& peer : peers(levels))
            ways.push_back(std::move(peer.way));
        const auto measure = [&](int degree, std::span<const Way> against) {
            const auto run = [&mesh, degree, levels] {
                refine(mesh.data, degree, levels);
            };
            const double n_points = double(refine(mesh.data, degree, levels).size());
            suite.compare(
                {"subdivide", mesh.name, mesh.n_faces(), degree, 1, n_points, "vertices"},
                {kOurs, fmt::format("Refinement, {} levels", levels), run}, against);
        };
        measure(3, ways);
    }
}

}  // namespace osdx::bench
