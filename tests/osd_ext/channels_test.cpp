// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/evaluate_addresses.h>
#include <osdx/evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/threads.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

// Data as integrators have them: arrays with strides, any number of channels, many addresses.

namespace osdx::test {
namespace {

/// Arrays of a modelling tool: vertices with more than positions, features by index.
template <class T>
struct Arrays {
    static constexpr int kStride = 5;
    std::vector<T> vertices;
    std::vector<Index> creases, corners, holes;
    std::vector<float> crease_sharpness, corner_sharpness;
    MeshView view;

    /// \pre creases of the mesh are tags of one edge, corners of one vertex
    explicit Arrays(const MeshData& mesh) : view(mesh.view()) {
        for (const auto& p : mesh.positions) {
            for (const double x : {p.x, p.y, p.z, -1.0, -2.0})
                vertices.push_back(static_cast<T>(x));
        }
        for (const Tag& tag : mesh.tags) {
            if (tag.name == "crease") {
                creases.insert(creases.end(), tag.ints.begin(), tag.ints.end());
                crease_sharpness.push_back(static_cast<float>(tag.floats[0]));
            } else if (tag.name == "corner") {
                corners.push_back(static_cast<Index>(tag.ints[0]));
                corner_sharpness.push_back(static_cast<float>(tag.floats[0]));
            } else if (tag.name == "hole") {
                holes.push_back(static_cast<Index>(tag.ints[0]));
            }
        }
        view.creases = creases;
        view.crease_sharpness = crease_sharpness;
        view.corners = corners;
        view.corner_sharpness = corner_sharpness;
        view.holes = holes;
        const Features f = features_of(mesh);
        view.boundary = f.boundary;
        view.crease_method = f.creases;
        view.smooth_triangles = f.smooth_triangles;
    }

