// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include <osdx/add_channels.h>
#include <osdx/file.h>
#include <osdx/files/tessellation_file.h>
#include <osdx/mesh_file.h>
#include <osdx/subdivide.h>
#include <osdx/surface.h>

#include "tests/support/test_folder.h"

namespace osdx {
namespace {

namespace fs = std::filesystem;
using test::content, test::TestFolder;

class Export : public TestFolder {};

/// Takes a number from the front of `bytes`, lowest byte first.
template <class T>
T take(std::string_view& bytes) {
    static_assert(std::endian::native == std::endian::little);
    T value{};
    if (bytes.size() < sizeof(T)) {
        ADD_FAILURE() << "the file is too short";
        return value;
    }
    std::memcpy(&value, bytes.data(), sizeof(T));
    bytes.remove_prefix(sizeof(T));
    return value;
}

Vec3<float> take_vector(std::string_view& bytes) {
    const auto x = take<float>(bytes);
    const auto y = take<float>(bytes);
    return {x, y, take<float>(bytes)};
}

void expect_error(const Status& status, ErrorCode code) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, code) << status.error().message;
}

// ---- Meshes ----

void expect_same(const Result<MeshData>& read, const MeshData& written) {
    ASSERT_TRUE(read) << read.error().message << ", line " << read.error().line;
    EXPECT_EQ(read->positions, written.positions);
    EXPECT_EQ(read->face_sizes, written.face_sizes);
    EXPECT_EQ(read->face_vertices, written.face_vertices);
}

/// Faces of 3 to 7 vertices over points of all magnitudes; a few hundred kB as text.
MeshData random_mesh() {
    std::mt19937 random(42);
    std::uniform_real_distribution<double> mantissa(-1, 1);
    std::uniform_int_distribution<int> exponent(-300, 300), size(3, 7), vertex(0, 2999);
    MeshData mesh;
    for (int i = 0; i < 3000; ++i) {
        Vec3<double> p;
        for (int k = 0; k < 3; ++k)
            p[k] = std::ldexp(mantissa(random), exponent(random));
        mesh.positions.push_back(p);
    }
    mesh.positions[7] = {0.1, -0.0, std::numeric_limits<double>::denorm_min()};
    mesh.positions[8] = {1.0 / 3, 1e22, std::numeric_limits<double>::max()};
    for (int i = 0; i < 3000; ++i) {
        mesh.face_sizes.push_back(static_cast<Index>(size(random)));
        for (Index c = 0; c < mesh.face_sizes.back(); ++c)
            mesh.face_vertices.push_back(static_cast<Index>(vertex(random)));
    }
    return mesh;
}

TEST_F(Export, MeshesReadBackExactly) {
    const MeshData mesh = random_mesh();
    for (const std::string_view extension : {".obj", ".off", ".ply", ".OBJ"}) {
        SCOPED_TRACE(extension);
        const fs::path path = folder_ / ("mesh" + std::string(extension));
        const Status status = write_mesh(path, mesh);
        ASSERT_TRUE(status) << status.error().message;
        const auto read = read_mesh(path);
        expect_same(read, mesh);
        ASSERT_TRUE(read);
        EXPECT_TRUE(std::signbit(read->positions[7].y));  // == takes -0 for 0
    }
    EXPECT_EQ(n_files(), 4);
}

TEST_F(Export, FacesOfManyVerticesReadBackFromPly) {
    MeshData mesh;
    mesh.positions.resize(300, Vec3<double>(0));
    mesh.face_sizes = {300, 3};
    for (Index v = 0; v < 303; ++v)
        mesh.face_vertices.push_back(v % 300);
    ASSERT_TRUE(write_mesh(folder_ / "mesh.ply", mesh));
    expect_same(read_mesh(folder_ / "mesh.ply"), mesh);
    // A list counted by uchar could not hold the first face.
    EXPECT_NE(content(folder_ / "mesh.ply").find("list uint uint"), std::string::npos);
}

TEST_F(Export, TextureCoordinatesReadBackFromObj) {
    MeshData mesh = random_mesh();
    for (std::size_t i = 0; i < 1000; ++i)
        mesh.uvs.emplace_back(1.0 / double(i + 1), -0.1 * double(i));
    for (std::size_t c = 0; c < mesh.face_vertices.size(); ++c)
        mesh.face_uvs.push_back(static_cast<Index>(7 * c % 1000));
    ASSERT_TRUE(write_mesh(folder_ / "mesh.obj", mesh));
    const auto read = read_mesh(folder_ / "mesh.obj");
    expect_same(read, mesh);
    EXPECT_EQ(read->uvs, mesh.uvs);
    EXPECT_EQ(read->face_uvs, mesh.face_uvs);
    mesh.face_uvs.pop_back();
    for (const std::string_view name : {"mesh.obj", "mesh.off"})
        expect_error(write_mesh(folder_ / name, mesh), ErrorCode::SizeMismatch);
}

TEST_F(Export, TagsReadBackFromObj) {
    MeshData mesh;
    mesh.positions.resize(3, Vec3<double>(0));
    mesh.face_sizes = {3};
    mesh.face_vertices = {0, 1, 2};
    mesh.tags = {{"crease", {0, 1}, {1.0 / 3}, {}, 0},
                 {"creasemethod", {}, {}, {"chaikin"}, 0},
                 {"edit", {-1}, {1e-300, 2}, {"add", "P"}, 0}};
    ASSERT_TRUE(write_mesh(folder_ / "mesh.obj", mesh));
    const auto read = read_mesh(folder_ / "mesh.obj");
    expect_same(read, mesh);
    ASSERT_EQ(read->tags.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(read->tags[i].name, mesh.tags[i].name);
        EXPECT_EQ(read->tags[i].ints, mesh.tags[i].ints);
        EXPECT_EQ(read->tags[i].floats, mesh.tags[i].floats);
        EXPECT_EQ(read->tags[i].text, mesh.tags[i].text);
    }
    // The other formats have no place for tags.
    ASSERT_TRUE(write_mesh(folder_ / "mesh.off", mesh));
    expect_same(read_mesh(folder_ / "mesh.off"), mesh);
}

