// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include <osdx/mesh_data.h>

#include "far/mesh/formats/output.h"

namespace osdx::inline OSDX_ABI::detail {

/// Calls f(the vertices of the face).
template <class F>
void for_each_face(const MeshData& mesh, F&& f) {
    std::span<const Index> vertices = mesh.face_vertices;
    for (const Index n : mesh.face_sizes) {
        f(vertices.first(n));
        vertices = vertices.subspan(n);
    }
}

/// The vertices and faces as OFF and text PLY have them after their headers.
/// \param write_more  of vertex v: what follows its position
/// \param write_more_of_face  of the face with n corners from the first on: what follows them
template <class F, class G>
void write_body(Output& out, const MeshData& mesh, F&& write_more,
                G&& write_more_of_face) {
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const Vec3<double>& p = mesh.positions[v];
        out.text("{} {} {}", p.x, p.y, p.z);
        write_more(v);
        out.text("\n");
    }
    std::size_t first = 0;
    for_each_face(mesh, [&](std::span<const Index> face) {
        out.text("{}", face.size());
        for (const Index v : face)
            out.text(" {}", v);
        write_more_of_face(first, face.size());
        first += face.size();
        out.text("\n");
    });
}

}  // namespace osdx::inline OSDX_ABI::detail
