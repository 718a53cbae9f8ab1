// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Control points against the Gregory end caps of OpenSubdiv, which shares no code with ours:
// all but the tangents is the same, so that with its tangents all points are.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <opensubdiv/far/patchTable.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/ptexIndices.h>
#include <opensubdiv/far/stencilTable.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <osdx/build_topology.h>
#include <osdx/mesh_file.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "far/patches/gregory_net.h"
#include "far/refine/refinement.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;
using namespace test;
using Net = std::vector<Vec3<double>>;

struct OsdPoint {
    Vec3<double> p{0};
    void Clear() { p = Vec3<double>(0); }
    void AddWithWeight(const OsdPoint& other, double weight) { p += weight * other.p; }
};

/// The tangents of OpenSubdiv: along an edge inside,
/// 1 / (2 n lambda (n + 5)) sum of cos(j theta) (4 e_j + 2 e_(j-1) + 2 e_(j+1) + f_(j-1) + f_j),
/// and across a border those of Biermann, Levin and Zorin (2000) for any number of faces. f is
/// the corner across a quad.
FanMask osd_tangents(const FanShape& fan, int edge) {
    const int n = fan.n_faces, m = fan.n_edges();
    FanMask t(static_cast<std::size_t>(1 + m + n), 0.0);
    const auto add_edge = [&](int j, double w) { t[1 + (j + m) % m] += w; };
    const auto add_across = [&](int j, double w) {
        // f = 4 c - v - e_j - e_(j+1).
        j = (j + n) % n;
        t[1 + m + j] += 4 * w;
        t[0] -= w;
        add_edge(j, -w);
        add_edge(j + 1, -w);
    };
    if (fan.sharp) {
        t[0] = -1.0 / 3;
        add_edge(edge, 1.0 / 3);
    } else if (!fan.open) {
        const double theta = 2 * std::numbers::pi / n, ct = std::cos(theta);
        const double lambda =
            (5 + ct + std::cos(theta / 2) * std::sqrt(18 + 2 * ct)) / 16;
        for (int j = 0; j < n; ++j) {
            const double w = std::cos((j - edge) * theta) / (2 * n * lambda * (n + 5));
            add_edge(j, 4 * w);
            add_edge(j - 1, 2 * w);
            add_edge(j + 1, 2 * w);
            add_across(j - 1, w);
            add_across(j, w);
        }
    } else {
        const double h = std::numbers::pi / n, ch = std::cos(h);
        const double along = std::cos(edge * h) / 6,
                     across = edge == 0 || edge == n ? 0 : std::sin(edge * h);
        add_edge(0, along);
        add_edge(n, -along);
        const double w = across / (3 * (3 * n + ch));
        t[0] -= 4 * std::sin(h) * w;
        if (across > 0) {
            for (const int end : {0, n})
                add_edge(end, -(1 + 2 * ch) * std::sqrt((1 + ch) / (1 - ch)) * w);
        }
        for (int j = 0; j <= n; ++j)
            add_edge(j, 4 * std::sin(j * h) * w);
        for (int j = 0; j < n; ++j)
            add_across(j, (std::sin(j * h) + std::sin((j + 1) * h)) * w);
    }
    return t;
}

std::unique_ptr<Far::TopologyRefiner> osd_refiner(const Topology& base,
                                                  const Features& features) {
    std::vector<int> sizes, creases, corners;
    std::vector<float> crease_weights, corner_weights;
    for (Index f = 0; f < base.n_faces(); ++f)
        sizes.push_back(static_cast<int>(base.face_size(f)));
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        if (base.is_border(h) || base.twin[h] < h || features.edge(base.edge[h]) <= 0)
            continue;
        creases.push_back(static_cast<int>(base.vertex[h]));
        creases.push_back(static_cast<int>(base.to_vertex(h)));
        crease_weights.push_back(static_cast<float>(features.edge(base.edge[h])));
    }
    for (Index v = 0; v < base.n_vertices(); ++v) {
        if (features.vertex(v) > 0) {
            corners.push_back(static_cast<int>(v));
            corner_weights.push_back(static_cast<float>(features.vertex(v)));
        }
    }
    const std::vector<int> vertices(base.vertex.begin(), base.vertex.end());
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(base.n_vertices());
    descriptor.numFaces = static_cast<int>(base.n_faces());
    descriptor.numVertsPerFace = sizes.data();
    descriptor.vertIndicesPerFace = vertices.data();
    descriptor.numCreases = static_cast<int>(crease_weights.size());
    descriptor.creaseVertexIndexPairs = creases.data();
    descriptor.creaseWeights = crease_weights.data();
    descriptor.numCorners = static_cast<int>(corner_weights.size());
    descriptor.cornerVertexIndices = corners.data();
    descriptor.cornerWeights = corner_weights.data();
    Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    return std::unique_ptr<Far::TopologyRefiner>(
        Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_CATMARK, options)));
}

