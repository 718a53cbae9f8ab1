// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include <osdx/creases.h>
#include <osdx/features.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {
namespace {

/// Of each face, of length one, or 0.
std::vector<Vec3<double>> face_normals(const MeshData& mesh, const Topology& t) {
    std::vector<Vec3<double>> normals(t.n_faces(), Vec3<double>(0));
    for (Index f = 0; f < t.n_faces(); ++f) {
        const auto from_first = [&](Index h) {
            return mesh.positions[t.vertex[h]] -
                   mesh.positions[t.vertex[t.face_offsets[f]]];
        };
        for (Index h = t.face_offsets[f] + 1; h + 1 < t.face_offsets[f + 1]; ++h)
            normals[f] += glm::cross(from_first(h), from_first(h + 1));
        if (const double length = glm::length(normals[f]); length > 0)
            normals[f] /= length;
    }
    return normals;
}

}  // namespace

std::vector<Tag> crease_tags(const MeshData& mesh, const Topology& t, double degrees) {
    const std::vector<Vec3<double>> normals = face_normals(mesh, t);
    const double most = degrees * std::numbers::pi / 180;
    std::vector<Tag> tags;
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (t.is_border(h) || t.twin[h] < h)
            continue;
        const Vec3<double>&a = normals[t.face(h)], &b = normals[t.face(t.twin[h])];
        // Exact near 0 and 180 degrees, where the cosine alone is not.
        const double angle = std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
        if (!(angle > most))
            continue;
        Tag& tag = tags.emplace_back();
        tag.name = "crease";
        tag.ints = {static_cast<int>(t.vertex[h]), static_cast<int>(t.to_vertex(h))};
        tag.floats = {kInfinitelySharp};
    }
    return tags;
}

}  // namespace osdx::inline OSDX_ABI
