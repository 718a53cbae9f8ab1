// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <osdx/openmesh_arrays.h>

namespace osdx::inline OSDX_ABI {
namespace {

using OpenMesh::PolyConnectivity;

/// The elements of one kind that are marked as deleted; empty where there are none.
/// \param handle  handle(i)
template <class Handle>
std::vector<bool> deleted_of(const PolyConnectivity& mesh, std::size_t n, bool has_status,
                             Handle&& handle) {
    std::vector<bool> deleted;
    for (std::size_t i = 0; has_status && i < n; ++i) {
        if (!mesh.status(handle(i)).deleted())
            continue;
        deleted.resize(n);
        deleted[i] = true;
    }
    return deleted;
}

/// A property of float or double, 0 where the mesh has none of this name.
template <template <class> class PropHandle>
class Sharpness {
public:
    Sharpness(const PolyConnectivity& mesh, const std::string& name) : mesh_(mesh) {
        if (!mesh.get_property_handle(single_, name))
            mesh.get_property_handle(double_, name);
    }
    template <class Handle>
    float operator()(Handle h) const {
        if (single_.is_valid())
            return mesh_.property(single_, h);
        return double_.is_valid() ? static_cast<float>(mesh_.property(double_, h)) : 0.0f;
    }

private:
    const PolyConnectivity& mesh_;
    PropHandle<float> single_;
    PropHandle<double> double_;
};

class Reader {
public:
    Reader(const PolyConnectivity& mesh, const OpenMeshOptions& options)
        : mesh_(mesh), options_(options) {}

    Result<OpenMeshArrays> read() {
        arrays_.vertices = {
            mesh_.n_vertices(),
            deleted_of(mesh_, mesh_.n_vertices(), mesh_.has_vertex_status(), vertex)};
        arrays_.faces = {mesh_.n_faces(), deleted_of(mesh_, mesh_.n_faces(),
                                                     mesh_.has_face_status(), face)};
        arrays_.boundary = options_.boundary;
        arrays_.crease_method = options_.crease_method;
        arrays_.smooth_triangles = options_.smooth_triangles;
        if (Status s = read_faces(); !s)
            return s.error();
        if (Status s = read_creases(); !s)
            return s.error();
        if (Status s = read_corners(); !s)
            return s.error();
        read_holes();
        return std::move(arrays_);
    }

private:
    static OpenMesh::VertexHandle vertex(std::size_t i) {
        return OpenMesh::VertexHandle(static_cast<int>(i));
    }
    static OpenMesh::FaceHandle face(std::size_t i) {
        return OpenMesh::FaceHandle(static_cast<int>(i));
    }

    Status read_faces() {
        arrays_.face_sizes.reserve(arrays_.faces.size());
        arrays_.face_vertices.reserve(mesh_.n_halfedges());
        for (Index f = 0; f < arrays_.faces.size(); ++f) {
            const OpenMesh::FaceHandle handle = arrays_.face_handle(f);
            const OpenMesh::HalfedgeHandle first = mesh_.halfedge_handle(handle);
            if (!first.is_valid()) {
                return fail(ErrorCode::FaceTooSmall,
                            fmt::format("face {} has no halfedge", handle.idx()),
                            arrays_.faces.handle(f));
            }
            // OpenMesh's face names the halfedge that ends at the first vertex.
            OpenMesh::HalfedgeHandle h = first;
            Index n = 0;
            do {
                const OpenMesh::VertexHandle v = mesh_.to_vertex_handle(h);
                arrays_.face_vertices.push_back(arrays_.number(v));
                if (arrays_.face_vertices.back() == kInvalidIndex) {
                    return fail(ErrorCode::IndexOutOfRange,
                                fmt::format("face {} names vertex {}, which is deleted",
                                            handle.idx(), v.idx()),
                                arrays_.faces.handle(f));
                }
                ++n;
                h = mesh_.next_halfedge_handle(h);
            } while (h != first);
            arrays_.face_sizes.push_back(n);
        }
        return ok();
    }

