// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/build_patch_table.h>
#include <osdx/grid_evaluator.h>
#include <osdx/surface.h>

#include "benchmarks/meshes.h"
#include "benchmarks/samples.h"

namespace osdx::bench {

/// A surface with its points in float, and the bytes that it holds.
struct FloatSurface {
    Surface surface;
    std::vector<Vec3<float>> points;
    double bytes = 0;
};

/// Without tags.
/// \throw std::runtime_error with the reason why the mesh is refused
FloatSurface make_surface(const BenchMesh& mesh, const PatchTableOptions& patches);

/// Faces over each of which one B-spline patch of the base mesh lies: there the surface of
/// degree 3 is the limit of Catmull and Clark, whoever evaluates it.
std::vector<Index> regular_faces(const Surface& surface);

/// Faces in patches around interior vertices of so many faces, wholly.
std::vector<Index> ev_faces(const Surface& surface, int valence);
/// Faces with a Gregory patch of four sides.
std::vector<Index> gregory_faces(const Surface& surface);

/// A grid that is evaluated at once, with position, du and dv.
class Grid {
public:
    /// On each face of the base mesh, at the places of grid_places().
    explicit Grid(const FloatSurface& surface);
    /// On each sector of the patches of a class; square patches have one.
    Grid(const FloatSurface& surface, Index patch_class);

    std::size_t n_places() const { return evaluator_.n_samples(); }
    Way in_cache() const;
    Way into_buffer() const;
    std::vector<SurfaceJet<float>> evaluate_all() const;

private:
    struct Arrays {
        std::vector<Vec3<float>> p, du, dv;
    };
    void evaluate(Arrays& out) const;

    const FloatSurface* surface_;
    GridEvaluator<float> evaluator_;
    double bytes_ = 0;
};

/// The places of the grid on a class of patches; their (u, v) may be turned against those of
/// the patch. Empty where some patch is too small to be found.
std::vector<Place> class_places(const Surface& surface, Index patch_class);

/// Points one by one, where patch and place in it are known.
SampleWay our_points(const FloatSurface& surface, std::span<const Place> places);
/// Points of a patch that follow one another at once.
SampleWay our_points_by_patch(const FloatSurface& surface, std::span<const Place> places);

}  // namespace osdx::bench