TEST_F(Export, RefusesTagsThatObjCannotHold) {
    for (const std::string word : {"", "two words", "#x", "x\\", "x\n"}) {
        MeshData mesh;
        mesh.tags = {{"crease", {}, {}, {"good", word}, 0}};
        expect_error(write_mesh(folder_ / "mesh.obj", mesh), ErrorCode::WriteFailed);
        mesh.tags = {{word, {}, {}, {}, 0}};
        expect_error(write_mesh(folder_ / "mesh.obj", mesh), ErrorCode::WriteFailed);
    }
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Export, RefusesMeshesAndExtensionsItCannotWrite) {
    MeshData mesh;
    mesh.face_sizes = {3, 4};
    mesh.face_vertices = {0, 1, 2, 0, 1, 2};
    for (const std::string_view name : {"mesh.obj", "mesh.off", "mesh.ply"})
        expect_error(write_mesh(folder_ / name, mesh), ErrorCode::SizeMismatch);
    mesh.face_sizes = {3, 3};
    for (const std::string_view name : {"mesh.stl", "mesh.glb", "mesh"})
        expect_error(write_mesh(folder_ / name, mesh), ErrorCode::InvalidOption);
    EXPECT_EQ(n_files(), 0);
}

// ---- Tessellations ----

/// A quad of face 7 and a triangle of face 9 over it, like a house; numbers that differ
/// between float and double. The surface has no normal at point 4.
Tessellation house() {
    Tessellation t;
    t.positions = {
        {0, 0, 0.1}, {1.1, 0, 0.1}, {1.1, 1, 0.1}, {0, 1, 0.1}, {0.5, 2.2, 0.1}};
    t.normals = {{0, 0, 1}, {0.6, 0, 0.8}, {0, 0.6, 0.8}, {0, 0, 1}, {0, 0, 0}};
    t.addresses.resize(5);
    t.facet_sizes = {4, 3};
    t.facet_faces = {7, 9};
    t.facet_points = {0, 1, 2, 3, 3, 2, 4};
    t.facet_normals = t.facet_points;
    t.facet_uvs = {{0, 0}, {1.0 / 3, 0}, {1.0 / 3, 0.1},  {0, 0.1},
                   {1, 0}, {1, 1},       {0.7, 0.1 + 0.2}};
    return t;
}

TEST_F(Export, ObjHoldsTheTessellationExactly) {
    const Tessellation t = house();
    ASSERT_TRUE(write_tessellation(folder_ / "house.obj", t));
    const auto mesh = read_mesh(folder_ / "house.obj");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(std::ranges::equal(mesh->positions, t.positions));
    EXPECT_TRUE(std::ranges::equal(mesh->face_sizes, t.facet_sizes));
    EXPECT_TRUE(std::ranges::equal(mesh->face_vertices, t.facet_points));

    const std::string text = content(folder_ / "house.obj");
    EXPECT_NE(text.find("f 1/1/1 2/2/2 3/3/3 4/4/4\nf 4/5/4 3/6/3 5/7/5\n"),
              std::string::npos)
        << text;
    std::istringstream words(text);
    std::vector<double> normals, uvs;
    for (std::string line; std::getline(words, line);) {
        std::istringstream numbers(line);
        std::string keyword;
        numbers >> keyword;
        for (double x = 0; (keyword == "vn" || keyword == "vt") && numbers >> x;)
            (keyword == "vn" ? normals : uvs).push_back(x);
    }
    ASSERT_EQ(normals.size(), 15u);
    ASSERT_EQ(uvs.size(), 14u);
    for (std::size_t i = 0; i < 5; ++i)
        EXPECT_EQ(Vec3<double>(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]),
                  t.normals[i]);
    for (std::size_t c = 0; c < 7; ++c)
        EXPECT_EQ(Vec2<double>(uvs[2 * c], uvs[2 * c + 1]), t.facet_uvs[c]);
}

TEST_F(Export, PlyHoldsPositionsExactlyAndTheBaseFaces) {
    const Tessellation t = house();
    ASSERT_TRUE(write_tessellation(folder_ / "house.ply", t));
    const auto mesh = read_mesh(folder_ / "house.ply");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(std::ranges::equal(mesh->positions, t.positions));
    EXPECT_TRUE(std::ranges::equal(mesh->face_sizes, t.facet_sizes));
    EXPECT_TRUE(std::ranges::equal(mesh->face_vertices, t.facet_points));

    const std::string text = content(folder_ / "house.ply");
    constexpr std::string_view kEnd = "end_header\n";
    std::string_view bytes = text;
    bytes.remove_prefix(text.find(kEnd) + kEnd.size());
    for (std::size_t i = 0; i < 5; ++i) {
        for (int k = 0; k < 3; ++k)
            EXPECT_EQ(take<double>(bytes), t.positions[i][k]);
        EXPECT_EQ(take_vector(bytes), Vec3<float>(t.normals[i]));
    }
    std::size_t corner = 0;
    for (std::size_t i = 0; i < 2; ++i) {
        const Index n = t.facet_sizes[i];
        EXPECT_EQ(take<std::uint8_t>(bytes), n);
        for (Index c = 0; c < n; ++c)
            EXPECT_EQ(take<std::uint32_t>(bytes), t.facet_points[corner + c]);
        EXPECT_EQ(take<std::uint32_t>(bytes), t.facet_faces[i]);
        EXPECT_EQ(take<std::uint8_t>(bytes), 2 * n);
        for (Index c = 0; c < n; ++c) {
            EXPECT_EQ(take<float>(bytes), static_cast<float>(t.facet_uvs[corner + c].x));
            EXPECT_EQ(take<float>(bytes), static_cast<float>(t.facet_uvs[corner + c].y));
        }
        corner += n;
    }
    EXPECT_TRUE(bytes.empty());
    for (const std::string_view line :
         {"format binary_little_endian 1.0", "property list uchar uint vertex_indices",
          "property uint base_face", "property list uchar float texcoord"})
        EXPECT_NE(text.find(std::string(line) + "\n"), std::string::npos) << line;
}

