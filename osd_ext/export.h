// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>

#include "far/mesh_data.h"
#include "far/result.h"
#include "osd_ext/tessellation.h"

namespace osdx {

/// Writes a tessellation by the extension of `path`:
///
/// OBJ   points as v, normals as vn, texcoords as vt, facets as f v/vt/vn; the shortest
///       digits that read back exactly.
/// PLY   binary, little endian: vertices with double x y z and float nx ny nz; faces with
///       uchar/uint list vertex_indices, uint base_face, uchar/float list texcoord (u0 v0 u1
///       v1 ..., of the corners).
/// STL   binary: float positions, facets cut into triangles with their own normals.
/// GLB   glTF 2.0: one mesh of triangles, float positions, normals and, where there are,
///       texcoords with their v turned to 1 - v, as glTF has it; a double sided material. Coordinates are not turned, though glTF takes y for up. Where the surface
///       has no normal, that of the triangles around the point stands in.
///
/// Without texcoords, OBJ and PLY hold facet_uvs in their place.
/// In PLY and GLB a vertex has one normal, and in GLB one texture coordinate: a point with
/// several is there as often, with equal bits. Points of no facet are left out of them.
/// \return InvalidOption for another extension; EmptyMesh, SizeMismatch or IndexOutOfRange
///         for a tessellation against its shapes; WriteFailed, also where the format has
///         too few bits (STL, GLB). Nothing half-written is left.
Status write_tessellation(const std::filesystem::path& path,
                          const Tessellation& tessellation);

/// Writes a polygon mesh as OBJ, OFF or PLY, all in text, with the shortest digits that read
/// back exactly. Tags and texture coordinates go into OBJ only. Indices are not checked.
/// \return InvalidOption for another extension, SizeMismatch if face_sizes, face_vertices
///         and face_uvs disagree, WriteFailed. Nothing half-written is left.
Status write_mesh(const std::filesystem::path& path, const MeshData& mesh);

/// Lets `write` fill a stream, and gives the file its name only when that succeeded: a
/// temporary file beside `path` is renamed, or removed; what `write` throws passes through.
/// \return WriteFailed, also if `write` leaves the stream in a failed state or if `path`
///         names a folder or a device.
Status write_file(const std::filesystem::path& path,
                  const std::function<void(std::ostream&)>& write);

}  // namespace osdx
