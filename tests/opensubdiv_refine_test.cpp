// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Degree 3 against the uniform refinement of OpenSubdiv, which shares no code with ours.

#include <gtest/gtest.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefiner.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "far/refine.h"
#include "tests/test_meshes.h"

namespace osdx {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

constexpr int kLevels = 3;

template <class T>
struct OsdPoint {
    Vec3<T> p{T(0)};
    void Clear() { p = Vec3<T>(T(0)); }
    void AddWithWeight(const OsdPoint& other, T weight) { p += weight * other.p; }
};

std::unique_ptr<Far::TopologyRefiner> osd_refiner(const MeshData& mesh) {
    const std::vector<int> sizes(mesh.face_sizes.begin(), mesh.face_sizes.end());
    const std::vector<int> vertices(mesh.face_vertices.begin(), mesh.face_vertices.end());
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(mesh.positions.size());
    descriptor.numFaces = static_cast<int>(sizes.size());
    descriptor.numVertsPerFace = sizes.data();
    descriptor.vertIndicesPerFace = vertices.data();
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    std::unique_ptr<Far::TopologyRefiner> refiner(
        Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_CATMARK)));
    Far::TopologyRefiner::UniformOptions options(kLevels);
    options.fullTopologyInLastLevel = true;
    refiner->RefineUniform(options);
    return refiner;
}

/// Points of levels 0, 1, ...
template <class T>
std::vector<std::vector<OsdPoint<T>>> osd_points(const Far::TopologyRefiner& refiner,
                                                 const std::vector<Vec3<T>>& base) {
    std::vector<std::vector<OsdPoint<T>>> points(1);
    for (const Vec3<T>& p : base)
        points[0].push_back({p});
    const Far::PrimvarRefinerReal<T> interpolator(refiner);
    for (int l = 1; l <= kLevels; ++l) {
        points.emplace_back(refiner.GetLevel(l).GetNumVertices());
        interpolator.Interpolate(l, points[l - 1], points[l]);
    }
    return points;
}

/// Our vertices and faces of a level in OpenSubdiv's numbering.
struct Correspondence {
    std::vector<int> vertex, face;
};

void descend(const Topology& ours, const Far::TopologyLevel& theirs,
             Correspondence& map) {
    Correspondence child;
    for (Index v = 0; v < ours.n_vertices(); ++v)
        child.vertex.push_back(theirs.GetVertexChildVertex(map.vertex[v]));
    std::vector<int> of_edge(ours.n_edges, -1);
    for (Index h = 0; h < ours.n_halfedges(); ++h) {
        const int e =
            theirs.FindEdge(map.vertex[ours.vertex[h]], map.vertex[ours.to_vertex(h)]);
        ASSERT_GE(e, 0);
        of_edge[ours.edge[h]] = theirs.GetEdgeChildVertex(e);
    }
    child.vertex.insert(child.vertex.end(), of_edge.begin(), of_edge.end());
    for (Index f = 0; f < ours.n_faces(); ++f)
        child.vertex.push_back(theirs.GetFaceChildVertex(map.face[f]));
    for (Index h = 0; h < ours.n_halfedges(); ++h) {
        const int f = map.face[ours.face[h]];
        const auto corners = theirs.GetFaceVertices(f);
        const int corner = corners.FindIndex(map.vertex[ours.vertex[h]]);
        ASSERT_GE(corner, 0);
        child.face.push_back(theirs.GetFaceChildFaces(f)[corner]);
    }
    map = std::move(child);
}

