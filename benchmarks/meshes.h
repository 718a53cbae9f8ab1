// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string>
#include <vector>

#include <osdx/features.h>
#include <osdx/mesh_data.h>

namespace osdx::bench {

/// A mesh of quads without tags or texture coordinates.
struct BenchMesh {
    std::string name;
    MeshData data;

    Index n_faces() const { return static_cast<Index>(data.face_sizes.size()); }
    Index n_vertices() const { return static_cast<Index>(data.positions.size()); }
};

/// How all meshes are read: without tags.
inline constexpr FeatureOptions kNoTags = {.ignore_tags = true,
                                           .boundary = BoundaryRule::EdgeOnly};

/// Sizes, in faces, from which meshes are measured; the mesh itself comes before them.
inline constexpr Index kSizes[] = {25'000, 400'000, 1'600'000};

/// Uniform Catmull-Clark; the border is a cubic B-spline.
MeshData refined(const MeshData& mesh, int levels);

/// The mesh itself, after one step if not all faces are quads, and refined until it has the
/// faces of each of kSizes up to `largest`.
/// \throw std::runtime_error with the reason why the mesh is refused
std::vector<BenchMesh> mesh_sizes(const std::string& name, const MeshData& mesh,
                                  Index largest);

/// The one that stage "size" compares the last with; null where there is none but that.
const BenchMesh* base_of_size(std::span<const BenchMesh> meshes);

/// A slab with n x n square holes, slightly waved: 24 n^2 + 12 n faces or so, vertices of
/// valence 4, 5 at the holes and 3 at the corners.
MeshData perforated_slab(Index n);

/// Of the bounding box.
double diagonal(const MeshData& mesh);

/// The largest distance from a point of one set to the nearest of the other, if it is below
/// `reach`; otherwise infinity, as for sets of different size.
double set_distance(std::span<const Vec3<double>> a, std::span<const Vec3<double>> b,
                    double reach);

}  // namespace osdx::bench
