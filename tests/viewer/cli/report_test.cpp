// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/report.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/patch_table.h>
#include <osdx/surface.h>

#include "tests/support/test_meshes.h"
#include "viewer/cli/commands.h"

namespace osdx::cli {
namespace {

using namespace test;

TEST(Report, CountsOfClosedMeshes) {
    const Json cube_details = mesh_details(topology_of(cube()));
    EXPECT_EQ(cube_details.dump(),
              R"({"vertices":8,"faces":6,"boundary_edges":0,"edges":12,"closed":true,)"
              R"("boundary_loops":0,"components":1,"euler":2,"valences":{"3":8},)"
              R"("boundary_valences":{},"face_sizes":{"4":6}})");
    EXPECT_EQ(mesh_details(topology_of(double_torus()))["euler"], -2);
}

TEST(Report, CountsOfOpenMeshes) {
    const Json quads = mesh_details(topology_of(grid(2, 3)));
    EXPECT_EQ(quads["closed"], false);
    EXPECT_EQ(quads["boundary_edges"], 10);
    EXPECT_EQ(quads["boundary_loops"], 1);
    EXPECT_EQ(quads["euler"], 1);
    EXPECT_EQ(one_line(quads["valences"]), "2 x 4");
    EXPECT_EQ(one_line(quads["boundary_valences"]), "4 x 1, 6 x 2");

    // Faces 20 and 21 make one gap: two loops.
    const Json gaps = mesh_details(topology_of(without_faces(torus(5, 6), {7, 20, 21})));
    EXPECT_EQ(gaps["boundary_loops"], 2);
    EXPECT_EQ(gaps["boundary_edges"], 4 + 6);
    EXPECT_EQ(gaps["components"], 1);
    EXPECT_EQ(gaps["euler"], -2);

    // Two pieces, and vertices that no face uses.
    MeshData ends = without_faces(cube(), {2, 3, 4, 5});
    EXPECT_EQ(mesh_details(topology_of(ends))["components"], 2);
    EXPECT_EQ(mesh_details(topology_of(ends))["boundary_loops"], 2);
    ends.positions.emplace_back(0, 0, 0);
    const Json pieces = mesh_details(topology_of(ends));
    EXPECT_EQ(pieces["vertices"], 9);
    EXPECT_EQ(pieces["euler"], 2);  // of two disks
}

// Euler's number of a piece is 2 - 2 handles - loops; the open meshes have no handles but
// the torus.
TEST(Report, LoopsAgreeWithEulersNumber) {
    for (const auto& [name, mesh] : open_meshes()) {
        const Json d = mesh_details(topology_of(mesh));
        const int handles = name.starts_with("torus") ? 1 : 0;
        EXPECT_EQ(d["euler"].get<int>(), 2 * d["components"].get<int>() - 2 * handles -
                                             d["boundary_loops"].get<int>())
            << name;
    }
}

TEST(Report, Features) {
    Features f;
    EXPECT_EQ(feature_lines(feature_report(f), true), "");
    EXPECT_EQ(feature_lines(feature_report(f), false), "border:     edge-only\n");
    f.edge_sharpness = {0, 2.5, kInfinitelySharp, 1, 0};
    f.vertex_sharpness = {kInfinitelySharp, 0};
    f.hole = {false, true, true};
    f.boundary = BoundaryRule::None;
    f.creases = CreaseMethod::Chaikin;
    f.smooth_triangles = true;
    const Json report = feature_report(f);
    EXPECT_EQ(
        report.dump(),
        R"({"creases":{"semi_sharp":2,"infinitely_sharp":1,"largest_sharpness":2.5},)"
        R"("corners":{"semi_sharp":0,"infinitely_sharp":1,"largest_sharpness":0.0},)"
        R"("holes":2,"boundary":"none","crease_method":"chaikin","smooth_triangles":true})");
    EXPECT_EQ(feature_lines(report, false),
              "creases:    2 semi-sharp (up to 2.5), 1 infinitely sharp\n"
              "corners:    1 infinitely sharp\n"
              "holes:      2\n"
              "border:     none\n"
              "method:     chaikin\n"
              "triangles:  smooth\n");
}

TEST(Report, Patches) {
    const auto s = Surface::build(prism(5), {.degree = 3});
    ASSERT_TRUE(s);
    const Json counts = patch_counts(s->patches());
    EXPECT_EQ(counts["ev"]["3"], 10);
    EXPECT_EQ(counts["ef"].dump(), "{}");
    EXPECT_EQ(counts["gregory"].dump(), "{}");
    Index n = counts["regular"];
    for (const char* key : {"ev", "ef"}) {
        for (const auto& [sides, count] : counts[key].items())
            n += count.get<Index>();
    }
    EXPECT_EQ(n, s->patches().n_patches());
    EXPECT_NE(patch_summary(s->patches()).find("10 EV(3)"), std::string::npos)
        << patch_summary(s->patches());
    const auto dual = Surface::build(octahedron(), {.degree = 2});
    ASSERT_TRUE(dual);
    EXPECT_EQ(patch_summary(dual->patches()).find("EV"), std::string::npos);
    EXPECT_EQ(patch_counts(dual->patches())["ef"]["3"], 8);
}

void expect_near(const Json& actual, const Json& expected, const std::string& what) {
    ASSERT_EQ(actual.is_array(), expected.is_array()) << what;
    if (!actual.is_array()) {
        const auto e = expected.get<double>();
        EXPECT_NEAR(actual.get<double>(), e, 1e-11 * (1 + std::abs(e))) << what;
        return;
    }
    ASSERT_EQ(actual.size(), expected.size()) << what;
    for (std::size_t i = 0; i < actual.size(); ++i)
        expect_near(actual[i], expected[i], what + ' ' + std::to_string(i));
}

TEST(PatchCommand, WritesTheGregoryPatchesOfReferenceFiles) {
    const auto out = std::filesystem::path(testing::TempDir()) / "osdx_gregory.json";
    for (const std::string n : {"3", "4", "5", "8"}) {
        SCOPED_TRACE(n);
        CommandOptions options;
        options.input = std::filesystem::path(OSDX_TEST_DATA) / ("acc2_n" + n + ".json");
        options.out = out;
        ASSERT_TRUE(patch_command(options));
        std::ifstream written(out), reference(options.input);
        const Json actual = Json::parse(written), expected = Json::parse(reference);
        for (const std::string patch : {"paper", "tuned"}) {
            for (const char* key :
                 {"control", "domain", "pos", "d1", "d2", "d11", "d12", "d22"})
                expect_near(actual.at(patch).at(key), expected.at(patch).at(key),
                            patch + '.' + key);
            ASSERT_EQ(actual[patch].contains("centre_point"), n != "4");
            if (n != "4") {
                expect_near(actual[patch]["centre_point"],
                            expected[patch]["centre_point"], "centre");
            }
        }
    }
    std::filesystem::remove(out);
}

}  // namespace
}  // namespace osdx::cli
