// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <osdx/mesh_data.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {

Status check_uvs(const MeshData& mesh) {
    if (mesh.face_uvs.empty())
        return ok();
    if (mesh.face_uvs.size() != mesh.face_vertices.size()) {
        return fail(
            ErrorCode::SizeMismatch,
            fmt::format("there are texture coordinates for {} face corners, but {} are "
                        "there",
                        mesh.face_uvs.size(), mesh.face_vertices.size()));
    }
    const auto is_sound = [&](Index uv) {
        return uv < mesh.uvs.size() && std::isfinite(mesh.uvs[uv].x) &&
               std::isfinite(mesh.uvs[uv].y);
    };
    Index corner = detail::first_index(
        mesh.face_uvs.size(), [&](Index c) { return !is_sound(mesh.face_uvs[c]); });
    if (corner == kInvalidIndex)
        return ok();
    const Index i = mesh.face_uvs[corner];
    Index face = 0;
    while (corner >= mesh.face_sizes[face])
        corner -= mesh.face_sizes[face++];
    const Index line = mesh.view().line_of_face(face);
    if (i >= mesh.uvs.size()) {
        return fail(
            ErrorCode::IndexOutOfRange,
            fmt::format("face {} names texture coordinate {}, but the mesh has {}", face,
                        i, mesh.uvs.size()),
            face, line);
    }
    return fail(ErrorCode::NonFinitePoint,
                fmt::format("face {} names texture coordinate {}, which is ({}, {})",
                            face, i, mesh.uvs[i].x, mesh.uvs[i].y),
                face, line);
}

double bounding_diagonal(std::span<const Vec3<double>> points) {
    if (points.empty())
        return 0;
    Vec3<double> lo = points[0], hi = points[0];
    for (const auto& p : points) {
        lo = glm::min(lo, p);
        hi = glm::max(hi, p);
    }
    return glm::length(hi - lo);
}

}  // namespace osdx::inline OSDX_ABI