/// A GLB file, cut into its chunks.
struct Glb {
    nlohmann::json json;
    std::string binary;

    /// The bytes of an accessor.
    std::string_view data(std::size_t accessor) const {
        const auto& view =
            json["bufferViews"]
                [json["accessors"][accessor]["bufferView"].get<std::size_t>()];
        return std::string_view(binary).substr(view.value("byteOffset", 0u),
                                               view["byteLength"].get<std::size_t>());
    }
};

Glb read_glb(const fs::path& path) {
    const std::string text = content(path);
    std::string_view bytes = text;
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    bytes.remove_prefix(std::min<std::size_t>(4, bytes.size()));
    EXPECT_EQ(take<std::uint32_t>(bytes), 2u);
    EXPECT_EQ(take<std::uint32_t>(bytes), text.size());
    const auto json_size = take<std::uint32_t>(bytes);
    EXPECT_EQ(json_size % 4, 0u);
    EXPECT_LT(json_size, 4000u);  // the check of the size leaves that much
    EXPECT_EQ(take<std::uint32_t>(bytes), 0x4E4F534Au);
    Glb glb;
    glb.json = nlohmann::json::parse(bytes.substr(0, json_size));
    bytes.remove_prefix(json_size);
    const auto binary_size = take<std::uint32_t>(bytes);
    EXPECT_EQ(take<std::uint32_t>(bytes), 0x004E4942u);
    EXPECT_EQ(binary_size, bytes.size());
    glb.binary = bytes;
    EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
    return glb;
}

/// The house with a sharp eave: at points 2 and 3 the triangle has normals of its own. A
/// point and a normal of no facet.
Tessellation house_with_eave() {
    Tessellation t = house();
    t.normals.insert(t.normals.end(), {{1, 0, 0}, {0.8, 0, 0.6}});
    t.facet_normals = {0, 1, 2, 3, 6, 5, 4};
    t.positions.emplace_back(9, 9, 9);
    t.normals.emplace_back(0, 1, 0);
    return t;
}

TEST_F(Export, ObjNamesTheNormalOfEachSide) {
    ASSERT_TRUE(write_tessellation(folder_ / "house.obj", house_with_eave()));
    const std::string text = content(folder_ / "house.obj");
    EXPECT_NE(text.find("f 1/1/1 2/2/2 3/3/3 4/4/4\nf 4/5/7 3/6/6 5/7/5\n"),
              std::string::npos)
        << text;
}

TEST_F(Export, PlyAndGlbHaveAVertexForEachSide) {
    const Tessellation t = house_with_eave();
    // In the order of the points; points 2 and 3 twice, the last point not at all.
    const std::vector<Index> points = {0, 1, 2, 2, 3, 3, 4};
    const std::vector<Index> normals = {0, 1, 2, 5, 3, 6, 4};
    const std::vector<Index> corners = {0, 1, 2, 4, 5, 3, 6};

    ASSERT_TRUE(write_tessellation(folder_ / "house.ply", t));
    const auto mesh = read_mesh(folder_ / "house.ply");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->face_vertices, corners);
    ASSERT_EQ(mesh->positions.size(), points.size());
    for (std::size_t v = 0; v < points.size(); ++v)
        EXPECT_EQ(mesh->positions[v], t.positions[points[v]]);
    const std::string text = content(folder_ / "house.ply");
    constexpr std::string_view kEnd = "end_header\n";
    std::string_view bytes = text;
    bytes.remove_prefix(text.find(kEnd) + kEnd.size());
    for (std::size_t v = 0; v < points.size(); ++v) {
        bytes.remove_prefix(24);
        EXPECT_EQ(take_vector(bytes), Vec3<float>(t.normals[normals[v]]));
    }

    ASSERT_TRUE(write_tessellation(folder_ / "house.glb", t));
    const Glb glb = read_glb(folder_ / "house.glb");
    std::string_view position = glb.data(0), normal = glb.data(1), index = glb.data(2);
    ASSERT_EQ(position.size(), 7 * 12u);
    for (std::size_t v = 0; v < points.size(); ++v) {
        EXPECT_EQ(take_vector(position), Vec3<float>(t.positions[points[v]]));
        // The point without normal has that of its triangle.
        const Vec3<double> expected =
            normals[v] == 4 ? Vec3<double>(0, 0, 1) : t.normals[normals[v]];
        // Half a unit in the last place of each component.
        EXPECT_LE(glm::length(Vec3<double>(take_vector(normal)) - expected), 1e-7);
    }
    for (const Index c : {0, 1, 2, 0, 2, 3, 4, 5, 6})
        EXPECT_EQ(take<Index>(index), corners[c]);
}

/// The house with a roof that is apart from its wall in the texture, at point 3 only.
Tessellation house_with_texture() {
    Tessellation t = house();
    t.texcoords = {{0, 0}, {0.5, 0}, {0.5, 0.25}, {0, 0.25}, {0.25, 0.75}, {1.0 / 3, 1}};
    t.facet_texcoords = {0, 1, 2, 3, 5, 2, 4};
    return t;
}

TEST_F(Export, ObjNamesTextureCoordinates) {
    const Tessellation t = house_with_texture();
    ASSERT_TRUE(write_tessellation(folder_ / "house.obj", t));
    const auto mesh = read_mesh(folder_ / "house.obj");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(std::ranges::equal(mesh->face_vertices, t.facet_points));
    EXPECT_TRUE(std::ranges::equal(mesh->uvs, t.texcoords));
    EXPECT_TRUE(std::ranges::equal(mesh->face_uvs, t.facet_texcoords));
}

