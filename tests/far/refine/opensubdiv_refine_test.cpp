// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Degree 3 against the uniform refinement of OpenSubdiv, which shares no code with ours.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefiner.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/mesh_file.h>
#include <osdx/topology.h>

#include "far/mesh/topology_edits.h"
#include "far/refine/grids/odd_grids.h"
#include "far/refine/refinement.h"
#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

constexpr int kLevels = 3;

template <class T>
struct OsdPoint {
    Vec3<T> p{T(0)};
    void Clear() { p = Vec3<T>(T(0)); }
    void AddWithWeight(const OsdPoint& other, T weight) { p += weight * other.p; }
};

/// The tags of a mesh in OpenSubdiv's form, read here once more: nothing of ours is asked.
struct OsdTags {
    std::vector<int> crease_vertices, corner_vertices, holes;
    std::vector<float> crease_weights, corner_weights;
    Sdc::Options options;

    OsdTags(const MeshData& mesh, std::optional<BoundaryRule> boundary) {
        options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
        for (const Tag& tag : mesh.tags) {
            if (tag.name == "crease") {
                crease_vertices.insert(crease_vertices.end(), tag.ints.begin(),
                                       tag.ints.end());
                crease_weights.push_back(static_cast<float>(tag.floats.at(0)));
            } else if (tag.name == "corner") {
                corner_vertices.push_back(tag.ints.at(0));
                corner_weights.push_back(static_cast<float>(tag.floats.at(0)));
            } else if (tag.name == "hole") {
                holes.insert(holes.end(), tag.ints.begin(), tag.ints.end());
            } else if (tag.name == "creasemethod" && tag.text.at(0) == "chaikin") {
                options.SetCreasingMethod(Sdc::Options::CREASE_CHAIKIN);
            } else if (tag.name == "smoothtriangles" && tag.text.at(0) == "smooth") {
                options.SetTriangleSubdivision(Sdc::Options::TRI_SUB_SMOOTH);
            } else if (tag.name == "interpolateboundary") {
                options.SetVtxBoundaryInterpolation(
                    tag.ints.at(0) == 0   ? Sdc::Options::VTX_BOUNDARY_NONE
                    : tag.ints.at(0) == 1 ? Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER
                                          : Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
            }
        }
        if (boundary) {
            options.SetVtxBoundaryInterpolation(
                *boundary == BoundaryRule::None ? Sdc::Options::VTX_BOUNDARY_NONE
                : *boundary == BoundaryRule::EdgeOnly
                    ? Sdc::Options::VTX_BOUNDARY_EDGE_ONLY
                    : Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
        }
    }
};

std::unique_ptr<Far::TopologyRefiner> osd_refiner(const MeshData& mesh,
                                                  std::optional<BoundaryRule> boundary) {
    const std::vector<int> sizes(mesh.face_sizes.begin(), mesh.face_sizes.end());
    const std::vector<int> vertices(mesh.face_vertices.begin(), mesh.face_vertices.end());
    const OsdTags tags(mesh, boundary);
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(mesh.positions.size());
    descriptor.numFaces = static_cast<int>(sizes.size());
    descriptor.numVertsPerFace = sizes.data();
    descriptor.vertIndicesPerFace = vertices.data();
    descriptor.numCreases = static_cast<int>(tags.crease_weights.size());
    descriptor.creaseVertexIndexPairs = tags.crease_vertices.data();
    descriptor.creaseWeights = tags.crease_weights.data();
    descriptor.numCorners = static_cast<int>(tags.corner_weights.size());
    descriptor.cornerVertexIndices = tags.corner_vertices.data();
    descriptor.cornerWeights = tags.corner_weights.data();
    descriptor.numHoles = static_cast<int>(tags.holes.size());
    descriptor.holeIndices = tags.holes.data();
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    std::unique_ptr<Far::TopologyRefiner> refiner(
        Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_CATMARK, tags.options)));
    Far::TopologyRefiner::UniformOptions options(kLevels);
    options.fullTopologyInLastLevel = true;
    refiner->RefineUniform(options);
    return refiner;
}