    Channels<const T> positions() const { return {vertices.data(), kStride, 3}; }
};

std::vector<NamedMesh> all_meshes() {
    std::vector<NamedMesh> all;
    for (const auto& meshes :
         {closed_meshes(), open_meshes(), creased_meshes(), semi_sharp_meshes()})
        all.insert(all.end(), meshes.begin(), meshes.end());
    return thinned(all);
}

TEST(MeshView, MakesTheSurfaceOfTheFile) {
    for (const auto& [name, mesh] : all_meshes()) {
        SCOPED_TRACE(name);
        for (const int d : {2, 3}) {
            const auto file = Surface::build(mesh, {.degree = d});
            const Arrays<double> arrays(mesh);
            const auto s = Surface::build(arrays.view, arrays.positions(), {.degree = d});
            ASSERT_EQ(s.has_value(), file.has_value());
            if (!file)
                continue;
            EXPECT_TRUE(s->patches() == file->patches());
            EXPECT_TRUE(std::ranges::equal(s->points(), file->points()));
            const Arrays<float> narrow(mesh);
            const auto f = Surface::build(narrow.view, narrow.positions(), {.degree = d});
            ASSERT_TRUE(f);
            EXPECT_TRUE(f->patches() == file->patches());
            EXPECT_EQ(f->points()[0].x, double(float(mesh.positions[0].x)));
        }
    }
}

void expect_refused(const MeshView& view, Channels<const double> positions,
                    ErrorCode code, Index element, const std::string& words) {
    const auto s = Surface::build(view, positions);
    ASSERT_FALSE(s) << words;
    EXPECT_EQ(s.error().code, code) << s.error().message;
    EXPECT_EQ(s.error().element, element);
    EXPECT_NE(s.error().message.find(words), std::string::npos) << s.error().message;
}

TEST(MeshView, IsRefusedWithTheElement) {
    const MeshData mesh = cube();
    const auto positions = channels(mesh.positions.data());
    const MeshView good = mesh.view();
    ASSERT_TRUE(Surface::build(good, positions));

    MeshView view = good;
    const Index a = mesh.face_vertices[0], b = mesh.face_vertices[1],
                c = mesh.face_vertices[2];
    const std::vector<Index> two_edges = {a, b, a, c};
    const std::vector<float> sharp = {3, 3}, nan = {3, std::nanf("")};
    view.creases = two_edges;
    expect_refused(view, positions, ErrorCode::SizeMismatch, kInvalidIndex,
                   "0 sharpnesses were given for 2 creases");
    view.crease_sharpness = sharp;
    expect_refused(view, positions, ErrorCode::InvalidFeature, 1, "share no edge");
    view.crease_sharpness = nan;
    expect_refused(view, positions, ErrorCode::InvalidFeature, 1, "is not a number");
    view.creases = std::span(two_edges).first(3);
    expect_refused(view, positions, ErrorCode::SizeMismatch, kInvalidIndex, "have two");

    view = good;
    const std::vector<Index> far_away = {7, 8};
    view.corners = far_away;
    view.corner_sharpness = sharp;
    expect_refused(view, positions, ErrorCode::InvalidFeature, 1, "vertex 8");
    view = good;
    view.holes = far_away;
    expect_refused(view, positions, ErrorCode::InvalidFeature, 0, "face 7");
    view = good;
    view.n_vertices = 7;
    expect_refused(view, positions, ErrorCode::IndexOutOfRange, 1, "names vertex 7");

    auto moved = mesh.positions;
    moved[5].y = std::numeric_limits<double>::infinity();
    expect_refused(good, channels(moved.data()), ErrorCode::NonFinitePoint, 5,
                   "vertex 5");
    expect_refused(good, {&moved[0].x, 3, 2}, ErrorCode::SizeMismatch, kInvalidIndex,
                   "positions have 3 channels, not 2");
}

/// Inside of faces, on their edges and corners, and where quarters meet.
std::vector<Address> random_addresses(const Surface& s, std::size_t n, unsigned seed) {
    std::mt19937 random(seed);
    const auto number = [&] {
        const double x = double(random() >> 8) * 0x1p-24;
        return random() % 4 == 0 ? std::round(x) : x;
    };
    std::vector<Address> all;
    while (all.size() < n) {
        const auto face = static_cast<Index>(random() % s.base().n_faces());
        const auto corner = static_cast<Index>(s.base().face_offsets[face] +
                                               random() % s.base().face_size(face));
        if (s.patches().has_surface(face))
            all.push_back(to_address(s.base(), {corner, number(), number()}));
    }
    return all;
}

/// Channels at the vertices that have nothing to do with each other.
template <class T>
std::vector<T> random_channels(std::size_t n, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<T> values(n);
    for (T& x : values)
        x = static_cast<T>(double(random()) / 0x1p32);
    return values;
}

template <class T>
void expect_as_single_calls(const Surface& s, int n_channels, int order, Chart chart) {
    const Index n = s.base().n_vertices();
    const auto vertices = random_channels<T>(std::size_t(n) * n_channels, 1);
    const auto values = s.values(channels(vertices.data(), n_channels));
    // The first 17 many times, so that patches have several and one.
    auto where = random_addresses(s, 60, 2);
    for (int i = 0; i < 300; ++i)
        where.push_back(where[(i * i) % 17]);
    const int width = n_derivatives(order) * n_channels, stride = width + 3;
    std::vector<T> out(where.size() * stride, T(7)), one(width);
    const AddressReport report =
        s.evaluate(values, n_channels, where, order, {out.data(), stride, width}, chart);
    EXPECT_EQ(report.n_clamped, 0u);
    EXPECT_EQ(report.n_without_point, 0u);
    EXPECT_EQ(report.first_without_point, SIZE_MAX);
    // Sums of some hundred terms, at most; second derivatives are differences of those over
    // the square of a patch, and in BaseUV of what may be turned by charts nearly singular.
    const T eps = std::numeric_limits<T>::epsilon();
    const T tolerance[3] = {64 * eps, 1024 * eps, 65536 * eps};
    for (std::size_t i = 0; i < where.size(); ++i) {
        s.evaluator().evaluate_channels<T>(
            values, n_channels, s.patches().locate(where[i]), order, chart, one);
        for (int k = 0; k < width; ++k) {
            const int r = k / n_channels, m = r > 2 ? 2 : r > 0;
            ASSERT_NEAR(out[i * stride + k], one[k],
                        tolerance[m] * (1 + std::abs(one[k])))
                << "address " << i << ", derivative " << r;
        }
        for (int k = width; k < stride; ++k)
            ASSERT_EQ(out[i * stride + k], T(7));
    }
}

TEST(ManyAddresses, AreAsSingleCalls) {
    for (const auto& [name, mesh] : all_meshes()) {
        if (name.starts_with("pole 64"))
            continue;  // 64 sides, whose derivatives have digits fewer: see below
        SCOPED_TRACE(name);
        for (const int d : {2, 3, 4}) {
            const auto s = Surface::build(mesh, {.degree = d});
            if (!s)
                continue;
            SCOPED_TRACE(d);
            // Of degree 2 second derivatives jump at spokes, where some of the addresses lie.
            expect_as_single_calls<double>(*s, 1, d == 2 ? 1 : 2, Chart::BaseUV);
            expect_as_single_calls<double>(*s, 3, 1, Chart::BaseUV);
            expect_as_single_calls<double>(*s, 11, d == 2 ? 1 : 2, Chart::Native);
            expect_as_single_calls<float>(*s, 7, 0, Chart::BaseUV);
        }
        const auto gregory =
            Surface::build(mesh, {.degree = 3, .family = PatchFamily::Gregory});
        if (gregory)
            expect_as_single_calls<double>(*gregory, 4, 1, Chart::BaseUV);
    }
}

TEST(ManyAddresses, HaveAnAnswerForEveryNumber) {
    MeshData mesh = without_faces(prism(5), {});
    mesh.tags.push_back({"hole", {1}, {}, {}, 0});
    const auto s = Surface::build(mesh);
    ASSERT_TRUE(s);
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = 1 / 0.0;
    const std::vector<Address> where = {{2, 0.5, 0.5},   {1, 0.5, 0.5}, {99, 0, 0},
                                        {2, nan, 0},     {2, 0, nan},   {2, -3, 0.5},
                                        {2, 0.5, 1e300}, {0, inf, 0},   {0, 0.7, 0.1}};
    std::vector<double> out(9 * where.size());
    const AddressReport report = s->evaluate(where, 1, channels(out.data(), 9));
    EXPECT_EQ(report.n_without_point, 4u);
    EXPECT_EQ(report.first_without_point, 1u);
    EXPECT_EQ(report.n_clamped, 4u);
    const std::vector<Address> instead = {{2, 0, 0.5}, {2, 0.5, 1}};
    for (std::size_t i = 0; i < where.size(); ++i) {
        const SurfaceJet<double> jet = s->evaluate(where[i]);
        for (int c = 0; c < 3; ++c) {
            if (i >= 1 && i < 5) {
                EXPECT_TRUE(std::isnan(out[9 * i + c]));
                EXPECT_TRUE(std::isnan(jet.p[c]));
                continue;
            }
            EXPECT_TRUE(std::isfinite(out[9 * i + c]));
            EXPECT_NEAR(out[9 * i + c], jet.p[c], 1e-14);
            if (i == 5 || i == 6) {
                EXPECT_NEAR(out[9 * i + c], s->evaluate(instead[i - 5]).p[c], 1e-14);
            }
        }
    }
    EXPECT_EQ(s->evaluate({}, 1, channels(out.data(), 9)).n_without_point, 0u);
}

TEST(ManyAddresses, AreTheSameForAnyNumberOfThreads) {
    const auto s = Surface::build(pole(5, 4, 8));
    ASSERT_TRUE(s);
    constexpr std::size_t kChunk = std::size_t(1) << 20, kNowhere = kChunk + 7;
    auto where = random_addresses(*s, kChunk + 30000, 3);  // two chunks
    where[kNowhere].face = s->base().n_faces();
    const auto evaluate = [&](int n_threads) {
        std::vector<double> out(3 * where.size());
        with_threads(n_threads, [&] {
            const auto report = s->evaluate(where, 0, channels(out.data(), 3));
            EXPECT_EQ(report.n_without_point, 1u);
            EXPECT_EQ(report.first_without_point, kNowhere);
        });
        EXPECT_TRUE(std::isnan(out[3 * kNowhere]));
        std::fill_n(&out[3 * kNowhere], 3, 0.0);
        return out;
    };
    const auto one = evaluate(1);
    EXPECT_TRUE(one == evaluate(3));
    // Nor on what else is evaluated.
    for (std::size_t i = 0; i < where.size(); i += 10007) {
        std::array<double, 3> alone;
        s->evaluate(std::span(where).subspan(i, 1), 0, channels(alone.data(), 3));
        EXPECT_TRUE(std::ranges::equal(alone, std::span(one).subspan(3 * i, 3)));
    }
}

TEST(Channels, FollowVerticesThatMove) {
    const MeshData mesh = random_displaced(double_torus(), 1, 0.1);
    auto s = Surface::build(mesh);
    ASSERT_TRUE(s);
    auto vertices = random_channels<float>(4 * mesh.positions.size(), 5);
    auto values = s->values(channels(vertices.data(), 4));
    const std::vector<Index> moved = {3, 17, 4};
    for (const Index v : moved)
        vertices[4 * v + 2] += 1;
    const auto change = s->dependents(moved);
    ASSERT_TRUE(change);
    EXPECT_LT(change->points.size(), s->patches().n_points() / 2);
    const Channels<const float> all = channels(vertices.data(), 4);
    s->refresh(all, *change, moved, values);
    EXPECT_EQ(values, s->values(all));
    EXPECT_FALSE(s->dependents(std::vector<Index>{Index(mesh.positions.size())}));
}

/// What the rows make of values at their columns.
std::vector<double> product(const StencilTable& rows, std::span<const double> values) {
    std::vector<double> out(rows.n_rows());
    for (Index r = 0; r < rows.n_rows(); ++r) {
        for (std::size_t k = rows.offsets[r]; k < rows.offsets[r + 1]; ++k)
            out[r] += rows.weights[k] * values[rows.indices[k]];
    }
    return out;
}

TEST(Weights, MakeTheValuesAndSumToOneOrZero) {
    for (const auto& [name, mesh] : all_meshes()) {
        if (name.starts_with("pole 64"))
            continue;
        SCOPED_TRACE(name);
        for (const int d : {2, 3}) {
            const auto s = Surface::build(mesh, {.degree = d});
            if (!s)
                continue;
            const auto where = random_addresses(*s, 40, 9);
            const auto vertices = random_channels<double>(mesh.positions.size(), 8);
            const auto values = s->values(channels(vertices.data(), 1));
            std::vector<double> out(6 * where.size());
            const int order = d == 2 ? 1 : 2, n = n_derivatives(order);  // as above
            s->evaluate(values, 1, where, order, channels(out.data(), n));
            for (const WeightsOf of :
                 {WeightsOf::BaseVertices, WeightsOf::ControlPoints}) {
                const WeightRows w =
                    weights_at(s->evaluator(), where, order, Chart::BaseUV, of);
                EXPECT_EQ(w.report.n_without_point, 0u);
                ASSERT_EQ(w.rows.n_rows(), n * where.size());
                const auto made = product(w.rows, of == WeightsOf::BaseVertices
                                                      ? std::span<const double>(vertices)
                                                      : std::span<const double>(values));
                for (std::size_t i = 0; i < made.size(); ++i) {
                    ASSERT_NEAR(made[i], out[i], 1e-10 * (1 + std::abs(out[i]))) << i;
                    double sum = 0, most = 0;
                    for (std::size_t k = w.rows.offsets[i]; k < w.rows.offsets[i + 1];
                         ++k) {
                        sum += w.rows.weights[k];
                        most = std::max(most, std::abs(w.rows.weights[k]));
                        ASSERT_TRUE(k == w.rows.offsets[i] ||
                                    w.rows.indices[k - 1] < w.rows.indices[k]);
                    }
                    ASSERT_NEAR(sum, i % n == 0 ? 1.0 : 0.0, 1e-13 * (1 + most)) << i;
                }
            }
            // Another way to them: from the last point back.
            std::vector<double> row(mesh.positions.size());
            s->add_base_weights(where[7], 1, 1.0, row);
            const WeightRows w =
                weights_at(s->evaluator(), std::span(where).subspan(7, 1), 1);
            for (std::size_t k = w.rows.offsets[1]; k < w.rows.offsets[2]; ++k)
                row[w.rows.indices[k]] -= w.rows.weights[k];
            for (const double x : row)
                ASSERT_NEAR(x, 0, 1e-12);
        }
    }
}

TEST(Weights, AreEmptyWhereThereIsNoPoint) {
    const auto s = Surface::build(cube());
    ASSERT_TRUE(s);
    const std::vector<Address> where = {{0, 0.5, 0.5}, {6, 0, 0}, {1, 0.1, 2}};
    const WeightRows w = weights_at(s->evaluator(), where, 1);
    ASSERT_EQ(w.rows.n_rows(), 9u);
    EXPECT_EQ(w.rows.offsets[3], w.rows.offsets[6]);
    EXPECT_GT(w.rows.offsets[7], w.rows.offsets[6]);
    EXPECT_EQ(w.report.n_without_point, 1u);
    EXPECT_EQ(w.report.first_without_point, 1u);
    EXPECT_EQ(w.report.n_clamped, 1u);
}

void expect_out_of_range(const Status& status, Index vertex) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::NonFinitePoint);
    EXPECT_EQ(status.error().element, vertex);
    EXPECT_NE(status.error().message.find("scale the mesh"), std::string::npos);
}