TEST_F(Export, PlyHoldsTextureCoordinatesOfCorners) {
    const Tessellation t = house_with_texture();
    ASSERT_TRUE(write_tessellation(folder_ / "house.ply", t));
    const auto mesh = read_mesh(folder_ / "house.ply");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(std::ranges::equal(mesh->face_vertices,
                                   t.facet_points));  // no vertex is doubled for them
    const std::string text = content(folder_ / "house.ply");
    std::string_view bytes = text;
    // The triangle, from the end: four bytes for each number, one for each count.
    bytes.remove_prefix(text.size() - 6 * 4);
    for (const Index i : {5, 2, 4}) {
        EXPECT_EQ(take<float>(bytes), static_cast<float>(t.texcoords[i].x));
        EXPECT_EQ(take<float>(bytes), static_cast<float>(t.texcoords[i].y));
    }
}

TEST_F(Export, GlbHoldsTextureCoordinatesOfVertices) {
    const Tessellation t = house_with_texture();
    ASSERT_TRUE(write_tessellation(folder_ / "house.glb", t));
    const Glb glb = read_glb(folder_ / "house.glb");
    const nlohmann::json& primitive = glb.json["meshes"][0]["primitives"][0];
    ASSERT_EQ(glb.json["accessors"].size(), 4u);
    const auto accessor = primitive["attributes"]["TEXCOORD_0"].get<std::size_t>();
    EXPECT_EQ(glb.json["accessors"][accessor]["type"], "VEC2");
    EXPECT_EQ(glb.json["accessors"][accessor]["componentType"], 5126);  // float
    EXPECT_EQ(glb.json["accessors"][accessor]["count"], 6u);
    EXPECT_EQ(glb.json["bufferViews"][accessor]["target"], 34962);  // vertices
    // In the order of the points; point 3 twice.
    std::string_view bytes = glb.data(accessor);
    for (const Index i : {0, 1, 2, 3, 5, 4}) {
        EXPECT_EQ(take<float>(bytes), static_cast<float>(t.texcoords[i].x));
        EXPECT_EQ(take<float>(bytes), static_cast<float>(1 - t.texcoords[i].y));
    }
    bytes = glb.data(primitive["attributes"]["POSITION"].get<std::size_t>());
    bytes.remove_prefix(3 * 12);
    const Vec3<float> once = take_vector(bytes);
    EXPECT_EQ(once, take_vector(bytes));
    bytes = glb.data(primitive["indices"].get<std::size_t>());
    for (const Index expected : {0, 1, 2, 0, 2, 3, 4, 2, 5})
        EXPECT_EQ(take<Index>(bytes), expected);
}

/// The house with an eave, with channels of its points: a colour beyond 1, and others of one, three
/// and five numbers that differ between float and double.
Tessellation house_with_channels() {
    Tessellation t = house_with_eave();
    t.channels = {
        {"color", 3, {}}, {"weight", 1, {}}, {"velocity", 3, {}}, {"five", 5, {}}};
    for (NamedChannels& c : t.channels) {
        for (std::size_t i = 0; i < t.positions.size() * static_cast<std::size_t>(c.n);
             ++i)
            c.values.push_back(double(i) / (c.n + 6.0));
    }
    for (double& x : t.channels[1].values)
        x = std::round(x);
    return t;
}

void expect_channel(const Result<MeshData>& mesh, std::string_view name, int n,
                    const std::vector<double>& values) {
    ASSERT_TRUE(mesh) << mesh.error().message;
    const NamedChannels* c = find_channels(mesh->channels, name);
    ASSERT_TRUE(c) << name;
    EXPECT_EQ(c->n, n) << name;
    EXPECT_EQ(c->values, values) << name;
}

TEST_F(Export, ObjHoldsColoursExactly) {
    const Tessellation t = house_with_channels();
    ASSERT_TRUE(write_tessellation(folder_ / "house.obj", t));
    const auto mesh = read_mesh(folder_ / "house.obj");
    expect_channel(mesh, "color", 3, t.channels[0].values);
    EXPECT_EQ(mesh->channels.size(), 1u);
    EXPECT_TRUE(std::ranges::equal(mesh->positions, t.positions));
}

TEST_F(Export, PlyHoldsAllChannelsOfVertices) {
    const Tessellation t = house_with_channels();
    ASSERT_TRUE(write_tessellation(folder_ / "house.ply", t));
    const auto mesh = read_mesh(folder_ / "house.ply");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->channels.size(), 4u);
    for (const NamedChannels& c : t.channels) {
        std::vector<double> expected;  // points 2 and 3 twice, the last not at all
        for (const Index p : {0, 1, 2, 2, 3, 3, 4}) {
            for (int k = 0; k < c.n; ++k) {
                const double x = c.view()[p][k];
                expected.push_back(c.name == "color" ? double(float(x)) : x);
            }
        }
        expect_channel(mesh, c.name, c.n, expected);
    }
    const std::string text = content(folder_ / "house.ply");
    for (const std::string_view line : {"float red", "float blue", "float weight",
                                        "double velocity_0", "double five_4"}) {
        EXPECT_NE(text.find("property " + std::string(line) + "\n"), std::string::npos)
            << line;
    }
}

TEST_F(Export, PlyHoldsColoursOfBytesAsBytes) {
    Tessellation t = house();
    t.channels = {{"color", 4, {}}};
    for (int i = 0; i < 20; ++i)
        t.channels[0].values.push_back(13 * i / 255.);
    ASSERT_TRUE(write_tessellation(folder_ / "house.ply", t));
    expect_channel(read_mesh(folder_ / "house.ply"), "color", 4, t.channels[0].values);
    EXPECT_NE(content(folder_ / "house.ply").find("property uchar alpha\n"),
              std::string::npos);
}

