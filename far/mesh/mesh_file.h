// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <osdx/mesh_data.h>
#include <osdx/result.h>

namespace osdx::inline OSDX_ABI {

/// Reads OBJ (v, vt, f with n-gons and negative indices, t, g, o, usemtl, mtllib; other lines are
/// skipped), OFF as text, or PLY (text and binary, both byte orders). Lines end with LF, CR LF or
/// CR; text is UTF-8, or UTF-16 with its mark. In OBJ a backslash at the end, perhaps before
/// blanks, joins the next line, but not to g, o, usemtl and mtllib, whose names may end in one.
///
/// Texture coordinates:
///   OBJ  vt, by the corners of faces
///   OFF  of vertices: STOFF and, in this order, STC, STN, STCN
///   PLY  texcoord, a list of faces; or of vertices s and t, u and v, texture_u and texture_v,
///        texture_s and texture_t. Corners of a vertex with the same ones share them.
/// Corners without, and those whose are not there or not finite, get (0, 0), a value of their
/// own; where all are so the mesh has none.
///
/// Channels of vertices; all vertices have them or none has:
///   OBJ  "color" of lines v x y z r g b and v x y z r g b a. The fourth of four numbers is a
///        weight and left out.
///   OFF  "color" of COFF and its kin, three or four numbers: of 255 where all are written as
///        integers and one is beyond 1.
///   PLY  "color" of red, green, blue and, if it is there, alpha: uchar and ushort over their
///        greatest value, other types as they are. Every other property that is a number is a
///        channel of its name; NAME_0, NAME_1, ... that stand together are one NAME.
/// Normals are left out: they are the surface's own.
///
/// Nothing is repaired, dropped or renumbered; repair() does that. What is taken although it
/// is not as it should be stands in `warnings`: texture coordinates as above, rows of PLY with
/// values that the header does not declare, OFF without its first line. Numbers may be nan or
/// inf and faces small: the check of the mesh refuses them. An index that no unsigned number holds
/// (0 in OBJ, negative beyond the first vertex) is refused here, since MeshData could not
/// carry it.
/// \param extension  with its dot: ".obj", ".off" or ".ply"
/// \return FileFormat, EmptyMesh or IndexOutOfRange; with the line.
OSDX_API Result<MeshData> parse_mesh(std::string_view text, std::string_view extension);

/// Reads a file by the extension of `path`.
/// \return FileUnreadable, or what parse_mesh() returns
OSDX_API Result<MeshData> read_mesh(const std::filesystem::path& path);

/// A polygon mesh as OBJ, OFF or PLY, all in text, with the shortest digits that read back
/// exactly. Tags and names of faces go into OBJ only; texture coordinates into OBJ and PLY;
/// "color" into all, other channels into PLY. There a channel has the least type that holds it
/// exactly, double or float, and colours that are all 255ths are uchar. Indices of vertices are not
/// checked.
/// \param extension  with its dot
/// \return InvalidOption for another extension; for PLY what check_uvs() returns;
///         SizeMismatch if face_sizes, face_vertices and face_uvs or the sizes of channels disagree; what check_face_names() returns;
///         WriteFailed for tags, names of faces and of channels that would not read back: a
///         name is of words with one space between, in PLY one word that is no other's.
OSDX_API Result<std::string> format_mesh(const MeshData& mesh,
                                         std::string_view extension);

/// Writes that to a file by the extension of `path`. Nothing half-written is left.
/// \return what format_mesh() and write_file() return
OSDX_API Status write_mesh(const std::filesystem::path& path, const MeshData& mesh);

}  // namespace osdx::inline OSDX_ABI
