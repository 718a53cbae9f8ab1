// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include <osdx/evaluator.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

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
OSDX_API Tessellation tessellate(const Topology& base, const ResolvedFeatures& features,
                                 int rate, const SurfaceFunction& surface);

/// The same of the surface of a patch table, by GridEvaluator.
/// \param points  all control points, evaluator.table().n_points() of them
OSDX_API Tessellation tessellate(const Evaluator& evaluator,
                                 std::span<const Vec3<double>> points, int rate);

}  // namespace osdx::inline OSDX_ABI
