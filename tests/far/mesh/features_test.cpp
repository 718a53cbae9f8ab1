// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/build_topology.h>
#include <osdx/creases.h>
#include <osdx/features.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "far/refine/refinement.h"
#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

/// A tetrahedron with a tag that does nothing on line 201 and another one on line 202.
MeshData tagged(Tag tag) {
    MeshData data = test::tetrahedron();
    tag.line = 202;
    data.tags = {{"interpolateboundary", {1}, {}, {}, 201}, std::move(tag)};
    return data;
}

Result<Features> read(const MeshData& data, const FeatureOptions& options = {}) {
    return build_features(data, test::topology_of(data), options);
}

Index edge_between(const Topology& t, Index a, Index b) {
    Index found = kInvalidIndex;
    t.for_each_edge(a, [&](Index e, Index to) {
        if (to == b)
            found = e;
    });
    return found;
}

TEST(Features, HoldWhatTheTagsSay) {
    MeshData data = test::grid(2, 2);
    data.tags = {{"crease", {4, 1}, {2.5}, {}, 0},
                 {"crease", {4, 7}, {11}, {}, 0},
                 {"crease", {4, 3}, {1}, {}, 0},
                 {"crease", {3, 4}, {0}, {}, 0},
                 {"corner", {4, 0}, {3}, {}, 0},
                 {"corner", {1, 2}, {1, -2}, {}, 0},
                 {"hole", {3}, {}, {}, 0},
                 {"interpolateboundary", {1}, {}, {}, 0},
                 {"creasemethod", {}, {}, {"chaikin"}, 0},
                 {"smoothtriangles", {}, {}, {"smooth"}, 0},
                 {"facevaryinginterpolateboundary", {1}, {}, {}, 0}};
    const Topology t = test::topology_of(data);
    const Result<Features> f = read(data);
    ASSERT_TRUE(f) << f.error().message;
    EXPECT_EQ(f->edge(edge_between(t, 1, 4)), 2.5);
    EXPECT_EQ(f->edge(edge_between(t, 4, 7)), kInfinitelySharp);
    EXPECT_EQ(f->edge(edge_between(t, 4, 3)), 0);  // the later tag
    EXPECT_EQ(f->edge(edge_between(t, 0, 1)), 0);
    EXPECT_EQ(f->vertex_sharpness, (std::vector<double>{3, 1, 0, 0, 3, 0, 0, 0, 0}));
    EXPECT_EQ(f->hole, (std::vector<bool>{false, false, false, true}));
    EXPECT_EQ(f->boundary, BoundaryRule::EdgeAndCorner);
    EXPECT_EQ(f->creases, CreaseMethod::Chaikin);
    EXPECT_TRUE(f->smooth_triangles);

    const Result<Features> other = read(data, {.boundary = BoundaryRule::None});
    ASSERT_TRUE(other);
    EXPECT_EQ(other->boundary, BoundaryRule::None);
    const Result<Features> none = read(data, {.ignore_tags = true});
    ASSERT_TRUE(none);
    EXPECT_TRUE(none->edge_sharpness.empty());
    EXPECT_TRUE(none->vertex_sharpness.empty());
    EXPECT_TRUE(none->hole.empty());
    EXPECT_EQ(none->boundary, BoundaryRule::EdgeOnly);
}

