// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/mesh_file.h>
#include <osdx/repair.h>
#include <osdx/topology.h>

namespace osdx {
namespace {

using Indices = std::vector<Index>;

MeshData read(std::string_view obj) {
    const auto mesh = parse_mesh(obj, ".obj");
    EXPECT_TRUE(mesh) << mesh.error().message;
    return mesh ? *mesh : MeshData{};
}

RepairedMesh repaired(const MeshData& mesh, const RepairOptions& options = {}) {
    const auto result = repair(mesh, options);
    EXPECT_TRUE(result) << result.error().message;
    return result ? *result : RepairedMesh{};
}

/// That the check of meshes takes it.
Topology topology_of(const MeshData& mesh) {
    const auto topology = build_topology(mesh);
    EXPECT_TRUE(topology) << topology.error().message;
    return topology ? *topology : Topology{};
}

Index n_border(const Topology& t) {
    Index n = 0;
    for (Index h = 0; h < t.n_halfedges(); ++h)
        n += t.is_border(h);
    return n;
}

constexpr std::string_view kCorners =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 "
    "1\n";
constexpr std::string_view kFaces =
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

std::string cube(std::string_view faces = kFaces) {
    return std::string(kCorners) + std::string(faces);
}

TEST(Repair, LeavesSoundMeshesAlone) {
    MeshData mesh =
        read(cube() + "v 9 9 9\nt crease 2/1/0 1 0 3\nt corner 2/1/0 0 8 1\n");
    mesh.channels = {{"w", 1, {0, 1, 2, 3, 4, 5, 6, 7, 8}}};
    const auto [same, report] = repaired(mesh);
    EXPECT_TRUE(report.is_empty());
    EXPECT_EQ(same.positions, mesh.positions);
    EXPECT_EQ(same.face_sizes, mesh.face_sizes);
    EXPECT_EQ(same.face_vertices, mesh.face_vertices);
    EXPECT_EQ(same.vertex_lines, mesh.vertex_lines);
    EXPECT_EQ(same.face_lines, mesh.face_lines);
    EXPECT_EQ(same.channels[0].values, mesh.channels[0].values);
    EXPECT_EQ(report.faces, (Indices{0, 1, 2, 3, 4, 5}));
    ASSERT_EQ(same.tags.size(), 2u);
    EXPECT_EQ(same.tags[0].ints, (std::vector<int>{0, 1}));
    EXPECT_EQ(same.tags[1].ints, (std::vector<int>{0, 8}));
    EXPECT_EQ(same.tags[1].floats, std::vector<double>{1});
}

/// Each face of the cube with corners of its own, each off by `distance`.
MeshData soup(double distance) {
    const MeshData whole =
        read(cube("g a\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\ng b\n"
                  "f 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"));
    MeshData mesh = whole;
    mesh.positions.clear();
    mesh.vertex_lines.clear();
    for (Index c = 0; c < whole.face_vertices.size(); ++c) {
        const Vec3<double> off(c % 2 == 0 ? distance : 0, 0, c % 3 == 0 ? distance : 0);
        mesh.positions.push_back(whole.positions[whole.face_vertices[c]] + off);
        mesh.face_vertices[c] = c;
    }
    return mesh;
}

TEST(Repair, WeldsNearPoints) {
    // The diagonal is 2 sqrt(3); no two copies are farther than sqrt(2) times the distance.
    for (const double distance : {0.0, 1e-6}) {
        const auto [mesh, report] = repaired(soup(distance));
        const Topology t = topology_of(mesh);
        EXPECT_EQ(t.n_vertices(), 8u);
        EXPECT_EQ(n_border(t), 0u);
        EXPECT_EQ(report.n_welded, 16u);
        EXPECT_EQ(report.n_flipped_faces, 0u);
        EXPECT_EQ(mesh.groups.faces, (Indices{0, 0, 0, 1, 1, 1}));
        for (Index v = 0; v < 8; ++v)
            EXPECT_EQ(mesh.positions[v], soup(distance).positions[report.vertices[v]]);
    }
    // Some copies are off alike, and so the same.
    EXPECT_GT(repaired(soup(1e-5)).mesh.positions.size(), 16u);
    EXPECT_EQ(repaired(soup(1e-5), {.weld = 1e-5}).mesh.positions.size(), 8u);
    EXPECT_LT(repaired(soup(1e-9), {.weld = 0}).report.n_welded, 8u);
    EXPECT_EQ(repaired(soup(0), {.weld = 0}).report.n_welded, 16u);
    EXPECT_EQ(repaired(soup(0), {.weld = -1}).report.n_welded, 0u);
    const auto alone = repaired(soup(0), {.faces = false});
    EXPECT_EQ(alone.mesh.positions.size(), 8u);
    EXPECT_EQ(n_border(topology_of(alone.mesh)), 0u);
}

TEST(Repair, TagsAndTextureCoordinatesGoWithWeldedPoints) {
    MeshData mesh = soup(0);
    mesh.uvs.resize(24);
    for (Index c = 0; c < 24; ++c)
        mesh.face_uvs.push_back(23 - c);
    // Corners of the first face run from vertex 3 to 2 of the cube.
    mesh.tags = {{"crease", {1, 0}, {2}, {}, 0}, {"corner", {4, 5}, {3, 4}, {}, 0}};
    const auto result = repaired(mesh);
    EXPECT_EQ(result.mesh.face_uvs, mesh.face_uvs);
    ASSERT_EQ(result.mesh.tags.size(), 2u);
    EXPECT_EQ(result.mesh.tags[0].ints, (std::vector<int>{0, 1}));
    EXPECT_EQ(result.mesh.tags[1].floats, (std::vector<double>{3, 4}));
    mesh.tags[1].ints[0] = 24;
    EXPECT_EQ(repair(mesh).error().code, ErrorCode::InvalidTag);
}

TEST(Repair, DropsSmallFacesAndRepeatedVertices) {
    const MeshData mesh =
        read(cube("f 1 2\nf 4 3 3 2 1 4\nf 5 6 7 8\nf\nf 1 2 6 5\nf 7 7 7\n"
                  "f 2 3 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
                  "f 1 2 3 2\nt hole 2/0/0 0 2\nt hole 1/0/0 9\n"));
    const auto [fixed, report] = repaired(mesh);
    EXPECT_EQ(n_border(topology_of(fixed)), 0u);
    EXPECT_EQ(report.n_dropped_faces, 4u);
    EXPECT_EQ(report.n_shortened_faces, 2u);
    EXPECT_EQ(report.faces, (Indices{1, 2, 4, 6, 7, 8}));
    EXPECT_EQ(fixed.face_sizes, Indices(6, 4));
    EXPECT_EQ(report.n_dropped_tags, 1u);
    ASSERT_EQ(fixed.tags.size(), 1u);
    EXPECT_EQ(fixed.tags[0].ints, std::vector<int>{1});
    EXPECT_EQ(fixed.face_lines[0], mesh.face_lines[1]);
}

// A face around a hole, which comes by the ends of its bridge twice.
TEST(Repair, PartsAFaceWhereItMeetsItself) {
    const std::string ring =
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 3 1 0\nv 3 3 0\nv 1 3 0\n"
        "f 1 2 3 4 1 5 8 7 6 5\n";
    const auto [mesh, report] = repaired(read(ring));
    EXPECT_EQ(topology_of(mesh).n_vertices(), 10u);
    EXPECT_EQ(report.n_added_vertices, 2u);
    EXPECT_EQ(mesh.positions[8], mesh.positions[0]);
    EXPECT_EQ(mesh.positions[9], mesh.positions[4]);
    // With neighbours all around, too.
    const auto framed = repaired(
        read(ring + "v -1 -1 0\nv 5 -1 0\nv 5 5 0\nv -1 5 0\nf 9 10 2 1\nf 10 11 3 2\n"
                    "f 11 12 4 3\nf 12 9 1 4\nf 5 6 7 8\n"));
    topology_of(framed.mesh);
    EXPECT_EQ(framed.mesh.face_sizes.size(), 6u);
}

TEST(Repair, MakesOrientationsAgree) {
    MeshData mesh =
        read(cube("f 4 3 2 1\nf 8 7 6 5\nf 1 2 6 5\nf 2 3 7 6\nf 7 8 4 3\n"
                  "f 4 1 5 8\n"));
    mesh.uvs.resize(24);
    for (Index c = 0; c < 24; ++c)
        mesh.face_uvs.push_back(c);
    const auto [fixed, report] = repaired(mesh);
    EXPECT_EQ(report.n_flipped_faces, 2u);
    EXPECT_EQ(n_border(topology_of(fixed)), 0u);
    // The first corner stays the first, and values go with their vertices.
    EXPECT_EQ(Indices(fixed.face_vertices.begin() + 4, fixed.face_vertices.begin() + 8),
              (Indices{7, 4, 5, 6}));
    EXPECT_EQ(Indices(fixed.face_uvs.begin() + 4, fixed.face_uvs.begin() + 8),
              (Indices{4, 7, 6, 5}));
    EXPECT_EQ(Indices(fixed.face_vertices.begin(), fixed.face_vertices.begin() + 4),
              (Indices{3, 2, 1, 0}));
}

TEST(Repair, CutsMoebiusStrips) {
    constexpr int kN = 9;
    MeshData mesh;
    for (int i = 0; i < kN; ++i) {
        const double a = 2 * M_PI * i / kN, half = a / 2;
        for (const double s : {-0.3, 0.3}) {
            const double r = 1 + s * std::cos(half);
            mesh.positions.emplace_back(r * std::cos(a), r * std::sin(a),
                                        s * std::sin(half));
        }
        const Index at = static_cast<Index>(2 * i);
        const bool last = i + 1 == kN;
        mesh.face_sizes.push_back(4);
        for (const Index v :
             {at, last ? Index(1) : at + 2, last ? Index(0) : at + 3, at + 1})
            mesh.face_vertices.push_back(v);
    }
    ASSERT_FALSE(build_topology(mesh));
    const auto [fixed, report] = repaired(mesh);
    EXPECT_EQ(report.n_cut_edges, 1u);
    EXPECT_EQ(report.n_added_vertices, 2u);
    EXPECT_EQ(n_border(topology_of(fixed)), 2u * kN + 2);
}

TEST(Repair, PartsFacesWhereThreeAndMoreMeet) {
    // A fin inside of a cube, from an edge at which its faces bend less than to the fin.
    const auto off =
        repaired(read(cube() + "v -1 0 0\nv 1 0 0\nf 8 7 10 9\n"
                               "t crease 2/1/0 6 7 2\nt corner 1/1/0 7 3\n"));
    EXPECT_EQ(n_border(topology_of(off.mesh)), 4u);
    EXPECT_EQ(off.report.n_parted_edges, 1u);
    EXPECT_EQ(off.report.n_added_vertices, 2u);
    EXPECT_EQ(off.mesh.positions[10], off.mesh.positions[7]);
    EXPECT_EQ(off.report.vertices[11], 6u);
    ASSERT_EQ(off.mesh.tags.size(), 3u);  // the crease is on both edges now
    EXPECT_EQ(off.mesh.tags[0].ints, (std::vector<int>{6, 7}));
    EXPECT_EQ(off.mesh.tags[1].ints, (std::vector<int>{10, 11}));
    EXPECT_EQ(off.mesh.tags[2].ints, (std::vector<int>{7, 10}));
    // A fin outside that goes on level with a face. The cube's other face there is connected to
    // that one around both ends of the edge, and so parted from its neighbours: it has a border
    // of three edges, they of two, the fin of three.
    const auto level = repaired(read(cube() + "v -1 3 1\nv 1 3 1\nf 8 7 10 9\n"));
    EXPECT_EQ(n_border(topology_of(level.mesh)), 8u);
    EXPECT_EQ(level.report.n_added_vertices, 2u);
}

TEST(Repair, CopiesVerticesWhereFansMeet) {
    const auto [mesh, report] = repaired(
        read("v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n"));
    EXPECT_EQ(report.n_added_vertices, 1u);
    topology_of(mesh);
    EXPECT_EQ(mesh.face_vertices, (Indices{0, 1, 2, 5, 3, 4}));
    EXPECT_EQ(mesh.vertex_lines[5], 1u);
}

TEST(Repair, RefusesWhatHoldsNotWhatItNames) {
    MeshData mesh = read(cube());
    mesh.face_vertices[3] = 8;
    EXPECT_EQ(repair(mesh).error().code, ErrorCode::IndexOutOfRange);
    mesh.face_vertices.pop_back();
    EXPECT_EQ(repair(mesh).error().code, ErrorCode::SizeMismatch);
}

}  // namespace
}  // namespace osdx
