// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"

namespace osdx::bench {
namespace {

constexpr const char* kUnit = "samples";

Case make_case(const char* stage, const BenchMesh& mesh, std::span<const Place> places,
               int degree = 3, int threads = 1) {
    return {stage,  mesh.name, mesh.n_faces(),
            degree, threads,   static_cast<double>(places.size()),
            kUnit};
}

std::vector<Index> all_faces(const BenchMesh& mesh) {
    std::vector<Index> faces(mesh.n_faces());
    std::iota(faces.begin(), faces.end(), Index(0));
    return faces;
}

std::vector<Way> ways_in_cache(std::span<const SampleWay> ways, std::size_t n) {
    std::vector<Way> result;
    for (const SampleWay& way : ways) {
        if (!way.is_wide)
            result.push_back(in_cache(way, n));
    }
    return result;
}

template <class T>
void append(std::vector<T>& to, std::vector<T> more) {
    std::ranges::move(more, std::back_inserter(to));
}

/// Against places where the surfaces are the same, `exact`, and where they are not.
void check_peers(Suite& suite, const BenchMesh& mesh, const SampleWay& ours,
                 std::span<const SampleWay> peers, std::span<const Place> places,
                 const std::vector<bool>& exact) {
    // 64 terms or so, each rounded in float; the weights of derivatives are larger.
    constexpr double kRounding = 1e-5;
    // Patches that are not regular follow the limit in their own way; see README.md.
    constexpr double kApart = 0.03;
    const double size = diagonal(mesh.data);
    const auto a = evaluate_all(ours, places.size());
    for (const SampleWay& peer : peers) {
        const auto b = evaluate_all(peer, places.size());
        double p = 0, d = 0, apart = 0;
        for (std::size_t i = 0; i < places.size(); ++i) {
            const double gap = glm::length(a[i].p - b[i].p) / size;
            if (!exact[places[i].face]) {
                apart = std::max(apart, gap);
                continue;
            }
            p = std::max(p, gap);
            d = std::max({d, glm::length(a[i].du - b[i].du) / size,
                          glm::length(a[i].dv - b[i].dv) / size});
        }
        const std::string name = mesh.name + ": " + peer.name;
        suite.check(name + ", p where patches are regular", p, kRounding);
        suite.check(name + ", du and dv there", d, kRounding);
        suite.check(name + ", p elsewhere", apart, kApart);
    }
}

std::vector<bool> as_flags(const BenchMesh& mesh, std::span<const Index> faces) {
    std::vector<bool> flags(mesh.n_faces());
    for (const Index f : faces)
        flags[f] = true;
    return flags;
}

/// Patches of one kind alone. Too few of them say nothing.
void measure_kind(Suite& suite, const char* stage, const BenchMesh& mesh,
                  const FloatSurface& surface, PatchKind kind, int n_sectors) {
    constexpr std::size_t kFewest = 32;
    const PatchTable& table = surface.surface.patches();
    const auto faces = faces_where(surface.surface, [&](Index patch) {
        const PatchClass& c = table.class_of(patch);
        return c.kind == kind && c.n_sectors == n_sectors &&
               c.border == PatchBorder::None;
    });
    if (faces.size() < kFewest || !suite.wants(stage))
        return;
    const auto places = grid_places(faces);
    const SampleWay ours = our_grid(surface, places);
    const auto peers = opensubdiv_gregory_grid(mesh, places);
    check_peers(suite, mesh, ours, peers, places, std::vector<bool>(mesh.n_faces()));
    suite.compare(make_case(stage, mesh, places), in_cache(ours, places.size()),
                  ways_in_cache(peers, places.size()));
}

void measure_all(Suite& suite, const BenchMesh& mesh, const FloatSurface& surface) {
    const auto places = grid_places(all_faces(mesh));
    const std::size_t n = places.size();
    const SampleWay ours = our_grid(surface, places);
    std::vector<SampleWay> peers;
    if (mesh.n_faces() <= kLargestForStencils) {
        peers = opensubdiv_grid(mesh, places, 2, true);
        append(peers, embree_grid(mesh, places));
        check_peers(suite, mesh, ours, peers, places,
                    as_flags(mesh, regular_faces(surface.surface)));
    }
    suite.compare(make_case("evaluate_grid_cached", mesh, places), in_cache(ours, n),
                  ways_in_cache(peers, n));
    for (const int threads : {1, 2}) {
        std::vector<Way> buffers;
        for (const SampleWay& peer : peers) {
            if (threads > 1 || !peer.is_wide)
                buffers.push_back(into_buffer(peer, n, threads));
        }
        suite.compare(make_case("evaluate_grid_buffer", mesh, places, 3, threads),
                      into_buffer(ours, n, threads), buffers);
    }
    Way alone = on_one_thread(into_buffer(ours, n, 1));
    alone.name = "grid, one thread";
    suite.compare(make_case("threads", mesh, places, 3, 2), into_buffer(ours, n, 2),
                  std::vector<Way>{alone});
}

double n_control_points(const Surface& surface, std::span<const Place> places) {
    double n = 0;
    for (const Place& p : places) {
        const Index patch = surface.patches().locate(Address{p.face, p.u, p.v}).patch;
        n += static_cast<double>(surface.patches().patch(patch).points.size());
    }
    return n;
}

/// Rates are in control points, so that a ratio of one is a cost that grows like their number.
void measure_degrees(Suite& suite, const BenchMesh& mesh, const FloatSurface& cubic) {
    const auto places = grid_places(all_faces(mesh));
    const std::size_t n = places.size();
    Way three = in_cache(our_grid(cubic, places), n);
    three.name = "grid, degree 3";
    three.items = n_control_points(cubic.surface, places);
    for (const int degree : {2, 4, 5, 6, 7}) {
        const FloatSurface surface = make_surface(mesh, surface_options(degree));
        Case what = make_case("degree", mesh, places, degree);
        what.items = n_control_points(surface.surface, places);
        what.unit = "control points";
        suite.compare(what, in_cache(our_grid(surface, places), n),
                      std::vector<Way>{three});
    }
}

}  // namespace

void evaluate_grid_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    if (!suite.wants_any({"evaluate_grid_cached", "evaluate_grid_buffer",
                          "evaluate_grid_ev5", "evaluate_grid_gregory", "degree",
                          "threads"}))
        return;
    for (const BenchMesh& mesh : meshes) {
        if (mesh.n_faces() > kLargestForPeers)
            continue;
        const FloatSurface surface = make_surface(mesh, surface_options(3));
        if (suite.wants_any({"evaluate_grid_cached", "evaluate_grid_buffer", "threads"}))
            measure_all(suite, mesh, surface);
        if (mesh.n_faces() > kLargestForStencils)
            continue;
        measure_kind(suite, "evaluate_grid_ev5", mesh, surface, PatchKind::EV, 5);
        if (suite.wants("evaluate_grid_gregory")) {
            measure_kind(suite, "evaluate_grid_gregory", mesh,
                         make_surface(mesh, surface_options(3, PatchFamily::Gregory)),
                         PatchKind::Gregory, 4);
        }
        if (suite.wants("degree"))
            measure_degrees(suite, mesh, surface);
    }
    // The cost of a face of the largest mesh, against that of one of kSizes[0].
    const BenchMesh& large = meshes.back();
    const auto base = std::ranges::find_if(
        meshes, [](const BenchMesh& m) { return m.n_faces() >= kSizes[0]; });
    if (!suite.wants("size") || base == meshes.end() || &*base == &large)
        return;
    const auto measure = [](const BenchMesh& mesh, const FloatSurface& surface,
                            const std::vector<Place>& places) {
        Way way = in_cache(our_grid(surface, places), places.size());
        way.name = "grid, " + mesh.name;
        way.items = mesh.n_faces();
        return way;
    };
    const FloatSurface small_surface = make_surface(*base, surface_options(3)),
                       large_surface = make_surface(large, surface_options(3));
    const auto small_places = grid_places(all_faces(*base)),
               large_places = grid_places(all_faces(large));
    Case what = make_case("size", large, large_places);
    what.unit = "faces";
    suite.compare(what, measure(large, large_surface, large_places),
                  std::vector<Way>{measure(*base, small_surface, small_places)});
}

}  // namespace osdx::bench
