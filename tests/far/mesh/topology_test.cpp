// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/topology.h>

#include "far/mesh/topology_edits.h"
#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

/// What the comments of Topology promise.
void expect_consistent(const Topology& t, Index n_border = 0) {
    ASSERT_EQ(t.face_offsets.front(), 0u);
    ASSERT_EQ(t.face_offsets.back(), t.n_halfedges());
    ASSERT_EQ(t.twin.size(), t.n_halfedges());
    ASSERT_EQ(t.edge.size(), t.n_halfedges());
    ASSERT_EQ(t.faces.size(), t.quads_only ? 0 : t.n_halfedges());
    ASSERT_EQ(t.n_halfedges() + n_border, 2 * t.n_edges);
    ASSERT_EQ(std::ranges::count(t.twin, kInvalidIndex), n_border);
    std::vector<int> edge_uses(t.n_edges, 0);
    std::vector<Index> outgoing(t.n_vertices(), 0);
    for (Index f = 0; f < t.n_faces(); ++f) {
        ASSERT_GE(t.face_size(f), 3u);
        for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
            ASSERT_EQ(t.face(h), f);
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
        ASSERT_TRUE(std::ranges::equal(t.vertex, data.face_vertices));
    }
}

/// The faces in a random order, each from a random corner on.
MeshData shuffled(const MeshData& mesh, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::vector<Index>> faces;
    auto v = mesh.face_vertices.begin();
    for (const Index n : mesh.face_sizes) {
        faces.emplace_back(v, v + n);
        std::rotate(faces.back().begin(), faces.back().begin() + random() % n,
                    faces.back().end());
        v += n;
    }
    std::ranges::shuffle(faces, random);
    MeshData result;
    result.positions = mesh.positions;
    for (const auto& face : faces) {
        result.face_sizes.push_back(static_cast<Index>(face.size()));
        result.face_vertices.insert(result.face_vertices.end(), face.begin(), face.end());
    }
    return result;
}