/// sRGB to linear light, as IEC 61966-2-1 has it.
double linear(double c) {
    const double x = std::clamp(c, 0.0, 1.0);
    return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

// Values of the standard's table: bytes 188, 128, 10 are a half, a fifth, three thousandths.
TEST_F(Export, GlbHoldsColoursInLinearLight) {
    Tessellation t = house();
    t.channels = {{"color", 4, {}}};
    for (int i = 0; i < 5; ++i) {
        for (const double byte : {188, 128, 10, 128})
            t.channels[0].values.push_back(byte / 255);
    }
    ASSERT_TRUE(write_tessellation(folder_ / "house.glb", t));
    const Glb glb = read_glb(folder_ / "house.glb");
    const auto& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
    std::string_view bytes = glb.data(attributes["COLOR_0"].get<std::size_t>());
    // The expected ones have six digits.
    EXPECT_NEAR(take<float>(bytes), 0.502886, 1e-6);
    EXPECT_NEAR(take<float>(bytes), 0.215861, 1e-6);
    EXPECT_NEAR(take<float>(bytes), 0.003035, 1e-6);
    EXPECT_EQ(take<float>(bytes), float(128 / 255.));  // alpha is no light
}

/// Ten faces, of which 7 and 9 have names; what they are made of does not matter.
MeshData named_base() {
    MeshData mesh;
    mesh.face_sizes.assign(10, 3);
    mesh.face_vertices.assign(30, 0);
    const Index none = kInvalidIndex;
    mesh.groups = {{"wall", "roof of tiles"}, {0, 0, 0, 0, 0, 0, 0, 0, 0, 1}};
    mesh.objects = {{"house"}, {none, none, none, none, none, none, none, 0, 0, none}};
    mesh.materials = {{"unused", "slate\xff gr\xc3\xbc\xc3\x9f"},
                      {none, none, none, none, none, none, none, none, none, 1}};
    mesh.material_files = {"house.mtl"};
    return mesh;
}

TEST_F(Export, ObjNamesWhatFacetsLieIn) {
    const MeshData base = named_base();
    ASSERT_TRUE(write_tessellation(folder_ / "house.obj", house(), &base));
    const auto mesh = read_mesh(folder_ / "house.obj");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->groups.names, base.groups.names);
    EXPECT_EQ(mesh->groups.faces, (std::vector<Index>{0, 1}));
    EXPECT_EQ(mesh->objects.names, base.objects.names);
    EXPECT_EQ(mesh->objects.faces, (std::vector<Index>{0, kInvalidIndex}));
    EXPECT_EQ(mesh->materials.names, std::vector(1, base.materials.names[1]));
    EXPECT_EQ(mesh->materials.faces, (std::vector<Index>{kInvalidIndex, 0}));
    EXPECT_EQ(mesh->material_files, base.material_files);
    // As it is without them, but for these lines.
    std::istringstream lines(content(folder_ / "house.obj"));
    std::string rest;
    for (std::string line; std::getline(lines, line);) {
        if (line[0] != 'g' && line[0] != 'o' && line[0] != 'u' && line[0] != 'm')
            rest += line + "\n";
    }
    EXPECT_EQ(rest, *format_tessellation(house(), ".obj"));
}

TEST_F(Export, GlbHasAPrimitiveOfEachMaterial) {
    MeshData base = named_base();
    ASSERT_TRUE(write_tessellation(folder_ / "house.glb", house(), &base));
    const Glb glb = read_glb(folder_ / "house.glb");
    const nlohmann::json &materials = glb.json["materials"],
                         &primitives = glb.json["meshes"][0]["primitives"];
    ASSERT_EQ(primitives.size(), 2u);
    ASSERT_EQ(materials.size(), 2u);
    EXPECT_FALSE(materials[0].contains("name"));
    EXPECT_EQ(materials[1]["name"], "slate? gr\xc3\xbc\xc3\x9f");
    const std::vector<std::vector<Index>> expected = {{0, 1, 2, 0, 2, 3}, {3, 2, 4}};
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(primitives[i]["material"], i);
        EXPECT_EQ(primitives[i]["attributes"], primitives[0]["attributes"]);
        std::string_view bytes = glb.data(primitives[i]["indices"].get<std::size_t>());
        for (const Index v : expected[i])
            EXPECT_EQ(take<Index>(bytes), v);
        EXPECT_TRUE(bytes.empty());
    }
    // One material of all, whatever it is called.
    base.materials.faces.assign(10, 0);
    const char* const strange[] = {"\xc0\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80",
                                   "\xe2\x82", "\xf0\x9f\x8f\xa0"};
    for (const std::string name : strange) {
        base.materials.names = {name};
        ASSERT_TRUE(write_tessellation(folder_ / "house.glb", house(), &base));
        const auto json = read_glb(folder_ / "house.glb").json;
        ASSERT_EQ(json["materials"].size(), 1u);
        EXPECT_EQ(json["meshes"][0]["primitives"].size(), 1u);
        const std::string valid =
            name[0] == '\xf0' ? name : std::string(name.size(), '?');
        EXPECT_EQ(json["materials"][0]["name"], valid);
    }
}

