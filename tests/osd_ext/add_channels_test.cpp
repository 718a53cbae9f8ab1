// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/add_channels.h>
#include <osdx/evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/surface.h>
#include <osdx/tessellation.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx::test {
namespace {

/// The position, a constant and seven numbers that have nothing to do with each other.
MeshData with_channels(MeshData mesh) {
    std::mt19937 random(5);
    mesh.channels = {{"place", 3, {}}, {"one", 1, {}}, {"seven", 7, {}}};
    for (const Vec3<double>& p : mesh.positions) {
        for (int k = 0; k < 3; ++k)
            mesh.channels[0].values.push_back(p[k]);
        mesh.channels[1].values.push_back(1);
        for (int k = 0; k < 7; ++k)
            mesh.channels[2].values.push_back(double(random()) / 0x1p32);
    }
    return mesh;
}

std::vector<NamedMesh> meshes() {
    std::vector<NamedMesh> all;
    for (const auto& some :
         {closed_meshes(), open_meshes(), creased_meshes(), semi_sharp_meshes()}) {
        for (const NamedMesh& m : some) {
            if (m.data.face_sizes.size() < 40)
                all.push_back(m);
        }
    }
    return all;
}

TEST(AddChannels, AreThoseOfTheSurfaceAtThePoints) {
    int n_tested = 0;
    for (const auto& [name, plain] : meshes()) {
        const MeshData mesh = with_channels(plain);
        for (const int d : {2, 3, 4}) {
            SCOPED_TRACE(name + ", degree " + std::to_string(d));
            const auto s = Surface::build(mesh, {.degree = d});
            if (!s)
                continue;
            Tessellation t = s->tessellate(3);
            const auto facets = t.facet_points;
            const Status status = add_channels(t, *s, mesh.channels);
            ASSERT_TRUE(status) << status.error().message;
            EXPECT_EQ(t.facet_points, facets);
            ASSERT_EQ(t.channels.size(), 3u);
            // Sums of some hundred terms; by other kernels than the grid's.
            const double tolerance = 1e-13 * diagonal(mesh);
            // One at a time, in float, from weights of float.
            const std::vector<float> narrow(mesh.channels[2].values.begin(),
                                            mesh.channels[2].values.end());
            const auto values = s->values(channels(narrow.data(), 7));
            std::vector<float> one(7);
            for (std::size_t i = 0; i < t.positions.size(); ++i) {
                const double* place = t.channels[0].view()[i];
                for (int k = 0; k < 3; ++k)
                    ASSERT_NEAR(place[k], t.positions[i][k], tolerance);
                ASSERT_NEAR(t.channels[1].values[i], 1, 1e-13);
                s->evaluator().evaluate_channels<float>(
                    values, 7, s->patches().locate(t.addresses[i]), 0, Chart::BaseUV,
                    one);
                for (int k = 0; k < 7; ++k) {
                    ASSERT_NEAR(t.channels[2].view()[i][k], one[k],
                                256 * std::numeric_limits<float>::epsilon());
                }
            }
            ++n_tested;
        }
    }
    EXPECT_GE(n_tested, 20);
}

// A later call appends; holes have no points, and so no channels.
TEST(AddChannels, AppendAndLeaveHolesOut) {
    MeshData mesh = with_channels(cube());
    mesh.tags = {{"hole", {0}, {}, {}, 0}};
    const auto s = Surface::build(mesh);
    ASSERT_TRUE(s);
    Tessellation t = s->tessellate(2);
    ASSERT_TRUE(add_channels(t, *s, std::span(mesh.channels).first(1)));
    ASSERT_TRUE(add_channels(t, *s, std::span(mesh.channels).subspan(1)));
    ASSERT_TRUE(add_channels(t, *s, {}));
    ASSERT_EQ(t.channels.size(), 3u);
    EXPECT_EQ(t.channels[2].name, "seven");
    for (const NamedChannels& c : t.channels) {
        ASSERT_EQ(c.values.size(), t.positions.size() * static_cast<std::size_t>(c.n));
        for (const double x : c.values)
            ASSERT_TRUE(std::isfinite(x));
    }
}

TEST(AddChannels, RefuseWhatIsNotOfTheVertices) {
    const MeshData mesh = with_channels(cube());
    const auto s = Surface::build(mesh);
    ASSERT_TRUE(s);
    Tessellation t = s->tessellate(2);
    std::vector<NamedChannels> bad = mesh.channels;
    bad[2].values[7 * 4 + 3] = NAN;
    Status status = add_channels(t, *s, bad);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::NonFinitePoint);
    EXPECT_EQ(status.error().element, 4u);
    bad[2].values.pop_back();
    status = add_channels(t, *s, bad);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::SizeMismatch);
    EXPECT_TRUE(t.channels.empty());
}

}  // namespace
}  // namespace osdx::test
