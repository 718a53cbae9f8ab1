// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>

#include <osdx/files/tessellation_file.h>
#include <osdx/mesh_file.h>
#include <osdx/surface.h>

int main(int argc, char** argv) {
    if (argc != 2)
        return std::puts("usage: sample MESH  (OBJ, OFF or PLY; writes surface.ply)"), 2;

    const auto mesh = osdx::read_mesh(argv[1]);
    if (!mesh)
        return std::puts(mesh.error().message.c_str()), 1;

    const auto surface = osdx::Surface::build(*mesh, {.degree = 5});
    if (!surface)
        return std::puts(surface.error().message.c_str()), 1;

    const auto jet = surface->evaluate({.face = 0, .u = 0.25, .v = 0.75});
    const auto n = osdx::normal(jet);
    std::printf("p = (%g, %g, %g), n = (%g, %g, %g), mean curvature %g\n", jet.p.x,
                jet.p.y, jet.p.z, n.x, n.y, n.z, osdx::curvature(jet).mean);

    const auto written = osdx::write_tessellation("surface.ply", surface->tessellate(8));
    return written ? 0 : 1;
}
