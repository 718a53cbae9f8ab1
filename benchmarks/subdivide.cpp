// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include <osdx/buffer.h>
#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/topology.h>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"
#include "far/refine/grids/even_grids.h"
#include "far/refine/grids/odd_grids.h"

namespace osdx::bench {
namespace {

enum class Connectivity { FaceVertices, Full };

struct Refined {
    Buffer<Vec3<double>> points;
    Buffer<Index> face_sizes, face_vertices;
    Topology topology;
};

template <class R>
Buffer<Vec3<double>> refined_points(const R& refinement, Index n, const MeshData& mesh) {
    Buffer<Vec3<double>> points(n);
    refinement.points(std::span(mesh.positions), std::span(points));
    return points;
}

/// From arrays, as the peers.
/// \pre the connectivity of even degrees is FaceVertices
Refined refine(const MeshData& mesh, int degree, int levels, Connectivity connectivity) {
    Topology base = *build_topology(mesh);
    const Features features = *build_features(mesh, base, kNoTags);
    Refined r;
    if (degree % 2 == 0) {
        const EvenGrids refinement(std::move(base), degree, levels, features);
        r.points = refined_points(refinement, refinement.n_vertices(), mesh);
        r.face_sizes.resize(refinement.n_faces());
        r.face_vertices.resize(refinement.n_halfedges());
        refinement.faces(r.face_sizes, r.face_vertices);
        return r;
    }
    const OddGrids refinement(std::move(base), degree, levels, features);
    const QuadGrids grids = refinement.grids();
    r.points = refined_points(refinement, grids.n_vertices(), mesh);
    if (connectivity == Connectivity::Full) {
        r.topology = to_topology(grids);
    } else {
        r.face_vertices.resize(grids.n_halfedges());
        face_vertices(grids, r.face_vertices);
    }
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
    const Topology base = *build_topology(mesh.data);
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
            const char* with =
                connectivity == Connectivity::Full ? "full topology" : "face vertices";
            Way ours{kOurs, fmt::format("{} levels, {}", levels, with),
                     [run] { (void)run(); }};
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
        // Larger meshes take fewer levels to the same size, by the same peers.
        const bool beside_peers = mesh.n_faces() <= kLargestForStencils;
        if (beside_peers) {
            // Fewer levels, where there are too many points to look for.
            const int checked = n_levels(mesh, 500'000);
            check(suite, mesh, opensubdiv_refine(mesh, checked, false), checked);
            check(suite, mesh, all_peers(checked), checked);
        }
        for (const int threads : {1, 2}) {
            measure(3, threads, Connectivity::FaceVertices,
                    beside_peers ? opensubdiv_refine(mesh, levels, false)
                                 : std::vector<RefineWay>());
            measure(3, threads, Connectivity::Full,
                    beside_peers ? all_peers(levels) : std::vector<RefineWay>());
        }
        if (mesh.n_faces() < kSizes[0]) {
            for (const int degree : {2, 4, 5, 6, 7})
                measure(degree, 1, Connectivity::FaceVertices, {});
        }
    }
}

}  // namespace osdx::bench
