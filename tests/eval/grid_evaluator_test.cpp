// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <osdx/build_patch_table.h>
#include <osdx/evaluator.h>
#include <osdx/grid_evaluator.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "tests/support/instruction_sets.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using namespace test;

Surface surface_of(const MeshData& mesh, const PatchTableOptions& options = {}) {
    auto s = Surface::build(mesh, options);
    EXPECT_TRUE(s) << (s ? "" : s.error().message);
    return std::move(*s);
}

template <class T>
std::vector<Vec3<T>> points_of(const Surface& s) {
    return {s.points().begin(), s.points().end()};
}

/// The samples of a unit, by the addresses that the header names.
std::vector<PatchPoint> samples_of_face(const PatchTable& table, Index face, int rate) {
    std::vector<PatchPoint> samples;
    const Topology& base = table.base();
    if (!table.has_surface(face))
        return samples;
    if (base.face_size(face) == 4) {
        for (int j = 0; j <= rate; ++j) {
            for (int i = 0; i <= rate; ++i)
                samples.push_back(
                    table.locate(Address{face, double(i) / rate, double(j) / rate}));
        }
        return samples;
    }
    for (Index h = base.face_offsets[face]; h < base.face_offsets[face + 1]; ++h) {
        for (int j = 0; j <= rate / 2; ++j) {
            for (int i = 0; i <= rate / 2; ++i)
                samples.push_back(
                    table.locate(QuarterPoint{h, 2.0 * i / rate, 2.0 * j / rate}));
        }
    }
    return samples;
}

/// Values of all samples in the layout of arrays of structures, by derivative.
template <class T>
struct Values {
    std::vector<T> of[6];
    SampleBuffers<T> buffers;

    explicit Values(const GridEvaluator<T>& grid) {
        for (int r = 0; r < n_derivatives(grid.order()); ++r) {
            of[r].assign(3 * grid.n_samples(), std::numeric_limits<T>::quiet_NaN());
            buffers[r].data = of[r].data();
        }
    }
};

template <class T>
Values<T> evaluate(const GridEvaluator<T>& grid, std::span<const Vec3<T>> points) {
    Values<T> values(grid);
    grid.evaluate(points, values.buffers);
    return values;
}

/// Bounds of the errors, over the rounding of T and the size of the sum: the largest sum over the
/// control points of |weight| |point|, of this derivative and of those before.
///
/// In float the sums of products err by a few. In double the weights do as well, since other
/// sectors stand for the same points and places (a, b) differ by an ulp: by tens. Second
/// derivatives beside borders are those of PatchBasis::axis_place: Newton's method ends at some
/// 1e-16, which 1/slope^2 multiplies, up to 1e5 at pinned vertices.
template <class T>
double relative_bound(const PatchClass& c, int r) {
    if (std::is_same_v<T, float>)
        return 16;
    return r < 3 ? 128 : c.is_open() ? 1e6 : 512;
}

template <class T>
void expect_values(const GridEvaluator<T>& grid, const Surface& surface,
                   const std::vector<PatchPoint>& samples, Chart border_chart) {
    const std::vector<Vec3<T>> points = points_of<T>(surface);
    const Values<T> values = evaluate<T>(grid, points);
    const Evaluator& e = surface.evaluator();
    ASSERT_EQ(grid.n_samples(), samples.size());
    std::vector<double> w;
    for (std::size_t s = 0; s < samples.size(); ++s) {
        const PatchClass& c = e.table().class_of(samples[s].patch);
        const auto n = static_cast<std::size_t>(c.n_points());
        w.assign(n_derivatives(2) * n, 0.0);
        const Chart chart = c.is_open() ? border_chart : Chart::BaseUV;
        e.weights(samples[s], 2, chart, w);
        const auto indices = surface.patches().patch(samples[s].patch).points;
        // At a pinned centre the surface is a cone, without second derivatives.
        const bool cone =
            c.border == PatchBorder::Pinned && samples[s].a + samples[s].b < 1e-8;
        for (int r = 0;
             r < n_derivatives(cone ? std::min(grid.order(), 1) : grid.order()); ++r) {
            double largest = 0;  // of the weights of this derivative and of those before
            Vec3<double> sum(0);
            for (std::size_t k = 0; k < n; ++k)
                sum += w[r * n + k] * surface.points()[indices[k]];
            for (int q = 0; q <= r; ++q) {
                double size = 0;
                for (std::size_t k = 0; k < n; ++k)
                    size += std::abs(w[q * n + k]) *
                            glm::length(surface.points()[indices[k]]);
                largest = std::max(largest, size);
            }
            for (int k = 0; k < 3; ++k) {
                const double tolerance =
                    relative_bound<T>(c, r) * std::numeric_limits<T>::epsilon() * largest;
                ASSERT_NEAR(values.of[r][3 * s + k], sum[k], tolerance)
                    << "sample " << s << ", derivative " << r << ", a " << samples[s].a
                    << ", b " << samples[s].b << ", kind " << int(c.kind) << ", border "
                    << int(c.border) << ", n " << c.n_sectors;
            }
        }
    }
}