/// Points of levels 0, 1, ...
template <class T>
std::vector<std::vector<OsdPoint<T>>> osd_points(const Far::TopologyRefiner& refiner,
                                                 const std::vector<Vec3<T>>& base) {
    std::vector<std::vector<OsdPoint<T>>> points(1);
    for (const Vec3<T>& p : base)
        points[0].push_back({p});
    const Far::PrimvarRefinerReal<T> interpolator(refiner);
    for (int l = 1; l <= kLevels; ++l) {
        points.emplace_back(refiner.GetLevel(l).GetNumVertices());
        interpolator.Interpolate(l, points[l - 1], points[l]);
    }
    return points;
}

/// Our vertices and faces of a level in OpenSubdiv's numbering.
struct Correspondence {
    std::vector<int> vertex, face;
};

void descend(const Topology& ours, const Far::TopologyLevel& theirs,
             Correspondence& map) {
    Correspondence child;
    for (Index v = 0; v < ours.n_vertices(); ++v)
        child.vertex.push_back(theirs.GetVertexChildVertex(map.vertex[v]));
    std::vector<int> of_edge(ours.n_edges, -1);
    for (Index h = 0; h < ours.n_halfedges(); ++h) {
        // By face and corner: two vertices may have several edges in common.
        const int f = map.face[ours.face(h)];
        const int corner =
            theirs.GetFaceVertices(f).FindIndex(map.vertex[ours.vertex[h]]);
        ASSERT_GE(corner, 0);
        const int e = theirs.GetFaceEdges(f)[corner];
        of_edge[ours.edge[h]] = theirs.GetEdgeChildVertex(e);
    }
    child.vertex.insert(child.vertex.end(), of_edge.begin(), of_edge.end());
    for (Index f = 0; f < ours.n_faces(); ++f)
        child.vertex.push_back(theirs.GetFaceChildVertex(map.face[f]));
    for (Index h = 0; h < ours.n_halfedges(); ++h) {
        const int f = map.face[ours.face(h)];
        const auto corners = theirs.GetFaceVertices(f);
        const int corner = corners.FindIndex(map.vertex[ours.vertex[h]]);
        ASSERT_GE(corner, 0);
        child.face.push_back(theirs.GetFaceChildFaces(f)[corner]);
    }
    map = std::move(child);
}

/// Far keeps sharpness in float, which errs by 2^-22 below 8: as much of an edge as the mixed
/// points may move. \return that, or 0 where floats hold every sharpness
double sharpness_error(const MeshData& mesh) {
    bool exact = true;
    for (const Tag& tag : mesh.tags) {
        exact = exact && tag.name != "creasemethod";
        for (const double s : tag.floats)
            exact = exact && double(float(s)) == s;
    }
    return exact ? 0 : std::ldexp(1.0, -22);
}

/// Whether Chaikin's averages end one half of an edge whose sharpness s was above one. There
/// Far 3.5 extrapolates, (s crease - (s - 1) smooth), although its own comment and its other
/// callers take the crease: it passes a rule for the child that skips the clamping of s.
bool far_extrapolates(const RefinedLevel& parent, const RefinedLevel& child) {
    for (Index e = 0; e < parent.topology.n_edges; ++e) {
        const bool first = child.features.edge(2 * e) > 0,
                   second = child.features.edge(2 * e + 1) > 0;
        if (parent.features.edge(e) > 1 && !(first && second))
            return true;
    }
    return false;
}

