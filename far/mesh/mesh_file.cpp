// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cstdint>

#include <fmt/format.h>

#include <osdx/file.h>
#include <osdx/mesh_file.h>

#include "far/mesh/formats/encoding.h"
#include "far/mesh/formats/formats.h"
#include "far/mesh/formats/output.h"
#include "far/mesh/formats/scan.h"

namespace osdx::inline OSDX_ABI {
namespace detail {

Status check_shapes(const MeshData& mesh) {
    std::uint64_t n = 0;
    for (const Index size : mesh.face_sizes)
        n += size;
    if (n != mesh.face_vertices.size()) {
        return fail(
            ErrorCode::SizeMismatch,
            fmt::format("the face sizes add up to {}, but there are {} face vertices", n,
                        mesh.face_vertices.size()));
    }
    if (!mesh.face_uvs.empty() && mesh.face_uvs.size() != n) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("there are {} face vertices, but {} of them with texture "
                                "coordinates",
                                n, mesh.face_uvs.size()));
    }
    if (Status status = check_channel_sizes(mesh.channels, next_vertex(mesh)); !status)
        return status;
    return check_face_names(mesh);
}

}  // namespace detail

namespace {

constexpr std::array<detail::WriteFormat<MeshData>, 3> kFormats{{
    {".obj", detail::check_obj, detail::write_obj},
    {".off", detail::check_shapes, detail::write_off},
    {".ply", detail::check_ply, detail::write_ply},
}};

}  // namespace

Result<MeshData> parse_mesh(std::string_view text, std::string_view extension) {
    const std::string lower = detail::lower_case(extension);
    const auto read = lower == ".obj"   ? detail::read_obj
                      : lower == ".off" ? detail::read_off
                      : lower == ".ply" ? detail::read_ply
                                        : nullptr;
    if (!read) {
        return fail(ErrorCode::FileFormat,
                    fmt::format("the extension '{}' is none of .obj, .off and .ply",
                                detail::printable(extension)));
    }
    // The byte order marks of UTF-8 and UTF-16.
    std::string converted;
    if (text.starts_with("\xEF\xBB\xBF")) {
        text.remove_prefix(3);
    } else if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
        converted = detail::from_utf16(text.substr(2), text.front() == '\xFE');
        text = converted;
    }
    if (std::ranges::all_of(text, detail::is_space))
        return fail(ErrorCode::EmptyMesh, "the file is empty");
    if (text.substr(0, 2).find('\0') != text.npos) {
        return fail(
            ErrorCode::FileFormat,
            "the file starts with a byte 0, as UTF-16 without a mark or what is no "
            "text does: save it as UTF-8");
    }
    return read(text);
}

Result<MeshData> read_mesh(const std::filesystem::path& path) {
    const Result<std::string> text = read_file(path);
    if (!text)
        return text.error();
    return parse_mesh(*text, path.extension().string());
}

Result<std::string> format_mesh(const MeshData& mesh, std::string_view extension) {
    return detail::format_as<MeshData>(extension, mesh, kFormats);
}

Status write_mesh(const std::filesystem::path& path, const MeshData& mesh) {
    return detail::write_as<MeshData>(path, mesh, kFormats);
}

}  // namespace osdx::inline OSDX_ABI
