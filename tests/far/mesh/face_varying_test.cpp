// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <map>
#include <random>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/face_varying.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using namespace test;

constexpr FaceVaryingRule kRules[] = {
    FaceVaryingRule::None,         FaceVaryingRule::CornersOnly,
    FaceVaryingRule::CornersPlus1, FaceVaryingRule::CornersPlus2,
    FaceVaryingRule::Boundaries,   FaceVaryingRule::All};

FaceVarying build(const Topology& mesh, const Features& features,
                  const std::vector<Index>& values, FaceVaryingRule rule) {
    auto result = build_face_varying(mesh, features, values, rule);
    EXPECT_TRUE(result) << (result ? "" : result.error().message);
    return std::move(*result);
}

std::vector<NamedMesh> meshes() {
    auto all = closed_meshes();
    for (auto& mesh : open_meshes())
        all.push_back(std::move(mesh));
    return all;
}

// The number of faces at a vertex is that of the fan that has its value, not that of the mesh's
// vertex of the same number.
TEST(FaceVarying, CountsTheFacesOfFans) {
    int n_cut = 0;
    for (const NamedMesh& m : meshes()) {
        SCOPED_TRACE(m.name);
        const Topology t = topology_of(m.data);
        // Faces in two parts, with values of their own.
        std::vector<Index> values;
        for (Index h = 0; h < t.n_halfedges(); ++h)
            values.push_back(2 * t.vertex[h] + t.face(h) % 2);
        const FaceVarying f = build(t, {}, values, FaceVaryingRule::CornersOnly);
        n_cut += f.topology.n_vertices() > t.n_vertices();
        for (Index v = 0; v < f.topology.n_vertices(); ++v) {
            Index n = 0;
            f.topology.for_each_outgoing(v, [&](Index) { ++n; });
            EXPECT_EQ(f.topology.valence(v), n) << "vertex " << v;
        }
    }
    EXPECT_GT(n_cut, 0);
}

// With the vertices themselves as values there are no seams: all is as in the mesh.
TEST(FaceVarying, WithoutSeamsIsTheMesh) {
    for (const NamedMesh& m : meshes()) {
        SCOPED_TRACE(m.name);
        const Topology t = topology_of(m.data);
        Features features;
        features.edge_sharpness.assign(t.n_edges, 2.5);
        features.vertex_sharpness.assign(t.n_vertices(), 0.5);
        features.hole.assign(t.n_faces(), false);
        features.hole[0] = true;
        features.creases = CreaseMethod::Chaikin;
        features.smooth_triangles = true;
        for (const FaceVaryingRule rule : kRules) {
            const FaceVarying f = build(t, features, m.data.face_vertices, rule);
            EXPECT_EQ(f.topology.face_offsets, t.face_offsets);
            EXPECT_EQ(f.topology.twin, t.twin);
            EXPECT_EQ(f.topology.edge, t.edge);
            EXPECT_EQ(f.topology.n_edges, t.n_edges);
            for (Index h = 0; h < t.n_halfedges(); ++h)
                ASSERT_EQ(f.values[f.topology.vertex[h]], t.vertex[h]);
            EXPECT_EQ(f.features.hole, features.hole);
            EXPECT_EQ(f.features.creases, CreaseMethod::Chaikin);
            EXPECT_TRUE(f.features.smooth_triangles);
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                ASSERT_EQ(f.features.edge(t.edge[h]), t.is_border(h) ? 10 : 2.5);
                const Index v = t.vertex[h];
                if (!t.is_border(t.vertex_halfedge[v])) {
                    ASSERT_EQ(f.features.vertex(f.topology.vertex[h]), 0.5);
                }
            }
        }
    }
}