/// The points of each level, ours against theirs. Raises `worst` to the largest distance over
/// the diagonal. \return false if a level was left out since far_extrapolates()
template <class T>
bool expect_equal_levels(const MeshData& mesh, double* worst = nullptr,
                         std::optional<BoundaryRule> boundary = {}) {
    const auto refiner = osd_refiner(mesh, boundary);
    std::vector<Vec3<T>> points(mesh.positions.begin(), mesh.positions.end());
    const auto theirs = osd_points<T>(*refiner, points);

    const Topology base = test::topology_of(mesh);
    const auto features = build_features(mesh, base, {.boundary = boundary});
    if (!features) {
        ADD_FAILURE() << features.error().message;
        return false;
    }
    Refinement refinement(base, 3, *features);
    Correspondence map;
    for (Index v = 0; v < refinement.topology(0).n_vertices(); ++v)
        map.vertex.push_back(static_cast<int>(v));
    for (Index f = 0; f < refinement.topology(0).n_faces(); ++f)
        map.face.push_back(static_cast<int>(f));

    std::size_t longest_row = 0;
    for (int l = 1; l <= kLevels; ++l) {
        refinement.add_level();
        if (far_extrapolates(refinement.level(l - 1), refinement.level(l)))
            return false;
        for (const StencilTable& factor : refinement.factors(l)) {
            std::vector<Vec3<T>> next(factor.n_rows());
            factor.apply(std::span<const Vec3<T>>(points), std::span(next));
            points = std::move(next);
            for (Index r = 0; r < factor.n_rows(); ++r)
                longest_row =
                    std::max(longest_row, factor.offsets[r + 1] - factor.offsets[r]);
        }
        descend(refinement.topology(l - 1), refiner->GetLevel(l - 1), map);
        if (testing::Test::HasFatalFailure())
            return true;
        EXPECT_EQ(points.size(), theirs[l].size());
        const auto& hole = refinement.level(l).features.hole;
        for (Index f = 0; f < refinement.topology(l).n_faces(); ++f) {
            EXPECT_EQ(!hole.empty() && hole[f],
                      refiner->GetLevel(l).IsFaceHole(map.face[f]))
                << "level " << l << ", face " << f;
        }
        // Both sides sum rows in another order. A sum of m terms errs by m/2 ulps at worst
        // and sqrt(m)/2 as a rule; OpenSubdiv's weights are sums themselves and as far off
        // again (measured: 1.6 times half of this, at valence 24). Each level adds its own.
        const T tolerance = T((l * 4 * (2 + std::sqrt(double(longest_row))) *
                                   std::numeric_limits<T>::epsilon() +
                               l * sharpness_error(mesh)) *
                              test::diagonal(mesh));
        for (Index v = 0; v < points.size(); ++v) {
            const T distance = glm::distance(points[v], theirs[l][map.vertex[v]].p);
            EXPECT_LE(distance, tolerance) << "level " << l << ", vertex " << v;
            if (worst)
                *worst = std::max(*worst, distance / test::diagonal(mesh));
            if (distance > tolerance)
                return true;
        }
    }
    return true;
}

/// The last level on grids, in float.
void expect_equal_grids(const MeshData& mesh) {
    const auto refiner = osd_refiner(mesh, {});
    const std::vector<Vec3<float>> points(mesh.positions.begin(), mesh.positions.end());
    const auto theirs = osd_points<float>(*refiner, points).back();
    const OddGrids ours(test::topology_of(mesh), 3, kLevels, test::features_of(mesh));
    const QuadGrids grids = ours.grids();
    ASSERT_EQ(grids.n_vertices(), theirs.size());
    std::vector<Vec3<float>> out(grids.n_vertices());
    ours.points(std::span<const Vec3<float>>(points), std::span(out));
    std::vector<Index> vertices(grids.n_halfedges());
    face_vertices(grids, vertices);

    Topology level = test::topology_of(mesh);
    Correspondence map;
    for (Index v = 0; v < level.n_vertices(); ++v)
        map.vertex.push_back(static_cast<int>(v));
    for (Index f = 0; f < level.n_faces(); ++f)
        map.face.push_back(static_cast<int>(f));
    Index valence = 4;
    for (Index v = 0; v < level.n_vertices(); ++v)
        valence = std::max(valence, level.valence(v));
    for (Index f = 0; f < level.n_faces(); ++f)
        valence = std::max(valence, level.face_size(f));
    for (int l = 0; l < kLevels; ++l) {
        descend(level, refiner->GetLevel(l), map);
        if (testing::Test::HasFatalFailure())
            return;
        level = split(level);
    }
    // As in expect_equal_levels(): the rows have 2 n + 1 entries at most.
    const double tolerance = (kLevels * 4 * (2 + std::sqrt(2.0 * valence + 1)) *
                                  std::numeric_limits<float>::epsilon() +
                              kLevels * sharpness_error(mesh)) *
                             test::diagonal(mesh);
    for (Index h = 0; h < level.n_halfedges(); ++h) {
        ASSERT_LE(glm::distance(out[vertices[ours.from_split(h)]],
                                theirs[map.vertex[level.vertex[h]]].p),
                  tolerance)
            << "halfedge " << h;
    }
}