    /// The sharpness of an edge or vertex: that of its property, or of its flag.
    float chosen(float by_property, bool is_feature) const {
        return by_property == 0 && is_feature ? options_.feature_sharpness : by_property;
    }
    static Status check(std::string_view what, float sharpness, int handle) {
        if (sharpness == sharpness)
            return ok();
        return fail(ErrorCode::InvalidFeature,
                    fmt::format("the sharpness of {} {} is not a number", what, handle),
                    static_cast<Index>(handle));
    }

    Status read_creases() {
        const Sharpness<OpenMesh::EPropHandleT> sharpness(mesh_, options_.sharpness);
        for (std::size_t i = 0; i < mesh_.n_edges(); ++i) {
            const OpenMesh::EdgeHandle e(static_cast<int>(i));
            if (mesh_.has_edge_status() && mesh_.status(e).deleted())
                continue;
            const float s = chosen(sharpness(e),
                                   mesh_.has_edge_status() && mesh_.status(e).feature());
            if (Status sound = check("edge", s, e.idx()); !sound)
                return sound;
            if (s <= 0 || !has_face(e))
                continue;
            const OpenMesh::HalfedgeHandle h = mesh_.halfedge_handle(e, 0);
            arrays_.creases.push_back(arrays_.number(mesh_.from_vertex_handle(h)));
            arrays_.creases.push_back(arrays_.number(mesh_.to_vertex_handle(h)));
            arrays_.crease_sharpness.push_back(s);
        }
        return ok();
    }

    bool has_face(OpenMesh::EdgeHandle e) const {
        for (unsigned side = 0; side < 2; ++side) {
            const OpenMesh::FaceHandle f =
                mesh_.face_handle(mesh_.halfedge_handle(e, side));
            if (f.is_valid() && arrays_.number(f) != kInvalidIndex)
                return true;
        }
        return false;
    }

    Status read_corners() {
        const Sharpness<OpenMesh::VPropHandleT> sharpness(mesh_, options_.sharpness);
        for (Index i = 0; i < arrays_.vertices.size(); ++i) {
            const OpenMesh::VertexHandle v = arrays_.vertex_handle(i);
            const float s = chosen(
                sharpness(v), mesh_.has_vertex_status() && mesh_.status(v).feature());
            if (Status sound = check("vertex", s, v.idx()); !sound)
                return sound;
            if (s <= 0)
                continue;
            arrays_.corners.push_back(i);
            arrays_.corner_sharpness.push_back(s);
        }
        return ok();
    }

    void read_holes() {
        OpenMesh::FPropHandleT<bool> hole;
        if (!mesh_.get_property_handle(hole, options_.hole))
            return;
        for (Index f = 0; f < arrays_.faces.size(); ++f) {
            if (mesh_.property(hole, arrays_.face_handle(f)))
                arrays_.holes.push_back(f);
        }
    }