std::vector<PatchPoint> all_samples(const Surface& s, int rate) {
    std::vector<PatchPoint> all;
    for (Index f = 0; f < s.base().n_faces(); ++f) {
        const auto samples = samples_of_face(s.patches(), f, rate);
        all.insert(all.end(), samples.begin(), samples.end());
    }
    return all;
}

template <class T>
class GridEvaluatorOf : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(GridEvaluatorOf, Scalars);

/// Every kind of patch, with and without tables.
template <class T>
void expect_mesh(const NamedMesh& mesh, const PatchTableOptions& patches, int rate,
                 int order) {
    SCOPED_TRACE(testing::Message() << mesh.name << ", degree " << patches.degree
                                    << ", rate " << rate << ", order " << order);
    const Surface s = surface_of(mesh.data, patches);
    const auto samples = all_samples(s, rate);
    // Tables for all, for what comes often, for none.
    for (const Index uses : {1u, 3u, 1000000u}) {
        const GridEvaluator<T> grid(s.evaluator(), rate,
                                    {.order = order, .min_table_uses = uses});
        EXPECT_EQ(grid.n_units(), s.base().n_faces());
        if (uses == 1) {
            EXPECT_EQ(grid.n_single_samples(), 0u);
        } else if (uses == 1000000) {
            EXPECT_EQ(grid.n_single_samples(), grid.n_samples());
            EXPECT_EQ(grid.table_bytes(), 0u);
        }
        expect_values<T>(grid, s, samples, Chart::BaseUV);
        if (testing::Test::HasFatalFailure())
            return;
    }
}

TYPED_TEST(GridEvaluatorOf, ClosedMeshesEqualSinglePoints) {
    int k = 0;
    for (const NamedMesh& m : closed_meshes()) {
        for (const int degree : {2, 3, 5}) {
            expect_mesh<TypeParam>(m, {.degree = degree}, 1 + k % 9, k % 3);
            ++k;
        }
    }
}

TYPED_TEST(GridEvaluatorOf, OpenMeshesEqualSinglePoints) {
    int k = 0;
    for (const NamedMesh& m : open_meshes()) {
        for (const int degree : {3, 4}) {
            if (m.data.face_sizes.size() < 200)
                expect_mesh<TypeParam>(m, {.degree = degree}, 1 + k % 8, k % 3);
            ++k;
        }
    }
}

TYPED_TEST(GridEvaluatorOf, CreasedMeshesEqualSinglePoints) {
    int k = 0;
    for (const auto& meshes : {creased_meshes(), semi_sharp_meshes()}) {
        for (const NamedMesh& m : meshes) {
            expect_mesh<TypeParam>(m, {.degree = 2 + k % 2}, 1 + k % 8, k % 3);
            ++k;
        }
    }
}

