// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <span>
#include <vector>

#include <osdx/mesh_data.h>

#include "benchmarks/meshes.h"
#include "benchmarks/samples.h"
#include "benchmarks/suite.h"

/// What other libraries do at each stage. All of it returns nothing where the library was not
/// there at the build. Ways refer to the mesh and the places that they were made for.
namespace osdx::bench {

/// Isolation of OpenSubdiv's patches: what its documentation takes for final quality on smooth
/// meshes.
inline constexpr int kIsolation = 3;

/// Osd's evaluator of patches, limit stencils (some 250 bytes a place) and Bfr.
std::vector<SampleWay> opensubdiv_grid(const BenchMesh& mesh,
                                       std::span<const Place> places, int threads);
/// Osd's evaluator on one Gregory patch over each face, the others unrefined.
std::vector<SampleWay> opensubdiv_gregory_grid(const BenchMesh& mesh,
                                               std::span<const Place> places);
/// Far's basis functions and a sum, patch by patch, where the patch is known.
/// \param isolation  kIsolation, or 0 for one patch over each face
std::vector<SampleWay> opensubdiv_points(const BenchMesh& mesh,
                                         std::span<const Place> places, int isolation);
std::vector<SampleWay> embree_grid(const BenchMesh& mesh, std::span<const Place> places);
std::vector<SampleWay> embree_points(const BenchMesh& mesh,
                                     std::span<const Place> places);

/// From arrays to where points can be evaluated.
std::vector<Way> opensubdiv_build(const BenchMesh& mesh);

/// From `positions` to all points of the patches, and those at places afterwards.
struct UpdateWay {
    Way way;
    std::function<std::vector<Vec3<float>>(std::span<const Place>)> points;
};
std::vector<UpdateWay> opensubdiv_update(const BenchMesh& mesh,
                                         std::span<const Vec3<float>> positions,
                                         int threads);

/// From arrays to topology and positions of the refined mesh.
struct RefineWay {
    Way way;
    std::function<std::vector<Vec3<double>>()> points;
    /// Borders are refined as cubic B-splines, as ours.
    bool same_border = true;
};
/// A mesh of a library whose add_vertex() takes three coordinates and whose add_face() takes
/// vertices.
template <class Mesh, class Vertex>
Mesh add_faces(const MeshData& data) {
    Mesh mesh;
    std::vector<Vertex> vertices, corners;
    for (const Vec3<double>& p : data.positions)
        vertices.push_back(mesh.add_vertex({p.x, p.y, p.z}));
    auto next = data.face_vertices.begin();
    for (const Index size : data.face_sizes) {
        corners.clear();
        for (Index i = 0; i < size; ++i)
            corners.push_back(vertices[*next++]);
        mesh.add_face(corners);
    }
    return mesh;
}

/// \param full  all of the topology on the last level, too, instead of the vertices of faces
std::vector<RefineWay> opensubdiv_refine(const BenchMesh& mesh, int levels, bool full);
std::vector<RefineWay> openmesh_refine(const BenchMesh& mesh, int levels);
std::vector<RefineWay> cgal_refine(const BenchMesh& mesh, int levels);

/// Positions, normals and quads at a rate, with the surface of each face made on the way.
struct TessellateWay {
    Way way;
    std::function<Index()> n_facets;
};
std::vector<TessellateWay> opensubdiv_tessellate(const BenchMesh& mesh, int rate);

}  // namespace osdx::bench
