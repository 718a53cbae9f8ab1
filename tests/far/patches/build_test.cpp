// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// What the number of threads may not change, and updates of a part.

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/build_patch_table.h>
#include <osdx/build_topology.h>
#include <osdx/dependents.h>
#include <osdx/patch_table.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "far/refine/refinement.h"
#include "tests/support/refine_support.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

using Point = Vec3<double>;

/// With creases, darts, holes and borders, and more elements than one task takes.
std::vector<test::NamedMesh> large_meshes() {
    std::vector<test::NamedMesh> meshes;
    meshes.push_back({"torus", test::torus(70, 60)});
    meshes.push_back({"pole", test::pole(5, 24, 20)});
    meshes.push_back({"face pole", test::face_pole(7, 24, 20)});
    MeshData grid = test::without_faces(test::grid(70, 60), {700, 1777, 3001});
    std::vector<Index> path;
    for (Index i = 10; i < 50; ++i)
        path.push_back(i * 61 + 20);
    test::add_crease(grid, path);
    test::add_crease(grid, {30 * 61 + 40, 31 * 61 + 40, 32 * 61 + 40}, 1.5);
    test::add_corner(grid, 60 * 61 + 50);
    meshes.push_back({"creased grid", std::move(grid)});
    MeshData slab = test::double_torus();
    Refinement refinement(test::topology_of(slab), 3);
    for (int i = 0; i < 3; ++i)
        refinement.add_level();
    meshes.push_back(
        {"refined double torus",
         to_mesh_data(refinement.topology(3), refinement.points(slab.positions))});
    return meshes;
}

std::vector<test::NamedMesh> all_meshes() {
    auto meshes = test::closed_meshes();
    for (auto&& more : {test::open_meshes(), test::creased_meshes(),
                        test::semi_sharp_meshes(), large_meshes()})
        meshes.insert(meshes.end(), more.begin(), more.end());
    return meshes;
}

std::vector<PatchTableOptions> all_options() {
    std::vector<PatchTableOptions> all;
    for (int degree = 2; degree <= 5; ++degree)
        all.push_back({.degree = degree});
    all.push_back({.family = PatchFamily::Gregory});
    all.push_back({.family = PatchFamily::Gregory, .gregory = {.levels = 1}});
    return all;
}

std::vector<std::tuple<test::NamedMesh, PatchTableOptions>> cases() {
    return test::thinned(test::combinations(all_meshes(), all_options()));
}

Result<Surface> build_with(int n_threads, const MeshData& mesh,
                           const PatchTableOptions& options) {
    return test::with_threads(n_threads, [&] { return Surface::build(mesh, options); });
}

TEST(Build, IsTheSameForAnyNumberOfThreads) {
    int n_built = 0;
    for (const auto& [named, options] : cases()) {
        const auto& [name, mesh] = named;
        SCOPED_TRACE(name + ", degree " + std::to_string(options.degree));
        const Result<Surface> one = build_with(1, mesh, options);
        for (const int n_threads : {2, 3}) {
            const Result<Surface> more = build_with(n_threads, mesh, options);
            ASSERT_EQ(one.has_value(), more.has_value());
            if (!one) {
                ASSERT_EQ(one.error().message, more.error().message);
                continue;
            }
            ++n_built;
            ASSERT_TRUE(one->patches() == more->patches());
            ASSERT_TRUE(std::ranges::equal(one->points(), more->points()));
            ASSERT_TRUE(
                std::ranges::equal(one->unused_vertices(), more->unused_vertices()));
        }
    }
    EXPECT_GT(n_built, test::fewest(500));
}

// Refusals come from the first element at fault, whichever thread meets one first.
TEST(Build, RefusesTheSameElementForAnyNumberOfThreads) {
    MeshData mesh = test::torus(90, 80);
    for (const Index v : {6500u, 5123u, 7100u})
        mesh.positions[v].y = std::numeric_limits<double>::quiet_NaN();
    for (const int n_threads : {1, 2, 3}) {
        const Result<Surface> surface = build_with(n_threads, mesh, {});
        ASSERT_FALSE(surface);
        EXPECT_EQ(surface.error().code, ErrorCode::NonFinitePoint);
        EXPECT_EQ(surface.error().element, 5123u);
    }
}

// ---------------------------------------------------------------------- updates

/// The rows one after the other, as their definition says.
template <class T>
std::vector<T> refreshed_slowly(const PatchTable& table, std::vector<T> values,
                                std::size_t n_channels) {
    const StencilTable& rows = table.refined_points();
    values.resize(n_channels * table.n_points());
    for (Index r = 0; r < rows.n_rows(); ++r) {
        for (std::size_t c = 0; c < n_channels; ++c) {
            T sum = 0;
            for (std::size_t k = rows.offsets[r]; k < rows.offsets[r + 1]; ++k)
                sum += T(rows.weights[k]) * values[rows.indices[k] * n_channels + c];
            values[(table.n_base_points() + r) * n_channels + c] = sum;
        }
    }
    return values;
}

template <class T>
void expect_refreshed_as_defined(const PatchTable& table, int n_channels) {
    SCOPED_TRACE(n_channels);
    std::mt19937 random(3);
    std::vector<T> base(std::size_t(n_channels) * table.n_base_points());
    for (T& x : base)
        x = std::uniform_real_distribution<T>(-1, 1)(random);
    std::vector<T> values = base;
    values.resize(std::size_t(n_channels) * table.n_points());
    table.refresh_channels<T>(n_channels, values);
    EXPECT_EQ(values, refreshed_slowly(table, base, std::size_t(n_channels)));
}

