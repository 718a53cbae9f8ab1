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

namespace {

Status check_channel_size(const NamedChannels& channel, Index n_vertices) {
    const bool is_color = channel.name == kColorName;
    if (channel.n < 1 || (is_color && channel.n != 3 && channel.n != 4)) {
        return fail(
            ErrorCode::SizeMismatch,
            fmt::format("the channel {} has {} numbers for each vertex{}", channel.name,
                        channel.n, is_color ? ", but colours have 3 or 4" : ""));
    }
    const auto n = static_cast<std::size_t>(channel.n);
    if (channel.values.size() != n * n_vertices) {
        return fail(
            ErrorCode::SizeMismatch,
            fmt::format("the channel {} has {} values, but {} vertices need {} each",
                        channel.name, channel.values.size(), n_vertices, n));
    }
    return ok();
}

Status check_finite(const NamedChannels& channel, const MeshView& mesh) {
    const auto n = static_cast<std::size_t>(channel.n);
    const Index v = detail::first_index(mesh.n_vertices, [&](Index i) {
        for (std::size_t k = n * i; k < n * (i + 1); ++k) {
            if (!std::isfinite(channel.values[k]))
                return true;
        }
        return false;
    });
    if (v == kInvalidIndex)
        return ok();
    const double* value = channel.view()[v];
    while (std::isfinite(*value))
        ++value;
    return fail(ErrorCode::NonFinitePoint,
                fmt::format("vertex {} has the value {} in the channel {}", v, *value,
                            channel.name),
                v, mesh.line_of_vertex(v));
}

Status check_names(const FaceNames& names, const char* what, const MeshView& mesh) {
    if (names.faces.empty())
        return ok();
    if (names.faces.size() != mesh.face_sizes.size()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("there are {} of {} faces, but {} faces are there", what,
                                names.faces.size(), mesh.face_sizes.size()));
    }
    const Index f = detail::first_index(names.faces.size(), [&](Index i) {
        return names.faces[i] != kInvalidIndex && names.faces[i] >= names.names.size();
    });
    if (f == kInvalidIndex)
        return ok();
    return fail(ErrorCode::IndexOutOfRange,
                fmt::format("face {} has number {} of the {}, but there are {}", f,
                            names.faces[f], what, names.names.size()),
                f, mesh.line_of_face(f));
}

}  // namespace

Status check_channels(std::span<const NamedChannels> channels, const MeshView& mesh) {
    if (Status status = detail::check_channel_sizes(channels, mesh.n_vertices); !status)
        return status;
    for (const NamedChannels& channel : channels) {
        if (Status status = check_finite(channel, mesh); !status)
            return status;
    }
    return ok();
}

Status detail::check_channel_sizes(std::span<const NamedChannels> channels,
                                   Index n_vertices) {
    for (const NamedChannels& channel : channels) {
        if (Status status = check_channel_size(channel, n_vertices); !status)
            return status;
    }
    return ok();
}

Status check_face_names(const MeshData& mesh) {
    if (Status status = check_names(mesh.groups, "groups", mesh.view()); !status)
        return status;
    if (Status status = check_names(mesh.objects, "objects", mesh.view()); !status)
        return status;
    return check_names(mesh.materials, "materials", mesh.view());
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
