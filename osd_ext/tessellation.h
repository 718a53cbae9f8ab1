// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <span>
#include <vector>

#include <osdx/address.h>
#include <osdx/buffer.h>
#include <osdx/channels.h>
#include <osdx/mesh_data.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The surface as a watertight mesh of small facets, each inside one base face.
///
/// Shapes: positions, addresses and channels n_points; normals n_normals; texcoords n_texcoords;
/// facet_sizes and facet_faces n_facets; facet_points, facet_normals, facet_uvs and
/// facet_texcoords sum of facet_sizes, and corner_values of face_varying too. The two for texture
/// coordinates may be empty.
///
/// A point that faces share is stored once, evaluated from its first face, so the facets on
/// all sides have it equal to the bit. A normal is that of one side of the sharp edges at its
/// point: normal i, for i < n_points, is that of point i at addresses[i]; those of the other
/// sides follow. Without sharp edges facet_normals is facet_points.
struct Tessellation {
    Buffer<Vec3<double>> positions;
    Buffer<Address> addresses;     ///< where the point was evaluated
    Buffer<Vec3<double>> normals;  ///< unit; zero where the surface has no normal

    Buffer<Index> facet_sizes;       ///< 3 or 4
    Buffer<Index> facet_faces;       ///< the base face that the facet lies in
    Buffer<Index> facet_points;      ///< corners, counter-clockwise
    Buffer<Index> facet_normals;     ///< of each corner
    Buffer<Vec2<double>> facet_uvs;  ///< (u, v) of each corner in facet_faces[i]

    /// Of the mesh's own texture coordinates (TextureSurface::add_to). Corners at a point
    /// share one unless a seam lies between them.
    Buffer<Vec2<double>> texcoords;
    Buffer<Index> facet_texcoords;  ///< of each corner

    std::vector<NamedChannels> channels;  ///< of points: colours, ... (add_channels())
    /// Of corners, shared as texcoords are (FaceVaryingSurface::add_to).
    std::vector<FaceVaryingChannels> face_varying;
};

/// The facets cut into triangles, a quad along the diagonal from its first corner: places in
/// facet_points, facet_normals and facet_uvs.
OSDX_API std::vector<std::array<Index, 3>> triangle_corners(
    const Tessellation& tessellation);

/// The same triangles as points.
OSDX_API std::vector<std::array<Index, 3>> triangles(const Tessellation& tessellation);

}  // namespace osdx::inline OSDX_ABI
