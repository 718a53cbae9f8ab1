// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include <osdx/address.h>
#include <osdx/buffer.h>
#include <osdx/evaluator.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_jet.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx {

/// The surface as a watertight mesh of small facets, each inside one base face.
///
/// Shapes: positions, addresses n_points; normals n_normals; texcoords n_texcoords;
/// facet_sizes and facet_faces n_facets; facet_points, facet_normals, facet_uvs and
/// facet_texcoords sum of facet_sizes. The two for texture coordinates may be empty.
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
};

/// A surface over the faces of a base mesh, with derivatives in (u, v). Called from several
/// threads at the same time.
using SurfaceFunction = std::function<SurfaceJet<double>(const QuarterPoint&)>;

/// Tessellates every base face of n corners that is no hole into rings of quads: every edge
/// of the mesh gets `rate` segments. At even rates no facet leaves its quarter of the face; at
/// odd rates the facets on the middle lines do, with a triangle, a quad or a fan of triangles
/// in the centre.
///
/// The sides of a vertex are the fans of faces between its infinitely sharp edges; a vertex
/// where one such edge ends has one side. Holes have no facets, and no points of their own;
/// the surface is not evaluated there.
///
/// Threads: goes wide; the result does not depend on their number. O(result).
/// \param features  sharp edges and holes of the base, as PatchTable::features() has them
/// \pre rate >= 1
Tessellation tessellate(const Topology& base, const ResolvedFeatures& features, int rate,
                        const SurfaceFunction& surface);

/// The same of the surface of a patch table, by GridEvaluator.
/// \param points  all control points, evaluator.table().n_points() of them
Tessellation tessellate(const Evaluator& evaluator, std::span<const Vec3<double>> points,
                        int rate);

/// The facets cut into triangles, a quad along the diagonal from its first corner: places in
/// facet_points, facet_normals and facet_uvs.
std::vector<std::array<Index, 3>> triangle_corners(const Tessellation& tessellation);

/// The same triangles as points.
std::vector<std::array<Index, 3>> triangles(const Tessellation& tessellation);

}  // namespace osdx
