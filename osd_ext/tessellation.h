// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <functional>
#include <vector>

#include "eval/surface_jet.h"
#include "far/address.h"
#include "far/types.h"

namespace osdx {

/// The surface as a watertight mesh of small facets, each inside one base face.
///
/// Shapes: positions, normals, addresses n_points; facet_sizes and facet_faces n_facets;
/// facet_points and facet_uvs sum of facet_sizes.
///
/// A point that faces share is stored once, evaluated from its first face, so the facets on
/// both sides have it equal to the bit.
struct Tessellation {
    std::vector<Vec3<double>> positions;
    std::vector<Vec3<double>> normals;  ///< unit; zero where the surface has no normal
    std::vector<Address> addresses;     ///< where the point was evaluated

    std::vector<Index> facet_sizes;       ///< 3 or 4
    std::vector<Index> facet_faces;       ///< the base face that the facet lies in
    std::vector<Index> facet_points;      ///< corners, counter-clockwise
    std::vector<Vec2<double>> facet_uvs;  ///< (u, v) of each corner in facet_faces[i]
};

/// A surface over the faces of a base mesh, with derivatives in (u, v). Called from several
/// threads at the same time.
using SurfaceFunction = std::function<SurfaceJet<double>(const QuarterPoint&)>;

/// Tessellates every base face of n corners into rings of quads: every edge of the mesh gets
/// `rate` segments. At even rates no facet leaves its quarter of the face; at odd rates the
/// facets on the middle lines do, with a triangle, a quad or a fan of triangles in the centre.
///
/// Threads: goes wide; the result does not depend on their number.
/// \pre rate >= 1
Tessellation tessellate(const Topology& base, int rate, const SurfaceFunction& surface);

/// The facets cut into triangles, a quad along the diagonal from its first corner.
std::vector<std::array<Index, 3>> triangles(const Tessellation& tessellation);

}  // namespace osdx