/// A topology as build_topology makes it: pairs of twins, one fan for each vertex.
void expect_manifold(const Topology& t) {
    std::vector<int> n_sides(t.n_edges, 0);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        ASSERT_LT(t.edge[h], t.n_edges);
        ++n_sides[t.edge[h]];
        if (t.is_border(h))
            continue;
        ASSERT_EQ(t.twin[t.twin[h]], h);
        ASSERT_EQ(t.edge[t.twin[h]], t.edge[h]);
        ASSERT_EQ(t.vertex[t.twin[h]], t.to_vertex(h));
    }
    for (Index h = 0; h < t.n_halfedges(); ++h)
        ASSERT_EQ(n_sides[t.edge[h]], t.is_border(h) ? 1 : 2);
    std::vector<int> visited(t.n_halfedges(), 0);
    for (Index v = 0; v < t.n_vertices(); ++v) {
        t.for_each_outgoing(v, [&](Index h) {
            ASSERT_EQ(t.vertex[h], v);
            ++visited[h];
        });
    }
    for (const int n : visited)
        ASSERT_EQ(n, 1);
}

// Random values per corner, few enough that neighbours agree often.
TEST(FaceVarying, IsManifoldAndAgreesAcrossItsEdges) {
    std::mt19937 random(11);
    for (const NamedMesh& m : meshes()) {
        for (const Index n_labels : {1u, 2u, 3u}) {
            SCOPED_TRACE(testing::Message() << m.name << ", labels " << n_labels);
            const Topology t = topology_of(m.data);
            std::vector<Index> values;
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                const auto label = static_cast<Index>(random() % (4 * n_labels));
                values.push_back(4 * t.vertex[h] + (label < n_labels ? label : 0));
            }
            const FaceVarying f = build(t, {}, values, FaceVaryingRule::CornersPlus2);
            const Topology& cut = f.topology;
            EXPECT_EQ(cut.face_offsets, t.face_offsets);
            EXPECT_EQ(cut.faces, t.faces);
            expect_manifold(cut);
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                ASSERT_EQ(f.values[cut.vertex[h]], values[h]);
                if (t.is_border(h)) {
                    ASSERT_TRUE(cut.is_border(h));
                    continue;
                }
                const Index g = t.twin[h];
                const bool agree =
                    values[h] == values[t.next(g)] && values[t.next(h)] == values[g];
                ASSERT_EQ(cut.twin[h], agree ? g : kInvalidIndex);
                ASSERT_EQ(cut.edge[std::min(h, g)], t.edge[h]);
            }
        }
    }
}

TEST(FaceVarying, OfSeparateFacesHasAVertexForEachCorner) {
    const MeshData mesh = cube();
    const Topology t = topology_of(mesh);
    std::vector<Index> values(24);
    for (Index h = 0; h < 24; ++h)
        values[h] = h;
    const FaceVarying f = build(t, {}, values, FaceVaryingRule::CornersOnly);
    EXPECT_EQ(f.topology.n_vertices(), 24u);
    EXPECT_EQ(f.topology.n_edges, 24u);
    for (Index v = 0; v < 24; ++v)
        EXPECT_EQ(f.features.vertex(v), kInfinitelySharp);
    const FaceVarying smooth = build(t, {}, values, FaceVaryingRule::None);
    for (Index v = 0; v < 24; ++v)
        EXPECT_EQ(smooth.features.vertex(v), 0);
}

TEST(FaceVarying, PassesOverLooseVertices) {
    MeshData mesh = cube();
    mesh.positions.insert(mesh.positions.begin(), {9, 9, 9});
    for (Index& v : mesh.face_vertices)
        ++v;
    const Topology t = topology_of(mesh);
    const FaceVarying f = build(t, {}, mesh.face_vertices, FaceVaryingRule::All);
    EXPECT_EQ(f.topology.n_vertices(), 8u);
    expect_manifold(f.topology);
}

MeshData tagged(std::vector<std::pair<const char*, std::vector<int>>> tags) {
    MeshData mesh = cube();
    for (auto& [name, ints] : tags)
        mesh.tags.push_back({name, std::move(ints), {}, {}, 7});
    return mesh;
}