TEST_F(Export, RefusesNamesAgainstTheirShapes) {
    const auto refuse = [&](ErrorCode code, std::initializer_list<const char*> extensions,
                            const auto& break_it) {
        MeshData base = named_base();
        break_it(base);
        for (const std::string extension : extensions) {
            expect_error(
                write_tessellation(folder_ / ("house" + extension), house(), &base),
                code);
        }
    };
    const auto all = {".obj", ".ply", ".stl", ".glb"};
    using enum ErrorCode;
    refuse(IndexOutOfRange, all, [](MeshData& m) { m.face_sizes.resize(9); });
    refuse(SizeMismatch, all, [](MeshData& m) { m.groups.faces.pop_back(); });
    refuse(IndexOutOfRange, all, [](MeshData& m) { m.materials.faces[2] = 2; });
    refuse(WriteFailed, {".obj"}, [](MeshData& m) { m.groups.names[0] = "two  spaces"; });
    refuse(WriteFailed, {".obj"}, [](MeshData& m) { m.material_files[0] = "a\nb"; });
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Export, GlbHoldsChannelsAsAttributes) {
    const Tessellation t = house_with_channels();
    ASSERT_TRUE(write_tessellation(folder_ / "house.glb", t));
    const Glb glb = read_glb(folder_ / "house.glb");
    const nlohmann::json& primitive = glb.json["meshes"][0]["primitives"][0];
    const nlohmann::json& attributes = primitive["attributes"];
    ASSERT_EQ(attributes.size(), 10u);
    const auto expect = [&](const std::string& name, const std::string& type,
                            const NamedChannels& c, int first, int n) {
        SCOPED_TRACE(name);
        ASSERT_TRUE(attributes.contains(name));
        const auto i = attributes[name].get<std::size_t>();
        EXPECT_EQ(glb.json["accessors"][i]["type"], type);
        EXPECT_EQ(glb.json["accessors"][i]["componentType"], 5126);  // float
        EXPECT_EQ(glb.json["accessors"][i]["count"], 7u);
        EXPECT_EQ(glb.json["bufferViews"][i]["target"], 34962);  // vertices
        std::string_view bytes = glb.data(i);
        ASSERT_EQ(bytes.size(), 28u * static_cast<unsigned>(n));
        for (const Index p : {0, 1, 2, 2, 3, 3, 4}) {
            for (int k = first; k < first + n; ++k) {
                const double x = c.view()[p][k];
                EXPECT_EQ(take<float>(bytes),
                          static_cast<float>(name == "COLOR_0" ? linear(x) : x));
            }
        }
    };
    expect("COLOR_0", "VEC3", t.channels[0], 0, 3);
    expect("_WEIGHT", "SCALAR", t.channels[1], 0, 1);
    expect("_VELOCITY", "VEC3", t.channels[2], 0, 3);
    for (int k = 0; k < 5; ++k)
        expect("_FIVE_" + std::to_string(k), "SCALAR", t.channels[3], k, 1);
    // What was there before stays in its place.
    std::string_view bytes = glb.data(attributes["POSITION"].get<std::size_t>());
    EXPECT_EQ(take_vector(bytes), Vec3<float>(t.positions[0]));
    bytes = glb.data(primitive["indices"].get<std::size_t>());
    for (const Index c : {0, 1, 2, 0, 2, 4, 5, 3, 6})
        EXPECT_EQ(take<Index>(bytes), c);
}

TEST_F(Export, FilesWithoutRoomForChannelsAreAsWithoutThem) {
    const Tessellation with = house_with_channels();
    Tessellation without = with;
    without.channels.clear();
    EXPECT_EQ(*format_tessellation(with, ".stl"), *format_tessellation(without, ".stl"));
    Tessellation other = with;  // OBJ has colours only
    other.channels.erase(other.channels.begin());
    EXPECT_EQ(*format_tessellation(other, ".obj"), *format_tessellation(without, ".obj"));
}

TEST_F(Export, RefusesChannelsAgainstTheirShapesAndNames) {
    const auto refuse = [&](const std::vector<std::string_view>& names, ErrorCode code,
                            const auto& break_it) {
        Tessellation t = house_with_channels();
        break_it(t);
        for (const std::string_view name : names)
            expect_error(write_tessellation(folder_ / name, t), code);
    };
    using enum ErrorCode;
    const std::vector<std::string_view> all = {"t.obj", "t.ply", "t.stl", "t.glb"};
    refuse(all, SizeMismatch, [](Tessellation& t) { t.channels[2].values.pop_back(); });
    refuse(all, SizeMismatch, [](Tessellation& t) { t.channels[0].n = 0; });
    const std::vector<std::string_view> named = {"t.ply", "t.glb"};
    for (const std::string name : {"", "two words", "five_3", "a\n"}) {
        refuse(named, WriteFailed, [&](Tessellation& t) { t.channels[1].name = name; });
    }
    for (const std::string name : {"velocity", "VELOCITY"}) {
        refuse({"t.glb"}, WriteFailed,
               [&](Tessellation& t) { t.channels[1].name = name; });
    }
    for (const double x : {1e39, double(NAN)}) {
        refuse({"t.glb"}, WriteFailed,
               [&](Tessellation& t) { t.channels[2].values[4] = x; });
    }
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Export, StlHoldsTrianglesWithTheirNormals) {
    const Tessellation t = house();
    ASSERT_TRUE(write_tessellation(folder_ / "house.stl", t));
    const std::string text = content(folder_ / "house.stl");
    ASSERT_EQ(text.size(), 84 + 3 * 50u);
    EXPECT_FALSE(text.starts_with("solid"));
    std::string_view bytes = text;
    bytes.remove_prefix(80);
    EXPECT_EQ(take<std::uint32_t>(bytes), 3u);
    const std::vector<std::array<Index, 3>> triangles = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}};
    for (const auto& triangle : triangles) {
        EXPECT_EQ(take_vector(bytes), Vec3<float>(0, 0, 1));
        for (const Index p : triangle)
            EXPECT_EQ(take_vector(bytes), Vec3<float>(t.positions[p]));
        EXPECT_EQ(take<std::uint16_t>(bytes), 0);
    }
}

TEST_F(Export, StlNormalOfATriangleWithoutAreaIsZero) {
    Tessellation t = house();
    t.positions[4] = t.positions[3];
    ASSERT_TRUE(write_tessellation(folder_ / "house.stl", t));
    const std::string text = content(folder_ / "house.stl");
    std::string_view bytes = text;
    bytes.remove_prefix(84 + 2 * 50);
    EXPECT_EQ(take_vector(bytes), Vec3<float>(0));
}