// OpenMesh links the faces one by one; the arrays are linked all at once.
TEST(Topology, IsThatOfOpenMesh) {
    auto all = meshes();
    // Of several chunks of faces that are linked for themselves first.
    all.push_back({"torus", test::torus(70, 60)});
    all.push_back({"grid", test::grid(70, 60)});
    all.push_back({"shuffled torus", shuffled(test::torus(70, 60), 1)});
    all.push_back({"shuffled grid", shuffled(test::grid(70, 60), 2)});
    all.push_back({"shuffled poles", shuffled(test::face_pole(360, 3, 2), 3)});
    for (auto&& mesh : test::open_meshes())
        all.push_back(std::move(mesh));
    for (const auto& [name, data] : all) {
        SCOPED_TRACE(name);
        const Result<Topology> t = build_topology(data);
        ASSERT_TRUE(t) << t.error().message;
        EXPECT_EQ(*t, test::topology_of(data));
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
                                             first_face + t.face(h),
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
            ASSERT_EQ(d.vertex[map[h]], t.face(h));
            ASSERT_EQ(d.face(map[h]), rank[t.vertex[h]]);
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

// With the counted valences, and by walks where nobody has counted.
TEST(Topology, FindsVerticesByTheirValence) {
    for (const auto& [name, data] : meshes()) {
        SCOPED_TRACE(name);
        const Topology t = *build_topology(data);
        ASSERT_EQ(t.valences.size(), t.n_vertices());
        for (const Topology& mesh : {t, split(t)}) {
            for (const Index n : {0u, 2u, 3u, 4u, 5u, 254u}) {
                Index expected = 0;
                for (Index v = mesh.find_valence(n); v != kInvalidIndex;
                     v = mesh.find_valence(n, v + 1), ++expected) {
                    while (expected < v)
                        ASSERT_NE(mesh.valence(expected++), n);
                    ASSERT_EQ(mesh.valence(v), n);
                }
                while (expected < mesh.n_vertices())
                    ASSERT_NE(mesh.valence(expected++), n);
            }
        }
    }
}

// ---------------------------------------------------------------------- open meshes

Index count_borders(const Topology& t) {
    return static_cast<Index>(std::ranges::count(t.twin, kInvalidIndex));
}

bool is_inside(const Topology& t, Index v) {
    const Index h = t.vertex_halfedge[v];
    return h != kInvalidIndex && !t.is_border(h);
}

TEST(Topology, DualOfOpenMeshesHasTheVerticesInside) {
    for (const auto& [name, data] : test::open_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data), s = split(t);
        // In a split mesh every face has one vertex inside at least, or two side by side.
        std::vector<Index> map;
        const Topology d = dual(s, &map);
        expect_consistent(d, count_borders(d));
        ASSERT_EQ(d.n_vertices(), s.n_faces());
        ASSERT_EQ(map.size(), s.n_halfedges());
        std::vector<Index> rank(s.n_vertices(), kInvalidIndex);
        Index n_inside = 0;
        for (Index v = 0; v < s.n_vertices(); ++v) {
            if (is_inside(s, v))
                rank[v] = n_inside++;
        }
        ASSERT_EQ(d.n_faces(), n_inside);
        std::vector<bool> hit(d.n_halfedges(), false);
        for (Index h = 0; h < s.n_halfedges(); ++h) {
            if (!is_inside(s, s.vertex[h])) {
                ASSERT_EQ(map[h], kInvalidIndex);
                continue;
            }
            ASSERT_LT(map[h], d.n_halfedges());
            ASSERT_FALSE(hit[map[h]]);
            hit[map[h]] = true;
            ASSERT_EQ(d.vertex[map[h]], s.face(h));
            ASSERT_EQ(d.face(map[h]), rank[s.vertex[h]]);
            ASSERT_EQ(d.next(map[h]), map[s.ccw(h)]);
            // It crosses the edge of the next halfedge about the vertex, whose other end has
            // a dual face or not.
            ASSERT_EQ(d.is_border(map[h]), !is_inside(s, s.to_vertex(s.ccw(h))));
        }
        ASSERT_EQ(std::ranges::count(hit, true), d.n_halfedges());
    }
}

/// Closed and open ones.
std::vector<test::NamedMesh> all_meshes() {
    auto result = meshes();
    for (auto& mesh : test::open_meshes())
        result.push_back(std::move(mesh));
    return result;
}

/// True with probability 1/n, the same on every platform.
std::vector<bool> random_flags(std::size_t size, unsigned seed, unsigned n) {
    std::mt19937 random(seed);
    std::vector<bool> flags(size);
    for (std::size_t i = 0; i < size; ++i)
        flags[i] = random() % n == 0;
    return flags;
}

void expect_equal(const Topology& a, const Topology& b) {
    EXPECT_EQ(a.face_offsets, b.face_offsets);
    EXPECT_EQ(a.vertex, b.vertex);
    EXPECT_EQ(a.twin, b.twin);
    EXPECT_EQ(a.edge, b.edge);
    EXPECT_EQ(a.faces, b.faces);
    EXPECT_EQ(a.n_edges, b.n_edges);
    EXPECT_EQ(a.n_vertices(), b.n_vertices());
}

TEST(Topology, SubmeshKeepsFacesInTheirOrder) {
    for (const auto& [name, data] : all_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        for (unsigned seed = 0; seed < 6; ++seed) {
            const std::vector<bool> flags = random_flags(t.n_faces(), seed, 1 + seed);
            const Flags keep(flags.begin(), flags.end());
            const Submesh sub = submesh(t, keep);
            const Topology& s = sub.topology;
            Buffer<Index> faces, halfedges;
            std::vector<bool> vertex(t.n_vertices(), false), edge(t.n_edges, false);
            for (Index f = 0; f < t.n_faces(); ++f) {
                if (!keep[f])
                    continue;
                faces.push_back(f);
                for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
                    halfedges.push_back(h);
                    vertex[t.vertex[h]] = edge[t.edge[h]] = true;
                }
            }
            const auto ascending = [](const std::vector<bool>& used) {
                Buffer<Index> all;
                for (Index i = 0; i < used.size(); ++i) {
                    if (used[i])
                        all.push_back(i);
                }
                return all;
            };
            ASSERT_EQ(sub.faces, faces);
            ASSERT_EQ(sub.halfedges, halfedges);
            ASSERT_EQ(sub.vertices, ascending(vertex));
            ASSERT_EQ(sub.edges, ascending(edge));
            ASSERT_EQ(s.n_faces(), faces.size());
            ASSERT_EQ(s.n_halfedges(), halfedges.size());
            ASSERT_EQ(s.n_vertices(), sub.vertices.size());
            ASSERT_EQ(s.n_edges, sub.edges.size());
            for (Index k = 0; k < s.n_halfedges(); ++k) {
                const Index h = sub.halfedges[k];
                ASSERT_EQ(sub.faces[s.face(k)], t.face(h));
                ASSERT_EQ(sub.vertices[s.vertex[k]], t.vertex[h]);
                ASSERT_EQ(sub.edges[s.edge[k]], t.edge[h]);
                ASSERT_EQ(sub.halfedges[s.next(k)], t.next(h));
                const Index twin = t.twin[h];
                if (twin == kInvalidIndex || !keep[t.face(twin)])
                    ASSERT_TRUE(s.is_border(k));
                else
                    ASSERT_EQ(sub.halfedges[s.twin[k]], twin);
                // One at a border where there is one, as long as the faces are one fan.
                ASSERT_EQ(s.vertex[s.vertex_halfedge[s.vertex[k]]], s.vertex[k]);
                if (s.is_border(k)) {
                    ASSERT_TRUE(s.is_border(s.vertex_halfedge[s.vertex[k]]));
                }
            }
        }
    }
}

