// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <iosfwd>
#include <string_view>

#include <osdx/mesh_data.h>
#include <osdx/result.h>

/// The formats of mesh files, one source each. For mesh_file.cpp.
namespace osdx::inline OSDX_ABI::detail {

Result<MeshData> read_obj(std::string_view text);
Result<MeshData> read_off(std::string_view text);
Result<MeshData> read_ply(std::string_view text);

/// Refuses arrays that disagree in length.
Status check_shapes(const MeshData& mesh);
/// Refuses besides what the reader of OBJ would not take for what it is.
Status check_obj(const MeshData& mesh);
/// The same of PLY.
Status check_ply(const MeshData& mesh);

/// \pre check_shapes(), for OBJ check_obj(), for PLY check_ply()
void write_obj(std::ostream& stream, const MeshData& mesh);
void write_off(std::ostream& stream, const MeshData& mesh);
void write_ply(std::ostream& stream, const MeshData& mesh);

}  // namespace osdx::inline OSDX_ABI::detail
