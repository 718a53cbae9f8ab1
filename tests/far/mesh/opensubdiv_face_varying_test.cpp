// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Face-varying data against Far's InterpolateFaceVarying, which shares no code with ours.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefiner.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <osdx/build_topology.h>
#include <osdx/face_varying.h>
#include <osdx/mesh_file.h>
#include <osdx/topology.h>

#include "far/mesh/topology_edits.h"
#include "far/refine/refinement.h"
#include "tests/support/test_meshes.h"
#include "tests/support/thinned.h"

namespace osdx {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

constexpr int kLevels = 3;
constexpr FaceVaryingRule kRules[] = {
    FaceVaryingRule::None,         FaceVaryingRule::CornersOnly,
    FaceVaryingRule::CornersPlus1, FaceVaryingRule::CornersPlus2,
    FaceVaryingRule::Boundaries,   FaceVaryingRule::All};
constexpr BoundaryRule kBoundaryRules[] = {BoundaryRule::None, BoundaryRule::EdgeOnly,
                                           BoundaryRule::EdgeAndCorner};

struct OsdValue {
    Vec2<double> p{0};
    void Clear() { p = Vec2<double>(0); }
    void AddWithWeight(const OsdValue& other, double weight) { p += weight * other.p; }
};

Sdc::Options::FVarLinearInterpolation osd_rule(FaceVaryingRule rule) {
    switch (rule) {
        case FaceVaryingRule::None:
            return Sdc::Options::FVAR_LINEAR_NONE;
        case FaceVaryingRule::CornersOnly:
            return Sdc::Options::FVAR_LINEAR_CORNERS_ONLY;
        case FaceVaryingRule::CornersPlus1:
            return Sdc::Options::FVAR_LINEAR_CORNERS_PLUS1;
        case FaceVaryingRule::CornersPlus2:
            return Sdc::Options::FVAR_LINEAR_CORNERS_PLUS2;
        case FaceVaryingRule::Boundaries:
            return Sdc::Options::FVAR_LINEAR_BOUNDARIES;
        case FaceVaryingRule::All:
            break;
    }
    return Sdc::Options::FVAR_LINEAR_ALL;
}

std::unique_ptr<Far::TopologyRefiner> osd_refiner(const MeshData& mesh,
                                                  BoundaryRule boundary,
                                                  FaceVaryingRule rule) {
    Sdc::Options options;
    options.SetFVarLinearInterpolation(osd_rule(rule));
    options.SetVtxBoundaryInterpolation(boundary == BoundaryRule::None
                                            ? Sdc::Options::VTX_BOUNDARY_NONE
                                        : boundary == BoundaryRule::EdgeOnly
                                            ? Sdc::Options::VTX_BOUNDARY_EDGE_ONLY
                                            : Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    std::vector<int> crease_vertices, corner_vertices;
    std::vector<float> crease_weights, corner_weights;
    for (const Tag& tag : mesh.tags) {
        if (tag.name == "crease") {
            crease_vertices.insert(crease_vertices.end(), tag.ints.begin(),
                                   tag.ints.end());
            crease_weights.push_back(static_cast<float>(tag.floats.at(0)));
        } else if (tag.name == "corner") {
            corner_vertices.push_back(tag.ints.at(0));
            corner_weights.push_back(static_cast<float>(tag.floats.at(0)));
        } else if (tag.name == "creasemethod" && tag.text.at(0) == "chaikin") {
            options.SetCreasingMethod(Sdc::Options::CREASE_CHAIKIN);
        } else if (tag.name == "smoothtriangles" && tag.text.at(0) == "smooth") {
            options.SetTriangleSubdivision(Sdc::Options::TRI_SUB_SMOOTH);
        }
    }
    const std::vector<int> sizes(mesh.face_sizes.begin(), mesh.face_sizes.end());
    const std::vector<int> vertices(mesh.face_vertices.begin(), mesh.face_vertices.end());
    const std::vector<int> values(mesh.face_uvs.begin(), mesh.face_uvs.end());
    Far::TopologyDescriptor::FVarChannel channel;
    channel.numValues = static_cast<int>(mesh.uvs.size());
    channel.valueIndices = values.data();
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(mesh.positions.size());
    descriptor.numFaces = static_cast<int>(sizes.size());
    descriptor.numVertsPerFace = sizes.data();
    descriptor.vertIndicesPerFace = vertices.data();
    descriptor.numCreases = static_cast<int>(crease_weights.size());
    descriptor.creaseVertexIndexPairs = crease_vertices.data();
    descriptor.creaseWeights = crease_weights.data();
    descriptor.numCorners = static_cast<int>(corner_weights.size());
    descriptor.cornerVertexIndices = corner_vertices.data();
    descriptor.cornerWeights = corner_weights.data();
    descriptor.numFVarChannels = 1;
    descriptor.fvarChannels = &channel;
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    std::unique_ptr<Far::TopologyRefiner> refiner(
        Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_CATMARK, options)));
    Far::TopologyRefiner::UniformOptions uniform(kLevels);
    uniform.fullTopologyInLastLevel = true;
    refiner->RefineUniform(uniform);
    return refiner;
}

