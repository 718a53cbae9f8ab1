// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/topology.h>

#include "tests/support/spline_reference.h"

/// Meshes built in code, the closed ones about the size of the unit sphere.
namespace osdx::test {

MeshData tetrahedron();
MeshData cube();  ///< vertices of valence 3, quads
MeshData octahedron();
MeshData icosahedron();
MeshData dodecahedron();           ///< 12 pentagons, valence 3
MeshData truncated_icosahedron();  ///< 12 pentagons, 20 hexagons, valence 3

/// m x n quads, every vertex of valence 4. Vertex (i, j) is i n + j; face (i, j) is i n + j
/// with the corners (i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1).
/// \pre m, n >= 3
MeshData torus(Index m, Index n);

/// Faces 0 and 1 are n-gons, then n quads; valence 3.
MeshData prism(Index n);

/// Triangles; vertices 0 and 1 are the poles of valence n, the others have valence 4.
MeshData bipyramid(Index n);

/// Quads; vertices 0 and 1 are poles of valence n. About each pole lies a cap of n sectors
/// of k x k quads, and `rings` rings of quads join the caps. The 2n outer corners of the
/// sectors, k steps both ways from their pole, have valence 3; they are 2k edges apart
/// along a cap and `rings` edges across. All other vertices have valence 4.
/// \pre n >= 3; k, rings >= 1
MeshData pole(Index n, Index k = 1, Index rings = 1);

/// The dual of pole(): faces 0 and 1 are n-gons, 2n faces are triangles with k - 1 rows of
/// quads between them and the n-gon; every vertex has valence 4.
MeshData face_pole(Index n, Index k = 1, Index rings = 1);

/// The boundary of a slab of voxels with two holes: genus 2, quads, valences 3 to 5.
MeshData double_torus();

/// Vertex f at the centroid of face f; face v around vertex v.
MeshData dual_mesh(const MeshData& mesh);

/// Each coordinate moves by at most `amount`: same seed, same mesh, on every platform.
MeshData random_displaced(MeshData mesh, unsigned seed, double amount);

struct NamedMesh {
    std::string name;
    MeshData data;
};

/// A small mesh of each kind above, with generic positions.
std::vector<NamedMesh> closed_meshes();

/// m x n quads in a plane. Vertex (i, j) is i (n + 1) + j, face (i, j) is i n + j.
MeshData grid(Index m, Index n);

/// k quads around vertex 0 of the border.
MeshData border_fan(Index k);

/// The mesh without some of its faces; vertices stay.
MeshData without_faces(const MeshData& mesh, const std::vector<Index>& faces);

/// Open meshes, slightly displaced: quads and other polygons, border vertices of 1 to 6
/// faces, several borders, components and loose vertices.
std::vector<NamedMesh> open_meshes();

/// Tags the edges along a path of vertices.
void add_crease(MeshData& mesh, const std::vector<Index>& path, double sharpness = 10);
void add_corner(MeshData& mesh, Index vertex, double sharpness = 10);

/// Meshes with tags, slightly displaced, whose sharp features are all infinitely sharp:
/// creases through regular and extraordinary vertices and n-gons, darts, junctions, corners,
/// spikes, holes beside creases, every rule for the border.
std::vector<NamedMesh> creased_meshes();

/// The same kinds of features with sharpness from 0.5 to 2.5.
std::vector<NamedMesh> semi_sharp_meshes();

/// Of a mesh that build_mesh accepts; throws otherwise.
Topology topology_of(const MeshData& mesh);

/// Of the mesh and its tags; throws where they do not fit.
Features features_of(const MeshData& mesh);

/// A border or an infinitely sharp crease from one side, from corner to corner or all around.
struct SharpCurve {
    Polygon polygon;
    std::vector<Index>
        halfedges;  ///< of the edges of the polygon, with the face on the left
    /// A smooth vertex is at this end: what is nearer to it than half the support of a
    /// B-spline is another curve.
    bool dart_at_start = false, dart_at_end = false;
};

/// All curves of a mesh with its tags; creases come twice.
std::vector<SharpCurve> sharp_curves(const MeshData& mesh);

/// Of the bounding box.
double diagonal(const MeshData& mesh);

}  // namespace osdx::test
