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

/// Writes a tessellation by the extension of `path`: OBJ (vn, vt of each corner, 17 digits),
/// PLY (binary little endian, double positions, float normals, base face and u, v of each
/// facet corner's point), STL (binary, quads cut into triangles) or GLB (triangles, float
/// positions and normals, one mesh).
/// \return InvalidOption for another extension, WriteFailed; nothing half-written is left.
Status write_tessellation(const std::filesystem::path& path,
                          const Tessellation& tessellation);

/// Writes a polygon mesh as OBJ, OFF or PLY (text; 17 digits, exact on reading back).
/// \return InvalidOption for another extension, WriteFailed; nothing half-written is left.
Status write_mesh(const std::filesystem::path& path, const MeshData& mesh);

/// Lets `write` fill a stream, and gives the file its name only when that succeeded: a
/// temporary file beside `path` is renamed, or removed.
Status write_file(const std::filesystem::path& path,
                  const std::function<void(std::ostream&)>& write);

}  // namespace osdx
