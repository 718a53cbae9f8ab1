// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <iterator>

#include <glm/geometric.hpp>

#include <osdx/build_patch_table.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"

namespace osdx::bench {
namespace {

Case make_case(const char* stage, const BenchMesh& mesh, const Grid& grid, int degree = 3,
               int threads = 1) {
    return {stage,    mesh.name, mesh.n_faces(),
            degree,   threads,   static_cast<double>(grid.n_places()),
            "samples"};
}

std::vector<Way> ways_in_cache(std::span<const SampleWay> ways, std::size_t n) {
    std::vector<Way> result;
    for (const SampleWay& way : ways) {
        if (!way.is_wide)
            result.push_back(in_cache(way, n));
    }
    return result;
}

/// Against places on faces where the surfaces are the same, `exact`, and where they are not.
/// \param turned  (u, v) of the places runs otherwise than ours: derivatives are not compared
void check_peers(Suite& suite, const BenchMesh& mesh, const Grid& ours,
                 std::span<const SampleWay> peers, std::span<const Place> places,
                 std::span<const Index> exact, bool turned) {
    // 64 terms or so, each rounded in float; the weights of derivatives are larger.
    constexpr double kRounding = 1e-5;
    // Patches that are not regular follow the limit in their own way; see
    // docs/benchmarks.md.
    constexpr double kApart = 0.03;
    const double size = diagonal(mesh.data);
    std::vector<bool> is_exact(mesh.n_faces());
    for (const Index f : exact)
        is_exact[f] = true;
    const auto a = ours.evaluate_all();
    for (const SampleWay& peer : peers) {
        const auto b = evaluate_all(peer, places.size());
        double p = 0, d = 0, apart = 0;
        for (std::size_t i = 0; i < places.size(); ++i) {
            const double gap = glm::length(a[i].p - b[i].p) / size;
            if (!is_exact[places[i].face]) {
                apart = std::max(apart, gap);
                continue;
            }
            p = std::max(p, gap);
            if (!turned) {
                d = std::max({d, glm::length(a[i].du - b[i].du) / size,
                              glm::length(a[i].dv - b[i].dv) / size});
            }
        }
        const std::string name = mesh.name + ": " + peer.library + " " + peer.name;
        if (!exact.empty()) {
            suite.check(name + ", p where patches are regular", p, kRounding);
            suite.check(name + ", du and dv there", d, kRounding);
        }
        suite.check(name + ", p elsewhere", apart, kApart);
    }
}

/// Patches of one kind alone. Too few of them say nothing.
void measure_kind(Suite& suite, const char* stage, const BenchMesh& mesh,
                  const FloatSurface& surface, PatchKind kind, int n_sectors) {
    constexpr std::size_t kFewest = 32 * kGridSize;
    const auto classes = surface.surface.patches().classes();
    for (Index i = 0; i < classes.size(); ++i) {
        const PatchClass& c = classes[i];
        if (c.kind != kind || c.n_sectors != n_sectors || c.border != PatchBorder::None)
            continue;
        const Grid grid(surface, i);
        const std::size_t n = grid.n_places();
        const auto places = class_places(surface.surface, i);
        if (n < kFewest || places.empty())
            continue;
        const auto peers = opensubdiv_gregory_grid(mesh, places);
        check_peers(suite, mesh, grid, peers, places, {}, true);
        suite.compare(make_case(stage, mesh, grid), grid.in_cache(),
                      ways_in_cache(peers, n));
    }
}

void measure_all(Suite& suite, const BenchMesh& mesh, const FloatSurface& surface) {
    const Grid grid(surface);
    const std::size_t n = grid.n_places();
    std::vector<Place> places;
    std::vector<SampleWay> peers;
    if (mesh.n_faces() <= kLargestForStencils &&
        suite.wants_any({"evaluate_grid_cached", "evaluate_grid_buffer"})) {
        places = grid_places(mesh.n_faces());
        peers = opensubdiv_grid(mesh, places, 2);
        std::ranges::move(embree_grid(mesh, places), std::back_inserter(peers));
        check_peers(suite, mesh, grid, peers, places, regular_faces(surface.surface),
                    false);
    }
    suite.compare(make_case("evaluate_grid_cached", mesh, grid), grid.in_cache(),
                  ways_in_cache(peers, n));
    for (const int threads : {1, 2}) {
        std::vector<Way> buffers;
        for (const SampleWay& peer : peers) {
            if (threads > 1 || !peer.is_wide)
                buffers.push_back(into_buffer(peer, n, threads));
        }
        suite.compare(make_case("evaluate_grid_buffer", mesh, grid, 3, threads),
                      grid.into_buffer(), buffers);
    }
    Way alone = on_one_thread(grid.in_cache());
    alone.name = "grid, one thread";
    suite.compare(make_case("threads", mesh, grid, 3, 2), grid.in_cache(),
                  std::vector<Way>{alone});
}

/// Control points under all samples.
double n_control_points(const Surface& surface) {
    double n = 0;
    for (const Place& p : grid_places(surface.base().n_faces())) {
        const Index patch = surface.patches().locate(Address{p.face, p.u, p.v}).patch;
        n += static_cast<double>(surface.patches().patch(patch).points.size());
    }
    return n;
}

/// Rates are in control points, so that a ratio of one is a cost that grows like their number.
void measure_degrees(Suite& suite, const BenchMesh& mesh, const FloatSurface& cubic) {
    const Grid cubic_grid(cubic);
    Way three = cubic_grid.in_cache();
    three.name = "grid, degree 3";
    three.items = n_control_points(cubic.surface);
    for (const int degree : {2, 4, 5, 6, 7}) {
        const FloatSurface surface = make_surface(mesh, {.degree = degree});
        const Grid grid(surface);
        Case what = make_case("degree", mesh, grid, degree);
        what.items = n_control_points(surface.surface);
        what.unit = "control points";
        suite.compare(what, grid.in_cache(), std::vector<Way>{three});
    }
}

/// The cost of a face of the largest mesh, against that of one of kSizes[0].
void measure_sizes(Suite& suite, const BenchMesh& small, const BenchMesh& large) {
    const FloatSurface small_surface = make_surface(small, {.degree = 3}),
                       large_surface = make_surface(large, {.degree = 3});
    const Grid small_grid(small_surface), large_grid(large_surface);
    Way way = small_grid.in_cache();
    way.name = "grid, " + small.name;
    way.items = small.n_faces();
    way.bytes = 0;  // of another mesh
    Case what = make_case("size", large, large_grid);
    what.items = large.n_faces();
    what.unit = "faces";
    suite.compare(what, large_grid.in_cache(), std::vector<Way>{way});
}

}  // namespace

void evaluate_grid_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    const bool all =
        suite.wants_any({"evaluate_grid_cached", "evaluate_grid_buffer", "threads"});
    for (const BenchMesh& mesh : meshes) {
        if (mesh.n_faces() > kLargestForPeers ||
            !(all ||
              suite.wants_any({"evaluate_grid_ev5", "evaluate_grid_gregory", "degree"})))
            continue;
        const FloatSurface surface = make_surface(mesh, {.degree = 3});
        if (all)
            measure_all(suite, mesh, surface);
        if (mesh.n_faces() > kLargestForStencils)
            continue;
        if (suite.wants("evaluate_grid_ev5"))
            measure_kind(suite, "evaluate_grid_ev5", mesh, surface, PatchKind::EV, 5);
        if (suite.wants("evaluate_grid_gregory")) {
            measure_kind(
                suite, "evaluate_grid_gregory", mesh,
                make_surface(mesh, {.degree = 3, .family = PatchFamily::Gregory}),
                PatchKind::Gregory, 4);
        }
        if (suite.wants("degree"))
            measure_degrees(suite, mesh, surface);
    }
    if (const BenchMesh* small = base_of_size(meshes); small && suite.wants("size"))
        measure_sizes(suite, *small, meshes.back());
}

}  // namespace osdx::bench
