// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/test_meshes.h"

namespace osdx {
namespace {

/// What the comments of Topology promise.
void expect_consistent(const Topology& t, Index n_border = 0) {
    ASSERT_EQ(t.face_offsets.front(), 0u);
    ASSERT_EQ(t.face_offsets.back(), t.n_halfedges());
    ASSERT_EQ(t.twin.size(), t.n_halfedges());
    ASSERT_EQ(t.edge.size(), t.n_halfedges());
    ASSERT_EQ(t.face.size(), t.n_halfedges());
    ASSERT_EQ(t.n_halfedges() + n_border, 2 * t.n_edges);
    ASSERT_EQ(std::ranges::count(t.twin, kInvalidIndex), n_border);
    std::vector<int> edge_uses(t.n_edges, 0);
    std::vector<Index> outgoing(t.n_vertices(), 0);
    for (Index f = 0; f < t.n_faces(); ++f) {
        ASSERT_GE(t.face_size(f), 3u);
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
            ASSERT_EQ(t.face[h], f);
            const Index last = t.face_offsets[f + 1] - 1;
            ASSERT_EQ(t.next(h), h == last ? t.face_offsets[f] : h + 1);
        }
    }
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        ASSERT_LT(t.vertex[h], t.n_vertices());
        ASSERT_LT(t.edge[h], t.n_edges);
        ASSERT_EQ(t.prev(t.next(h)), h);
        ASSERT_EQ(t.next(t.prev(h)), h);
        ++edge_uses[t.edge[h]];
        ++outgoing[t.vertex[h]];
        if (t.is_border(h)) {
            ASSERT_EQ(t.vertex_halfedge[t.vertex[h]], h);
            ++edge_uses[t.edge[h]];
            continue;
        }
        ASSERT_LT(t.twin[h], t.n_halfedges());
        ASSERT_NE(t.twin[h], h);
        ASSERT_EQ(t.twin[t.twin[h]], h);
        ASSERT_EQ(t.edge[t.twin[h]], t.edge[h]);
        ASSERT_EQ(t.vertex[t.twin[h]], t.to_vertex(h));
        if (t.is_border(t.prev(h)))
            continue;
        ASSERT_EQ(t.vertex[t.ccw(h)], t.vertex[h]);
        ASSERT_EQ(t.to_vertex(t.ccw(h)), t.vertex[t.prev(h)]);
    }
    for (Index e = 0; e < t.n_edges; ++e)
        ASSERT_EQ(edge_uses[e], 2) << "edge " << e;
    // One orbit of ccw() holds every halfedge of its vertex.
    for (Index v = 0; v < t.n_vertices(); ++v) {
        ASSERT_EQ(t.valence(v), outgoing[v]) << "vertex " << v;
        if (outgoing[v] == 0)
            ASSERT_EQ(t.vertex_halfedge[v], kInvalidIndex);
        else
            ASSERT_EQ(t.vertex[t.vertex_halfedge[v]], v);
    }
}

int euler_characteristic(const Topology& t) {
    const auto used =
        t.n_vertices() - std::ranges::count(t.vertex_halfedge, kInvalidIndex);
    return static_cast<int>(used + t.n_faces()) - static_cast<int>(t.n_edges);
}

/// Vertex 0 and the last one belong to no face.
MeshData cube_with_loose_vertices() {
    MeshData data = test::cube();
    data.positions.insert(data.positions.begin(), {7, 8, 9});
    data.positions.emplace_back(10, 11, 12);
    for (Index& v : data.face_vertices)
        ++v;
    return data;
}

std::vector<test::NamedMesh> meshes() {
    auto result = test::closed_meshes();
    result.push_back({"pole 360", test::pole(360, 1, 2)});
    result.push_back({"prism 360", test::prism(360)});
    result.push_back({"cube and loose vertices", cube_with_loose_vertices()});
    return result;
}

std::vector<Index> face_of(const Topology& t, Index f) {
    return {t.vertex.begin() + t.face_offsets[f],
            t.vertex.begin() + t.face_offsets[f + 1]};
}

TEST(Topology, KeepsTheCornersOfTheMesh) {
    for (const auto& [name, data] : meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        ASSERT_EQ(t.n_faces(), data.face_sizes.size());
        EXPECT_EQ(t.n_vertices(), data.positions.size());
        for (Index f = 0; f < t.n_faces(); ++f)
            EXPECT_EQ(t.face_size(f), data.face_sizes[f]);
        ASSERT_EQ(t.vertex, data.face_vertices);
    }
}

TEST(Topology, IsConsistent) {
    for (const auto& [name, data] : meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        expect_consistent(t);
        expect_consistent(split(t));
        expect_consistent(dual(t));
        expect_consistent(split(split(t)));
        expect_consistent(dual(split(t)));
        expect_consistent(split(dual(t)));
    }
}

TEST(Topology, IsConsistentWithBorders) {
    for (const auto& [name, data] : test::open_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        const auto n_border =
            static_cast<Index>(std::ranges::count(t.twin, kInvalidIndex));
        EXPECT_GT(n_border, 0u);
        expect_consistent(t, n_border);
        const Topology s = split(t);
        expect_consistent(s, 2 * n_border);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            // The halves of an edge, as the header numbers them.
            const bool first = t.is_border(h) || h < t.twin[h];
            EXPECT_EQ(s.edge[4 * h], 2 * t.edge[h] + (first ? 0 : 1));
            EXPECT_EQ(s.edge[4 * t.next(h) + 3], 2 * t.edge[h] + (first ? 1 : 0));
        }
        for (Index v = 0; v < t.n_vertices(); ++v) {
            std::vector<Index> edges;
            t.for_each_edge(v, [&](Index e, Index) { edges.push_back(e); });
            const Index h = t.vertex_halfedge[v];
            EXPECT_EQ(edges.size(),
                      t.valence(v) + (h != kInvalidIndex && t.is_border(h)));
            std::ranges::sort(edges);
            EXPECT_EQ(std::ranges::adjacent_find(edges), edges.end());
        }
    }
}

