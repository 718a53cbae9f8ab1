// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <glm/geometric.hpp>

#include <osdx/build_patch_table.h>
#include <osdx/evaluator.h>
#include <osdx/topology.h>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"

namespace osdx::bench {
namespace {

/// So many that their output and the points of their patches stay in the second cache.
constexpr std::size_t kPlaces = 8192;

/// Anywhere on any of the faces, in no order, `run` of them on each at a time.
std::vector<Place> random_places(std::span<const Index> faces, std::size_t run) {
    std::mt19937 random(1);  // its numbers are the same everywhere
    const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    std::vector<Place> places;
    Index face = 0;
    for (std::size_t i = 0; i < kPlaces; ++i) {
        if (i % run == 0)
            face = faces[random() % std::min<std::size_t>(faces.size(), 1024)];
        const float u = unit();
        places.push_back({face, u, unit()});
    }
    return places;
}

Way all_at_once(const SampleWay& way) {
    return into_buffer(way, kPlaces, 1);
}

void measure(Suite& suite, const std::string& stage, const BenchMesh& mesh,
             const FloatSurface& surface, std::span<const Index> faces, std::size_t run,
             int isolation, double tolerance) {
    constexpr std::size_t kFewest = 32;
    if (faces.size() < kFewest || !suite.wants(stage))
        return;
    const auto places = random_places(faces, run);
    const SampleWay ours =
        run == 1 ? our_points(surface, places) : our_points_by_patch(surface, places);
    auto peers = opensubdiv_points(mesh, places, isolation);
    std::ranges::move(embree_points(mesh, places), std::back_inserter(peers));
    const auto a = evaluate_all(ours, kPlaces);
    std::vector<Way> ways;
    for (const SampleWay& peer : peers) {
        const auto b = evaluate_all(peer, kPlaces);
        double gap = 0;
        for (std::size_t i = 0; i < kPlaces; ++i)
            gap = std::max<double>(gap, glm::length(a[i].p - b[i].p));
        suite.check(mesh.name + ": " + peer.name + ", p", gap / diagonal(mesh.data),
                    tolerance);
        ways.push_back(all_at_once(peer));
    }
    suite.compare({stage, mesh.name, mesh.n_faces(), 3, 1, double(kPlaces), "points"},
                  all_at_once(ours), ways);
}

/// One by one, and as many at a time as a pixel takes rays, or a small tile.
void measure_both(Suite& suite, const std::string& kind, const BenchMesh& mesh,
                  const FloatSurface& surface, std::span<const Index> faces,
                  int isolation, double tolerance) {
    measure(suite, "evaluate_point_" + kind, mesh, surface, faces, 1, isolation,
            tolerance);
    measure(suite, "evaluate_many_" + kind, mesh, surface, faces, 16, isolation,
            tolerance);
}

/// Anywhere on the mesh, in no order: at once against one by one.
void measure_scattered(Suite& suite, const BenchMesh& mesh, const FloatSurface& surface) {
    const std::string stage = "evaluate_scattered";
    if (!suite.wants(stage))
        return;
    const std::size_t n = suite.options().smoke ? 10'000 : 1'000'000;
    const Topology& base = surface.surface.base();
    std::mt19937 random(1);
    std::vector<Address> where;
    while (where.size() < n) {
        const auto quarter = static_cast<Index>(random() % base.n_halfedges());
        const double x = double(random() >> 8) * 0x1p-24;
        where.push_back(to_address(base, {quarter, x, double(random() >> 8) * 0x1p-24}));
    }
    const std::span<const float> values(&surface.points[0].x, 3 * surface.points.size());
    std::vector<float> at_once(9 * n), one_by_one(9 * n);
    const Way ours{kOurs, "evaluate_addresses", [&] {
                       surface.surface.evaluate(values, 3, where, 1,
                                                channels(at_once.data(), 9));
                   }};
    const Way single{"osdx one by one", "Evaluator", [&] {
                         const Evaluator& evaluator = surface.surface.evaluator();
                         for (std::size_t i = 0; i < n; ++i)
                             evaluator.evaluate_channels<float>(
                                 values, 3, surface.surface.patches().locate(where[i]), 1,
                                 Chart::BaseUV, std::span(one_by_one).subspan(9 * i, 9));
                     }};
    ours.run();
    single.run();
    double gap = 0;
    for (std::size_t i = 0; i < 9 * n; ++i)
        gap = std::max<double>(gap, std::abs(at_once[i] - one_by_one[i]));
    suite.check(mesh.name + ": scattered, one by one", gap / diagonal(mesh.data), 1e-6);
    for (const int threads : suite.options().threads)
        suite.compare({stage, mesh.name, mesh.n_faces(), 3, threads, double(n), "points"},
                      ours, std::array{on_one_thread(single)});
}

}  // namespace

void evaluate_points_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    if (!suite.wants_any({"evaluate_point_regular", "evaluate_point_ev5",
                          "evaluate_point_gregory", "evaluate_many_regular",
                          "evaluate_many_ev5", "evaluate_many_gregory",
                          "evaluate_scattered"}))
        return;
    for (const BenchMesh& mesh : meshes) {
        if (mesh.n_faces() > kLargestForStencils)
            continue;
        const FloatSurface surface = make_surface(mesh, {.degree = 3});
        measure_scattered(suite, mesh, surface);
        measure_both(suite, "regular", mesh, surface, regular_faces(surface.surface),
                     kIsolation, 1e-5);
        // One Gregory patch over each face follows the limit in its own way.
        measure_both(suite, "ev5", mesh, surface, ev_faces(surface.surface, 5), 0, 0.03);
        const FloatSurface gregory =
            make_surface(mesh, {.degree = 3, .family = PatchFamily::Gregory});
        measure_both(suite, "gregory", mesh, gregory, gregory_faces(gregory.surface), 0,
                     0.03);
    }
}

}  // namespace osdx::bench
