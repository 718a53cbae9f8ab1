// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <vector>

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

    std::vector<Index> facet_sizes;   ///< 3 or 4
    std::vector<Index> facet_faces;   ///< the base face that the facet lies in
    std::vector<Index> facet_points;  ///< corners, counter-clockwise
    std::vector<Vec2<double>> facet_uvs;  ///< (u, v) of each corner in facet_faces[i]
};

/// The facets cut into triangles, a quad along the diagonal from its first corner.
/// triangle_facets receives the facet of each triangle when it is not null.
std::vector<std::array<Index, 3>> triangles(const Tessellation& tessellation,
                                            std::vector<Index>* triangle_facets = nullptr);

}  // namespace osdx