TYPED_TEST(GridEvaluatorOf, GregoryPatchesEqualSinglePoints) {
    int k = 0;
    for (const auto& meshes : {closed_meshes(), open_meshes()}) {
        for (const NamedMesh& m : meshes) {
            if (m.data.face_sizes.size() < 200)
                expect_mesh<TypeParam>(
                    m, {.family = PatchFamily::Gregory, .gregory = {.levels = k % 2}},
                    1 + k % 8, k % 3);
            ++k;
        }
    }
}

TYPED_TEST(GridEvaluatorOf, HighDegreesEqualSinglePoints) {
    for (const int degree : {6, 7, 9, kMaxDegree})
        expect_mesh<TypeParam>({"pole(5)", pole(5, 3)}, {.degree = degree}, 4,
                               degree % 3);
}

TYPED_TEST(GridEvaluatorOf, LargeRatesEqualSinglePoints) {
    for (const int rate : {17, 32, 61})
        expect_mesh<TypeParam>({"prism(5)", prism(5)}, {}, rate, 1);
}

/// Rows that are cut into vectors in all ways, of regular patches and others.
TYPED_TEST(GridEvaluatorOf, EveryInstructionSetEqualsSinglePoints) {
    for_each_target([] {
        for (const int rate : thinned<int>({2, 3, 7, 8})) {
            for (const int order : {0, 1, 2}) {
                expect_mesh<TypeParam>({"pole(5)", pole(5, 3)}, {}, rate, order);
                expect_mesh<TypeParam>({"prism(5)", prism(5)}, {.degree = 4}, rate,
                                       order);
                expect_mesh<TypeParam>({"pole(3)", pole(3, 4)}, {.degree = 5 + rate % 3},
                                       rate, order);
            }
        }
    });
}

/// A pole of 360 sectors: its tables are those of one.
TEST(GridEvaluator, SectorsShareTables) {
    const auto bytes = [](Index n) {
        const Surface s = surface_of(pole(n, 2));
        return GridEvaluator<double>(s.evaluator(), 4).table_bytes();
    };
    // By the number of control points, 3/2 of it by the larger of the two.
    EXPECT_LT(5 * bytes(90), 8 * bytes(60));
}

/// At borders normals exist where (u, v) is singular, at smooth border vertices of one face.
TYPED_TEST(GridEvaluatorOf, NativeChartsAtBordersGiveNormals) {
    using T = TypeParam;
    int n_singular = 0;
    for (const NamedMesh& m : open_meshes()) {
        if (m.data.face_sizes.size() > 100)
            continue;
        SCOPED_TRACE(m.name);
        const Surface s = surface_of(m.data);
        const auto samples = all_samples(s, 4);
        for (const Index uses : {1u, 1000000u}) {
            const GridEvaluator<T> grid(
                s.evaluator(), 4,
                {.order = 2, .native_at_borders = true, .min_table_uses = uses});
            expect_values<T>(grid, s, samples, Chart::Native);
            const Values<T> v = evaluate<T>(grid, points_of<T>(s));
            for (std::size_t k = 0; k < samples.size(); ++k) {
                const auto at = [&](int r) {
                    return Vec3<T>(v.of[r][3 * k], v.of[r][3 * k + 1],
                                   v.of[r][3 * k + 2]);
                };
                SurfaceJet<T> jet;
                jet.du = at(1);
                jet.dv = at(2);
                ASSERT_NE(normal(jet), Vec3<T>(0)) << "sample " << k;
                n_singular += normal(s.evaluator().evaluate<double>(
                                  s.points(), samples[k])) == Vec3<double>(0);
            }
        }
    }
    EXPECT_GT(n_singular, 0);
}

// ------------------------------------------------------------------------------- outputs

/// Regular and other patches, faces of all kinds, a hole.
Surface mixed_surface() {
    MeshData mesh = pole(5, 3);
    mesh.tags.push_back({"hole", {3}, {}, {}, 0});
    return surface_of(mesh);
}

