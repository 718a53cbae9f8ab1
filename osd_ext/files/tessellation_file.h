// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

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
/// GLB   floats: "color" as COLOR_0, clamped to 0..1, which glTF takes for linear light; others
///       in capitals after a low line, _NAME, and more than four numbers as _NAME_0, _NAME_1,
///       ...
///
/// Without texcoords, OBJ and PLY hold facet_uvs in their place.
/// In PLY and GLB a vertex has one normal, and in GLB one texture coordinate: a point with
/// several is there as often, with equal bits. Points of no facet are left out of them.
/// \return InvalidOption for another extension; EmptyMesh, SizeMismatch or IndexOutOfRange
///         for a tessellation against its shapes; WriteFailed, also where the format has
///         too few bits (STL, GLB) or would mix up channels by their names (PLY, GLB). Nothing
///         half-written is left.
OSDX_API Status write_tessellation(const std::filesystem::path& path,
                                   const Tessellation& tessellation);

/// The same into memory.
/// \param extension  with its dot
/// \return what write_tessellation() returns, but not WriteFailed for the disk
OSDX_API Result<std::string> format_tessellation(const Tessellation& tessellation,
                                                 std::string_view extension);

}  // namespace osdx::inline OSDX_ABI
