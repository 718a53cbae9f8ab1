// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"
#include "far/features.h"
#include "far/mesh.h"
#include "far/refine.h"
#include "far/uniform_refinement.h"

namespace osdx::bench {
namespace {

/// From arrays, as the peers.
struct Refined {
    std::vector<Vec3<double>> points;
    std::vector<Index> face_vertices;
    Topology topology;
};

enum class Connectivity { FaceVertices, Full };

Topology base_of(const MeshData& mesh) {
    return build_topology(*build_mesh(mesh));
}

Features features_of(const MeshData& mesh, const Topology& base) {
    return *build_features(mesh, base,
                           {.ignore_tags = true, .boundary = BoundaryRule::EdgeOnly});
}

Refined refine(const MeshData& mesh, int degree, int levels, Connectivity connectivity) {
    Refined r;
    Topology base = base_of(mesh);
    const Features features = features_of(mesh, base);
    if (degree % 2 == 1) {
        const UniformRefinement refinement(std::move(base), degree, levels, features);
        r.points.resize(refinement.grids().n_vertices());
        refinement.points(std::span(mesh.positions), std::span(r.points));
        if (connectivity == Connectivity::Full) {
            r.topology = to_topology(refinement.grids());
        } else {
            r.face_vertices.resize(refinement.grids().n_halfedges());
            face_vertices(refinement.grids(), r.face_vertices);
        }
        return r;
    }
    Refinement refinement(std::move(base), degree, features);
    for (int i = 0; i < levels; ++i)
        refinement.add_level();
    r.points = refinement.points(mesh.positions);
    r.topology = refinement.topology(levels);
    return r;
}

/// As many as keep the faces within a limit, four at most.
int n_levels(const BenchMesh& mesh, std::size_t most_faces) {
    int levels = 4;
    while (levels > 1 && std::size_t(mesh.n_faces()) << (2 * levels) > most_faces)
        --levels;
    return levels;
}

void check(Suite& suite, const BenchMesh& mesh, std::span<const RefineWay> peers,
           int levels) {
    const auto expected = refine(mesh.data, 3, levels, Connectivity::FaceVertices).points;
    const double size = diagonal(mesh.data);
    const Topology base = base_of(mesh.data);
    const bool has_border =
        std::ranges::find(base.twin, kInvalidIndex) != base.twin.end();
    for (const RefineWay& peer : peers) {
        const auto points = peer.points();
        const std::string what = fmt::format(
            "{}: {} {}, {} of points after {} levels", mesh.name, peer.way.library,
            peer.way.name, has_border && !peer.same_border ? "number" : "set", levels);
        if (has_border && !peer.same_border) {
            suite.check(what, std::abs(double(points.size()) - double(expected.size())),
                        0);
        } else {  // in double on both sides
            suite.check(what, set_distance(points, expected, 1e-9 * size) / size, 1e-9);
        }
    }
}

}  // namespace

void subdivide_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    if (!suite.wants("subdivide"))
        return;
    for (const BenchMesh& mesh : meshes) {
        const int levels = n_levels(mesh, 7'000'000);
        const auto measure = [&](int degree, int threads, Connectivity connectivity,
                                 std::span<const RefineWay> peers) {
            const auto run = [&] {
                return refine(mesh.data, degree, levels, connectivity);
            };
            Way ours{kOurs,
                     fmt::format("{} levels, {}", levels,
                                 degree % 2 == 0 ? "Refinement"
                                 : connectivity == Connectivity::Full
                                     ? "UniformRefinement, full topology"
                                     : "UniformRefinement, face vertices"),
                     [run] { run(); }};
            const auto n_points = double(measured(run, ours.bytes).points.size());
            std::vector<Way> ways;
            for (const RefineWay& peer : peers)
                ways.push_back(peer.way);
            suite.compare({"subdivide", mesh.name, mesh.n_faces(), degree, threads,
                           n_points, "vertices"},
                          ours, ways);
        };
        const auto all_peers = [&](int n) {
            std::vector<RefineWay> ways = opensubdiv_refine(mesh, n, true);
            std::ranges::move(openmesh_refine(mesh, n), std::back_inserter(ways));
            std::ranges::move(cgal_refine(mesh, n), std::back_inserter(ways));
            return ways;
        };
        // Fewer levels, where there are too many points to look for.
        const int checked = n_levels(mesh, 500'000);
        if (mesh.n_faces() <= kLargestForPeers) {
            check(suite, mesh, opensubdiv_refine(mesh, checked, false), checked);
            check(suite, mesh, all_peers(checked), checked);
        }
        for (const int threads : {1, 2}) {
            measure(3, threads, Connectivity::FaceVertices,
                    opensubdiv_refine(mesh, levels, false));
            measure(3, threads, Connectivity::Full, all_peers(levels));
        }
        if (mesh.n_faces() < kSizes[0]) {
            for (const int degree : {2, 4, 5, 6, 7})
                measure(degree, 1, Connectivity::Full, {});
        }
    }
}

}  // namespace osdx::bench