TYPED_TEST(GridEvaluatorOf, LayoutsAreEqualToTheBit) {
    using T = TypeParam;
    // Low and high degrees, which are summed in ways of their own in the one layout.
    const std::pair<NamedMesh, int> meshes[] = {{{"pole(5)", pole(5, 3)}, 3},
                                                {{"prism(7)", prism(7)}, 3},
                                                {{"pole(4)", pole(4, 5)}, 5},
                                                {{"pole(3)", pole(3, 5)}, 6}};
    for (const auto& [m, degree] : meshes) {
        const Surface s = surface_of(m.data, {.degree = degree});
        const std::vector<Vec3<T>> points = points_of<T>(s);
        for (int order = 0; order <= 2; ++order) {
            for (const int rate : {1, 3, 4, 7, 8}) {
                SCOPED_TRACE(testing::Message()
                             << m.name << ", order " << order << ", rate " << rate);
                const GridEvaluator<T> grid(s.evaluator(), rate, {.order = order});
                const Values<T> expected = evaluate<T>(grid, points);
                const std::size_t n = grid.n_samples();
                const auto expect = [&](std::ptrdiff_t sample, std::ptrdiff_t channel,
                                        std::size_t size) {
                    // Guards around what is to be written.
                    constexpr std::size_t kGuard = 64;
                    const T guard = T(12345);
                    std::vector<T> memory[6];
                    SampleBuffers<T> out;
                    for (int r = 0; r < n_derivatives(order); ++r) {
                        memory[r].assign(size + 2 * kGuard, guard);
                        out[r] = {memory[r].data() + kGuard, sample, channel};
                    }
                    grid.evaluate(points, out);
                    for (int r = 0; r < n_derivatives(order); ++r) {
                        for (std::size_t k = 0; k < n; ++k) {
                            for (int c = 0; c < 3; ++c) {
                                T& value = memory[r][kGuard + k * sample + c * channel];
                                ASSERT_EQ(value, expected.of[r][3 * k + c])
                                    << "sample " << k << ", derivative " << r;
                                value = guard;
                            }
                        }
                        EXPECT_EQ(std::ranges::count(memory[r], guard),
                                  std::ptrdiff_t(memory[r].size()));
                    }
                };
                expect(3, 1, 3 * n);                               // structures
                expect(1, static_cast<std::ptrdiff_t>(n), 3 * n);  // arrays
                expect(1, static_cast<std::ptrdiff_t>(n) + 5, 3 * n + 10);
                expect(4, 1, 4 * n);
                expect(7, 2, 7 * n);
            }
        }
    }
}

TYPED_TEST(GridEvaluatorOf, BlocksAndStreamsAreEqualToTheBit) {
    using T = TypeParam;
    const Surface s = mixed_surface();
    const std::vector<Vec3<T>> points = points_of<T>(s);
    const GridEvaluator<T> grid(s.evaluator(), 5, {.order = 2});
    const Values<T> expected = evaluate<T>(grid, points);
    EXPECT_EQ(grid.first_sample(4), grid.first_sample(3));  // the hole
    EXPECT_EQ(grid.first_sample(grid.n_units()), grid.n_samples());
    for (const std::size_t bytes : {1u, 5000u, 100000000u}) {
        const GridEvaluator<T> blocks(
            s.evaluator(), 5, {.order = 2, .block_bytes = bytes, .stream_bytes = 0});
        const Values<T> streamed = evaluate<T>(blocks, points);
        std::vector<int> n_calls(grid.n_units(), 0);
        blocks.for_each_block(points, [&](const SampleBlock<T>& b) {
            for (Index u = b.first_unit; u < b.first_unit + b.n_units; ++u)
                ++n_calls[u];
            EXPECT_EQ(b.first_sample, blocks.first_sample(b.first_unit));
            EXPECT_EQ(b.first_sample + b.n_samples,
                      blocks.first_sample(b.first_unit + b.n_units));
            for (int r = 0; r < 6; ++r) {
                EXPECT_TRUE(std::equal(b.values[r], b.values[r] + 3 * b.n_samples,
                                       expected.of[r].data() + 3 * b.first_sample));
            }
        });
        EXPECT_EQ(n_calls, std::vector<int>(grid.n_units(), 1));
        for (int r = 0; r < 6; ++r)
            EXPECT_EQ(streamed.of[r], expected.of[r]);
    }
}