TEST(Topology, SubmeshOfAllIsTheMeshAndOfNoneIsEmpty) {
    for (const auto& [name, data] : all_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = split(test::topology_of(data));
        if (std::ranges::count(t.vertex_halfedge, kInvalidIndex) > 0)
            continue;  // loose vertices have no face that could keep them
        const Submesh all = submesh(t, Flags(t.n_faces(), true));
        expect_equal(all.topology, t);
        expect_consistent(all.topology, count_borders(t));
        const Submesh none = submesh(t, Flags(t.n_faces(), false));
        expect_consistent(none.topology);
        EXPECT_EQ(none.topology.n_vertices(), 0u);
        EXPECT_EQ(none.topology.n_faces(), 0u);
        EXPECT_EQ(none.topology.n_edges, 0u);
    }
    const Submesh loose =
        submesh(test::topology_of(cube_with_loose_vertices()), {1, 1, 1, 1, 1, 1});
    EXPECT_EQ(loose.vertices, (Buffer<Index>{1, 2, 3, 4, 5, 6, 7, 8}));
}

// The faces around one vertex, ring by ring: what local refinement takes.
TEST(Topology, SubmeshOfRingsIsConsistent) {
    for (const auto& [name, data] : all_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = split(split(test::topology_of(data)));
        Flags keep(t.n_faces(), false);
        keep[t.n_faces() / 2] = true;
        for (int ring = 0; ring < 3; ++ring) {
            keep = grown(t, keep);
            const Submesh sub = submesh(t, keep);
            // Rings that meet in a vertex from two sides are no fan.
            std::vector<int> n_ends(sub.topology.n_vertices(), 0);
            bool is_fan = true;
            for (Index k = 0; k < sub.topology.n_halfedges(); ++k) {
                if (sub.topology.is_border(k))
                    is_fan = is_fan && n_ends[sub.topology.vertex[k]]++ == 0;
            }
            if (is_fan)
                expect_consistent(sub.topology, count_borders(sub.topology));
            EXPECT_TRUE(is_fan || ring > 0);
        }
    }
}