TEST(Topology, CcwTurnsCounterClockwise) {
    // Face (0, 0) of the torus lies ahead and to the left of vertex (0, 0).
    const Topology t = test::topology_of(test::torus(4, 5));
    Index h = t.face_offsets[0];
    while (t.vertex[h] != 0)
        h = t.next(h);
    const Index neighbours[] = {5, 1, 15, 4};  // (1,0), (0,1), (-1,0), (0,-1)
    for (const Index v : neighbours) {
        EXPECT_EQ(t.to_vertex(h), v);
        h = t.ccw(h);
    }
}

TEST(Topology, SplitAndDualKeepTheEulerCharacteristic) {
    for (const auto& [name, data] : meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        const int expected = name.starts_with("torus")    ? 0
                             : name.starts_with("double") ? -2
                                                          : 2;
        EXPECT_EQ(euler_characteristic(t), expected);
        EXPECT_EQ(euler_characteristic(split(t)), expected);
        EXPECT_EQ(euler_characteristic(dual(t)), expected);
        EXPECT_EQ(euler_characteristic(dual(split(t))), expected);
    }
}

TEST(Topology, SplitNumbersAsItSays) {
    for (const auto& [name, data] : meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        const Topology s = split(t);
        ASSERT_EQ(s.n_vertices(), t.n_vertices() + t.n_edges + t.n_faces());
        ASSERT_EQ(s.n_faces(), t.n_halfedges());
        const Index first_edge = t.n_vertices(), first_face = first_edge + t.n_edges;
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            const std::vector<Index> quad = {t.vertex[h], first_edge + t.edge[h],
                                             first_face + t.face[h],
                                             first_edge + t.edge[t.prev(h)]};
            ASSERT_EQ(face_of(s, h), quad) << "halfedge " << h;
        }
        for (Index v = 0; v < s.n_vertices(); ++v) {
            const Index valence = v < first_edge   ? t.valence(v)
                                  : v < first_face ? 4
                                                   : t.face_size(v - first_face);
            ASSERT_EQ(s.valence(v), valence) << "vertex " << v;
        }
    }
}

/// For each vertex its number among those that faces use.
std::vector<Index> ranks(const Topology& t) {
    std::vector<Index> rank(t.n_vertices(), kInvalidIndex);
    Index n = 0;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (t.vertex_halfedge[v] != kInvalidIndex)
            rank[v] = n++;
    }
    return rank;
}

TEST(Topology, DualMapsHalfedgesAsItSays) {
    for (const auto& [name, data] : meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        std::vector<Index> map;
        const Topology d = dual(t, &map);
        ASSERT_EQ(map.size(), t.n_halfedges());
        ASSERT_EQ(d.n_vertices(), t.n_faces());
        const std::vector<Index> rank = ranks(t);
        std::vector<bool> hit(t.n_halfedges(), false);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            ASSERT_FALSE(hit[map[h]]);
            hit[map[h]] = true;
            ASSERT_EQ(d.vertex[map[h]], t.face[h]);
            ASSERT_EQ(d.face[map[h]], rank[t.vertex[h]]);
            // Counter-clockwise about the vertex is onwards in the dual face.
            ASSERT_EQ(d.next(map[h]), map[t.ccw(h)]);
        }
        for (Index f = 0; f < t.n_faces(); ++f)
            ASSERT_EQ(d.valence(f), t.face_size(f));
    }
}

TEST(Topology, DualOfDualIsTheMesh) {
    for (const auto& [name, data] : meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        const Topology dd = dual(dual(t));
        ASSERT_EQ(dd.n_faces(), t.n_faces());
        const std::vector<Index> rank = ranks(t);
        for (Index f = 0; f < t.n_faces(); ++f) {
            std::vector<Index> expected = face_of(t, f);
            for (Index& v : expected)
                v = rank[v];
            const std::vector<Index> actual = face_of(dd, f);
            const auto start = std::ranges::find(expected, actual[0]);
            std::rotate(expected.begin(), start, expected.end());
            ASSERT_EQ(actual, expected) << "face " << f;
        }
    }
}

TEST(Topology, LooseVerticesStayLoose) {
    const Topology t = test::topology_of(cube_with_loose_vertices());
    ASSERT_EQ(t.n_vertices(), 10u);
    EXPECT_EQ(t.vertex_halfedge[0], kInvalidIndex);
    EXPECT_EQ(t.vertex_halfedge[9], kInvalidIndex);
    int calls = 0;
    t.for_each_outgoing(0, [&](Index) { ++calls; });
    EXPECT_EQ(calls, 0);
    const Topology s = split(t);
    EXPECT_EQ(s.n_vertices(), 10u + 12 + 6);
    EXPECT_EQ(s.vertex_halfedge[0], kInvalidIndex);
    EXPECT_EQ(s.vertex_halfedge[9], kInvalidIndex);
    const Topology d = dual(t);
    EXPECT_EQ(d.n_vertices(), 6u);
    EXPECT_EQ(d.n_faces(), 8u);
}

}  // namespace
}  // namespace osdx
