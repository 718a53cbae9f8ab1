// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "benchmarks/ours.h"

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>

#include <benchmark/benchmark.h>

#include <osdx/evaluator.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

namespace osdx::bench {
namespace {

void write(const SurfaceJet<float>& jet, float* out) {
    std::copy_n(&jet.p.x, 3, out);
    std::copy_n(&jet.du.x, 3, out + 3);
    std::copy_n(&jet.dv.x, 3, out + 6);
}

}  // namespace

FloatSurface make_surface(const BenchMesh& mesh, const PatchTableOptions& patches) {
    double bytes;
    Result<Surface> built =
        measured([&] { return Surface::build(mesh.data, patches, kNoTags); }, bytes);
    if (!built)
        throw std::runtime_error(mesh.name + ": " + built.error().message);
    FloatSurface s{*std::move(built), {}, bytes};
    s.points.assign(s.surface.points().begin(), s.surface.points().end());
    return s;
}

namespace {

/// Faces whose whole grid lies in patches that the predicate takes.
template <class Predicate>
std::vector<Index> faces_where(const Surface& surface, Predicate&& takes) {
    std::vector<Index> faces;
    for (Index f = 0; f < surface.base().n_faces(); ++f) {
        bool all = true;
        for (int k = 0; k < kGridSide * kGridSide && all; ++k) {
            const Address at{f, grid_parameter(k % kGridSide),
                             grid_parameter(k / kGridSide)};
            all = takes(surface.patches().locate(at).patch);
        }
        if (all)
            faces.push_back(f);
    }
    return faces;
}

/// The points of a sector's grid, for all sectors of a class.
std::vector<DomainPoint> class_points(const PatchClass& c) {
    std::vector<DomainPoint> points;
    for (int sector = 0; sector < (c.is_square() ? 1 : c.n_sectors); ++sector) {
        for (int j = 0; j < kGridSide; ++j) {
            for (int i = 0; i < kGridSide; ++i)
                points.push_back({sector, grid_parameter(i), grid_parameter(j)});
        }
    }
    return points;
}

}  // namespace

std::vector<Index> regular_faces(const Surface& surface) {
    const PatchTable& table = surface.patches();
    return faces_where(surface, [&](Index patch) {
        return table.class_of(patch).kind == PatchKind::Regular &&
               table.patch(patch).level == 0;
    });
}

std::vector<Index> ev_faces(const Surface& surface, int valence) {
    const PatchTable& table = surface.patches();
    return faces_where(surface, [&](Index patch) {
        const PatchClass& c = table.class_of(patch);
        return c.kind == PatchKind::EV && c.n_sectors == valence &&
               c.border == PatchBorder::None;
    });
}

std::vector<Index> gregory_faces(const Surface& surface) {
    const PatchTable& table = surface.patches();
    return faces_where(surface, [&](Index patch) {
        const PatchClass& c = table.class_of(patch);
        return c.kind == PatchKind::Gregory && c.n_sectors == 4;
    });
}

Grid::Grid(const FloatSurface& surface)
    : surface_(&surface),
      evaluator_(measured(
          [&] { return GridEvaluator<float>(surface.surface.evaluator(), kGridRate); },
          bytes_)) {
    bytes_ += surface.bytes;
}

Grid::Grid(const FloatSurface& surface, Index patch_class)
    : surface_(&surface),
      evaluator_(surface.surface.evaluator(), patch_class,
                 class_points(surface.surface.patches().classes()[patch_class])) {}

void Grid::evaluate(Arrays& out) const {
    SampleBuffers<float> buffers;
    buffers[0].data = &out.p[0].x;
    buffers[1].data = &out.du[0].x;
    buffers[2].data = &out.dv[0].x;
    evaluator_.evaluate(surface_->points, buffers);
}

Way Grid::in_cache() const {
    const auto run = [this] {
        evaluator_.for_each_block(surface_->points, [](const SampleBlock<float>& block) {
            benchmark::DoNotOptimize(block.values);
            benchmark::ClobberMemory();
        });
    };
    return {kOurs, "GridEvaluator", run, bytes_};
}

Way Grid::into_buffer() const {
    const std::size_t n = n_places();
    const auto out = std::make_shared<Arrays>();
    for (auto* v : {&out->p, &out->du, &out->dv})
        v->resize(n);
    return {kOurs, "GridEvaluator", [this, out] { evaluate(*out); }, bytes_};
}

std::vector<SurfaceJet<float>> Grid::evaluate_all() const {
    const std::size_t n = n_places();
    Arrays out;
    for (auto* v : {&out.p, &out.du, &out.dv})
        v->resize(n);
    evaluate(out);
    std::vector<SurfaceJet<float>> jets;
    for (std::size_t i = 0; i < n; ++i)
        jets.push_back({out.p[i], out.du[i], out.dv[i]});
    return jets;
}

std::vector<Place> class_places(const Surface& surface, Index patch_class) {
    // One place of each sector, from which the others follow: d(a, b)/d(u, v) is the same all
    // over the sector.
    const PatchTable& table = surface.patches();
    struct Known {
        Index face = kInvalidIndex;
        Vec2<double> uv;
        PatchPoint at;
    };
    std::vector<std::vector<Known>> known(table.n_patches());
    for (Index f = 0; f < surface.base().n_faces(); ++f) {
        // Off all lines between cells of the coarser levels.
        for (int k = 0; k < 64; ++k) {
            const Vec2<double> uv((k % 8 + 0.5) / 8, (k / 8 + 0.5) / 8);
            const PatchPoint at = table.locate(Address{f, uv.x, uv.y});
            if (table.patch(at.patch).patch_class != patch_class)
                continue;
            known[at.patch].resize(
                static_cast<std::size_t>(table.class_of(at.patch).n_sectors));
            known[at.patch][at.sector] = {f, uv, at};
        }
    }
    const auto points = class_points(table.classes()[patch_class]);
    std::vector<Place> places;
    for (Index i = 0; i < table.n_patches(); ++i) {
        if (table.patch(i).patch_class != patch_class)
            continue;
        for (const DomainPoint& p : points) {
            if (known[i].empty() || known[i][p.sector].face == kInvalidIndex)
                return {};
            const Known& k = known[i][p.sector];
            const Vec2<double> d =
                turn(Vec2<double>(p.a - k.at.a, p.b - k.at.b), -k.at.quarter_turns);
            places.push_back({k.face, static_cast<float>(k.uv.x + d.x / k.at.scale),
                              static_cast<float>(k.uv.y + d.y / k.at.scale)});
        }
    }
    return places;
}

namespace {

std::vector<PatchPoint> located(const Surface& surface, std::span<const Place> places) {
    std::vector<PatchPoint> found;
    for (const Place& p : places)
        found.push_back(surface.patches().locate(Address{p.face, p.u, p.v}));
    return found;
}

}  // namespace

SampleWay our_points(const FloatSurface& surface, std::span<const Place> places) {
    const auto evaluate = [&surface, found = located(surface.surface, places)](
                              std::size_t first, std::size_t last, float* out) {
        const std::span<const Vec3<float>> points(surface.points);
        for (std::size_t i = first; i < last; ++i, out += 9)
            write(surface.surface.evaluator().evaluate<float, 1>(points, found[i]), out);
    };
    return {kOurs, "Evaluator", 9, evaluate, {}, surface.bytes};
}

SampleWay our_points_by_patch(const FloatSurface& surface,
                              std::span<const Place> places) {
    const auto evaluate = [&surface, found = located(surface.surface, places)](
                              std::size_t first, std::size_t last, float* out) {
        constexpr std::size_t kMost = 64;
        const std::span<const Vec3<float>> points(surface.points);
        std::array<SurfaceJet<float>, kMost> jets;
        for (std::size_t i = first; i < last;) {
            std::size_t n = 1;
            while (n < kMost && i + n < last && found[i + n].patch == found[i].patch)
                ++n;
            surface.surface.evaluator().evaluate_many<float, 1>(
                points, std::span(found).subspan(i, n), Chart::BaseUV,
                std::span(jets).first(n));
            for (std::size_t k = 0; k < n; ++k, out += 9)
                write(jets[k], out);
            i += n;
        }
    };
    return {kOurs, "Evaluator, by patch", 9, evaluate, {}, surface.bytes};
}

}  // namespace osdx::bench
