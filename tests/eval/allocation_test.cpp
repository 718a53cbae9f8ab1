// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <new>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/evaluator.h>
#include <osdx/face_varying_surface.h>
#include <osdx/grid_evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "eval/bases/generalised_bezier.h"
#include "eval/bases/gregory.h"
#include "tests/support/test_meshes.h"

namespace {
std::atomic<long> n_allocations = 0;
}

// Every allocation of this program is counted. Inlined, they look to the compiler as if new and
// free were mixed.
[[gnu::noinline]] void* operator new(std::size_t size) {
    ++n_allocations;
    if (void* p = std::malloc(size))
        return p;
    throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    ++n_allocations;
    return std::malloc(size);
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t align) {
    ++n_allocations;
    const std::size_t a = static_cast<std::size_t>(align);
    if (void* p = std::aligned_alloc(a, (size + a - 1) / a * a))
        return p;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p, std::align_val_t) noexcept {
    std::free(p);
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
    std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}

namespace osdx {
namespace {

using namespace test;

TEST(Queries, DoNotAllocate) {
    for (const int degree : {2, 3, 4, 9}) {
        // Borders have patches with corrections of their own.
        for (const MeshData& mesh :
             {pole(5), pole(360), border_fan(1), border_fan(4), border_fan(200)}) {
            const auto s = Surface::build(mesh, {.degree = degree});
            ASSERT_TRUE(s) << s.error().message;
            const Evaluator& e = s->evaluator();
            const std::vector<Vec3<float>> floats(s->points().begin(), s->points().end());
            std::vector<double> channels(std::size_t(s->patches().n_points()) * 5, 1.0);
            std::vector<double> out(5 * n_derivatives(2));
            int most = 0;
            for (Index i = 0; i < s->patches().n_patches(); ++i)
                most = std::max(most, s->patches().class_of(i).n_points());
            std::vector<double> weights(std::size_t(most) * n_derivatives(2));

            const long before = n_allocations;
            double sum = 0;
            const Index step = std::max<Index>(1, s->base().n_faces() / 50);
            for (Index f = 0; f < s->base().n_faces(); f += step) {
                const Address at{f, 0.3, 0.8};
                const PatchPoint p = s->patches().locate(at);
                sum += s->evaluate(at).p.x + s->evaluate(at, Chart::Native).du.x;
                sum += e.evaluate<float>(std::span<const Vec3<float>>(floats), at).p.x;
                std::array<PatchPoint, 9> places;
                places.fill(p);
                std::array<SurfaceJet<double>, 9> jets;
                e.evaluate_many<double>(s->points(), places, Chart::BaseUV, jets);
                sum += jets[8].p.x;
                e.evaluate_channels<double>(channels, 5, p, 2, Chart::BaseUV, out);
                const auto n =
                    static_cast<std::size_t>(s->patches().class_of(p.patch).n_points());
                e.weights(p, 2, Chart::BaseUV,
                          std::span(weights).first(n * n_derivatives(2)));
            }
            EXPECT_EQ(n_allocations, before)
                << "degree " << degree << ", " << mesh.positions.size() << " vertices";
            EXPECT_TRUE(std::isfinite(sum));
        }
    }
}

TEST(Queries, OfFaceVaryingChannelsDoNotAllocate) {
    const MeshData mesh = prism(7);
    const auto s = Surface::build(mesh);
    ASSERT_TRUE(s) << s.error().message;
    const std::vector<double> values(5 * mesh.positions.size(), 1.0);
    for (const FaceVaryingRule rule : {FaceVaryingRule::All, FaceVaryingRule::None}) {
        const auto f = FaceVaryingSurface::build(
            *s,
            {"", mesh.face_vertices, static_cast<Index>(mesh.positions.size()), rule});
        ASSERT_TRUE(f) << f.error().message;
        const Buffer<double> points = f->values(channels(values.data(), 5));
        std::array<double, 5 * n_derivatives(2)> out;
        const long before = n_allocations;
        for (Index face = 0; face < s->base().n_faces(); ++face)
            f->evaluate(points, 5, Address{face, 0.3, 0.4}, 2, out);
        EXPECT_EQ(n_allocations, before);
    }
}

TEST(Queries, OfBezierAndGregoryPatchesDoNotAllocate) {
    for (const int n : {3, 4, 5, 40}) {
        const GregoryBasis gregory(n);
        const GeneralisedBezierBasis bezier(n, 7);
        const long before = n_allocations;
        double sum = 0;
        const auto add = [&](Index, const auto& w) { sum += w.c[0]; };
        for (const DomainPoint& p :
             {DomainPoint{0, 0.3, 0.8}, {1, 1, 1}, {2, 0.9999, 0.9998}}) {
            for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
                gregory.for_each_weight<0>(p, chart, add);
                gregory.for_each_weight<2>(p, chart, add);
                bezier.for_each_weight<2>(p, chart, add);
            }
            sum += gregory.from_native(gregory.to_native(p)).a;
        }
        EXPECT_EQ(n_allocations, before) << "n " << n;
        EXPECT_TRUE(std::isfinite(sum));
    }
}

// Scratch memory is that of the threads, whatever the number of faces.
TEST(Queries, GridsAllocateForThreadsOnly) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    for (const Index n : {4u, 40u}) {
        const auto s = Surface::build(pole(5, n));
        ASSERT_TRUE(s) << s.error().message;
        const GridEvaluator<double> grid(s->evaluator(), 4);
        std::vector<double> values[3];
        SampleBuffers<double> out;
        for (int r = 0; r < 3; ++r) {
            values[r].resize(3 * grid.n_samples());
            out[r].data = values[r].data();
        }
        const std::function<void(const SampleBlock<double>&)> f = [](const auto&) {};
        grid.evaluate(s->points(), out);  // starts the threads
        const long before = n_allocations;
        grid.evaluate(s->points(), out);
        grid.for_each_block(s->points(), f);
        // Three arrays each, and some for the threads' own.
        EXPECT_LE(n_allocations, before + 16) << n;
        EXPECT_GE(n_allocations, before + 3) << n;
    }
}

// The counter works.
TEST(Queries, AllocationsAreCounted) {
    const long before = n_allocations;
    const auto p = std::make_unique<std::vector<int>>(100);
    EXPECT_EQ(n_allocations, before + 2);
    EXPECT_EQ(p->size(), 100u);
}

}  // namespace
}  // namespace osdx
