// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <numeric>

#include <glm/geometric.hpp>

#include <osdx/patch_table.h>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"

namespace osdx::bench {
namespace {

/// A few neighbours move, against all vertices anew: both by the facade, in double.
void measure_local(Suite& suite, const BenchMesh& mesh, Surface& surface) {
    constexpr Index kMoved = 16;
    const Index n = std::min(kMoved, mesh.n_vertices());
    std::vector<Index> vertices(n);
    std::iota(vertices.begin(), vertices.end(), Index(0));
    const std::span<const Vec3<double>> positions(mesh.data.positions);
    const auto move = [&] { (void)surface.move_vertices(vertices, positions.first(n)); };
    const auto set = [&] { (void)surface.set_positions(positions); };
    move();  // makes its tables
    suite.compare({"update_local", mesh.name, mesh.n_faces(), 3, 1, 1, "updates"},
                  {kOurs, "move_vertices, 16 of them", move},
                  std::vector<Way>{{kOurs, "set_positions", set}});
}

}  // namespace

void update_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    if (!suite.wants_any({"update", "update_local"}))
        return;
    for (const BenchMesh& mesh : meshes) {
        FloatSurface surface = make_surface(mesh, {.degree = 3});
        std::vector<Vec3<float>> moved;
        for (const Vec3<double>& p : mesh.data.positions)
            moved.push_back(Vec3<float>(p) * Vec3<float>(1, -2, 0.5f));
        const Way ours = {
            kOurs, "refresh_points",
            [&] {
                std::ranges::copy(moved, surface.points.begin());
                surface.surface.patches().refresh_points<float>(surface.points);
            },
            surface.bytes};
        std::vector<Place> places;
        for (const Index f : regular_faces(surface.surface)) {
            if (places.size() < 8192)
                places.push_back({f, 0.25f, 0.375f});
        }
        ours.run();
        const auto expected = evaluate_all(our_points(surface, places), places.size());
        for (const int threads : {1, 2}) {
            std::vector<Way> ways;
            if (mesh.n_faces() <= kLargestForPeers) {
                for (UpdateWay& peer : opensubdiv_update(mesh, moved, threads)) {
                    peer.way.run();
                    const auto points = peer.points(places);
                    double gap = 0;
                    for (std::size_t i = 0; i < places.size(); ++i)
                        gap =
                            std::max<double>(gap, glm::length(points[i] - expected[i].p));
                    // Rounding in float.
                    suite.check(mesh.name + ": " + peer.way.name + ", updated p",
                                gap / diagonal(mesh.data), 1e-5);
                    ways.push_back(std::move(peer.way));
                }
            }
            suite.compare({"update", mesh.name, mesh.n_faces(), 3, threads,
                           double(mesh.n_faces()), "faces"},
                          ours, ways);
        }
        measure_local(suite, mesh, surface.surface);
    }
}

}  // namespace osdx::bench