struct Count {
    int n_patches = 0, n_smooth_corners = 0, n_darts = 0;
    double error = 0, error_of_ours = 0;
};

/// All Gregory patches at level 1 of OpenSubdiv.
Count compare(const MeshData& mesh, BoundaryRule boundary) {
    const Topology base = topology_of(mesh);
    Features given = *build_features(mesh, base, {.boundary = boundary});
    const bool corners = boundary == BoundaryRule::EdgeAndCorner;
    given.boundary = corners ? boundary : BoundaryRule::EdgeOnly;
    const ResolvedFeatures features = resolve(base, given);

    // Theirs.
    const auto refiner = osd_refiner(base, features);
    Far::PatchTableFactory::Options options(1);
    options.SetPatchPrecision<double>();
    options.SetEndCapType(Far::PatchTableFactory::Options::ENDCAP_GREGORY_BASIS);
    options.useInfSharpPatch = true;
    options.generateLegacySharpCornerPatches = false;
    refiner->RefineAdaptive(options.GetRefineAdaptiveOptions());
    const std::unique_ptr<Far::PatchTable> table(
        Far::PatchTableFactory::Create(*refiner, options));
    const int n_refined = refiner->GetNumVerticesTotal();
    std::vector<OsdPoint> points(n_refined + table->GetNumLocalPoints());
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        points[v].p = mesh.positions[v];
    if (refiner->GetMaxLevel() > 0) {
        const Far::PrimvarRefinerReal<double> primvar(*refiner);
        OsdPoint* target = points.data() + refiner->GetLevel(0).GetNumVertices();
        primvar.Interpolate(1, points.data(), target);
    }
    if (const auto* local = table->GetLocalPointStencilTable<double>())
        local->UpdateValues(points.data(), points.data() + n_refined);

    // Ours.
    Refinement refinement(base, 3, features);
    refinement.add_level();
    const RefinedLevel& level = refinement.level(1);
    const Net refined = refinement.points(mesh.positions);

    // By Ptex face: the first halfedge of the quad, or that of the corner.
    std::vector<Index> halfedges;
    for (Index f = 0; f < base.n_faces(); ++f) {
        const Index first = base.face_offsets[f], n = base.face_size(f);
        for (Index i = 0; i < (n == 4 ? 1 : n); ++i)
            halfedges.push_back(first + i);
    }
    const double size = diagonal(mesh);
    Count count;
    for (int array = 0; array < table->GetNumPatchArrays(); ++array) {
        if (table->GetPatchArrayDescriptor(array).GetType() !=
            Far::PatchDescriptor::GREGORY_BASIS)
            continue;
        for (int i = 0; i < table->GetNumPatches(array); ++i) {
            const auto param = table->GetPatchParam(array, i);
            if (param.GetDepth() == 0 && !param.NonQuadRoot())
                continue;  // a quad of level 0
            Index h = halfedges[param.GetFaceId()];
            int turn = 0;
            if (!param.NonQuadRoot()) {
                turn = param.GetV() == 0 ? param.GetU() : 3 - param.GetU();
                h += static_cast<Index>(turn);
            }
            const auto theirs = table->GetPatchVertices(array, i);
            const Index face = refinement.level(1).children[h];
            const auto& t = level.topology;
            // OpenSubdiv pins patches to smooth corners of one face, and has no sharp edge
            // where a crease ends.
            bool smooth_corner = false, dart = false;
            for (Index g = t.face_offsets[face]; g < t.face_offsets[face + 1]; ++g) {
                const auto is_sharp = [&](Index e) {
                    return level.features.edge(t.edge[e]) >= kInfinitelySharp;
                };
                smooth_corner |= is_sharp(g) && is_sharp(t.prev(g)) &&
                                 level.features.vertex(t.vertex[g]) == 0;
                int n_sharp = 0;
                t.for_each_edge(t.vertex[g], [&](Index e, Index) {
                    n_sharp += level.features.edge(e) >= kInfinitelySharp;
                });
                dart |= n_sharp == 1;
            }
            if (smooth_corner || dart) {
                ++(dart ? count.n_darts : count.n_smooth_corners);
                continue;
            }
            ++count.n_patches;
            for (const auto tangents : {osd_tangents, tuned_tangents}) {
                const StencilTable rows =
                    gregory_points(t, level.features, face, {.tangents = tangents});
                Net ours(rows.n_rows());
                rows.apply<Vec3<double>>(refined, ours);
                double& error =
                    tangents == osd_tangents ? count.error : count.error_of_ours;
                for (int k = 0; k < 20; ++k) {
                    const auto& p = points[theirs[(k + 5 * turn) % 20]].p;
                    error = std::max(error, glm::length(ours[k] - p) / size);
                }
            }
        }
    }
    return count;
}

