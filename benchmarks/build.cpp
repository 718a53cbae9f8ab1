// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <osdx/patch_table.h>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"

namespace osdx::bench {
namespace {

Case make_case(const char* stage, const BenchMesh& mesh, int degree, int threads) {
    return {stage,  mesh.name, mesh.n_faces(), degree, threads, double(mesh.n_faces()),
            "faces"};
}

Way our_build(const BenchMesh& mesh, int degree, double* n_control_points = nullptr) {
    const FloatSurface once = make_surface(mesh, {.degree = degree});
    if (n_control_points) {
        const PatchTable& table = once.surface.patches();
        *n_control_points = 0;
        for (Index i = 0; i < table.n_patches(); ++i)
            *n_control_points += static_cast<double>(table.patch(i).points.size());
    }
    return {
        kOurs, "Surface::build",
        [&mesh, degree] { (void)Surface::build(mesh.data, {.degree = degree}, kNoTags); },
        once.bytes};
}

}  // namespace

void build_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    if (!suite.wants_any({"build", "degree", "threads", "size"}))
        return;
    for (const BenchMesh& mesh : meshes) {
        if (!suite.wants_any({"build", "degree", "threads"}))
            break;
        double cubic_points;
        const Way ours = our_build(mesh, 3, &cubic_points);
        const auto peers = suite.wants("build") && mesh.n_faces() <= kLargestForPeers
                               ? opensubdiv_build(mesh)
                               : std::vector<Way>();
        suite.compare(make_case("build", mesh, 3, 1), ours, peers);
        // Far builds on one thread.
        suite.compare(make_case("build", mesh, 3, 2), ours, peers);
        Way alone = on_one_thread(ours);
        alone.name = "build, one thread";
        suite.compare(make_case("threads", mesh, 3, 2), ours, std::vector<Way>{alone});
        if (!suite.wants("degree") || mesh.n_faces() > kLargestForStencils)
            continue;
        Way three = ours;
        three.name = "build, degree 3";
        three.items = cubic_points;
        for (const int degree : {2, 4, 5, 6, 7}) {
            Case what = make_case("degree", mesh, degree, 1);
            const Way way = our_build(mesh, degree, &what.items);
            what.unit = "control points";
            suite.compare(what, way, std::vector<Way>{three});
        }
    }
    const BenchMesh* base = base_of_size(meshes);
    if (!base || !suite.wants("size"))
        return;
    const BenchMesh& large = meshes.back();
    Way small = our_build(*base, 3);
    small.name = "build, " + base->name;
    small.items = base->n_faces();
    small.bytes = 0;  // of another mesh
    suite.compare(make_case("size", large, 3, 1), our_build(large, 3),
                  std::vector<Way>{small});
}

}  // namespace osdx::bench
