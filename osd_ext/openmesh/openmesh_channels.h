// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <OpenMesh/Core/Utils/Property.hh>

#include <osdx/channels.h>
#include <osdx/mesh_data.h>
#include <osdx/openmesh_arrays.h>
#include <osdx/result.h>

namespace osdx::inline OSDX_ABI {

/// Numbers of the vertices of OpenMeshArrays: where no vertex is deleted those of the mesh
/// itself, which has to live on and to keep its vertices; else a copy.
template <class T>
class VertexChannels {
public:
    explicit VertexChannels(Channels<const T> of_mesh) : of_mesh_(of_mesh) {}
    VertexChannels(std::vector<T> copy, int n)
        : of_mesh_{nullptr, n, n}, copy_(std::move(copy)) {}

    Channels<const T> channels() const noexcept {
        return is_copy() ? osdx::channels(copy_.data(), of_mesh_.n) : of_mesh_;
    }
    operator Channels<const T>() const noexcept { return channels(); }
    bool is_copy() const noexcept { return !copy_.empty(); }

private:
    Channels<const T> of_mesh_;
    std::vector<T> copy_;
};

namespace detail {

template <class V>
struct Components {
    using Scalar = typename OpenMesh::vector_traits<V>::value_type;
    static constexpr int n = static_cast<int>(OpenMesh::vector_traits<V>::size_);
    static const Scalar* data(const V& v) { return &v[0]; }
    static Scalar* data(V& v) { return &v[0]; }
};
template <class V>
requires std::is_arithmetic_v<V>
struct Components<V> {
    using Scalar = V;
    static constexpr int n = 1;
    static const Scalar* data(const V& v) { return &v; }
    static Scalar* data(V& v) { return &v; }
};

/// \tparam T  what the numbers are to be; others than the mesh's are copied
/// \param values  of each handle
template <class T, class V>
VertexChannels<T> vertex_channels(const OpenMeshArrays& arrays, const V* values) {
    using C = Components<V>;
    constexpr int n = C::n;
    if constexpr (std::same_as<T, typename C::Scalar>) {
        static_assert(sizeof(V) % sizeof(T) == 0);
        if (arrays.vertices.size() == 0)
            return VertexChannels<T>(Channels<const T>{nullptr, n, n});
        if (arrays.vertices.all_live()) {
            return VertexChannels<T>(
                Channels<const T>{C::data(*values), sizeof(V) / sizeof(T), n});
        }
    }
    std::vector<T> copy;
    copy.reserve(n * std::size_t(arrays.vertices.size()));
    for (Index v = 0; v < arrays.vertices.size(); ++v) {
        const auto* p = C::data(values[arrays.vertices.handle(v)]);
        for (int c = 0; c < n; ++c)
            copy.push_back(static_cast<T>(p[c]));
    }
    return VertexChannels<T>(std::move(copy), n);
}

}  // namespace detail

/// What positions() gives: float or double as the mesh's points are; double for other points.
template <OpenMeshMesh M>
using PositionScalar = std::conditional_t<
    std::same_as<typename detail::Components<typename M::Point>::Scalar, float>, float,
    double>;

/// The points of a mesh, three channels.
/// \pre arrays are those of the mesh
template <OpenMeshMesh M>
VertexChannels<PositionScalar<M>> positions(const M& mesh, const OpenMeshArrays& arrays) {
    return detail::vertex_channels<PositionScalar<M>>(arrays, mesh.points());
}

/// A property of vertices as float or double, which Surface::values() takes; else as
/// vertex_channels(). Values stay as they are: colours of unsigned char go from 0 to 255.
template <class T, OpenMeshMesh M, class V>
Result<VertexChannels<T>> vertex_channels_as(const M& mesh, const OpenMeshArrays& arrays,
                                             OpenMesh::VPropHandleT<V> property) {
    static_assert(!std::same_as<V, bool>, "OpenMesh keeps them as single bits");
    if (!property.is_valid())
        return fail(ErrorCode::InvalidOption,
                    "the mesh has no such property of vertices");
    return detail::vertex_channels<T>(arrays, mesh.property(property).data());
}

/// A property of vertices as channels: of numbers (but bool), or of vectors of these. The
/// standard ones go by their handles, mesh.vertex_colors_pph() or mesh.vertex_texcoords2D_pph().
/// Normals are no channels: the surface has its own.
/// \pre arrays are those of the mesh
/// \return InvalidOption where the mesh has no such property
template <OpenMeshMesh M, class V>
Result<VertexChannels<typename detail::Components<V>::Scalar>> vertex_channels(
    const M& mesh, const OpenMeshArrays& arrays, OpenMesh::VPropHandleT<V> property) {
    return vertex_channels_as<typename detail::Components<V>::Scalar>(mesh, arrays,
                                                                      property);
}

/// The same by name: vertex_channels<OpenMesh::Vec3f>(mesh, arrays, "velocity").
template <class V, OpenMeshMesh M>
Result<VertexChannels<typename detail::Components<V>::Scalar>> vertex_channels(
    const M& mesh, const OpenMeshArrays& arrays, const std::string& name) {
    OpenMesh::VPropHandleT<V> property;
    if (!mesh.get_property_handle(property, name)) {
        return fail(ErrorCode::InvalidOption,
                    "the mesh has no property of vertices of this type named " + name);
    }
    return vertex_channels(mesh, arrays, property);
}

namespace detail {

/// Gives every corner its value; those of one vertex that are equal become one.
class CornerValues {
public:
    /// \param out  without values; its n is set
    CornerValues(FaceVaryingChannels& out, Index n_vertices)
        : out_(out), first_(n_vertices, kInvalidIndex) {}