/// Where our faces are among theirs: corner c of our face f is corner c + shift of theirs.
struct FaceMap {
    std::vector<int> face, shift;
};

FaceMap descend(const Topology& ours, const Far::TopologyLevel& theirs,
                const Far::TopologyLevel& children, const FaceMap& map) {
    FaceMap child;
    for (Index h = 0; h < ours.n_halfedges(); ++h) {
        const Index f = ours.face(h);
        const int corner = static_cast<int>(h - ours.face_offsets[f]) + map.shift[f];
        const int wrapped = corner % static_cast<int>(ours.face_size(f));
        const int face = theirs.GetFaceChildFaces(map.face[f])[wrapped];
        const int vertex =
            theirs.GetVertexChildVertex(theirs.GetFaceVertices(map.face[f])[wrapped]);
        child.face.push_back(face);
        child.shift.push_back(children.GetFaceVertices(face).FindIndex(vertex));
    }
    return child;
}

/// One level of linear interpolation: FaceVaryingRule::All.
void split_linearly(Topology& t, std::vector<Vec2<double>>& values) {
    std::vector<Vec2<double>> edges(t.n_edges), faces(t.n_faces(), Vec2<double>(0));
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        edges[t.edge[h]] = 0.5 * (values[t.vertex[h]] + values[t.to_vertex(h)]);
        faces[t.face(h)] += values[t.vertex[h]] / double(t.face_size(t.face(h)));
    }
    values.insert(values.end(), edges.begin(), edges.end());
    values.insert(values.end(), faces.begin(), faces.end());
    t = split(t);
}

std::vector<Vec2<double>> refined(const StencilTable& factor,
                                  const std::vector<Vec2<double>>& in) {
    std::vector<Vec2<double>> out(factor.n_rows());
    factor.apply(std::span<const Vec2<double>>(in), std::span(out));
    return out;
}

/// Whether Chaikin's averages end one half of an edge whose sharpness was above one: there Far
/// 3.5 goes astray, as opensubdiv_refine_test.cpp says.
bool far_extrapolates(const RefinedLevel& parent, const RefinedLevel& child) {
    for (Index e = 0; e < parent.topology.n_edges; ++e) {
        if (parent.features.edge(e) > 1 &&
            !(child.features.edge(2 * e) > 0 && child.features.edge(2 * e + 1) > 0))
            return true;
    }
    return false;
}

/// The largest difference of a corner's value on any level, in units of the values.
/// \return nothing where we refuse
std::optional<double> difference(const MeshData& mesh, BoundaryRule boundary,
                                 FaceVaryingRule rule) {
    const Topology base = test::topology_of(mesh);
    const auto features = build_features(mesh, base, {.boundary = boundary});
    EXPECT_TRUE(features) << features.error().message;
    const auto channel = build_face_varying(base, *features, mesh.face_uvs, rule);
    if (!channel) {
        EXPECT_EQ(channel.error().code, ErrorCode::UnsupportedTag);
        return std::nullopt;
    }

    const auto refiner = osd_refiner(mesh, boundary, rule);
    std::vector<OsdValue> theirs;
    for (const Vec2<double>& uv : mesh.uvs)
        theirs.push_back({uv});
    const Far::PrimvarRefinerReal<double> interpolator(*refiner);

    std::vector<Vec2<double>> ours;
    for (const Index value : channel->values)
        ours.push_back(mesh.uvs[value]);
    Topology linear = channel->topology;
    Refinement refinement(channel->topology, 3, channel->features);
    FaceMap map;
    for (Index f = 0; f < base.n_faces(); ++f) {
        map.face.push_back(static_cast<int>(f));
        map.shift.push_back(0);
    }
    double worst = 0;
    for (int l = 1; l <= kLevels; ++l) {
        std::vector<OsdValue> next(refiner->GetLevel(l).GetNumFVarValues(0));
        interpolator.InterpolateFaceVarying(l, theirs, next, 0);
        theirs = std::move(next);
        map = descend(refinement.topology(l - 1), refiner->GetLevel(l - 1),
                      refiner->GetLevel(l), map);
        refinement.add_level();
        if (far_extrapolates(refinement.level(l - 1), refinement.level(l)))
            return worst;
        if (rule == FaceVaryingRule::All) {
            split_linearly(linear, ours);
        } else {
            for (const StencilTable& factor : refinement.factors(l))
                ours = refined(factor, ours);
        }
        const Topology& t = refinement.topology(l);
        EXPECT_EQ(ours.size(), t.n_vertices());
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            const Index f = t.face(h);
            const auto values = refiner->GetLevel(l).GetFaceFVarValues(map.face[f], 0);
            const int c = static_cast<int>(h - t.face_offsets[f]) + map.shift[f];
            worst = std::max(worst,
                             glm::distance(ours[t.vertex[h]], theirs[values[c % 4]].p));
        }
    }
    return worst;
}