constexpr const char* kRuleTag = "facevaryinginterpolateboundary";
constexpr const char* kCornersTag = "facevaryingpropagatecorners";

TEST(FaceVaryingRule, ComesFromTheTags) {
    using enum FaceVaryingRule;
    EXPECT_EQ(*face_varying_rule(cube()), All);
    for (int i = 0; i < 6; ++i)
        EXPECT_EQ(*face_varying_rule(tagged({{kRuleTag, {i}}})), kRules[i]);
    EXPECT_EQ(*face_varying_rule(tagged({{kRuleTag, {0}}, {kRuleTag, {4}}})), Boundaries);
    EXPECT_EQ(*face_varying_rule(tagged({{kCornersTag, {1}}, {kRuleTag, {2}}})),
              CornersPlus2);
    EXPECT_EQ(*face_varying_rule(tagged({{kRuleTag, {3}}, {kCornersTag, {1}}})),
              CornersPlus2);
    EXPECT_EQ(*face_varying_rule(tagged({{kRuleTag, {1}}, {kCornersTag, {0}}})),
              CornersOnly);
}

TEST(FaceVaryingRule, RefusesOtherTags) {
    const auto refuse = [](const MeshData& mesh, ErrorCode code, Index tag,
                           std::string_view words) {
        const auto rule = face_varying_rule(mesh);
        ASSERT_FALSE(rule);
        EXPECT_EQ(rule.error().code, code);
        EXPECT_EQ(rule.error().element, tag);
        EXPECT_EQ(rule.error().line, 7u);
        EXPECT_NE(rule.error().message.find(words), std::string::npos)
            << rule.error().message;
    };
    using enum ErrorCode;
    refuse(tagged({{kRuleTag, {6}}}), InvalidTag, 0, "from 0 to 5");
    refuse(tagged({{kRuleTag, {-1}}}), InvalidTag, 0, "from 0 to 5");
    refuse(tagged({{kRuleTag, {1}}, {kRuleTag, {}}}), InvalidTag, 1, "one number");
    refuse(tagged({{kCornersTag, {2}}}), InvalidTag, 0, "from 0 to 1");
    refuse(tagged({{kRuleTag, {1}}, {kCornersTag, {1}}}), UnsupportedTag, 1, "2 or 3");
}

TEST(FaceVaryingRefuses, ValuesForOtherCorners) {
    const Topology t = topology_of(cube());
    const auto result =
        build_face_varying(t, {}, std::vector<Index>(23), FaceVaryingRule::All);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::SizeMismatch);
}

// A semi-sharp crease that crosses a seam: its two edges at the vertex lie on both sides.
TEST(FaceVaryingRefuses, ChaikinsRuleAcrossSeams) {
    const MeshData mesh = grid(4, 2);
    const Topology t = topology_of(mesh);
    std::vector<Index> values;
    for (Index h = 0; h < t.n_halfedges(); ++h)
        values.push_back(2 * t.vertex[h] + Index(t.face(h) >= 4));  // i >= 2
    Features features;
    features.creases = CreaseMethod::Chaikin;
    features.edge_sharpness.assign(t.n_edges, 0);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (t.vertex[h] % 3 == 1 && t.to_vertex(h) % 3 == 1)
            features.edge_sharpness[t.edge[h]] = 1.5;
    }
    for (const FaceVaryingRule rule : kRules) {
        const auto result = build_face_varying(t, features, values, rule);
        if (rule == FaceVaryingRule::All) {
            EXPECT_TRUE(result);  // linear: no sharpness matters
            continue;
        }
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, ErrorCode::UnsupportedTag);
        EXPECT_EQ(result.error().element, 2 * 3 + 1u);
    }
    features.creases = CreaseMethod::Uniform;
    for (const FaceVaryingRule rule : kRules)
        EXPECT_TRUE(build_face_varying(t, features, values, rule));
}

}  // namespace
}  // namespace osdx
