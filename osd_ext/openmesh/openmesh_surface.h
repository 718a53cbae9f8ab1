// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <utility>
#include <vector>

#include <osdx/channels.h>
#include <osdx/openmesh_arrays.h>
#include <osdx/openmesh_channels.h>
#include <osdx/patch_options.h>
#include <osdx/result.h>
#include <osdx/surface.h>

namespace osdx::inline OSDX_ABI {

/// What became of a surface.
struct OpenMeshUpdate {
    bool rebuilt = false;  ///< else it has moved, and all faces are what they were
    /// If rebuilt: for each face of the surface before, the one with its handle if that has the
    /// same vertices, by handles, from the same first one; so that (u, v) there are the same.
    /// kInvalidIndex else.
    std::vector<Index> faces;

    Index face(Index old) const noexcept { return rebuilt ? faces[old] : old; }
};

/// A smooth surface over a mesh of OpenMesh, to which the mesh is handed over again after it was
/// edited. The mesh is not kept.
///
/// Faces of the surface are those of the mesh that are not deleted: arrays() has the handles.
/// garbage_collection() gives handles to other elements, which update() cannot know: the map of
/// faces is right only if none came between.
///
/// Threads: const members may run at the same time.
class OpenMeshSurface {
public:
    /// \return what read_openmesh() and Surface::build() return, with indices of handles
    template <OpenMeshMesh M>
    static Result<OpenMeshSurface> build(const M& mesh,
                                         const OpenMeshOptions& options = {},
                                         const PatchTableOptions& patches = {}) {
        Result<OpenMeshArrays> arrays = read_openmesh(mesh, options);
        if (!arrays)
            return arrays.error();
        const auto points = positions(mesh, *arrays);
        return build(std::move(*arrays), points.channels(), options, patches);
    }

    /// Takes the mesh as it is now: where its faces and features are as they were, the surface
    /// moves, which is cheap; else it is built anew, and what refers to it is void.
    /// \param mesh  the same, or another one
    /// \return as build(); on an error all is as it was
    template <OpenMeshMesh M>
    Result<OpenMeshUpdate> update(const M& mesh) {
        Result<OpenMeshArrays> arrays = read_openmesh(mesh, options_);
        if (!arrays)
            return arrays.error();
        const auto points = positions(mesh, *arrays);
        return update(std::move(*arrays), points.channels());
    }

    const Surface& surface() const noexcept { return surface_; }
    /// For Surface::move_vertices().
    Surface& surface() noexcept { return surface_; }
    const OpenMeshArrays& arrays() const noexcept { return arrays_; }

private:
    OpenMeshSurface(Surface surface, OpenMeshArrays arrays, OpenMeshOptions options,
                    const PatchTableOptions& patches)
        : surface_(std::move(surface)),
          arrays_(std::move(arrays)),
          options_(std::move(options)),
          patches_(patches) {}

    OSDX_API static Result<OpenMeshSurface> build(OpenMeshArrays arrays,
                                                  Channels<const float> points,
                                                  const OpenMeshOptions& options,
                                                  const PatchTableOptions& patches);
    OSDX_API static Result<OpenMeshSurface> build(OpenMeshArrays arrays,
                                                  Channels<const double> points,
                                                  const OpenMeshOptions& options,
                                                  const PatchTableOptions& patches);
    OSDX_API Result<OpenMeshUpdate> update(OpenMeshArrays arrays,
                                           Channels<const float> points);
    OSDX_API Result<OpenMeshUpdate> update(OpenMeshArrays arrays,
                                           Channels<const double> points);
    template <class T>
    Result<OpenMeshUpdate> update_with(OpenMeshArrays arrays, Channels<const T> points);

    Surface surface_;
    OpenMeshArrays arrays_;
    OpenMeshOptions options_;
    PatchTableOptions patches_;
};

/// The map of OpenMeshUpdate::faces, in linear time.
OSDX_API std::vector<Index> faces_by_handles(const OpenMeshArrays& before,
                                             const OpenMeshArrays& after);

}  // namespace osdx::inline OSDX_ABI