TEST(Update, IsThatOfTheRowsInOrder) {
    for (const auto& [named, options] : cases()) {
        const auto& [name, mesh] = named;
        const Result<Surface> surface = Surface::build(mesh, options);
        if (!surface)
            continue;
        SCOPED_TRACE(name + ", degree " + std::to_string(options.degree));
        const PatchTable& table = surface->patches();
        ASSERT_EQ(table.row_groups().front(), 0u);
        ASSERT_EQ(table.row_groups().back(), table.refined_points().n_rows());
        for (std::size_t g = 0; g + 1 < table.row_groups().size(); ++g) {
            const StencilTable& rows = table.refined_points();
            const Index begin = table.row_groups()[g], end = table.row_groups()[g + 1];
            for (std::size_t k = rows.offsets[begin]; k < rows.offsets[end]; ++k)
                ASSERT_LT(rows.indices[k], table.n_base_points() + begin);
        }
        for (const int n_channels : {1, 2, 3, 5}) {
            expect_refreshed_as_defined<float>(table, n_channels);
            expect_refreshed_as_defined<double>(table, n_channels);
        }
    }
}

/// By its definition, in time of the whole table.
Change change_of(const PatchTable& table, const std::vector<Index>& vertices) {
    std::vector<bool> moved(table.n_points());
    for (const Index v : vertices)
        moved[v] = true;
    Change change;
    const StencilTable& rows = table.refined_points();
    for (Index r = 0; r < rows.n_rows(); ++r) {
        for (std::size_t k = rows.offsets[r]; k < rows.offsets[r + 1]; ++k) {
            if (moved[rows.indices[k]])
                moved[table.n_base_points() + r] = true;
        }
        if (moved[table.n_base_points() + r])
            change.points.push_back(table.n_base_points() + r);
    }
    std::vector<bool> patch_moved(table.n_patches()), face_moved(table.base().n_faces());
    for (Index p = 0; p < table.n_patches(); ++p) {
        if (std::ranges::any_of(table.patch(p).points,
                                [&](Index i) { return moved[i]; })) {
            patch_moved[p] = true;
            change.patches.push_back(p);
        }
    }
    for (const Cell& cell : table.cells()) {
        if (patch_moved[cell.patch])
            face_moved[table.base().face(cell.quarter)] = true;
    }
    for (Index f = 0; f < table.base().n_faces(); ++f) {
        if (face_moved[f])
            change.faces.push_back(f);
    }
    return change;
}

TEST(Move, IsAsIfAllWereSet) {
    std::mt19937 random(5);
    for (const auto& [named, options] : cases()) {
        const auto& [name, mesh] = named;
        Result<Surface> moved = Surface::build(mesh, options);
        if (!moved)
            continue;
        SCOPED_TRACE(name + ", degree " + std::to_string(options.degree));
        Result<Surface> set = Surface::build(mesh, options);
        std::vector<Point> positions = mesh.positions;
        for (const int n : {1, 3}) {
            std::vector<Index> vertices;
            std::vector<Point> there;
            for (int i = 0; i < n; ++i) {
                vertices.push_back(static_cast<Index>(random() % positions.size()));
                positions[vertices.back()] += Point(0.1, 0.02 * i, -0.3);
                there.push_back(positions[vertices.back()]);
            }
            const Result<Change> change = moved->move_vertices(vertices, there);
            ASSERT_TRUE(change) << change.error().message;
            ASSERT_TRUE(set->set_positions(positions));
            ASSERT_TRUE(std::ranges::equal(moved->points(), set->points()));
            const Change expected = change_of(moved->patches(), vertices);
            EXPECT_EQ(change->points, expected.points);
            EXPECT_EQ(change->patches, expected.patches);
            EXPECT_EQ(change->faces, expected.faces);
        }
    }
}

// The support of a vertex has its size whatever the mesh has: 4 x 4 bicubic patches.
TEST(Move, ReachesAsFarAsTheSplineDoes) {
    for (int degree = 2; degree <= 5; ++degree) {
        Result<Surface> surface = Surface::build(test::torus(40, 30), {.degree = degree});
        const std::vector<Index> vertices = {333};
        const Result<Change> change =
            surface->move_vertices(vertices, std::vector<Point>{{1, 2, 3}});
        ASSERT_TRUE(change);
        EXPECT_TRUE(change->points.empty());
        EXPECT_EQ(change->patches.size(), std::size_t((degree + 1) * (degree + 1)));
        const int width = degree % 2 ? degree + 1 : degree + 2;
        EXPECT_EQ(change->faces.size(), std::size_t(width * width));
    }
}

TEST(Move, RefusesWhatIsNotThere) {
    Result<Surface> surface = Surface::build(test::cube());
    const std::vector<Point> before(surface->points().begin(), surface->points().end());
    const auto expect_refusal = [&](std::vector<Index> vertices,
                                    std::vector<Point> positions, ErrorCode code,
                                    Index element) {
        const Result<Change> change = surface->move_vertices(vertices, positions);
        ASSERT_FALSE(change);
        EXPECT_EQ(change.error().code, code);
        EXPECT_EQ(change.error().element, element);
        EXPECT_TRUE(std::ranges::equal(surface->points(), before));
    };
    expect_refusal({1, 2}, {{0, 0, 0}}, ErrorCode::SizeMismatch, kInvalidIndex);
    expect_refusal({1, 8}, {{0, 0, 0}, {0, 0, 0}}, ErrorCode::IndexOutOfRange, 8);
    expect_refusal({1, 5}, {{0, 0, 0}, {0, std::nan(""), 0}}, ErrorCode::NonFinitePoint,
                   5);
    EXPECT_TRUE(surface->move_vertices({}, {})->patches.empty());
}

}  // namespace
}  // namespace osdx