    const PolyConnectivity& mesh_;
    const OpenMeshOptions& options_;
    OpenMeshArrays arrays_;
};

/// What Error::element counts.
enum class Kind { Face, Vertex, Other };

Kind kind_of_element(ErrorCode code) {
    switch (code) {
        case ErrorCode::IndexOutOfRange:
        case ErrorCode::FaceTooSmall:
        case ErrorCode::RepeatedVertex:
        case ErrorCode::NonManifoldEdge:
        case ErrorCode::OppositeFaces:
        case ErrorCode::NotIsolated:
            return Kind::Face;
        case ErrorCode::NonFinitePoint:
        case ErrorCode::NonManifoldVertex:
        case ErrorCode::ValenceTwo:
            return Kind::Vertex;
        default:
            return Kind::Other;
    }
}

/// The indices in a message: numbers that follow "face", "vertex" or "vertices", and after these
/// those that "and" or "to" joins to them.
template <class F>
std::string replace_indices(std::string_view message, F&& handle) {
    std::string result;
    Kind kind = Kind::Other;
    bool after_number = false;
    for (std::size_t i = 0; i < message.size();) {
        const std::size_t end = std::min(message.find(' ', i), message.size());
        const std::string_view word = message.substr(i, end - i);
        std::size_t n_digits = 0;
        while (n_digits < word.size() &&
               std::isdigit(static_cast<unsigned char>(word[n_digits])))
            ++n_digits;
        const bool is_joint = (word == "and" || word == "to") && after_number;
        if (n_digits > 0 && kind != Kind::Other) {
            const auto index =
                static_cast<Index>(std::stoul(std::string(word.substr(0, n_digits))));
            result += fmt::format("{}{}", handle(kind, index), word.substr(n_digits));
        } else {
            result += word;
        }
        if (word == "face")
            kind = Kind::Face;
        else if (word == "vertex" || word == "vertices")
            kind = Kind::Vertex;
        else if (!is_joint && !(n_digits > 0))
            kind = Kind::Other;
        after_number = n_digits > 0;
        if (end < message.size())
            result += ' ';
        i = end + 1;
    }
    return result;
}

}  // namespace

LiveElements::LiveElements(std::size_t n_handles, const std::vector<bool>& deleted)
    : n_(static_cast<Index>(n_handles)) {
    if (deleted.empty())
        return;
    numbers_.assign(n_handles, kInvalidIndex);
    for (Index h = 0; h < n_handles; ++h) {
        if (deleted[h])
            continue;
        numbers_[h] = static_cast<Index>(handles_.size());
        handles_.push_back(h);
    }
    n_ = static_cast<Index>(handles_.size());
}

MeshView OpenMeshArrays::view() const noexcept {
    MeshView v;
    v.n_vertices = vertices.size();
    v.face_sizes = face_sizes;
    v.face_vertices = face_vertices;
    v.creases = creases;
    v.crease_sharpness = crease_sharpness;
    v.corners = corners;
    v.corner_sharpness = corner_sharpness;
    v.holes = holes;
    v.boundary = boundary;
    v.crease_method = crease_method;
    v.smooth_triangles = smooth_triangles;
    return v;
}

std::vector<Tag> OpenMeshArrays::tags() const {
    std::vector<Tag> tags;
    const auto add = [&](std::string name) -> Tag& {
        tags.emplace_back();
        tags.back().name = std::move(name);
        return tags.back();
    };
    for (std::size_t i = 0; i < crease_sharpness.size(); ++i) {
        Tag& tag = add("crease");
        tag.ints = {static_cast<int>(creases[2 * i]),
                    static_cast<int>(creases[2 * i + 1])};
        tag.floats = {crease_sharpness[i]};
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
        Tag& tag = add("corner");
        tag.ints = {static_cast<int>(corners[i])};
        tag.floats = {corner_sharpness[i]};
    }
    for (const Index f : holes)
        add("hole").ints = {static_cast<int>(f)};
    if (boundary != BoundaryRule::EdgeOnly) {
        add("interpolateboundary").ints = {boundary == BoundaryRule::EdgeAndCorner ? 1
                                                                                   : 0};
    }
    if (crease_method == CreaseMethod::Chaikin)
        add("creasemethod").text = {"chaikin"};
    if (smooth_triangles)
        add("smoothtriangles").text = {"smooth"};
    return tags;
}

bool OpenMeshArrays::same_surface(const OpenMeshArrays& other) const noexcept {
    return vertices.size() == other.vertices.size() && face_sizes == other.face_sizes &&
           face_vertices == other.face_vertices && creases == other.creases &&
           crease_sharpness == other.crease_sharpness && corners == other.corners &&
           corner_sharpness == other.corner_sharpness && holes == other.holes &&
           boundary == other.boundary && crease_method == other.crease_method &&
           smooth_triangles == other.smooth_triangles;
}

Error OpenMeshArrays::by_handles(Error error) const {
    const auto handle = [this](Kind kind, Index i) {
        const LiveElements& elements = kind == Kind::Face ? faces : vertices;
        return i < elements.size() ? elements.handle(i) : i;
    };
    const Kind kind = kind_of_element(error.code);
    if (kind != Kind::Other && error.element != kInvalidIndex)
        error.element = handle(kind, error.element);
    error.message = replace_indices(error.message, handle);
    return error;
}

Result<OpenMeshArrays> read_openmesh(const OpenMesh::PolyConnectivity& mesh,
                                     const OpenMeshOptions& options) {
    return Reader(mesh, options).read();
}

}  // namespace osdx::inline OSDX_ABI
