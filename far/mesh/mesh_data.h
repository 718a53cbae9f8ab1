// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <osdx/channels.h>
#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// What the surface does at the border of an open mesh. The names and, at degree 3, the
/// meanings are those of OpenSubdiv's Sdc.
enum class BoundaryRule : std::uint8_t {
    /// Faces that touch the border carry no surface: they are holes. Not where the border's
    /// edges are infinitely sharp by a tag.
    None,
    EdgeOnly,       ///< the border is the B-spline curve of the border polygon
    EdgeAndCorner,  ///< the same, and it is pinned to border vertices of one face
};

/// How the sharpness of a crease goes down from level to level.
enum class CreaseMethod : std::uint8_t {
    Uniform,  ///< by one
    Chaikin,  ///< averaged along the crease (Chaikin 1974), then by one
};

/// Where face-varying data are smooth. The names and meanings are those of OpenSubdiv's
/// Sdc::Options::FVAR_LINEAR_*.
///
/// The data have seams where the faces at an edge disagree. "Pinned": keeps its value, as a
/// corner does. Every rule pins where a seam crosses an infinitely sharp crease, and where
/// fans of faces with the same value meet in one vertex only.
enum class FaceVaryingRule : std::uint8_t {
    None,         ///< seams and borders are smooth curves, round their corners too
    CornersOnly,  ///< pinned where only one face has the value
    /// Pinned too where three or more values meet at a vertex; of two, both are sharp where
    /// a crease makes one of them so.
    CornersPlus1,
    /// Pinned too where a seam ends inside the mesh; of two values, both where only one face
    /// has one of them.
    CornersPlus2,
    Boundaries,  ///< seams and borders are linear
    All,         ///< linear in each face: no smoothing at all. OpenSubdiv's default
};

/// A `t` line of an OBJ file in OpenSubdiv's form: `t crease 2/1/0 4 7 3.5`.
struct Tag {
    std::string name;       ///< "crease", "corner", "hole", "interpolateboundary", ...
    std::vector<int> ints;  ///< vertex or face indices, counted from 0
    std::vector<double> floats;     ///< for instance sharpness
    std::vector<std::string> text;  ///< names, as of crease methods
    Index line = 0;                 ///< of the file; 0 when the tag came from memory
};

/// Which values face corners have, in an array of others. Where corners at a vertex name
/// different values a seam lies between them.
struct FaceVaryingView {
    std::string_view name{};  ///< for messages
    std::span<const Index>
        corner_values{};  ///< of each corner in MeshView::face_vertices
    Index n_values = 0;
    FaceVaryingRule rule = FaceVaryingRule::All;
};

/// Channels of values that face corners name: colours, texture coordinates, ...
struct FaceVaryingChannels : NamedChannels {
    std::vector<Index> corner_values;  ///< of each corner
    FaceVaryingRule rule = FaceVaryingRule::All;

    Index n_values() const noexcept {
        return n > 0 ? static_cast<Index>(values.size() / static_cast<std::size_t>(n))
                     : 0;
    }
    FaceVaryingView corners() const noexcept {
        return {name, corner_values, n_values(), rule};
    }
};

/// A polygon mesh without positions, in arrays of others, and where it is not smooth. Nothing
/// is copied, nothing checked; build_topology() and build_features() are the doors.
///
/// Sharpness s > 0: the next s levels of refinement take the rules of a crease or corner; 10 and
/// more are infinitely sharp.
struct MeshView {
    Index n_vertices = 0;
    std::span<const Index> face_sizes;        ///< n_faces
    std::span<const Index> face_vertices;     ///< the faces one after the other
    std::span<const Index> creases;           ///< vertices of edges, two for each
    std::span<const float> crease_sharpness;  ///< of each edge
    std::span<const Index> corners;           ///< vertices
    std::span<const float> corner_sharpness;  ///< of each
    std::span<const Index> holes;             ///< faces without surface
    /// What corners have beside vertices: FaceVaryingSurface::build() takes each of them.
    std::span<const FaceVaryingView> face_varying;
    BoundaryRule boundary = BoundaryRule::EdgeOnly;
    CreaseMethod crease_method = CreaseMethod::Uniform;
    /// Edge points beside triangles lean to the triangles (OpenSubdiv's TRI_SUB_SMOOTH).
    bool smooth_triangles = false;
    /// Lines of a file, of all vertices and of all faces, for messages; or empty.
    std::span<const Index> vertex_lines, face_lines;