/// The points of each level, ours against theirs. Raises `worst` to the largest distance over
/// the diagonal.
template <class T>
void expect_equal_levels(const MeshData& mesh, double* worst = nullptr) {
    const auto refiner = osd_refiner(mesh);
    std::vector<Vec3<T>> points(mesh.positions.begin(), mesh.positions.end());
    const auto theirs = osd_points<T>(*refiner, points);

    Refinement refinement(test::topology_of(mesh), 3);
    Correspondence map;
    for (Index v = 0; v < refinement.topology(0).n_vertices(); ++v)
        map.vertex.push_back(static_cast<int>(v));
    for (Index f = 0; f < refinement.topology(0).n_faces(); ++f)
        map.face.push_back(static_cast<int>(f));

    std::size_t longest_row = 0;
    for (int l = 1; l <= kLevels; ++l) {
        refinement.add_level();
        for (const StencilTable& factor : refinement.level(l).factors) {
            std::vector<Vec3<T>> next(factor.n_rows());
            factor.apply(std::span<const Vec3<T>>(points), std::span(next));
            points = std::move(next);
            for (Index r = 0; r < factor.n_rows(); ++r)
                longest_row =
                    std::max(longest_row, factor.offsets[r + 1] - factor.offsets[r]);
        }
        descend(refinement.topology(l - 1), refiner->GetLevel(l - 1), map);
        if (testing::Test::HasFatalFailure())
            return;
        ASSERT_EQ(points.size(), theirs[l].size());
        // Both sides sum rows in another order. A sum of m terms errs by m/2 ulps at worst
        // and sqrt(m)/2 as a rule; each level adds its own.
        const T tolerance = T(l * (2 + std::sqrt(double(longest_row)))) *
                            std::numeric_limits<T>::epsilon() * T(test::diagonal(mesh));
        for (Index v = 0; v < points.size(); ++v) {
            const T distance = glm::distance(points[v], theirs[l][map.vertex[v]].p);
            ASSERT_LE(distance, tolerance) << "level " << l << ", vertex " << v;
            if (worst)
                *worst = std::max(*worst, distance / test::diagonal(mesh));
        }
    }
}

std::vector<test::NamedMesh> meshes() {
    auto result = test::closed_meshes();
    for (const Index n : {3u, 5u, 8u, 64u, 360u})
        result.push_back({"pole " + std::to_string(n), test::pole(n, 1, 2)});
    result.push_back({"prism 64", test::prism(64)});
    return result;
}

bool has_quads_only(const MeshData& mesh) {
    return std::ranges::all_of(mesh.face_sizes, [](Index n) { return n == 4; });
}

TEST(OpenSubdivRefine, QuadMeshesInDouble) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (has_quads_only(mesh))
            expect_equal_levels<double>(mesh);
    }
}

TEST(OpenSubdivRefine, QuadMeshesInFloat) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (has_quads_only(mesh))
            expect_equal_levels<float>(mesh);
    }
}

TEST(OpenSubdivRefine, OtherPolygonsInDouble) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (!has_quads_only(mesh))
            expect_equal_levels<double>(mesh);
    }
}

TEST(OpenSubdivRefine, OtherPolygonsInFloat) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (!has_quads_only(mesh))
            expect_equal_levels<float>(mesh);
    }
}

// All meshes of the folder OSDX_MESHES that are closed, with their tags ignored on both
// sides; what build_mesh refuses is counted.
TEST(OpenSubdivRefine, MeshesOfAFolder) {
    const char* folder = std::getenv("OSDX_MESHES");
    if (!folder)
        GTEST_SKIP() << "OSDX_MESHES names no folder";
    int n_compared = 0, n_refused = 0;
    double worst_double = 0, worst_float = 0;
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
        if (file.path().extension() != ".obj" && file.path().extension() != ".off")
            continue;
        SCOPED_TRACE(file.path().string());
        auto mesh = read_mesh(file.path());
        if (mesh)
            mesh->tags.clear();
        if (!mesh || !build_mesh(*mesh)) {
            ++n_refused;
            continue;
        }
        expect_equal_levels<double>(*mesh, &worst_double);
        expect_equal_levels<float>(*mesh, &worst_float);
        ++n_compared;
    }
    EXPECT_GT(n_compared, 0);
    std::printf(
        "%d meshes at %d levels, largest difference over the diagonal: %.2g in "
        "double, %.2g in float; %d refused\n",
        n_compared, kLevels, worst_double, worst_float, n_refused);
}

}  // namespace
}  // namespace osdx
