// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <vector>

#include <osdx/resolved_features.h>
#include <osdx/topology.h>
#include <osdx/types.h>

#include "far/refine/grids/quad_grids.h"

/// Sharp features of OddGrids: what lies on edges and vertices of the roots.
namespace osdx::inline OSDX_ABI::detail {

/// An end of a root edge: of the lower halfedge of the edge.
struct EdgeEnd {
    Index halfedge;
    bool at_end;  ///< of the halfedge, not at its start
};

/// The rule of a vertex that is not smooth: a mixture of three.
struct SharpVertex {
    Index vertex;
    double corner = 0, crease = 0, smooth = 0;  ///< weights that sum to one
    EdgeEnd ends[2] = {};                       ///< where the crease goes
};

/// The rule of the points inside an edge that are not all smooth: a mixture of two.
struct SharpEdge {
    static constexpr std::size_t kAll = std::size_t(-1);
    Index halfedge;       ///< the lower one
    std::size_t weights;  ///< the first in GridRules::crease_weights; kAll: all are one
};

/// The rules of a step from grids of some size to twice that: those of the finer points.
struct GridRules {
    std::vector<SharpVertex> vertices;
    std::vector<SharpEdge> edges;
    std::vector<double> crease_weights;
    /// By edge: the weight of the centres of its faces in its point. Empty: 1/4.
    std::vector<double> face_weights;
};

/// The rules of a step from size 1, for the points of split(): those inside edges are vertices.
GridRules rules_after_split(const GridRules& rules, const Topology& mesh);

/// The sharpness of a level, and the rules from it to the next.
class GridSharpness {
public:
    GridSharpness(const Topology& mesh, const ResolvedFeatures& features);

    /// The rules of a step. Afterwards the sharpness is that of the finer level.
    GridRules step(const QuadGrids& coarse);

    /// After a step from size 1: the mesh is split(), halves of edges are edges of roots.
    void split_edges(const Topology& mesh, const Topology& split);

    /// By the numbers of the grids; features of other kinds are left as they are.
    void write(const QuadGrids& grids, ResolvedFeatures& features) const;

private:
    /// Of a root edge: of each of its segments from the start on, or one for all of them.
    struct Edge {
        Index halfedge;
        std::vector<double> segments;
        double at(Index segment) const {
            return segments[segments.size() == 1 ? 0 : segment];
        }
    };
    std::vector<Edge> finer_edges(const QuadGrids& coarse) const;

    CreaseMethod method_;
    bool smooth_triangles_;
    std::vector<Edge> edges_;  ///< those that are sharp somewhere
    std::vector<std::pair<Index, double>> vertices_;
};

}  // namespace osdx::inline OSDX_ABI::detail