std::vector<test::NamedMesh> meshes() {
    auto result = test::closed_meshes();
    for (const Index n : {3u, 5u, 8u, 64u, 360u})
        result.push_back({"pole " + std::to_string(n), test::pole(n, 1, 2)});
    result.push_back({"prism 64", test::prism(64)});
    return result;
}

bool has_quads_only(const MeshData& mesh) {
    return std::ranges::all_of(mesh.face_sizes, [](Index n) { return n == 4; });
}

TEST(OpenSubdivRefine, QuadMeshesInDouble) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (has_quads_only(mesh))
            expect_equal_levels<double>(mesh);
    }
}

TEST(OpenSubdivRefine, QuadMeshesInFloat) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (has_quads_only(mesh))
            expect_equal_levels<float>(mesh);
    }
}

TEST(OpenSubdivRefine, OtherPolygonsInDouble) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (!has_quads_only(mesh))
            expect_equal_levels<double>(mesh);
    }
}

TEST(OpenSubdivRefine, OtherPolygonsInFloat) {
    for (const auto& [name, mesh] : meshes()) {
        SCOPED_TRACE(name);
        if (!has_quads_only(mesh))
            expect_equal_levels<float>(mesh);
    }
}

constexpr BoundaryRule kBoundaryRules[] = {BoundaryRule::None, BoundaryRule::EdgeOnly,
                                           BoundaryRule::EdgeAndCorner};

TEST(OpenSubdivRefine, Grids) {
    auto all = meshes();
    for (auto& mesh : test::open_meshes())
        all.push_back(std::move(mesh));
    for (auto& mesh : test::semi_sharp_meshes())
        all.push_back(std::move(mesh));
    for (const auto& [name, mesh] : all) {
        SCOPED_TRACE(name);
        expect_equal_grids(mesh);
    }
}

TEST(OpenSubdivRefine, OpenMeshes) {
    for (const auto& [name, mesh] : test::open_meshes()) {
        for (const BoundaryRule boundary : kBoundaryRules) {
            SCOPED_TRACE(name + ", boundary rule " + std::to_string(int(boundary)));
            expect_equal_levels<double>(mesh, nullptr, boundary);
            expect_equal_levels<float>(mesh, nullptr, boundary);
        }
    }
}

Tag make_tag(std::string name, std::vector<int> ints, std::vector<double> floats) {
    return {std::move(name), std::move(ints), std::move(floats), {}, 0};
}

/// Creases and corners of every sharpness on random edges and vertices: creases, darts,
/// junctions, at borders too. Eighths and their Chaikin averages are exact in float as well,
/// so that both sides end a crease on the same level.
MeshData with_random_tags(MeshData mesh, unsigned seed, bool chaikin) {
    static constexpr double kSharpness[] = {0.125, 0.5, 1,    1.5, 2,
                                            2.875, 3,   4.25, 10,  12};
    std::mt19937 random(seed);
    const auto sharpness = [&] { return kSharpness[random() % std::size(kSharpness)]; };
    const Topology t = test::topology_of(mesh);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (random() % 3 == 0) {
            mesh.tags.push_back(make_tag(
                "crease", {int(t.vertex[h]), int(t.to_vertex(h))}, {sharpness()}));
        }
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (random() % 8 == 0)
            mesh.tags.push_back(make_tag("corner", {int(v)}, {sharpness()}));
    }
    mesh.tags.push_back(make_tag("hole", {int(random() % t.n_faces())}, {}));
    mesh.tags.push_back({"creasemethod", {}, {}, {chaikin ? "chaikin" : "normal"}, 0});
    mesh.tags.push_back(make_tag("interpolateboundary", {int(random() % 3)}, {}));
    if (seed % 2)
        mesh.tags.push_back({"smoothtriangles", {}, {}, {"smooth"}, 0});
    return mesh;
}

