// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <concepts>
#include <cstddef>
#include <string>
#include <vector>

#include <OpenMesh/Core/Mesh/PolyConnectivity.hh>
#include <OpenMesh/Core/Utils/vector_traits.hh>

#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// PolyMesh_ArrayKernelT and TriMesh_ArrayKernelT with any traits whose points have three
/// components: Vec3f, Vec3d, vectors of Eigen, ...
template <class M>
concept OpenMeshMesh = std::derived_from<M, OpenMesh::PolyConnectivity> &&
                       OpenMesh::vector_traits<typename M::Point>::size_ == 3;

/// Where a mesh of OpenMesh says what is sharp, and what it does not say.
///
/// Status flags and properties that the mesh does not have count for nothing. A property of
/// sharpness is of float or double, that of holes of bool.
struct OpenMeshOptions {
    /// Of edges and vertices with status().feature().
    float feature_sharpness = static_cast<float>(kInfinitelySharp);
    /// Properties of edges and of vertices: where the value is not 0 it replaces that of the
    /// flag. Values below 0 are smooth.
    std::string sharpness = "osdx:sharpness";
    /// A property of faces: those without surface.
    std::string hole = "osdx:hole";
    BoundaryRule boundary = BoundaryRule::EdgeOnly;
    CreaseMethod crease_method = CreaseMethod::Uniform;
    bool smooth_triangles = false;
};

/// Numbers for the elements of a mesh that are not deleted, in the order of their handles. Where
/// none is deleted a number is the handle's index.
class LiveElements {
public:
    LiveElements() = default;
    /// \param deleted  of each handle; or empty where none is
    OSDX_API LiveElements(std::size_t n_handles, const std::vector<bool>& deleted);

    Index size() const noexcept { return n_; }
    bool all_live() const noexcept { return numbers_.empty(); }
    /// The index of the handle.
    /// \pre i < size()
    Index handle(Index i) const noexcept { return all_live() ? i : handles_[i]; }
    /// kInvalidIndex for what is deleted or was not there.
    Index number(Index handle) const noexcept {
        if (all_live())
            return handle < n_ ? handle : kInvalidIndex;
        return handle < numbers_.size() ? numbers_[handle] : kInvalidIndex;
    }

private:
    Index n_ = 0;
    std::vector<Index> handles_, numbers_;
};

/// Connectivity and features of a mesh of OpenMesh in arrays, without what is deleted: vertices
/// and faces have the numbers of `vertices` and `faces`.
///
/// Shapes: those of MeshView. A face begins with the vertex at which OpenMesh begins it.
struct OpenMeshArrays {
    LiveElements vertices, faces;
    std::vector<Index> face_sizes, face_vertices;
    std::vector<Index> creases;  ///< vertices of edges, two for each
    std::vector<float> crease_sharpness;
    std::vector<Index> corners;  ///< vertices
    std::vector<float> corner_sharpness;
    std::vector<Index> holes;  ///< faces
    BoundaryRule boundary = BoundaryRule::EdgeOnly;
    CreaseMethod crease_method = CreaseMethod::Uniform;
    bool smooth_triangles = false;

    Index number(OpenMesh::VertexHandle v) const noexcept {
        return vertices.number(static_cast<Index>(v.idx()));
    }
    Index number(OpenMesh::FaceHandle f) const noexcept {
        return faces.number(static_cast<Index>(f.idx()));
    }
    /// \pre v < vertices.size()
    OpenMesh::VertexHandle vertex_handle(Index v) const noexcept {
        return OpenMesh::VertexHandle(static_cast<int>(vertices.handle(v)));
    }
    /// \pre f < faces.size()
    OpenMesh::FaceHandle face_handle(Index f) const noexcept {
        return OpenMesh::FaceHandle(static_cast<int>(faces.handle(f)));
    }

    /// Of these arrays, as long as they live.
    OSDX_API MeshView view() const noexcept;
    /// The features as tags of MeshData.
    OSDX_API std::vector<Tag> tags() const;
    /// Whether a surface over these arrays is one over the others: only handles differ, if
    /// anything. In linear time.
    OSDX_API bool same_surface(const OpenMeshArrays& other) const noexcept;
    /// What other functions refuse of view(), with the indices of handles instead of numbers.
    OSDX_API Error by_handles(Error error) const;
};

/// Reads the mesh as it is: garbage_collection() is not needed. Not checked further; that is
/// done where the arrays go. In linear time.
/// \pre links are as OpenMesh's functions leave them
/// \return IndexOutOfRange for a face with a deleted vertex (with the face), FaceTooSmall for
///         one without halfedges (with the face), InvalidFeature for a sharpness that is not a
///         number (with the edge or vertex)
OSDX_API Result<OpenMeshArrays> read_openmesh(const OpenMesh::PolyConnectivity& mesh,
                                              const OpenMeshOptions& options = {});

}  // namespace osdx::inline OSDX_ABI