/// How the corners of a mesh get their values.
enum class Layout { NoSeams, AllApart, TwoSides, Patches, Bowties, AnyCorner };
constexpr Layout kLayouts[] = {Layout::NoSeams, Layout::AllApart, Layout::TwoSides,
                               Layout::Patches, Layout::Bowties,  Layout::AnyCorner};

MeshData with_uvs(MeshData mesh, Layout layout, unsigned seed) {
    std::mt19937 random(seed);
    const auto n_vertices = static_cast<Index>(mesh.positions.size());
    std::vector<Index> number(4 * n_vertices, kInvalidIndex);
    mesh.uvs.clear();
    mesh.face_uvs.clear();
    const auto add = [&] {
        // By the seed alone: the distributions of the standard library differ.
        const double u = double(random()) / 0x1p32, v = double(random()) / 0x1p32;
        mesh.uvs.emplace_back(u, v);
        return static_cast<Index>(mesh.uvs.size() - 1);
    };
    std::size_t corner = 0;
    for (Index f = 0; f < mesh.face_sizes.size(); ++f) {
        const Index of_face = layout == Layout::TwoSides
                                  ? Index(2 * f < mesh.face_sizes.size())
                              : layout == Layout::Patches ? Index(random() % 8 == 0)
                              : layout == Layout::Bowties ? Index(random() % 3)
                                                          : 0;
        for (Index c = 0; c < mesh.face_sizes[f]; ++c, ++corner) {
            const Index label =
                layout == Layout::AnyCorner ? Index(random() % 5 / 3) : of_face;
            Index& value = number[4 * mesh.face_vertices[corner] + label];
            if (value == kInvalidIndex || layout == Layout::AllApart)
                value = add();
            mesh.face_uvs.push_back(value);
        }
    }
    return mesh;
}

Tag make_tag(std::string name, std::vector<int> ints, std::vector<double> floats) {
    return {std::move(name), std::move(ints), std::move(floats), {}, 0};
}

/// Creases and corners of every sharpness on random edges and vertices.
MeshData with_random_tags(MeshData mesh, unsigned seed, bool chaikin) {
    static constexpr double kSharpness[] = {0.125, 0.5, 1, 1.5, 2, 2.875, 3, 4.25, 10};
    std::mt19937 random(seed);
    const auto sharpness = [&] { return kSharpness[random() % std::size(kSharpness)]; };
    const auto sparsity = static_cast<Index>(2 + random() % 6);
    const Topology t = test::topology_of(mesh);
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (random() % sparsity == 0 && (t.is_border(h) || h < t.twin[h])) {
            mesh.tags.push_back(make_tag(
                "crease", {int(t.vertex[h]), int(t.to_vertex(h))}, {sharpness()}));
        }
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (random() % 8 == 0)
            mesh.tags.push_back(make_tag("corner", {int(v)}, {sharpness()}));
    }
    mesh.tags.push_back({"creasemethod", {}, {}, {chaikin ? "chaikin" : "normal"}, 0});
    if (seed % 2)
        mesh.tags.push_back({"smoothtriangles", {}, {}, {"smooth"}, 0});
    return mesh;
}

std::vector<test::NamedMesh> meshes() {
    auto all = test::closed_meshes();
    for (auto& mesh : test::open_meshes())
        all.push_back(std::move(mesh));
    std::erase_if(all, [](const auto& m) { return m.data.face_sizes.size() > 80; });
    return all;
}

// Sums of tens of terms below 1 on three levels, in another order: hundreds of ulps at most.
constexpr double kRounding = 1e-13;
// Far has the mixing weights of crease and corner as floats.
constexpr double kFloatWeights = 3e-7;