TEST(OpenSubdivRefine, SharpFeatures) {
    auto all = test::open_meshes();
    for (auto& mesh : test::closed_meshes())
        all.push_back(std::move(mesh));
    int n_whole = 0, n_all = 0;
    for (unsigned i = 0; i < all.size(); ++i) {
        for (const bool chaikin : {false, true}) {
            SCOPED_TRACE(all[i].name + (chaikin ? ", Chaikin" : ", uniform"));
            for (unsigned seed = 0; seed < 4; ++seed) {
                const bool whole = expect_equal_levels<double>(
                    with_random_tags(all[i].data, 10 * i + seed, chaikin));
                EXPECT_TRUE(whole || chaikin);
                n_whole += whole && chaikin;
                n_all += chaikin;
            }
        }
    }
    EXPECT_GT(2 * n_whole, n_all);
}

// Two faces at an interior vertex: the weight of the vertex itself is negative on the split
// mesh, but not in Catmull and Clark's form.
TEST(OpenSubdivRefine, InteriorVerticesOfTwoFaces) {
    MeshData mesh;
    mesh.positions = {{0, 0, 0}, {2, 0, 0}, {1, 2, 0}, {1, 0.5, 1}, {1, 0, -0.5}};
    mesh.face_sizes = {4, 4, 3, 3};
    mesh.face_vertices = {0, 4, 1, 2, 0, 3, 1, 4, 0, 2, 3, 1, 3, 2};
    expect_equal_levels<double>(mesh);
    mesh.face_sizes = {5, 5};
    mesh.face_vertices = {0, 1, 2, 3, 4, 4, 3, 2, 1, 0};
    expect_equal_levels<double>(mesh);
}

// All meshes of the folder OSDX_MESHES with their tags, as they are and under both boundary
// rules that keep the border; what is refused is named.
TEST(OpenSubdivRefine, MeshesOfAFolder) {
    const char* folder = std::getenv("OSDX_MESHES");
    if (!folder)
        GTEST_SKIP() << "OSDX_MESHES names no folder";
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
        if (file.path().extension() == ".obj" || file.path().extension() == ".off")
            files.push_back(file.path());
    }
    std::ranges::sort(files);
    int n_compared = 0;
    double worst_double = 0, worst_float = 0;
    for (const auto& file : files) {
        SCOPED_TRACE(file.string());
        const auto mesh = read_mesh(file);
        std::string refusal;
        if (!mesh) {
            refusal = mesh.error().message;
        } else if (const auto built = build_topology(*mesh); !built) {
            refusal = built.error().message;
        } else if (const auto features = build_features(*mesh, *built); !features) {
            refusal = features.error().message;
        }
        if (!refusal.empty()) {
            std::printf("%s: refused: %s\n", file.filename().c_str(), refusal.c_str());
            continue;
        }
        if (!expect_equal_levels<double>(*mesh, &worst_double))
            std::printf("%s: not to the last level\n", file.filename().c_str());
        for (const auto rule : {BoundaryRule::EdgeOnly, BoundaryRule::EdgeAndCorner}) {
            expect_equal_levels<double>(*mesh, &worst_double, rule);
            expect_equal_levels<float>(*mesh, &worst_float, rule);
        }
        ++n_compared;
    }
    EXPECT_GT(n_compared, 0);
    std::printf(
        "%d of %zu meshes at %d levels, largest difference over the diagonal: %.2g in "
        "double, %.2g in float\n",
        n_compared, files.size(), kLevels, worst_double, worst_float);
}

}  // namespace
}  // namespace osdx