TEST_F(Export, GlbHoldsOneMeshOfTriangles) {
    const Tessellation t = house();
    ASSERT_TRUE(write_tessellation(folder_ / "house.glb", t));
    const Glb glb = read_glb(folder_ / "house.glb");
    const nlohmann::json& json = glb.json;
    EXPECT_EQ(json["asset"]["version"], "2.0");
    ASSERT_EQ(json["meshes"].size(), 1u);
    ASSERT_EQ(json["accessors"].size(), 3u);
    EXPECT_EQ(json["scenes"][json["scene"].get<std::size_t>()]["nodes"][0], 0);
    EXPECT_EQ(json["nodes"][0]["mesh"], 0);
    EXPECT_EQ(json["materials"][0]["doubleSided"], true);
    EXPECT_EQ(json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"], 0);
    const nlohmann::json& primitive = json["meshes"][0]["primitives"][0];
    EXPECT_EQ(primitive["mode"], 4);  // triangles
    EXPECT_EQ(primitive["material"], 0);

    const auto position = primitive["attributes"]["POSITION"].get<std::size_t>();
    const nlohmann::json& accessor = json["accessors"][position];
    EXPECT_EQ(accessor["count"], 5u);
    EXPECT_EQ(accessor["type"], "VEC3");
    EXPECT_EQ(accessor["componentType"], 5126);  // float
    EXPECT_EQ(accessor["min"], (std::vector<double>{0, 0, 0.1f}));
    EXPECT_EQ(accessor["max"], (std::vector<double>{1.1f, 2.2f, 0.1f}));
    std::string_view bytes = glb.data(position);
    EXPECT_EQ(bytes.size(), 60u);
    for (const Vec3<double>& p : t.positions)
        EXPECT_EQ(take_vector(bytes), Vec3<float>(p));

    const auto indices = primitive["indices"].get<std::size_t>();
    EXPECT_EQ(json["accessors"][indices]["count"], 9u);
    EXPECT_EQ(json["accessors"][indices]["type"], "SCALAR");
    EXPECT_EQ(json["accessors"][indices]["componentType"], 5125);  // unsigned int
    bytes = glb.data(indices);
    EXPECT_EQ(bytes.size(), 36u);
    for (const Index expected : {0, 1, 2, 0, 2, 3, 3, 2, 4})
        EXPECT_EQ(take<Index>(bytes), expected);

    EXPECT_EQ(json["bufferViews"][0]["target"], 34962);  // vertices
    EXPECT_EQ(json["bufferViews"][2]["target"], 34963);  // indices
}

TEST_F(Export, GlbNormalsHaveUnitLength) {
    Tessellation t = house();
    // A facet without area, at a point without normal.
    t.positions.emplace_back(9, 9, 9);
    t.normals.emplace_back(0, 0, 0);
    t.facet_sizes.push_back(3);
    t.facet_faces.push_back(9);
    t.facet_points.insert(t.facet_points.end(), {5, 5, 5});
    t.facet_normals.insert(t.facet_normals.end(), {5, 5, 5});
    t.facet_uvs.resize(10);
    ASSERT_TRUE(write_tessellation(folder_ / "house.glb", t));
    const Glb glb = read_glb(folder_ / "house.glb");
    EXPECT_EQ(glb.json["accessors"][1]["count"], 6u);
    std::string_view bytes = glb.data(1);
    for (std::size_t i = 0; i < 4; ++i) {
        const Vec3<float> n = take_vector(bytes);
        // Half a unit in the last place of each component.
        EXPECT_LE(glm::length(Vec3<double>(n) - t.normals[i]), 1e-7) << "point " << i;
    }
    EXPECT_EQ(take_vector(bytes), Vec3<float>(0, 0, 1));  // of the triangle there
    EXPECT_EQ(take_vector(bytes), Vec3<float>(0, 0, 1));  // any, but of unit length
}

TEST_F(Export, RefusesTessellationsAgainstTheirShapes) {
    const auto refuse = [&](ErrorCode code, const auto& break_it) {
        Tessellation t = house();
        break_it(t);
        for (const std::string_view name : {"t.obj", "t.ply", "t.stl", "t.glb"})
            expect_error(write_tessellation(folder_ / name, t), code);
    };
    using enum ErrorCode;
    refuse(EmptyMesh, [](Tessellation& t) { t = {}; });
    refuse(SizeMismatch, [](Tessellation& t) { t.facet_sizes = {5, 2}; });
    refuse(SizeMismatch, [](Tessellation& t) { t.facet_sizes[0] = 3; });
    refuse(SizeMismatch, [](Tessellation& t) { t.facet_normals.pop_back(); });
    refuse(IndexOutOfRange, [](Tessellation& t) { t.normals.pop_back(); });
    refuse(SizeMismatch, [](Tessellation& t) { t.facet_faces.pop_back(); });
    refuse(SizeMismatch, [](Tessellation& t) { t.facet_uvs.pop_back(); });
    refuse(IndexOutOfRange, [](Tessellation& t) { t.facet_points[3] = 5; });
    refuse(SizeMismatch, [](Tessellation& t) { t.facet_texcoords = {0, 0}; });
    refuse(IndexOutOfRange, [](Tessellation& t) { t.facet_texcoords = t.facet_points; });
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Export, RefusesPositionsThatFloatsCannotHold) {
    for (const double x : {1e39, -1e39, std::numeric_limits<double>::quiet_NaN()}) {
        Tessellation t = house();
        t.positions[2].y = x;
        for (const std::string_view name : {"t.stl", "t.glb"}) {
            const Status status = write_tessellation(folder_ / name, t);
            expect_error(status, ErrorCode::WriteFailed);
            EXPECT_EQ(status.error().element, 2u);
        }
    }
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Export, RefusesOtherExtensions) {
    for (const std::string_view name : {"t.off", "t.gltf", "t"})
        expect_error(write_tessellation(folder_ / name, house()),
                     ErrorCode::InvalidOption);
    EXPECT_EQ(n_files(), 0);
}

// ---- From a file to a picture ----

// A cube whose colours are its corners', through subdivision, files and the surface.
TEST_F(Export, ColoursGoAllTheWay) {
    MeshData mesh;
    mesh.channels = {{"color", 3, {}}};
    for (Index v = 0; v < 8; ++v) {
        const Vec3<double> p(v & 1, v >> 1 & 1, v >> 2);
        mesh.positions.push_back(p);
        for (int k = 0; k < 3; ++k)
            mesh.channels[0].values.push_back(p[k]);
    }
    mesh.face_sizes.assign(6, 4);
    mesh.face_vertices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                          2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
    const auto fine = subdivide(mesh);
    ASSERT_TRUE(fine) << fine.error().message;
    for (const std::string_view extension : {".obj", ".off", ".ply"}) {
        SCOPED_TRACE(extension);
        const auto text = format_mesh(fine->data, extension);
        ASSERT_TRUE(text) << text.error().message;
        const auto back = parse_mesh(*text, extension);
        expect_same(back, fine->data);
        expect_channel(back, "color", 3, fine->data.channels[0].values);
        const auto surface = Surface::build(*back);
        ASSERT_TRUE(surface) << surface.error().message;
        Tessellation t = surface->tessellate(3);
        ASSERT_TRUE(add_channels(t, *surface, back->channels));
        ASSERT_TRUE(write_tessellation(folder_ / "cube.glb", t));
        const Glb glb = read_glb(folder_ / "cube.glb");
        const auto& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
        std::string_view colors = glb.data(attributes["COLOR_0"].get<std::size_t>()),
                         points = glb.data(attributes["POSITION"].get<std::size_t>());
        ASSERT_EQ(colors.size(), points.size());
        ASSERT_EQ(colors.size(), 12 * t.positions.size());
        for (std::size_t i = 0; i < t.positions.size(); ++i) {
            // Rounded to float twice, and summed by other kernels in double; the curve is
            // up to 2.3 steep.
            const Vec3<float> color = take_vector(colors), point = take_vector(points);
            for (int k = 0; k < 3; ++k)
                ASSERT_NEAR(color[k], linear(point[k]), 2.3e-7);
        }
    }
}

// ---- Files ----

void write_new(std::ostream& stream) {
    stream << "new";
}

TEST_F(Export, WriteFileReplacesAFileOnlyWhenItIsWhole) {
    const fs::path path = folder_ / "file";
    std::ofstream(path) << "old";
    const Status status = write_file(path, [&](std::ostream& stream) {
        stream << "new" << std::flush;
        EXPECT_EQ(content(path), "old");
        EXPECT_EQ(n_files(), 2);
    });
    EXPECT_TRUE(status);
    EXPECT_EQ(content(path), "new");
    EXPECT_EQ(n_files(), 1);
}

TEST_F(Export, WriteFileLeavesNothingWhenTheStreamFails) {
    const fs::path path = folder_ / "file";
    std::ofstream(path) << "old";
    expect_error(write_file(path,
                            [](std::ostream& stream) {
                                stream << "new";
                                stream.setstate(std::ios::failbit);
                            }),
                 ErrorCode::WriteFailed);
    EXPECT_EQ(content(path), "old");
    EXPECT_EQ(n_files(), 1);
}

TEST_F(Export, WriteFileLeavesNothingWhenTheWriterThrows) {
    const auto write = [](std::ostream& stream) {
        stream << "new" << std::flush;
        throw std::runtime_error("no more");
    };
    EXPECT_THROW(static_cast<void>(write_file(folder_ / "file", write)),
                 std::runtime_error);
    EXPECT_EQ(n_files(), 0);
}

/// Lets no file grow beyond `size`, as a full disk would.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t size) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &limit_);
        const rlimit less{size, limit_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &less);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &limit_);
        std::signal(SIGXFSZ, handler_);
    }