    /// 0 where none is known.
    Index line_of_vertex(Index v) const noexcept {
        return v < vertex_lines.size() ? vertex_lines[v] : 0;
    }
    Index line_of_face(Index f) const noexcept {
        return f < face_lines.size() ? face_lines[f] : 0;
    }
};

/// What faces are called: a name for each face that has one.
struct FaceNames {
    std::vector<std::string> names;
    /// Of each face its name, or kInvalidIndex; empty where no face has one.
    std::vector<Index> faces;
};

/// A polygon mesh as a file holds it. Not checked; build_topology() is the door.
///
/// Shapes: face_sizes n_faces; face_vertices sum of face_sizes, the faces one after the
/// other; face_uvs the same as face_vertices, or empty where the mesh has no texture
/// coordinates; the two line arrays are empty, or n_vertices and n_faces; channels n_vertices;
/// corner_values of face_varying the same as face_vertices.
///
/// The names of what lies in a face of the mesh are those of the face: of a facet i of a
/// Tessellation, groups.faces[facet_faces[i]].
struct MeshData {
    std::vector<Vec3<double>> positions;
    std::vector<Index> face_sizes;
    std::vector<Index> face_vertices;
    std::vector<Vec2<double>> uvs;  ///< texture coordinates
    std::vector<Index> face_uvs;    ///< of each corner in face_vertices
    std::vector<Tag> tags;
    /// Of vertices, beside their positions: "color", weights, velocities, ...
    std::vector<NamedChannels> channels;
    std::vector<FaceVaryingChannels> face_varying;  ///< of corners; in no file
    FaceNames groups, objects, materials;     ///< `g`, `o` and `usemtl` of an OBJ file
    std::vector<std::string> material_files;  ///< what its `mtllib` lines name

    std::vector<Index> vertex_lines;  ///< line of the file for each vertex
    std::vector<Index> face_lines;    ///< line of the file for each face
    std::vector<Warning> warnings;    ///< of the reader of the file

    /// Its faces and lines; features of a file are tags, which build_features() reads.
    MeshView view() const noexcept {
        MeshView v;
        v.n_vertices = static_cast<Index>(positions.size());
        v.face_sizes = face_sizes;
        v.face_vertices = face_vertices;
        v.vertex_lines = vertex_lines;
        v.face_lines = face_lines;
        return v;
    }
};

/// \return SizeMismatch, IndexOutOfRange or NonFinitePoint, with the face whose texture
///         coordinates are not as MeshData has them. Those of no face may be anything.
/// \pre face_sizes and face_vertices agree
OSDX_API Status check_uvs(const MeshData& mesh);

/// \return SizeMismatch where a channel has no n values for each vertex or n is not as
///         NamedChannels has it; NonFinitePoint with the vertex
OSDX_API Status check_channels(std::span<const NamedChannels> channels,
                               const MeshView& mesh);

namespace detail {
/// The sizes alone.
OSDX_API Status check_channel_sizes(std::span<const NamedChannels> channels,
                                    Index n_vertices);
}  // namespace detail

/// Of groups, objects and materials.
/// \return SizeMismatch; IndexOutOfRange with the face
OSDX_API Status check_face_names(const MeshData& mesh);

/// Diagonal of the bounding box of the points.
OSDX_API double bounding_diagonal(std::span<const Vec3<double>> points);

}  // namespace osdx::inline OSDX_ABI