TEST(OpenSubdivFaceVarying, AllRulesOnMeshesWithoutTags) {
    const std::vector layouts(std::begin(kLayouts), std::end(kLayouts));
    const std::vector boundaries(std::begin(kBoundaryRules), std::end(kBoundaryRules));
    const std::vector rules(std::begin(kRules), std::end(kRules));
    for (const auto& [name, mesh] : meshes()) {
        for (const auto& [layout, boundary, rule] :
             test::thinned(test::combinations(layouts, boundaries, rules))) {
            SCOPED_TRACE(testing::Message()
                         << name << ", layout " << int(layout) << ", rule " << int(rule)
                         << ", boundary rule " << int(boundary));
            const auto d =
                difference(with_uvs(mesh, layout, unsigned(boundary)), boundary, rule);
            ASSERT_TRUE(d);
            EXPECT_LE(*d, kRounding);
        }
    }
}

TEST(OpenSubdivFaceVarying, AllRulesOnMeshesWithSharpFeatures) {
    int n_refused = 0, n_chaikin = 0;
    for (const auto& [name, mesh] : meshes()) {
        for (const Layout layout : kLayouts) {
            for (const unsigned seed :
                 test::thinned<unsigned>({3, 0, 1, 2, 4, 5, 6, 7})) {
                const bool chaikin = seed % 4 == 3;
                const MeshData data =
                    with_random_tags(with_uvs(mesh, layout, seed), seed, chaikin);
                for (const FaceVaryingRule rule : kRules) {
                    SCOPED_TRACE(testing::Message()
                                 << name << ", layout " << int(layout) << ", seed "
                                 << seed << ", rule " << int(rule));
                    const auto d = difference(data, kBoundaryRules[seed % 3], rule);
                    ASSERT_TRUE(d || chaikin);
                    n_refused += !d;
                    n_chaikin += chaikin;
                    EXPECT_LE(d.value_or(0), kFloatWeights);
                }
            }
        }
    }
    EXPECT_GT(n_refused, 0);
    EXPECT_LT(n_refused, n_chaikin);
}

// All meshes of the folder OSDX_MESHES that have texture coordinates, by all rules and by that
// of their tags; what is refused is named.
TEST(OpenSubdivFaceVarying, MeshesOfAFolder) {
    const char* folder = std::getenv("OSDX_MESHES");
    if (!folder)
        GTEST_SKIP() << "OSDX_MESHES names no folder";
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
        if (file.path().extension() == ".obj")
            files.push_back(file.path());
    }
    std::ranges::sort(files);
    int n_compared = 0, n_with_uvs = 0;
    double worst = 0;
    for (const auto& file : files) {
        SCOPED_TRACE(file.string());
        const auto mesh = read_mesh(file);
        if (!mesh || mesh->face_uvs.empty())
            continue;
        ++n_with_uvs;
        const auto refuse = [&](const Error& error) {
            std::printf("%s: refused: %s\n", file.filename().c_str(),
                        error.message.c_str());
        };
        const auto built = build_topology(*mesh);
        if (!built) {
            refuse(built.error());
            continue;
        }
        const Topology base = *built;
        const auto features = build_features(*mesh, base);
        if (!features) {
            refuse(features.error());
            continue;
        }
        const auto rule = face_varying_rule(*mesh);
        ASSERT_TRUE(rule) << rule.error().message;
        // Values lie within the box of the texture coordinates.
        Vec2<double> low = mesh->uvs[0], high = low;
        for (const Vec2<double>& uv : mesh->uvs) {
            low = glm::min(low, uv);
            high = glm::max(high, uv);
        }
        const double size = std::max(glm::distance(low, high), 1e-300);
        bool whole = true;
        for (const FaceVaryingRule r : kRules) {
            const auto channel = build_face_varying(base, *features, mesh->face_uvs, r);
            if (!channel) {
                std::printf("%s: rule %d refused: %s\n", file.filename().c_str(), int(r),
                            channel.error().message.c_str());
                whole = false;
                continue;
            }
            for (const BoundaryRule boundary : kBoundaryRules) {
                const auto d = difference(*mesh, boundary, r);
                ASSERT_TRUE(d);
                EXPECT_LE(*d / size, kFloatWeights) << "rule " << int(r);
                worst = std::max(worst, *d / size);
            }
        }
        n_compared += whole;
    }
    EXPECT_GT(n_compared, 0);
    std::printf(
        "%d of %d meshes with texture coordinates compared by all rules at %d levels, "
        "largest difference over their box: %.2g\n",
        n_compared, n_with_uvs, kLevels, worst);
}

}  // namespace
}  // namespace osdx