    /// \param value  n numbers
    void add(Index vertex, const double* value) {
        Index* at = &first_[vertex];
        while (*at != kInvalidIndex &&
               !std::equal(value, value + out_.n, out_.view()[*at]))
            at = &next_[*at];
        if (*at == kInvalidIndex) {
            *at = static_cast<Index>(next_.size());
            out_.corner_values.push_back(*at);
            out_.values.insert(out_.values.end(), value, value + out_.n);
            next_.push_back(kInvalidIndex);
        } else {
            out_.corner_values.push_back(*at);
        }
    }

private:
    FaceVaryingChannels& out_;
    std::vector<Index> first_, next_;  // of the values of each vertex
};

/// \param value  value(halfedge that ends at the corner, its vertex)
template <OpenMeshMesh M, class Value>
FaceVaryingChannels corner_channels(const M& mesh, const OpenMeshArrays& arrays,
                                    Value&& value) {
    using V = std::remove_cvref_t<decltype(value(OpenMesh::HalfedgeHandle(),
                                                 OpenMesh::VertexHandle()))>;
    using C = Components<V>;
    FaceVaryingChannels out;
    out.n = C::n;
    CornerValues values(out, arrays.vertices.size());
    std::size_t corner = 0;
    for (Index f = 0; f < arrays.faces.size(); ++f) {
        auto h = mesh.halfedge_handle(arrays.face_handle(f));
        for (Index i = 0; i < arrays.face_sizes[f]; ++i, ++corner) {
            const V& v = value(h, mesh.to_vertex_handle(h));
            double numbers[C::n];
            std::copy_n(C::data(v), C::n, numbers);
            values.add(arrays.face_vertices[corner], numbers);
            h = mesh.next_halfedge_handle(h);
        }
    }
    return out;
}

}  // namespace detail

/// A property of halfedges, of numbers (but bool) or of vectors of these, as face-varying
/// channels: a corner has the value of the halfedge that ends there, as OpenMesh has it with
/// texture coordinates, and a seam is where the values differ. The standard ones go by their
/// handles, mesh.halfedge_texcoords2D_pph() or mesh.halfedge_colors_pph(). Their corners() go
/// into FaceVaryingSurface::build(), their view() into its values().
/// \pre arrays are those of the mesh
/// \return InvalidOption where the mesh has no such property
template <OpenMeshMesh M, class V>
Result<FaceVaryingChannels> halfedge_channels(
    const M& mesh, const OpenMeshArrays& arrays, OpenMesh::HPropHandleT<V> property,
    FaceVaryingRule rule = FaceVaryingRule::All) {
    static_assert(!std::same_as<V, bool>, "OpenMesh keeps them as single bits");
    if (!property.is_valid())
        return fail(ErrorCode::InvalidOption,
                    "the mesh has no such property of halfedges");
    FaceVaryingChannels result = detail::corner_channels(
        mesh, arrays,
        [&](auto h, auto) -> const V& { return mesh.property(property, h); });
    result.name = mesh.property(property).name();
    result.rule = rule;
    return result;
}

/// The same by name: halfedge_channels<OpenMesh::Vec3f>(mesh, arrays, "paint").
template <class V, OpenMeshMesh M>
Result<FaceVaryingChannels> halfedge_channels(
    const M& mesh, const OpenMeshArrays& arrays, const std::string& name,
    FaceVaryingRule rule = FaceVaryingRule::All) {
    OpenMesh::HPropHandleT<V> property;
    if (!mesh.get_property_handle(property, name)) {
        return fail(ErrorCode::InvalidOption,
                    "the mesh has no property of halfedges of this type named " + name);
    }
    return halfedge_channels(mesh, arrays, property, rule);
}

}  // namespace osdx::inline OSDX_ABI