// Squares of lengths would be infinite or zero.
TEST(Surface, RefusesCoordinatesOutOfRange) {
    const MeshData mesh = cube();
    for (const double scale : {1e160, 1e-160}) {
        MeshData scaled = mesh;
        for (Vec3<double>& p : scaled.positions)
            p *= scale;
        const auto built = Surface::build(scaled);
        expect_out_of_range(built ? ok() : Status(built.error()), 0);
        auto s = Surface::build(mesh);
        ASSERT_TRUE(s);
        expect_out_of_range(s->set_positions(scaled.positions), 0);
        EXPECT_EQ(s->points()[0], mesh.positions[0]);
    }
    MeshData one_far = mesh;
    one_far.positions[5].y = -1e151;
    const auto built = Surface::build(one_far);
    expect_out_of_range(built ? ok() : Status(built.error()), 5);
    // Small details, and a point at the origin, are in range.
    MeshData point = mesh;
    for (Vec3<double>& p : point.positions)
        p *= 0;
    EXPECT_TRUE(Surface::build(point));
    point.positions[3] = {1, 1e-200, 0};
    EXPECT_TRUE(Surface::build(point));
}

TEST(Surface, WithoutSizeHasNoNormals) {
    MeshData mesh = cube();
    for (Vec3<double>& p : mesh.positions)
        p = {1, 2, 3};
    for (const PatchFamily family : {PatchFamily::Multisided, PatchFamily::Gregory}) {
        PatchTableOptions options;
        options.family = family;
        const auto s = Surface::build(mesh, options);
        ASSERT_TRUE(s);
        for (const Vec3<double>& n : s->tessellate(4).normals)
            EXPECT_EQ(n, Vec3<double>(0));
    }
}