TEST(Features, RefuseTagsThatDoNotFit) {
    const Tag tags[] = {{"crease", {0, 7}, {1}, {}, 0},
                        {"crease", {0, -1}, {1}, {}, 0},
                        {"crease", {0, 1, 2}, {1, 1}, {}, 0},
                        {"crease", {0, 1}, {}, {}, 0},
                        {"crease", {0, 1}, {std::nan("")}, {}, 0},
                        {"corner", {4}, {1}, {}, 0},
                        {"corner", {-1}, {1}, {}, 0},
                        {"corner", {0, 1, 2}, {1, 1}, {}, 0},
                        {"hole", {4}, {}, {}, 0},
                        {"interpolateboundary", {3}, {}, {}, 0},
                        {"interpolateboundary", {}, {}, {}, 0},
                        {"creasemethod", {}, {}, {"round"}, 0},
                        {"smoothtriangles", {1}, {}, {}, 0}};
    for (const Tag& tag : tags) {
        SCOPED_TRACE(tag.name);
        const Result<Features> f = read(tagged(tag));
        ASSERT_FALSE(f);
        EXPECT_EQ(f.error().code, ErrorCode::InvalidTag) << f.error().message;
        EXPECT_EQ(f.error().element, 1u);
        EXPECT_EQ(f.error().line, 202u);
        EXPECT_NE(f.error().message.find(tag.name), std::string::npos);
        EXPECT_TRUE(read(tagged(tag), {.ignore_tags = true}));
    }
    for (const char* name : {"vertexedit", "no such tag"}) {
        const Result<Features> f = read(tagged({name, {}, {}, {}, 0}));
        ASSERT_FALSE(f);
        EXPECT_EQ(f.error().code, ErrorCode::UnsupportedTag);
        EXPECT_EQ(f.error().line, 202u);
    }
}

// What reads the border in features cannot be handed plain ones.
static_assert(!std::is_constructible_v<ResolvedFeatures, Features>);

TEST(Features, ResolvedMakeTheBorderSharp) {
    const Topology t = test::topology_of(test::grid(2, 3));
    for (const BoundaryRule rule :
         {BoundaryRule::None, BoundaryRule::EdgeOnly, BoundaryRule::EdgeAndCorner}) {
        Features plain;
        plain.boundary = rule;
        const ResolvedFeatures f = resolve(t, plain);
        for (Index h = 0; h < t.n_halfedges(); ++h)
            EXPECT_EQ(f.edge(t.edge[h]), t.is_border(h) ? kInfinitelySharp : 0.0);
        for (Index v = 0; v < t.n_vertices(); ++v) {
            const bool pinned = rule == BoundaryRule::EdgeAndCorner && t.valence(v) == 1;
            EXPECT_EQ(f.vertex(v), pinned ? kInfinitelySharp : 0.0);
        }
        for (Index face = 0; face < t.n_faces(); ++face)
            EXPECT_EQ(f.is_hole(face), rule == BoundaryRule::None);
        EXPECT_EQ(resolve(t, f), f);
    }
    EXPECT_TRUE(resolve(test::topology_of(test::cube()), {}).edge_sharpness.empty());
}

// Two levels at once, and one level, written and read again, then one more: the same points.
TEST(Features, SurviveTheWayThroughAFile) {
    for (MeshData data : {test::grid(3, 3), test::cube()}) {
        data = test::random_displaced(data, 1, 0.2);
        const auto v = [&](int i) { return int(data.face_vertices[i]); };
        data.tags = {{"crease", {v(0), v(1)}, {2.25}, {}, 0},
                     {"crease", {v(1), v(2)}, {1.5}, {}, 0},
                     {"crease", {v(2), v(3)}, {10}, {}, 0},
                     {"corner", {v(0)}, {1.5}, {}, 0},
                     {"hole", {1}, {}, {}, 0},
                     {"interpolateboundary", {1}, {}, {}, 0},
                     {"creasemethod", {}, {}, {"chaikin"}, 0}};
        const Result<Features> features = read(data);
        ASSERT_TRUE(features);
        Refinement two(test::topology_of(data), 3, *features);
        two.add_level();
        const RefinedLevel& level = two.level(1);
        MeshData middle = to_mesh_data(level.topology, two.points(data.positions));
        middle.tags = to_tags(level.topology, level.features);
        two.add_level();

        const Topology t = test::topology_of(middle);
        const Result<Features> again = read(middle);
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_EQ(again->hole, level.features.hole);
        Refinement one(t, 3, *again);
        one.add_level();
        const auto expected = two.points(data.positions),
                   actual = one.points(middle.positions);
        ASSERT_EQ(actual.size(), expected.size());
        // Face points stand at the end of both; the edges between are numbered otherwise.
        const Index first_face = t.n_vertices() + t.n_edges;
        for (Index i = 0; i < actual.size(); ++i) {
            if (i < t.n_vertices() || i >= first_face) {
                EXPECT_LT(glm::length(actual[i] - expected[i]), 1e-14) << i;  // rounding
            }
        }
    }
}

