// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <utility>

#include <osdx/openmesh_surface.h>

namespace osdx::inline OSDX_ABI {

std::vector<Index> faces_by_handles(const OpenMeshArrays& before,
                                    const OpenMeshArrays& after) {
    std::vector<Index> faces(before.faces.size(), kInvalidIndex);
    // Both are in the order of handles.
    Index g = 0;
    std::size_t at = 0, new_at = 0;
    for (Index f = 0; f < before.faces.size(); ++f) {
        const Index n = before.face_sizes[f];
        while (g < after.faces.size() && after.faces.handle(g) < before.faces.handle(f))
            new_at += after.face_sizes[g++];
        if (g < after.faces.size() && after.faces.handle(g) == before.faces.handle(f) &&
            after.face_sizes[g] == n) {
            Index i = 0;
            while (i < n && before.vertices.handle(before.face_vertices[at + i]) ==
                                after.vertices.handle(after.face_vertices[new_at + i]))
                ++i;
            if (i == n)
                faces[f] = g;
        }
        at += n;
    }
    return faces;
}

namespace {

template <class T>
Result<Surface> build_surface(const OpenMeshArrays& arrays, Channels<const T> points,
                              const PatchTableOptions& patches) {
    Result<Surface> surface = Surface::build(arrays.view(), points, patches);
    if (!surface)
        return arrays.by_handles(surface.error());
    return surface;
}

}  // namespace

Result<OpenMeshSurface> OpenMeshSurface::build(OpenMeshArrays arrays,
                                               Channels<const float> points,
                                               const OpenMeshOptions& options,
                                               const PatchTableOptions& patches) {
    Result<Surface> surface = build_surface(arrays, points, patches);
    if (!surface)
        return surface.error();
    return OpenMeshSurface(std::move(*surface), std::move(arrays), options, patches);
}

Result<OpenMeshSurface> OpenMeshSurface::build(OpenMeshArrays arrays,
                                               Channels<const double> points,
                                               const OpenMeshOptions& options,
                                               const PatchTableOptions& patches) {
    Result<Surface> surface = build_surface(arrays, points, patches);
    if (!surface)
        return surface.error();
    return OpenMeshSurface(std::move(*surface), std::move(arrays), options, patches);
}

template <class T>
Result<OpenMeshUpdate> OpenMeshSurface::update_with(OpenMeshArrays arrays,
                                                    Channels<const T> points) {
    OpenMeshUpdate update;
    if (arrays_.same_surface(arrays)) {
        const Status moved = surface_.set_positions(points);
        if (!moved)
            return arrays.by_handles(moved.error());
    } else {
        Result<Surface> surface = build_surface(arrays, points, patches_);
        if (!surface)
            return surface.error();
        update.rebuilt = true;
        update.faces = faces_by_handles(arrays_, arrays);
        surface_ = std::move(*surface);
    }
    arrays_ = std::move(arrays);
    return update;
}

Result<OpenMeshUpdate> OpenMeshSurface::update(OpenMeshArrays arrays,
                                               Channels<const float> points) {
    return update_with(std::move(arrays), points);
}
Result<OpenMeshUpdate> OpenMeshSurface::update(OpenMeshArrays arrays,
                                               Channels<const double> points) {
    return update_with(std::move(arrays), points);
}

}  // namespace osdx::inline OSDX_ABI