TEST(Surface, ThatWasMovedFromHasNoFaces) {
    auto s = Surface::build(cube());
    ASSERT_TRUE(s);
    Surface other = std::move(*s);
    EXPECT_EQ(s->base().n_faces(), 0u);
    EXPECT_EQ(s->points().size(), 0u);
    EXPECT_TRUE(s->unused_vertices().empty());
    EXPECT_TRUE(std::isnan(s->evaluate({0, 0.5, 0.5}).p.x));
    EXPECT_EQ(s->tessellate(2).positions.size(), 0u);
    EXPECT_FALSE(s->set_positions(other.points().first(8)));
    EXPECT_FALSE(s->move_vertices({}, {}));
    s->add_base_weights({0, 0.5, 0.5}, 0, 1, {});
    *s = std::move(other);
    EXPECT_EQ(s->base().n_faces(), 6u);
}

TEST(Weights, AreNotAddedWhereNoneAreDefined) {
    const auto s = Surface::build(cube());
    ASSERT_TRUE(s);
    std::vector<double> weights(8, 0), few(3, 0);
    s->add_base_weights({6, 0.5, 0.5}, 0, 1, weights);
    s->add_base_weights({0, NAN, 0.5}, 0, 1, weights);
    s->add_base_weights({0, 0.5, 0.5}, 6, 1, weights);
    s->add_base_weights({0, 0.5, 0.5}, -1, 1, weights);
    s->add_base_weights({0, 0.5, 0.5}, 0, 1, few);
    EXPECT_EQ(weights, std::vector<double>(8, 0));
    EXPECT_EQ(few, std::vector<double>(3, 0));
}

TEST(Surface, TessellatesRatesBelowOneAsOne) {
    const auto s = Surface::build(cube());
    ASSERT_TRUE(s);
    for (const int rate : {0, -3})
        EXPECT_EQ(s->tessellate(rate).facet_sizes.size(), 6u);
}

}  // namespace
}  // namespace osdx::test