MeshData with_lines(MeshData data) {
    for (Index v = 0; v < data.positions.size(); ++v)
        data.vertex_lines.push_back(11 + v);
    for (Index f = 0; f < data.face_sizes.size(); ++f)
        data.face_lines.push_back(101 + f);
    return data;
}

void expect_no_surface(const MeshData& data, int degree, ErrorCode code, Index element,
                       Index line) {
    const Result<Surface> s = Surface::build(data, {.degree = degree});
    ASSERT_FALSE(s);
    EXPECT_EQ(s.error().code, code) << s.error().message;
    EXPECT_EQ(s.error().element, element);
    EXPECT_EQ(s.error().line, line);
}

TEST(Features, SurfacesRefuseWhatTheyHaveNoRulesFor) {
    MeshData two = test::tetrahedron();
    two.positions.emplace_back(0, 0, 0);
    two.face_sizes = {4, 4, 3, 3};
    two.face_vertices = {0, 4, 1, 2, 0, 3, 1, 4, 0, 2, 3, 1, 3, 2};
    for (const int degree : {2, 3})
        expect_no_surface(with_lines(two), degree, ErrorCode::ValenceTwo, 4, 15);
    // Creases part the two faces: each has a border of its own.
    two.tags = {{"crease", {4, 0}, {10}, {}, 0}, {"crease", {4, 1}, {10}, {}, 0}};
    EXPECT_TRUE(Surface::build(two));
    const Tag smooth = {"smoothtriangles", {}, {}, {"smooth"}, 0};
    expect_no_surface(tagged(smooth), 4, ErrorCode::UnsupportedTag, 1, 202);
    EXPECT_TRUE(Surface::build(tagged(smooth)));
    EXPECT_TRUE(Surface::build(tagged(smooth), {.degree = 4}, {.ignore_tags = true}));
    const Tag harmless[] = {{"creasemethod", {}, {}, {"chaikin"}, 0},
                            {"facevaryinginterpolateboundary", {1}, {}, {}, 0},
                            {"smoothtriangles", {}, {}, {"catmark"}, 0},
                            {"crease", {0, 1}, {2.5}, {}, 0},
                            {"corner", {0}, {1}, {}, 0},
                            {"crease", {0, 1}, {0}, {}, 0},
                            {"corner", {0, 1}, {0, -1}, {}, 0}};
    for (const Tag& tag : harmless) {
        for (const int degree : {3, 4})
            EXPECT_TRUE(Surface::build(tagged(tag), {.degree = degree})) << tag.name;
    }
}

// A roof whose sides rise by 3/4, so that their normals differ by twice the angle of that.
TEST(Creases, AreWhereNormalsDifferByMoreThanTheAngle) {
    MeshData roof;
    roof.positions = {{-4, 0, 0}, {0, 0, 3}, {4, 0, 0}, {-4, 9, 0}, {0, 9, 3}, {4, 9, 0}};
    roof.face_sizes = {4, 4};
    roof.face_vertices = {0, 1, 4, 3, 1, 2, 5, 4};
    const Topology topology = *build_topology(roof);
    const double angle = 2 * std::atan2(3, 4) * 180 / M_PI;
    const std::vector<Tag> tags = crease_tags(roof, topology, angle - 1e-9);
    ASSERT_EQ(tags.size(), 1u);
    EXPECT_EQ(tags[0].name, "crease");
    EXPECT_EQ(tags[0].ints, (std::vector<int>{1, 4}));
    EXPECT_EQ(tags[0].floats, std::vector<double>{kInfinitelySharp});
    EXPECT_TRUE(crease_tags(roof, topology, angle + 1e-9).empty());
    for (Vec3<double>& p : roof.positions)
        p.z = 0;
    EXPECT_TRUE(crease_tags(roof, topology, 0).empty());
}

}  // namespace
}  // namespace osdx