TEST(Topology, CutPartsTheFans) {
    for (const auto& [name, data] : all_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        for (unsigned seed = 0; seed < 5; ++seed) {
            // All edges, then fewer and fewer.
            const std::vector<bool> edges = random_flags(t.n_edges, seed, 1 + seed);
            std::vector<Index> vertices;
            const Topology c = cut(t, edges, vertices);
            Index n_cut = 0;
            for (Index h = 0; h < t.n_halfedges(); ++h)
                n_cut += !t.is_border(h) && edges[t.edge[h]] && h < t.twin[h];
            expect_consistent(c, count_borders(t) + 2 * n_cut);
            ASSERT_EQ(c.n_edges, t.n_edges + n_cut);

            // Faces and halfedges keep their numbers; edges the first of their sides.
            ASSERT_EQ(c.face_offsets, t.face_offsets);
            ASSERT_EQ(c.faces, t.faces);
            Index next_edge = t.n_edges;
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                const bool is_cut = !t.is_border(h) && edges[t.edge[h]];
                ASSERT_EQ(c.twin[h], is_cut ? kInvalidIndex : t.twin[h]);
                ASSERT_EQ(c.edge[h], is_cut && h > t.twin[h] ? next_edge++ : t.edge[h]);
                ASSERT_EQ(vertices[c.vertex[h]], t.vertex[h]);
            }

            // A vertex a fan: halfedges about a vertex that uncut edges part have the same.
            ASSERT_EQ(vertices.size(), c.n_vertices());
            Index n_fans = 0;
            for (Index v = 0; v < t.n_vertices(); ++v) {
                ASSERT_EQ(vertices[v], v);
                Index n_ends = 0;  // borders and cuts at the vertex, from the left
                t.for_each_outgoing(
                    v, [&](Index h) { n_ends += t.is_border(h) || edges[t.edge[h]]; });
                n_fans += std::max(n_ends, Index(1));
            }
            ASSERT_EQ(c.n_vertices(), n_fans);
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                const Index onwards = t.ccw(h);
                if (onwards == kInvalidIndex || onwards == h)
                    continue;
                const bool parted = edges[t.edge[onwards]];
                int n_ends = 0;
                t.for_each_outgoing(t.vertex[h], [&](Index g) {
                    n_ends += t.is_border(g) || edges[t.edge[g]];
                });
                ASSERT_EQ(c.vertex[h] == c.vertex[onwards], !parted || n_ends < 2);
            }
        }
    }
}

TEST(Topology, CutAlongNoEdgeOrTheBorderChangesNothing) {
    for (const auto& [name, data] : all_meshes()) {
        SCOPED_TRACE(name);
        const Topology t = test::topology_of(data);
        std::vector<bool> borders(t.n_edges, false);
        for (Index h = 0; h < t.n_halfedges(); ++h)
            borders[t.edge[h]] = t.is_border(h);
        std::vector<Index> vertices;
        const Topology c = cut(t, borders, vertices);
        expect_equal(c, t);
        EXPECT_EQ(c.vertex_halfedge, t.vertex_halfedge);
    }
}

TEST(Topology, BorderStripIsASideOfQuads) {
    for (const auto& [name, data] : test::open_meshes()) {
        const Topology t = split(test::topology_of(data));
        for (unsigned seed = 0; seed < 6; ++seed) {
            SCOPED_TRACE(name + ", seed " + std::to_string(seed));
            // All of the border, then less of it; corners from none to every vertex.
            const std::vector<bool> skipped =
                seed < 3 ? std::vector<bool>(t.n_halfedges(), false)
                         : random_flags(t.n_halfedges(), seed, 3);
            std::vector<bool> corner(t.n_vertices(), false);
            if (seed % 3 > 0)
                corner = random_flags(t.n_vertices(), seed, seed % 3 == 1 ? 1 : 3);
            std::vector<Index> borders;
            std::vector<Index> out_of(t.n_vertices(), kInvalidIndex),
                into(t.n_vertices(), kInvalidIndex);
            for (Index h = 0; h < t.n_halfedges(); ++h) {
                if (!t.is_border(h) || skipped[h])
                    continue;
                borders.push_back(h);
                out_of[t.vertex[h]] = into[t.to_vertex(h)] = h;
            }
            const Topology s = with_border_strip(t, borders, corner);
            const auto m = static_cast<Index>(borders.size());

            std::vector<Index> corners;  // the vertices that have one, in order
            Index n_open_ends = 0;
            for (const Index h : borders) {
                const Index v = t.vertex[h], w = t.to_vertex(h);
                if (into[v] != kInvalidIndex && corner[v])
                    corners.push_back(v);
                n_open_ends += (into[v] == kInvalidIndex) + (out_of[w] == kInvalidIndex);
            }
            const auto n_corners = static_cast<Index>(corners.size());
            // A quad has one side on the outside, a corner two; an open end is one more.
            expect_consistent(s, count_borders(t) + 2 * n_corners + n_open_ends);
            ASSERT_EQ(s.n_faces(), t.n_faces() + m + n_corners);
            ASSERT_EQ(s.n_halfedges(), t.n_halfedges() + 4 * (m + n_corners));
            // A vertex between two quads of the strip, two at corners and open ends, and one
            // more beyond each corner.
            const auto n_used = [](const Topology& x) {
                return x.n_vertices() - static_cast<Index>(std::ranges::count(
                                            x.vertex_halfedge, kInvalidIndex));
            };
            ASSERT_EQ(n_used(s), n_used(t) + m + n_open_ends / 2 + 2 * n_corners);

            for (Index h = 0; h < t.n_halfedges(); ++h) {
                ASSERT_EQ(s.vertex[h], t.vertex[h]);
                ASSERT_EQ(s.edge[h], t.edge[h]);
                ASSERT_EQ(s.face(h), t.face(h));
                if (!t.is_border(h)) {
                    ASSERT_EQ(s.twin[h], t.twin[h]);
                }
            }
            for (Index i = 0; i < m; ++i) {
                const Index h = borders[i];
                ASSERT_EQ(s.face(s.twin[h]), t.n_faces() + i);
                ASSERT_EQ(s.face_size(t.n_faces() + i), 4u);
            }
            for (Index i = 0; i < n_corners; ++i) {
                const auto quad = face_of(s, t.n_faces() + m + i);
                ASSERT_EQ(quad.size(), 4u);
                ASSERT_EQ(std::ranges::count(quad, corners[i]), 1);
            }
            for (Index v = 0; v < t.n_vertices(); ++v) {
                const bool both = into[v] != kInvalidIndex && out_of[v] != kInvalidIndex;
                const Index n_quads = (into[v] != kInvalidIndex) +
                                      (out_of[v] != kInvalidIndex) + (both && corner[v]);
                ASSERT_EQ(s.valence(v), t.valence(v) + n_quads) << "vertex " << v;
                if (both) {
                    ASSERT_TRUE(is_inside(s, v)) << "vertex " << v;
                }
            }
        }
    }
}

