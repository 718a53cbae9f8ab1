// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <osdx/tessellation_rates.h>

#include "benchmarks/ours.h"
#include "benchmarks/peers.h"
#include "benchmarks/stages.h"

namespace osdx::bench {
namespace {

/// The greatest distance of the middles of facets from the surface, along its normal. Of quads
/// of the mesh: elsewhere (u, v) of odd rates have no middle.
double distance(const Surface& s, const Tessellation& t) {
    double greatest = 0;
    std::size_t c = 0;
    for (std::size_t f = 0; f < t.facet_sizes.size(); ++f) {
        const Index n = t.facet_sizes[f], face = t.facet_faces[f];
        Vec3<double> p(0);
        Vec2<double> uv(0);
        for (Index i = 0; i < n; ++i, ++c) {
            p += t.positions[t.facet_points[c]] / double(n);
            uv += t.facet_uvs[c] / double(n);
        }
        if (s.base().face_size(face) != 4)
            continue;
        const auto jet = s.evaluate({face, uv.x, uv.y}, Chart::Native);
        greatest = std::max(greatest, std::abs(glm::dot(jet.p - p, normal(jet))));
    }
    return greatest;
}

/// The mesh at an error, over its diagonal, by rates measured for it and by the one rate that
/// comes as near: as often a second as there are faces.
void compare_at_error(Suite& suite, const BenchMesh& mesh, const Surface& s,
                      double error) {
    constexpr std::size_t kMostFacets = 10'000'000;  // some 2 GB
    const double length = error * bounding_diagonal(mesh.data.positions);
    const auto adaptive = [&] {
        return s.tessellate(rates_from_error(s.evaluator(), s.points(), length));
    };
    double bytes = 0, uniform_bytes = 0;
    const Tessellation t = measured(adaptive, bytes);
    const double found = distance(s, t);
    // An estimate, of what eighths of faces show: twice as much is no fault.
    suite.check(
        fmt::format("{}: distance at the error {:.0e}, over it", mesh.name, error),
        found / length, 2);
    int rate = 0;
    std::size_t n_facets = 0;
    for (double d = 2 * found; d > found && n_facets < kMostFacets;) {
        ++rate;
        const Tessellation uniform =
            measured([&] { return s.tessellate(rate); }, uniform_bytes);
        n_facets = uniform.facet_sizes.size();
        d = distance(s, uniform);
    }
    for (const int threads : {1, 2}) {
        suite.compare(
            {"tessellate_error", mesh.name, mesh.n_faces(), 3, threads,
             double(mesh.n_faces()), "faces"},
            {kOurs, fmt::format("error {:.0e}, {} facets", error, t.facet_sizes.size()),
             [&] { (void)adaptive(); }, bytes},
            std::vector<Way>{{kOurs, fmt::format("rate {}, {} facets", rate, n_facets),
                              [&] { (void)s.tessellate(rate); }, uniform_bytes}});
    }
}

}  // namespace

void tessellate_stage(Suite& suite, std::span<const BenchMesh> meshes) {
    constexpr int kRate = 8;
    if (!suite.wants_any({"tessellate", "tessellate_error"}))
        return;
    for (const BenchMesh& mesh : meshes) {
        if (mesh.n_faces() > kLargestForStencils)
            continue;
        const FloatSurface surface = make_surface(mesh, {.degree = 3});
        if (suite.wants("tessellate_error"))
            compare_at_error(suite, mesh, surface.surface, 1e-4);
        if (!suite.wants("tessellate"))
            continue;
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
