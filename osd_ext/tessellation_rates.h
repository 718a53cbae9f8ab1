// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <span>
#include <vector>

#include <osdx/evaluator.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// How finely a mesh is tessellated: the segments of each edge, and the rings inside of each
/// face, which are those of a face with as many segments a side.
///
/// A rate below 1 counts as 1; a rate 1 inside of a face counts as 2 where an edge has more
/// segments, which then run to its centre.
struct TessellationRates {
    int rate = 1;                  ///< of all edges, where `edges` is empty
    std::span<const int> edges{};  ///< n_edges, or empty
    std::span<const int>
        faces{};  ///< n_faces, or empty: the largest of each face's edges
};

/// The same with arrays of its own, to be kept while the rates are used.
struct RateArrays {
    std::vector<int> edges;
    std::vector<int> faces;  ///< may be empty, as above

    operator TessellationRates() const noexcept { return {1, edges, faces}; }
};

/// Rates of edges from a function, called once for each.
OSDX_API RateArrays rates_of_edges(const Topology& base,
                                   const std::function<int(Index edge)>& rate);

/// Segments of about a length: that of the edge's curve on the surface, in eight chords,
/// divided by `length` and rounded up.
///
/// Threads, here and below: goes wide; the result does not depend on their number.
/// \param points  all control points, evaluator.table().n_points() of them
/// \param max_rate  no rate is above it; all are that if the length is not positive
/// \pre max_rate >= 1
OSDX_API RateArrays rates_from_length(const Evaluator& evaluator,
                                      std::span<const Vec3<double>> points, double length,
                                      int max_rate = 64);

/// Rates at which facets are about `error` from the surface, in units of the mesh: that of
/// chords, |second derivative| h^2 / 8, by second differences of the surface on a grid of
/// eighths in each face. An estimate, not a bound: what is smaller than an eighth of a face is
/// not seen.
///
/// Along borders and sharp edges the distance is that of the curve, elsewhere along the normal.
/// \param points, max_rate  as above
OSDX_API RateArrays rates_from_error(const Evaluator& evaluator,
                                     std::span<const Vec3<double>> points, double error,
                                     int max_rate = 64);

}  // namespace osdx::inline OSDX_ABI
