// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cstddef>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/openmesh_fill.h>

namespace osdx::inline OSDX_ABI {
namespace {

OpenMesh::VertexHandle vertex_handle(Index v) {
    return OpenMesh::VertexHandle(static_cast<int>(v));
}

/// \param sources  gets the face that each triangle is from
detail::FilledFaces cut(const MeshView& view, std::vector<Index>& sources) {
    detail::FilledFaces faces;
    Index begin = 0;
    for (Index f = 0; f < view.face_sizes.size(); ++f) {
        for (Index i = 2; i < view.face_sizes[f]; ++i) {
            faces.sizes.push_back(3);
            faces.corners.insert(faces.corners.end(), {begin, begin + i - 1, begin + i});
            sources.push_back(f);
        }
        begin += view.face_sizes[f];
    }
    return faces;
}

Status check_triangles(const MeshView& view, const detail::FilledFaces& faces,
                       const std::vector<Index>& sources) {
    std::vector<Index> vertices;
    vertices.reserve(faces.corners.size());
    for (const Index corner : faces.corners)
        vertices.push_back(view.face_vertices[corner]);
    MeshView triangles;
    triangles.n_vertices = view.n_vertices;
    triangles.face_sizes = faces.sizes;
    triangles.face_vertices = vertices;
    const Result<Topology> topology = build_topology(triangles);
    if (topology)
        return ok();
    const Index face = topology.error().element < sources.size()
                           ? sources[topology.error().element]
                           : kInvalidIndex;
    return fail(ErrorCode::NonManifoldEdge,
                fmt::format("face {} cannot be cut into triangles from its first corner: "
                            "other triangles have the same edge",
                            face),
                face, view.line_of_face(face));
}

void clear(OpenMesh::PolyConnectivity& mesh) {
    mesh.clean();
    mesh.resize(0, 0, 0);  // else the first elements get what the old ones had
}

/// \param topology  of the view
Result<detail::FilledFaces> fill(OpenMesh::PolyConnectivity& mesh, const MeshView& view,
                                 const Topology& topology, bool triangles) {
    detail::FilledFaces faces;
    std::vector<Index> sources;
    if (triangles) {
        faces = cut(view, sources);
        if (faces.sizes.size() != view.face_sizes.size()) {
            if (Status s = check_triangles(view, faces, sources); !s)
                return s.error();
        }
    } else {
        faces.sizes.assign(view.face_sizes.begin(), view.face_sizes.end());
        faces.corners.resize(view.face_vertices.size());
        std::iota(faces.corners.begin(), faces.corners.end(), Index(0));
    }

    clear(mesh);
    mesh.reserve(view.n_vertices, topology.n_edges, faces.sizes.size());
    for (Index v = 0; v < view.n_vertices; ++v)
        mesh.add_vertex();
    std::vector<OpenMesh::VertexHandle> vertices;
    std::size_t corner = 0;
    for (std::size_t f = 0; f < faces.sizes.size(); ++f) {
        vertices.clear();
        for (Index i = 0; i < faces.sizes[f]; ++i)
            vertices.push_back(
                vertex_handle(view.face_vertices[faces.corners[corner++]]));
        // OpenMesh refuses what it cannot link; the checks leave nothing to refuse.
        const OpenMesh::FaceHandle handle = mesh.add_face(vertices);
        if (!handle.is_valid() || handle.idx() != static_cast<int>(f)) {
            clear(mesh);
            const Index face = triangles ? sources[f] : static_cast<Index>(f);
            return fail(ErrorCode::NonManifoldVertex,
                        fmt::format("face {} cannot be linked to its neighbours", face),
                        face, view.line_of_face(face));
        }
    }
    return faces;
}

/// Flags and properties of sharpness of one kind of element, in so far as the mesh has them.
template <template <class> class PropHandle>
class SharpnessWriter {
public:
    SharpnessWriter(OpenMesh::PolyConnectivity& mesh, const std::string& name,
                    bool has_status)
        : mesh_(mesh), has_status_(has_status) {
        mesh.get_property_handle(single_, name);
        mesh.get_property_handle(double_, name);
    }
    template <class Handle>
    void operator()(Handle handle, double sharpness) const {
        if (sharpness <= 0)
            return;
        if (single_.is_valid())
            mesh_.property(single_, handle) = static_cast<float>(sharpness);
        if (double_.is_valid())
            mesh_.property(double_, handle) = sharpness;
        if (has_status_ && is_infinitely_sharp(sharpness))
            mesh_.status(handle).set_feature(true);
    }

private:
    OpenMesh::PolyConnectivity& mesh_;
    bool has_status_;
    PropHandle<float> single_;
    PropHandle<double> double_;
};

/// \param t  that the mesh was made of; its faces may be cut
void fill_features(OpenMesh::PolyConnectivity& mesh, const Topology& t,
                   const Features& features, bool triangles,
                   const OpenMeshOptions& options) {
    if (!features.edge_sharpness.empty()) {
        const SharpnessWriter<OpenMesh::EPropHandleT> write(mesh, options.sharpness,
                                                            mesh.has_edge_status());
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            const auto handle = mesh.find_halfedge(vertex_handle(t.vertex[h]),
                                                   vertex_handle(t.to_vertex(h)));
            write(mesh.edge_handle(handle), features.edge(t.edge[h]));
        }
    }
    if (!features.vertex_sharpness.empty()) {
        const SharpnessWriter<OpenMesh::VPropHandleT> write(mesh, options.sharpness,
                                                            mesh.has_vertex_status());
        for (Index v = 0; v < t.n_vertices(); ++v)
            write(vertex_handle(v), features.vertex(v));
    }
    OpenMesh::FPropHandleT<bool> hole;
    if (features.hole.empty() || !mesh.get_property_handle(hole, options.hole))
        return;
    int handle = 0;
    for (Index f = 0; f < t.n_faces(); ++f) {
        const Index n = triangles ? t.face_size(f) - 2 : 1;
        for (Index i = 0; i < n; ++i)
            mesh.property(hole, OpenMesh::FaceHandle(handle++)) = features.is_hole(f);
    }
}

}  // namespace

namespace detail {

Result<FilledFaces> fill_connectivity(OpenMesh::PolyConnectivity& mesh,
                                      const MeshData& data, bool triangles,
                                      const OpenMeshOptions& options) {
    const Result<Topology> topology = build_topology(data);
    if (!topology)
        return topology.error();
    const Result<Features> features = build_features(data, *topology);
    if (!features)
        return features.error();
    Result<FilledFaces> faces = fill(mesh, data.view(), *topology, triangles);
    if (faces)
        fill_features(mesh, *topology, *features, triangles, options);
    return faces;
}

Result<FilledFaces> fill_connectivity(OpenMesh::PolyConnectivity& mesh,
                                      const Tessellation& tessellation, bool triangles) {
    MeshView view;
    view.n_vertices = static_cast<Index>(tessellation.positions.size());
    view.face_sizes = tessellation.facet_sizes;
    view.face_vertices = tessellation.facet_points;
    const Result<Topology> topology = build_topology(view);
    if (!topology)
        return topology.error();
    return fill(mesh, view, *topology, triangles);
}

}  // namespace detail
}  // namespace osdx::inline OSDX_ABI