// ---- Channels and names ----

void expect_refused(const MeshData& mesh, ErrorCode code, Index element, Index line,
                    const std::string& words) {
    const auto t = build_topology(mesh);
    ASSERT_FALSE(t) << words;
    EXPECT_EQ(t.error().code, code) << t.error().message;
    EXPECT_EQ(t.error().element, element);
    EXPECT_EQ(t.error().line, line);
    EXPECT_NE(t.error().message.find(words), std::string::npos) << t.error().message;
}

TEST(MeshChannels, AreCheckedAtTheDoor) {
    MeshData good = test::cube();
    good.vertex_lines = {11, 12, 13, 14, 15, 16, 17, 18};
    good.channels = {{"color", 3, std::vector<double>(24, 0.5)},
                     {"weight", 1, std::vector<double>(8, 2)}};
    ASSERT_TRUE(build_topology(good));
    using enum ErrorCode;
    for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY)}) {
        MeshData mesh = good;
        mesh.channels[0].values[3 * 5 + 2] = bad;
        expect_refused(mesh, NonFinitePoint, 5, 16, "in the channel color");
    }
    MeshData mesh = good;
    mesh.channels[1].values[7] = NAN;
    expect_refused(mesh, NonFinitePoint, 7, 18, "in the channel weight");
    mesh = good;
    mesh.channels[1].values.pop_back();
    expect_refused(mesh, SizeMismatch, kInvalidIndex, 0,
                   "the channel weight has 7 values, but 8 vertices need 1 each");
    mesh = good;
    mesh.channels[1].n = 0;
    expect_refused(mesh, SizeMismatch, kInvalidIndex, 0, "weight has 0 numbers");
    mesh = good;
    mesh.channels[0] = {"color", 2, std::vector<double>(16, 0)};
    expect_refused(mesh, SizeMismatch, kInvalidIndex, 0, "colours have 3 or 4");
}

TEST(MeshFaceNames, AreCheckedAtTheDoor) {
    MeshData good = test::cube();
    good.face_lines = {21, 22, 23, 24, 25, 26};
    const FaceNames names = {{"a", "b"}, {0, 1, kInvalidIndex, 1, 0, 0}};
    for (FaceNames MeshData::*kind :
         {&MeshData::groups, &MeshData::objects, &MeshData::materials}) {
        MeshData mesh = good;
        mesh.*kind = names;
        ASSERT_TRUE(build_topology(mesh));
        (mesh.*kind).faces[3] = 2;
        expect_refused(mesh, ErrorCode::IndexOutOfRange, 3, 24, "face 3 has number 2 of");
        (mesh.*kind).faces.pop_back();
        expect_refused(mesh, ErrorCode::SizeMismatch, kInvalidIndex, 0, "5 faces");
    }
}

}  // namespace
}  // namespace osdx
