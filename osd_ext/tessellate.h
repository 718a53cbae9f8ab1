// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include <osdx/evaluator.h>
#include <osdx/resolved_features.h>
#include <osdx/surface_function.h>
#include <osdx/tessellation.h>
#include <osdx/tessellation_rates.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// Tessellates every base face of n corners that is no hole into rings of quads around its
/// centre; a strip of triangles and quads joins the outermost ring, at the rate of the inside, to
/// edges that have other rates. At even rates no facet leaves its quarter of the face; at odd
/// rates the facets on the middle lines do, with a triangle, a quad or a fan of triangles in the
/// centre of an odd inside.
///
/// Watertight for any rates: an edge of the mesh has its points once, for the faces on both
/// sides. Where all rates are equal, however they are given, the result is the same to the bit.
///
/// The sides of a vertex are the fans of faces between its infinitely sharp edges; a vertex
/// where one such edge ends has one side. Holes have no facets, and no points of their own;
/// the surface is not evaluated there.
///
/// Threads: goes wide; the result does not depend on their number. O(result).
/// \param features  sharp edges and holes of the base, as PatchTable::features() has them
OSDX_API Tessellation tessellate(const Topology& base, const ResolvedFeatures& features,
                                 const TessellationRates& rates,
                                 const SurfaceFunction& surface);
OSDX_API Tessellation tessellate(const Topology& base, const ResolvedFeatures& features,
                                 int rate, const SurfaceFunction& surface);

/// The same of the surface of a patch table: by GridEvaluator where all rates are equal, by
/// evaluate_addresses() otherwise.
/// \param points  all control points, evaluator.table().n_points() of them
OSDX_API Tessellation tessellate(const Evaluator& evaluator,
                                 std::span<const Vec3<double>> points,
                                 const TessellationRates& rates);
OSDX_API Tessellation tessellate(const Evaluator& evaluator,
                                 std::span<const Vec3<double>> points, int rate);

}  // namespace osdx::inline OSDX_ABI
