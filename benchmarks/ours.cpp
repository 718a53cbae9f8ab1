// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "benchmarks/ours.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace osdx::bench {
namespace {

void write(const SurfaceJet<float>& jet, float* out) {
    std::copy_n(&jet.p.x, 3, out);
    std::copy_n(&jet.du.x, 3, out + 3);
    std::copy_n(&jet.dv.x, 3, out + 6);
}

}  // namespace

FloatSurface make_surface(const BenchMesh& mesh, const SurfaceOptions& options) {
    double bytes;
    Result<Surface> built =
        measured([&] { return Surface::build(mesh.data, options); }, bytes);
    if (!built)
        throw std::runtime_error(mesh.name + ": " + built.error().message);
    FloatSurface s{*std::move(built), {}, bytes};
    s.points.assign(s.surface.points().begin(), s.surface.points().end());
    return s;
}

std::vector<Index> faces_where(const Surface& surface,
                               const std::function<bool(Index patch)>& takes) {
    std::vector<Index> faces;
    for (Index f = 0; f < surface.base().n_faces(); ++f) {
        const std::vector<Place> places = grid_places({&f, 1});
        if (std::ranges::all_of(places, [&](const Place& p) {
                return takes(surface.patches().locate(Address{f, p.u, p.v}).patch);
            }))
            faces.push_back(f);
    }
    return faces;
}

std::vector<Index> regular_faces(const Surface& surface) {
    const PatchTable& table = surface.patches();
    return faces_where(surface, [&](Index patch) {
        return table.class_of(patch).kind == PatchKind::Regular &&
               table.patch(patch).level == 0;
    });
}

SampleWay our_grid(const FloatSurface& surface, std::span<const Place> places) {
    const auto evaluate = [&surface, places](std::size_t first, std::size_t last,
                                             float* out) {
        const std::span<const Vec3<float>> points(surface.points);
        for (std::size_t i = first; i < last; ++i, out += 9) {
            const Place& p = places[i];
            write(surface.surface.evaluator().evaluate<float, 1>(
                      points, Address{p.face, p.u, p.v}),
                  out);
        }
    };
    return {kOurs, "Evaluator", 9, evaluate, {}, surface.bytes};
}

SampleWay our_points(const FloatSurface& surface, std::span<const Place> places) {
    std::vector<PatchPoint> found;
    for (const Place& p : places)
        found.push_back(surface.surface.patches().locate(Address{p.face, p.u, p.v}));
    const auto evaluate = [&surface, found](std::size_t first, std::size_t last,
                                            float* out) {
        const std::span<const Vec3<float>> points(surface.points);
        for (std::size_t i = first; i < last; ++i, out += 9)
            write(surface.surface.evaluator().evaluate<float, 1>(points, found[i]), out);
    };
    return {kOurs, "Evaluator", 9, evaluate, {}, surface.bytes};
}

}  // namespace osdx::bench