TYPED_TEST(GridEvaluatorOf, DoesNotDependOnTheNumberOfThreads) {
    using T = TypeParam;
    const Surface s = surface_of(pole(7, 6, 9));
    const std::vector<Vec3<T>> points = points_of<T>(s);
    const auto values = [&](std::size_t n_threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        n_threads);
        const GridEvaluator<T> grid(s.evaluator(), 6, {.block_bytes = 1});
        return evaluate<T>(grid, points);
    };
    const Values<T> one = values(1), two = values(2);
    for (int r = 0; r < 3; ++r)
        EXPECT_EQ(one.of[r], two.of[r]);
}

TYPED_TEST(GridEvaluatorOf, TablesKeepTheirBound) {
    using T = TypeParam;
    const Surface s = mixed_surface();
    const auto samples = all_samples(s, 6);
    const std::size_t all = GridEvaluator<T>(s.evaluator(), 6).table_bytes();
    std::size_t last = 1;
    for (const std::size_t bound : {std::size_t(0), all / 20, all / 3, all}) {
        const GridEvaluator<T> grid(s.evaluator(), 6, {.max_table_bytes = bound});
        EXPECT_LE(grid.table_bytes(), bound);
        EXPECT_GE(grid.table_bytes() + 1, last);
        last = grid.table_bytes();
        EXPECT_EQ(grid.n_single_samples() == 0, bound == all);
        expect_values<T>(grid, s, samples, Chart::BaseUV);
    }
}

TEST(GridEvaluator, OfHolesOnlyIsEmpty) {
    MeshData mesh = cube();
    for (int f = 0; f < 6; ++f)
        mesh.tags.push_back({"hole", {f}, {}, {}, 0});
    const Surface s = surface_of(mesh);
    const GridEvaluator<double> grid(s.evaluator(), 3);
    EXPECT_EQ(grid.n_units(), 6u);
    EXPECT_EQ(grid.n_samples(), 0u);
    evaluate<double>(grid, points_of<double>(s));
    grid.for_each_block(s.points(),
                        [](const SampleBlock<double>& b) { EXPECT_EQ(b.n_samples, 0u); });
}

// ------------------------------------------------------------------------ patches of a class

TYPED_TEST(GridEvaluatorOf, PatchesOfAClassEqualSinglePoints) {
    using T = TypeParam;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    for (const bool gregory : {false, true}) {
        for (const MeshData& mesh :
             {pole(5, 2), truncated_icosahedron(), border_fan(3)}) {
            const Surface s = surface_of(
                mesh,
                {.family = gregory ? PatchFamily::Gregory : PatchFamily::Multisided});
            const PatchTable& table = s.patches();
            for (Index c = 0; c < table.classes().size(); ++c) {
                const PatchClass& patch_class = table.classes()[c];
                std::vector<DomainPoint> points;
                for (int k = 0; k < 37; ++k) {
                    const int sector =
                        patch_class.is_square()
                            ? 0
                            : static_cast<int>(random() % patch_class.n_sectors);
                    points.push_back({sector, unit(random), unit(random)});
                }
                std::vector<PatchPoint> samples;
                Index n = 0;
                for (Index p = 0; p < table.n_patches(); ++p) {
                    if (table.patch(p).patch_class != c)
                        continue;
                    ++n;
                    for (const DomainPoint& at : points)
                        samples.push_back(
                            {p, static_cast<Index>(at.sector), at.a, at.b, 0, 1.0});
                }
                for (const Index uses : {1u, 1000000u}) {
                    const GridEvaluator<T> grid(s.evaluator(), c, points,
                                                {.order = 2, .min_table_uses = uses});
                    EXPECT_EQ(grid.n_units(), n);
                    expect_values<T>(grid, s, samples, Chart::BaseUV);
                }
            }
        }
    }
}

}  // namespace
}  // namespace osdx
