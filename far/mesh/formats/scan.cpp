// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/mesh/formats/scan.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace osdx::inline OSDX_ABI::detail {

std::string printable(std::string_view word) {
    std::string text(word.substr(0, 40));
    std::ranges::replace_if(
        text, [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

Error unexpected(std::string_view where, std::string_view word, std::string_view expected,
                 Index element, Index line) {
    return fail(
        ErrorCode::FileFormat,
        fmt::format("{} has '{}' where {} is expected", where, printable(word), expected),
        element, line);
}

void add_vertex(MeshData& mesh, const Vec3<double>& position, Index line) {
    mesh.positions.push_back(position);
    if (line > 0)
        mesh.vertex_lines.push_back(line);
}

Status read_vertex(Words words, Index line, MeshData& mesh) {
    const Index v = next_vertex(mesh);
    if (words.size() < 3) {
        return fail(
            ErrorCode::FileFormat,
            fmt::format("vertex {} has {} coordinates instead of 3", v, words.size()), v,
            line);
    }
    Vec3<double> position;
    for (int i = 0; i < 3; ++i) {
        const auto x = parse<double>(words[i]);
        if (!x)
            return unexpected(fmt::format("vertex {}", v), words[i], "a number", v, line);
        position[i] = *x;
    }
    add_vertex(mesh, position, line);
    return ok();
}

Status read_color(Words numbers, Index line, MeshData& mesh) {
    const Index v = next_vertex(mesh) - 1;
    const auto n = static_cast<int>(numbers.size());
    if (v == 0 && n > 0)
        mesh.channels.push_back({std::string(kColorName), n, {}});
    const int expected = mesh.channels.empty() ? 0 : mesh.channels[0].n;
    if (n != expected) {
        return fail(
            ErrorCode::FileFormat,
            n == 0 || expected == 0
                ? fmt::format("vertex {} has {} colour, unlike those before it", v,
                              n == 0 ? "no" : "a")
                : fmt::format(
                      "vertex {} has a colour of {} numbers, those before it of {}", v, n,
                      expected),
            v, line);
    }
    for (const std::string_view word : numbers) {
        const auto x = parse<double>(word);
        if (!x) {
            return unexpected(fmt::format("the colour of vertex {}", v), word, "a number",
                              v, line);
        }
        mesh.channels[0].values.push_back(*x);
    }
    return ok();
}

namespace {

Error bad_index(const MeshData& mesh, std::int64_t index, std::string_view why,
                Index line) {
    const Index f = next_face(mesh);
    return fail(ErrorCode::IndexOutOfRange,
                fmt::format("face {} names vertex {}, {}", f, index, why), f, line);
}

}  // namespace

Status add_corner(MeshData& mesh, std::int64_t index, Index line) {
    if (index < 0)
        return bad_index(mesh, index, "but the format counts vertices from 0", line);
    if (index >= kInvalidIndex)
        return bad_index(mesh, index, "which is beyond 32 bits", line);
    mesh.face_vertices.push_back(static_cast<Index>(index));
    return ok();
}

void end_face(MeshData& mesh, std::size_t first, Index line) {
    mesh.face_sizes.push_back(static_cast<Index>(mesh.face_vertices.size() - first));
    if (line > 0)
        mesh.face_lines.push_back(line);
}

namespace {

constexpr Index kNoUv = kInvalidIndex;

/// Corners of a kind, in a mesh whose texture coordinates are being settled.
struct UnsoundCorners {
    std::size_t n = 0;
    Index face = 0, uv = 0;  ///< of the first
};

std::string what_is_wrong(const MeshData& mesh, Index uv) {
    if (uv == kNoUv)
        return "has no texture coordinates";
    if (uv == kNoUv - 1)
        return "names texture coordinates by a number that none can have";
    if (uv >= mesh.uvs.size()) {
        return fmt::format("names texture coordinate {}, but the file has {}", uv,
                           mesh.uvs.size());
    }
    return fmt::format("names texture coordinate {}, which is ({}, {})", uv,
                       mesh.uvs[uv].x, mesh.uvs[uv].y);
}

}  // namespace

void add_uv(MeshData& mesh, std::size_t corner, Index uv) {
    mesh.face_uvs.resize(corner, kNoUv);
    mesh.face_uvs.push_back(std::min(uv, kNoUv - 1));
}

void set_vertex_uvs(MeshData& mesh) {
    mesh.face_uvs = mesh.face_vertices;
}

void settle_uvs(MeshData& mesh) {
    if (mesh.face_uvs.empty())
        return;
    mesh.face_uvs.resize(mesh.face_vertices.size(), kNoUv);
    const auto is_sound = [&](Index uv) {
        return uv < mesh.uvs.size() && std::isfinite(mesh.uvs[uv].x) &&
               std::isfinite(mesh.uvs[uv].y);
    };
    UnsoundCorners missing, invalid;
    std::size_t corner = 0;
    for (Index f = 0; f < next_face(mesh); ++f) {
        for (Index k = 0; k < mesh.face_sizes[f]; ++k, ++corner) {
            const Index uv = mesh.face_uvs[corner];
            if (is_sound(uv))
                continue;
            UnsoundCorners& corners = uv == kNoUv ? missing : invalid;
            if (corners.n++ == 0) {
                corners.face = f;
                corners.uv = uv;
            }
        }
    }
    if (missing.n + invalid.n == 0)
        return;
    const bool all = missing.n + invalid.n == mesh.face_uvs.size();
    const auto warn = [&](WarningCode code, const UnsoundCorners& corners) {
        if (corners.n == 0)
            return;
        mesh.warnings.push_back(
            {code,
             fmt::format("face {} {}; {} of {} face corners are so and {}", corners.face,
                         what_is_wrong(mesh, corners.uv), corners.n, mesh.face_uvs.size(),
                         all ? "none has any now" : "are at (0, 0) now"),
             mesh.view().line_of_face(corners.face)});
    };
    warn(WarningCode::MissingTexcoords, missing);
    warn(WarningCode::InvalidTexcoords, invalid);
    if (all) {
        mesh.face_uvs.clear();
        return;
    }
    const auto origin = static_cast<Index>(mesh.uvs.size());
    for (Index& uv : mesh.face_uvs) {
        if (!is_sound(uv))
            uv = origin;
    }
    mesh.uvs.emplace_back(0.0, 0.0);
}

Error ends_early(std::string_view item, std::int64_t i, std::int64_t n, Index line) {
    return fail(ErrorCode::FileFormat,
                fmt::format("the file ends before {} {} of {}", item, i, n),
                static_cast<Index>(i), line);
}

Result<MeshData> finish(MeshData mesh) {
    if (mesh.positions.empty())
        return fail(ErrorCode::EmptyMesh, "the file has no vertices");
    if (mesh.face_sizes.empty())
        return fail(ErrorCode::EmptyMesh, "the file has no faces");
    return mesh;
}

}  // namespace osdx::inline OSDX_ABI::detail
