// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string>
#include <vector>

#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx {

/// A `t` line of an OBJ file in OpenSubdiv's form: `t crease 2/1/0 4 7 3.5`.
struct Tag {
    std::string name;       ///< "crease", "corner", "hole", "interpolateboundary", ...
    std::vector<int> ints;  ///< vertex or face indices, counted from 0
    std::vector<double> floats;     ///< for instance sharpness
    std::vector<std::string> text;  ///< names, as of crease methods
    Index line = 0;                 ///< of the file; 0 when the tag came from memory
};

/// A polygon mesh as plain arrays: what files hold and what callers hand in. Not checked;
/// build_topology() is the door.
///
/// Shapes: face_sizes n_faces; face_vertices sum of face_sizes, the faces one after the
/// other; face_uvs the same as face_vertices, or empty where the mesh has no texture
/// coordinates; the two line arrays are empty, or n_vertices and n_faces.
struct MeshData {
    std::vector<Vec3<double>> positions;
    std::vector<Index> face_sizes;
    std::vector<Index> face_vertices;
    std::vector<Vec2<double>> uvs;  ///< texture coordinates
    std::vector<Index> face_uvs;    ///< of each corner in face_vertices
    std::vector<Tag> tags;

    std::vector<Index> vertex_lines;  ///< line of the file for each vertex
    std::vector<Index> face_lines;    ///< line of the file for each face

    /// Line of the file; 0 where none is known.
    Index line_of_vertex(Index v) const noexcept {
        return v < vertex_lines.size() ? vertex_lines[v] : 0;
    }
    Index line_of_face(Index f) const noexcept {
        return f < face_lines.size() ? face_lines[f] : 0;
    }
};

/// \return SizeMismatch, IndexOutOfRange or NonFinitePoint, with the face whose texture
///         coordinates are not as MeshData has them. Those of no face may be anything.
/// \pre face_sizes and face_vertices agree
Status check_uvs(const MeshData& mesh);

/// Diagonal of the bounding box of the points.
double bounding_diagonal(std::span<const Vec3<double>> points);

}  // namespace osdx
