// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Uses each component that it is built with, and prints the names of those that did their work.

#include <cstdio>
#include <string>

#include <osdx/surface.h>
#ifdef WITH_files
#include <osdx/files/tessellation_file.h>
#endif
#ifdef WITH_embree
#include <osdx/embree/ray_scene.h>
#endif
#ifdef WITH_opensubdiv
#include <osdx/opensubdiv/limit_surface.h>
#endif
#ifdef WITH_analysis
#include <osdx/analysis/continuity.h>
#endif
#ifdef WITH_openmesh
#include <osdx/openmesh.h>
#endif

int main() {
    const osdx::MeshData tetrahedron{
        .positions = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}},
        .face_sizes = {3, 3, 3, 3},
        .face_vertices = {0, 1, 2, 0, 2, 3, 0, 3, 1, 3, 2, 1}};
    const auto surface = osdx::Surface::build(tetrahedron);
    if (!surface)
        return std::puts(surface.error().message.c_str()), 1;

    std::string done;
    const auto add = [&](const char* name, bool works) {
        if (works)
            done += (done.empty() ? "" : ",") + std::string(name);
    };
#ifdef WITH_files
    add("files", bool(osdx::format_tessellation(surface->tessellate(2), ".glb")));
#endif
#ifdef WITH_embree
    const auto scene = osdx::TessellatedScene::build(surface->tessellate(2));
    add("embree", scene && scene->rays().intersect({{0.1f, 0.05f, 5}, {0, 0, -1}}));
#endif
#ifdef WITH_opensubdiv
    const auto limit = osdx::LimitSurface::build(surface->base(), osdx::Features(),
                                                 tetrahedron.positions);
    add("opensubdiv", limit && limit->n_patches() > 0);
#endif
#ifdef WITH_analysis
    add("analysis", osdx::measure_continuity(*surface, 2).n_samples > 0);
#endif
#ifdef WITH_openmesh
    const auto mesh = osdx::build_mesh(tetrahedron);
    add("openmesh", mesh && osdx::OpenMeshSurface::build(*mesh).has_value());
#endif
    std::puts(done.c_str());
}
