// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <osdx/mesh_data.h>
#include <osdx/result.h>

namespace osdx::inline OSDX_ABI {

/// Reads OBJ (v, vt, f with n-gons and negative indices, t; other lines are skipped), OFF, or
/// PLY (text and binary, both byte orders). Texture coordinates come from OBJ alone; there all
/// corners of all faces have them, or none has.
///
/// Nothing is repaired, dropped or renumbered. Numbers may be nan or inf: the check of the
/// mesh refuses them by vertex. An index that no unsigned number holds (0 in OBJ, negative
/// beyond the first vertex) is refused here, since MeshData could not carry it.
/// \param extension  with its dot: ".obj", ".off" or ".ply"
/// \return FileFormat, EmptyMesh, IndexOutOfRange or FaceTooSmall, or what check_uvs returns;
///         with the line.
OSDX_API Result<MeshData> parse_mesh(std::string_view text, std::string_view extension);

/// Reads a file by the extension of `path`.
/// \return FileUnreadable, or what parse_mesh() returns
OSDX_API Result<MeshData> read_mesh(const std::filesystem::path& path);

/// A polygon mesh as OBJ, OFF or PLY, all in text, with the shortest digits that read back
/// exactly. Tags and texture coordinates go into OBJ only. Indices are not checked.
/// \param extension  with its dot
/// \return InvalidOption for another extension; SizeMismatch if face_sizes, face_vertices and
///         face_uvs disagree; WriteFailed for a tag that is not of words.
OSDX_API Result<std::string> format_mesh(const MeshData& mesh,
                                         std::string_view extension);

/// Writes that to a file by the extension of `path`. Nothing half-written is left.
/// \return what format_mesh() and write_file() return
OSDX_API Status write_mesh(const std::filesystem::path& path, const MeshData& mesh);

}  // namespace osdx::inline OSDX_ABI