private:
    rlimit limit_{};
    void (*handler_)(int);
};

TEST_F(Export, LeavesNothingWhenTheDiskIsFull) {
    // The small file reaches the disk only when the stream is closed.
    for (const std::size_t n : {std::size_t{200}, std::size_t{1} << 20}) {
        Status status = ok();
        {
            const FileSizeLimit limit(100);
            status = write_file(folder_ / "file", [n](std::ostream& stream) {
                stream << std::string(n, 'x');
            });
        }
        expect_error(status, ErrorCode::WriteFailed);
    }
    for (const std::string_view name : {"t.obj", "t.ply", "t.stl", "t.glb"}) {
        Status status = ok();
        {
            const FileSizeLimit limit(100);
            status = write_tessellation(folder_ / name, house());
        }
        expect_error(status, ErrorCode::WriteFailed);
    }
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Export, WriteFileRefusesWhatIsNotAFile) {
    const Status missing = write_file(folder_ / "missing" / "file", write_new);
    expect_error(missing, ErrorCode::WriteFailed);
    EXPECT_TRUE(missing.error().message.starts_with("no file can be made in its folder"))
        << missing.error().message;
    expect_error(write_file(folder_, write_new), ErrorCode::WriteFailed);
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Export, WriteFileLeavesNothingWhenTheNameIsTaken) {
    const fs::path path = folder_ / "file";
    expect_error(write_file(path,
                            [&](std::ostream& stream) {
                                stream << "new";
                                fs::create_directory(path);
                            }),
                 ErrorCode::WriteFailed);
    EXPECT_TRUE(fs::is_directory(path));
    EXPECT_EQ(n_files(), 1);
}

}  // namespace
}  // namespace osdx