MeshData creased(MeshData mesh, unsigned every) {
    const Topology t = topology_of(mesh);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (t.is_border(h) || h > t.twin[h] || t.edge[h] % every != 0)
            continue;
        Tag tag;
        tag.name = "crease";
        tag.ints = {int(t.vertex[h]), int(t.to_vertex(h))};
        tag.floats = {10};
        mesh.tags.push_back(tag);
    }
    return mesh;
}

TEST(OpenSubdivGregory, HasTheSameControlPointsWithItsTangents) {
    int n_patches = 0, n_other = 0, n_darts = 0;
    double error_of_ours = 0;
    const auto check = [&](const NamedMesh& mesh, BoundaryRule rule) {
        const Count count = compare(mesh.data, rule);
        EXPECT_LE(count.error, 1e-14) << mesh.name;
        n_patches += count.n_patches;
        n_other += count.n_smooth_corners;
        n_darts += count.n_darts;
        error_of_ours = std::max(error_of_ours, count.error_of_ours);
    };
    for (const NamedMesh& mesh : closed_meshes()) {
        check(mesh, BoundaryRule::EdgeOnly);
        for (const unsigned every : {3u, 7u, 11u})
            check({mesh.name + " with creases", creased(mesh.data, every)},
                  BoundaryRule::EdgeOnly);
    }
    for (Index n = 3; n <= 12; ++n)
        check({"pole", random_displaced(pole(n, 2), n, 0.05)}, BoundaryRule::EdgeOnly);
    for (const BoundaryRule rule :
         {BoundaryRule::EdgeOnly, BoundaryRule::EdgeAndCorner}) {
        for (const NamedMesh& mesh : open_meshes()) {
            check(mesh, rule);
            check({mesh.name + " with creases", creased(mesh.data, 5)}, rule);
        }
    }
    EXPECT_GT(n_patches, test::fewest(2000));
    EXPECT_GT(error_of_ours, 1e-3);  // so that the comparison can fail
    std::printf("%d patches; left out: %d with smooth corners, %d with ends of creases\n",
                n_patches, n_other, n_darts);
}

// All meshes of the folder OSDX_MESHES, bare of their tags where they are semi-sharp.
TEST(OpenSubdivGregory, HasTheSameControlPointsInAFolder) {
    const char* folder = std::getenv("OSDX_MESHES");
    if (!folder)
        GTEST_SKIP() << "OSDX_MESHES names no folder";
    int n_meshes = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".obj" && extension != ".off" && extension != ".ply")
            continue;
        auto mesh = read_mesh(entry.path());
        if (!mesh)
            continue;
        const auto built = build_topology(*mesh);
        if (!built)
            continue;
        const Topology t = *built;
        const auto features = build_features(*mesh, t);
        const bool plain =
            features && check_gregory(*mesh, t, *features) && features->hole.empty();
        if (!plain)
            mesh->tags.clear();
        for (const BoundaryRule rule :
             {BoundaryRule::EdgeOnly, BoundaryRule::EdgeAndCorner}) {
            const Count count = compare(*mesh, rule);
            EXPECT_LE(count.error, 1e-12) << entry.path();
            std::printf(
                "%-30s %s %6d patches, %4d + %d left out, error %.1e, ours %.1e\n",
                entry.path().filename().c_str(), plain ? "    " : "bare", count.n_patches,
                count.n_smooth_corners, count.n_darts, count.error, count.error_of_ours);
            n_meshes += count.n_patches > 0;
        }
    }
    EXPECT_GT(n_meshes, 0);
}

}  // namespace
}  // namespace osdx
