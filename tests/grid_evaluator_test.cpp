// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/grid_evaluator.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "osd_ext/surface.h"
#include "tests/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

Surface surface_of(const MeshData& mesh, const SurfaceOptions& options = {}) {
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
        const PatchClass& c = e.basis(samples[s].patch).patch_class();
        const auto n = static_cast<std::size_t>(c.n_points());
        w.assign(n_derivatives(2) * n, 0.0);
        const Chart chart = c.is_open() ? border_chart : Chart::BaseUV;
        e.weights(samples[s], 2, chart, w);
        const auto indices = surface.patches().patch(samples[s].patch).points;
        for (int r = 0; r < n_derivatives(grid.order()); ++r) {
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
void expect_mesh(const NamedMesh& mesh, const SurfaceOptions& surface_options, int rate,
                 int order) {
    SCOPED_TRACE(testing::Message() << mesh.name << ", degree " << surface_options.degree
                                    << ", rate " << rate << ", order " << order);
    const Surface s = surface_of(mesh.data, surface_options);
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

TYPED_TEST(GridEvaluatorOf, ClosedMeshesEqualsSinglePoints) {
    int k = 0;
    for (const NamedMesh& m : closed_meshes()) {
        for (const int degree : {2, 3, 5}) {
            expect_mesh<TypeParam>(m, {.degree = degree}, 1 + k % 9, k % 3);
            ++k;
        }
    }
}

TYPED_TEST(GridEvaluatorOf, OpenMeshesEqualsSinglePoints) {
    int k = 0;
    for (const NamedMesh& m : open_meshes()) {
        for (const int degree : {3, 4}) {
            if (m.data.face_sizes.size() < 200)
                expect_mesh<TypeParam>(m, {.degree = degree}, 1 + k % 8, k % 3);
            ++k;
        }
    }
}

TYPED_TEST(GridEvaluatorOf, CreasedMeshesEqualsSinglePoints) {
    int k = 0;
    for (const auto& meshes : {creased_meshes(), semi_sharp_meshes()}) {
        for (const NamedMesh& m : meshes) {
            expect_mesh<TypeParam>(m, {.degree = 2 + k % 2}, 1 + k % 8, k % 3);
            ++k;
        }
    }
}

TYPED_TEST(GridEvaluatorOf, GregoryPatchesEqualsSinglePoints) {
    int k = 0;
    for (const auto& meshes : {closed_meshes(), open_meshes()}) {
        for (const NamedMesh& m : meshes) {
            if (m.data.face_sizes.size() < 200)
                expect_mesh<TypeParam>(m,
                                       {.family = PatchFamily::Gregory, .levels = k % 2},
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

}  // namespace
}  // namespace osdx
