// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/tessellation.h>

namespace osdx::inline OSDX_ABI {

/// Writes a tessellation by the extension of `path`:
///
/// OBJ   points as v, normals as vn, texcoords as vt, facets as f v/vt/vn; the shortest
///       digits that read back exactly.
/// PLY   binary, little endian: vertices with double x y z and float nx ny nz; faces with
///       uchar/uint list vertex_indices, uint base_face, uchar/float list texcoord (u0 v0 u1
///       v1 ..., of the corners).
/// STL   binary: float positions, facets cut into triangles with their own normals.
/// GLB   glTF 2.0: one mesh of triangles, float positions, normals and, where there are,
///       texcoords with their v turned to 1 - v, as glTF has it; a double sided material.
///       Coordinates are not turned, though glTF takes y for up. Where the surface has no
///       normal, that of the triangles around the point stands in.
///
/// Channels of points, by their names:
/// OBJ   "color" after x y z, the others not at all; STL none.
/// PLY   properties, as mesh_file.h has them: doubles, or less where that is exact; colours are
///       floats, or uchar where they are 255ths.
/// GLB   floats: "color" as COLOR_0, clamped to 0..1 and turned from sRGB, which colours of OBJ,
///       OFF and PLY are in practice, to linear light, which glTF wants (alpha stays); others
///       in capitals after a low line, _NAME, and more than four numbers as _NAME_0, _NAME_1,
///       ...
///
/// Names of the faces that facets lie in, where `base` is given:
/// OBJ   groups, objects and materials as g, o and usemtl, files of materials as mtllib.
/// GLB   materials: a primitive and a material of that name for each that a facet has, after one
///       without name for the others. Bytes that are no UTF-8 become question marks.
///
/// Without texcoords, OBJ and PLY hold facet_uvs in their place.
/// In PLY and GLB a vertex has one normal, and in GLB one texture coordinate: a point with
/// several is there as often, with equal bits. Points of no facet are left out of them.
/// \param base  the mesh that was tessellated, for its names; or null
/// \return InvalidOption for another extension; EmptyMesh, SizeMismatch or IndexOutOfRange
///         for a tessellation or names against their shapes; WriteFailed, also where the format
///         has too few bits (STL, GLB), would mix up channels by their names (PLY, GLB) or
///         names of faces by their spaces (OBJ). Nothing half-written is left.
OSDX_API Status write_tessellation(const std::filesystem::path& path,
                                   const Tessellation& tessellation,
                                   const MeshData* base = nullptr);

/// The same into memory.
/// \param extension  with its dot
/// \return what write_tessellation() returns, but not WriteFailed for the disk
OSDX_API Result<std::string> format_tessellation(const Tessellation& tessellation,
                                                 std::string_view extension,
                                                 const MeshData* base = nullptr);

}  // namespace osdx::inline OSDX_ABI
