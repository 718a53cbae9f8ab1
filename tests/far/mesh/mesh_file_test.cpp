// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <osdx/build_topology.h>
#include <osdx/mesh_data.h>
#include <osdx/mesh_file.h>
#include <osdx/topology.h>

namespace osdx {
namespace {

namespace fs = std::filesystem;

constexpr Index kNone = kInvalidIndex;

/// A folder of its own for each test.
class MeshIo : public testing::Test {
protected:
    void SetUp() override {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        folder_ =
            fs::path(testing::TempDir()) /
            ("osdx_mesh_io_" + std::string(test->name()) + std::to_string(getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path file(std::string_view extension, std::string_view content) const {
        const fs::path path = folder_ / ("mesh." + std::string(extension));
        std::ofstream(path, std::ios::binary) << content;
        return path;
    }

    Result<MeshData> read(std::string_view extension, std::string_view content) const {
        return read_mesh(file(extension, content));
    }

    fs::path folder_;
};

/// A file that is refused, and how.
struct Refusal {
    std::string_view content;
    ErrorCode code;
    Index element;
    Index line;
    std::string_view message;  ///< a part of it
};

void expect_refusal(const Result<MeshData>& mesh, const Refusal& expected) {
    SCOPED_TRACE(testing::Message() << "file: " << expected.content);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().code, expected.code);
    EXPECT_EQ(mesh.error().element, expected.element);
    EXPECT_EQ(mesh.error().line, expected.line);
    EXPECT_NE(mesh.error().message.find(expected.message), std::string::npos)
        << mesh.error().message;
}

// A cube with a vertex in the middle of an edge, so that two faces are pentagons. The
// fractions differ between float and double.
const std::vector<Vec3<double>> kPositions = {
    {-0.1, -0.1, -0.1}, {0.1, -0.1, -0.1}, {0.1, 0.1, -0.1},
    {-0.1, 0.1, -0.1},  {-0.1, -0.1, 0.1}, {0.1, -0.1, 0.1},
    {0.1, 0.1, 0.1},    {-0.1, 0.1, 0.1},  {0.0, -0.3333333333333333, 1e-3}};
const std::vector<Index> kFaceSizes = {4, 5, 5, 4, 4, 4};
const std::vector<Index> kFaceVertices = {0, 3, 2, 1, 4, 8, 5, 6, 7, 0, 1, 5, 8,
                                          4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};

void expect_cube(const Result<MeshData>& mesh) {
    ASSERT_TRUE(mesh) << mesh.error().message << ", line " << mesh.error().line;
    EXPECT_EQ(mesh->positions, kPositions);
    EXPECT_EQ(mesh->face_sizes, kFaceSizes);
    EXPECT_EQ(mesh->face_vertices, kFaceVertices);
    EXPECT_TRUE(mesh->tags.empty());
}

/// first, first + 1, ...
std::vector<Index> lines_from(Index first, std::size_t n) {
    std::vector<Index> lines(n);
    for (Index& line : lines)
        line = first++;
    return lines;
}

constexpr std::string_view kCubeObj = R"(# a cube with a cut edge
v -0.1 -0.1 -0.1
v +0.1 -1e-1 -.1
v 0.1 0.1 -0.1
v -0.1 0.1 -0.1
v -0.1 -0.1 0.1
v 0.1 -0.1 0.1
v 0.1 0.1 0.1
v -0.1 0.1 0.1
v 0 -0.3333333333333333 0.001
f 1 4 3 2
f 5 9 6 7 8
f 1 2 6 9 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
)";

constexpr std::string_view kCubeOff = R"(OFF
9 6 0
-0.1 -0.1 -0.1
0.1 -0.1 -0.1
0.1 0.1 -0.1
-0.1 0.1 -0.1
-0.1 -0.1 0.1
0.1 -0.1 0.1
0.1 0.1 0.1
-0.1 0.1 0.1
0 -0.3333333333333333 1e-3
4 0 3 2 1
5 4 8 5 6 7
5 0 1 5 8 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
)";

constexpr std::string_view kCubePly = R"(ply
format ascii 1.0
comment a cube with a cut edge
element vertex 9
property double x
property double y
property double z
element face 6
property list uchar int vertex_indices
end_header
-0.1 -0.1 -0.1
0.1 -0.1 -0.1
0.1 0.1 -0.1
-0.1 0.1 -0.1
-0.1 -0.1 0.1
0.1 -0.1 0.1
0.1 0.1 0.1
-0.1 0.1 0.1
0 -0.3333333333333333 0.001
4 0 3 2 1
5 4 8 5 6 7
5 0 1 5 8 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
)";

TEST_F(MeshIo, ReadsTheSameMeshFromEveryTextFormat) {
    struct Case {
        std::string_view extension, content;
        Index first_vertex_line;
    };
    for (const auto& [extension, content, line] :
         {Case{"obj", kCubeObj, 2}, Case{"off", kCubeOff, 3},
          Case{"ply", kCubePly, 11}}) {
        SCOPED_TRACE(extension);
        const auto mesh = read(extension, content);
        expect_cube(mesh);
        ASSERT_TRUE(mesh);
        EXPECT_EQ(mesh->vertex_lines, lines_from(line, 9));
        EXPECT_EQ(mesh->face_lines, lines_from(line + 9, 6));
    }
}

std::string with_crlf(std::string_view text) {
    std::string result;
    for (const char c : text)
        result += c == '\n' ? std::string("\r\n") : std::string(1, c);
    return result;
}

TEST_F(MeshIo, ReadsWindowsLineEndsAndByteOrderMark) {
    expect_cube(read("obj", "\xEF\xBB\xBF" + with_crlf(kCubeObj)));
    expect_cube(read("off", "\xEF\xBB\xBF" + with_crlf(kCubeOff)));
    expect_cube(read("ply", with_crlf(kCubePly)));
}

std::string with_cr(std::string text) {
    std::ranges::replace(text, '\n', '\r');
    return text;
}

TEST_F(MeshIo, ReadsLineEndsOfOldMacs) {
    expect_cube(read("obj", with_cr(std::string(kCubeObj))));
    expect_cube(read("off", with_cr(std::string(kCubeOff))));
    expect_cube(read("ply", with_cr(std::string(kCubePly))));
    const auto mixed = read("obj", "v 0 0 0\rv 1 0 0\r\nv 0 1 0\n\rf 1 2 3\r");
    ASSERT_TRUE(mixed) << mixed.error().message;
    EXPECT_EQ(mixed->vertex_lines, (std::vector<Index>{1, 2, 3}));
    EXPECT_EQ(mixed->face_lines, std::vector<Index>{5});
}

std::string in_utf16(std::string_view text, bool big_endian) {
    std::string result = big_endian ? "\xFE\xFF" : "\xFF\xFE";
    for (const char c : text)
        result += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
    return result;
}

TEST_F(MeshIo, ReadsUtf16WithItsMark) {
    for (const bool big_endian : {false, true}) {
        expect_cube(read("obj", in_utf16(kCubeObj, big_endian)));
        expect_cube(read("off", in_utf16(with_crlf(kCubeOff), big_endian)));
        expect_cube(read("ply", in_utf16(kCubePly, big_endian)));
    }
    // A letter of each length in UTF-8, and half of a pair.
    using namespace std::string_view_literals;
    std::string text = in_utf16("v 0 0 0\nf 1 1 1\ng ", false);
    text += "a\0\xE4\0\xAC\x20\x3D\xD8\x00\xDE\x00\xD8x\0\n\0"sv;
    text += in_utf16("f 1 1 1\n", false).substr(2);
    const auto names = read("obj", text);
    ASSERT_TRUE(names) << names.error().message;
    EXPECT_EQ(
        names->groups.names,
        std::vector<std::string>{"a\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80\xEF\xBF\xBDx"});
    const std::string unmarked = in_utf16(kCubeObj, true).substr(2);
    expect_refusal(read("obj", unmarked),
                   {unmarked, ErrorCode::FileFormat, kNone, 0, "save it as UTF-8"});
}

TEST_F(MeshIo, ReadsALastLineWithoutAnEnd) {
    expect_cube(read("obj", kCubeObj.substr(0, kCubeObj.size() - 1)));
    expect_cube(read("off", kCubeOff.substr(0, kCubeOff.size() - 1)));
    expect_cube(read("ply", kCubePly.substr(0, kCubePly.size() - 1)));
}

TEST_F(MeshIo, TakesExtensionsInCapitals) {
    expect_cube(read("OBJ", kCubeObj));
    expect_cube(read("Off", kCubeOff));
    expect_cube(read("PLY", kCubePly));
}

// ---- Files ----

TEST_F(MeshIo, RefusesFilesThatCannotBeRead) {
    expect_refusal(read_mesh(folder_ / "missing.obj"),
                   {"", ErrorCode::FileUnreadable, kNone, 0, "cannot be opened"});
    expect_refusal(read_mesh(folder_),
                   {"", ErrorCode::FileUnreadable, kNone, 0, "directory"});
    fs::create_directory(folder_ / "folder.obj");
    expect_refusal(read_mesh(folder_ / "folder.obj"),
                   {"", ErrorCode::FileUnreadable, kNone, 0, "directory"});
}

TEST_F(MeshIo, ReadsPipesAndRefusesDevices) {
    fs::create_symlink("/dev/zero", folder_ / "zero.obj");
    expect_refusal(read_mesh(folder_ / "zero.obj"),
                   {"", ErrorCode::FileUnreadable, kNone, 0, "device"});
    const fs::path pipe = folder_ / "pipe.obj";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    // More than a pipe holds at a time.
    const std::string text = std::string(kCubeObj) + std::string(200000, '\n');
    std::thread writer(
        [&] { std::ofstream(pipe, std::ios::binary) << text << "f 1 2 3\n"; });
    const auto mesh = read_mesh(pipe);
    writer.join();
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->face_sizes.size(), kFaceSizes.size() + 1);
}

TEST_F(MeshIo, RefusesOtherExtensions) {
    const Refusal expected{kCubeObj, ErrorCode::FileFormat, kNone, 0,
                           "'.stl' is none of .obj, .off and .ply"};
    expect_refusal(read("stl", kCubeObj), expected);
}

TEST_F(MeshIo, RefusesEmptyFiles) {
    for (const std::string_view extension : {"obj", "off", "ply"}) {
        for (const std::string_view content : {"", " \r\n\n"}) {
            expect_refusal(read(extension, content), {content, ErrorCode::EmptyMesh,
                                                      kNone, 0, "the file is empty"});
        }
    }
}

TEST_F(MeshIo, RefusesMeshesWithoutVerticesOrFaces) {
    const auto refuse = [&](std::string_view extension, std::string_view content,
                            std::string_view message) {
        expect_refusal(read(extension, content),
                       {content, ErrorCode::EmptyMesh, kNone, 0, message});
    };
    refuse("obj", "# nothing\n", "no vertices");
    refuse("obj", "f 1 2 3\n", "no vertices");
    refuse("obj", "v 0 0 0\n", "no faces");
    refuse("off", "# nothing\n", "no vertices");
    refuse("off", "OFF 0 0 0\n", "no vertices");
    refuse("off", "OFF 1 0 0\n0 0 0\n", "no faces");
    refuse("ply", "ply\nformat ascii 1.0\nend_header\n", "no vertices");
    refuse("ply",
           "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\n"
           "property int z\nend_header\n0 0 0\n",
           "no faces");
}

// ---- OBJ ----

TEST_F(MeshIo, ReadsEveryFormOfObjCorner) {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\n";
    const auto without = read(
        "obj", vertices + "f 1 2 3\nf 1//1 2//1 3//-1\nf +1/ 2// 3//1\nf -3 -2 -1\n");
    const auto with = read("obj", vertices +
                                      "f 1/1 2/2 3/-2\nf 1/1/ 2/-1/ 3/1/\n"
                                      "f 1/1/1 2/2/1 3/+1/7\nf -3/-2/-1 2/-1 -1/1\n");
    for (const auto* mesh : {&without, &with}) {
        ASSERT_TRUE(*mesh) << mesh->error().message;
        EXPECT_EQ((*mesh)->face_sizes, std::vector<Index>(4, 3));
        for (std::size_t c = 0; c < 12; ++c)
            EXPECT_EQ((*mesh)->face_vertices[c], c % 3) << "corner " << c;
    }
    EXPECT_TRUE(without->face_uvs.empty());
    ASSERT_EQ(with->face_uvs.size(), 12u);
    for (std::size_t c = 0; c < 12; ++c)
        EXPECT_EQ(with->face_uvs[c], Index(c % 3 == 1)) << "corner " << c;
}

TEST_F(MeshIo, ReadsTextureCoordinates) {
    // Before and after the faces that name them; extra numbers are as with v.
    const auto mesh = read("obj",
                           "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 -1e-3 9\nvt 7\nvt nan 0\n"
                           "f 1/4 2/2 3/-3\nvt 0.3333333333333333 0 # x\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->uvs.size(), 4u);
    EXPECT_EQ(mesh->uvs[0], Vec2<double>(0.25, -1e-3));
    EXPECT_EQ(mesh->uvs[1], Vec2<double>(7, 0));
    EXPECT_TRUE(std::isnan(mesh->uvs[2].x));  // no face names it
    EXPECT_EQ(mesh->uvs[3], Vec2<double>(0.3333333333333333, 0));
    EXPECT_EQ(mesh->face_uvs, (std::vector<Index>{3, 1, 0}));
}

TEST_F(MeshIo, RefusesBrokenTextureCoordinates) {
    using enum ErrorCode;
    const std::vector<Refusal> refusals = {
        {"v 0 0 0\nvt\n", FileFormat, 0, 2, "texture coordinate 0 has no numbers"},
        {"vt 0 0\nvt 0 a\n", FileFormat, 1, 2, "texture coordinate 1 has 'a' where"},
    };
    for (const Refusal& refusal : refusals)
        expect_refusal(read("obj", refusal.content), refusal);
}

/// A mesh that is read with one warning.
struct Warned {
    std::string_view content;
    WarningCode code;
    Index line;
    std::string_view message;  ///< a part of it
};

void expect_warning(const Result<MeshData>& mesh, const Warned& expected) {
    SCOPED_TRACE(testing::Message() << "file: " << expected.content);
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->warnings.size(), 1u);
    EXPECT_EQ(mesh->warnings[0].code, expected.code);
    EXPECT_EQ(mesh->warnings[0].line, expected.line);
    EXPECT_NE(mesh->warnings[0].message.find(expected.message), std::string::npos)
        << mesh->warnings[0].message;
}

TEST_F(MeshIo, GivesCornersWithoutSoundTextureCoordinatesOnesOfTheirOwn) {
    using enum WarningCode;
    using Numbers = std::vector<Index>;
    const std::string head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 3 4\n";
    struct Case {
        std::string_view faces;
        WarningCode code;
        Index line;
        std::string_view message;
        Numbers uvs;
    };
    const std::vector<Case> cases = {
        {"f 1/1 2/1 3/1\nf 1 2 3\n", MissingTexcoords, 6,
         "face 1 has no texture coordinates; 3 of 6", Numbers{0, 0, 0, 1, 1, 1}},
        {"f 1 2 3\nf 1/1 2/1 3/1\n", MissingTexcoords, 5, "face 0 has no texture",
         Numbers{1, 1, 1, 0, 0, 0}},
        {"f 1/1 2//7 3\n", MissingTexcoords, 5, "2 of 3", Numbers{0, 1, 1}},
        {"f 1/1 2/2 3/1\n", InvalidTexcoords, 5,
         "texture coordinate 1, but the file has 1", Numbers{0, 1, 0}},
        {"f 1/0 2/1 3/1\n", InvalidTexcoords, 5, "a number that none can have",
         Numbers{1, 0, 0}},
        {"f 1/1 2/1 3/-2\n", InvalidTexcoords, 5, "none can have", Numbers{0, 0, 1}},
        {"f 1/1 2/1 3/99999999999999999999\n", InvalidTexcoords, 5, "none can have",
         Numbers{0, 0, 1}},
    };
    for (const Case& c : cases) {
        const auto mesh = read("obj", head + std::string(c.faces));
        expect_warning(mesh, {c.faces, c.code, c.line, c.message});
        ASSERT_TRUE(mesh);
        EXPECT_EQ(mesh->face_uvs, c.uvs) << c.faces;
        ASSERT_EQ(mesh->uvs.size(), 2u);
        EXPECT_EQ(mesh->uvs[1], Vec2<double>(0, 0));
        EXPECT_TRUE(check_uvs(*mesh));
    }
    // Where none is sound there are none.
    const auto none = read("obj", head + "vt 0 inf\nf 1/2 2/2 3/2\n");
    expect_warning(none,
                   {"", InvalidTexcoords, 6, "texture coordinate 1, which is (0, inf)"});
    ASSERT_TRUE(none);
    EXPECT_TRUE(none->face_uvs.empty());
    EXPECT_TRUE(read("obj", head + "f 1/1 2/1 3/1\n")->warnings.empty());
}

TEST_F(MeshIo, CountsNegativeObjIndicesFromTheVerticesReadSoFar) {
    const auto mesh =
        read("obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -3\nv 1 1 0\nf -4 -1 -2\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{2, 1, 0, 0, 3, 2}));
}

TEST_F(MeshIo, LeavesForwardAndMissingObjIndicesToTheLaterCheck) {
    const auto mesh = read("obj", "f 1 2 4294967295\nv 0 0 0\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{0, 1, 4294967294}));
    EXPECT_EQ(mesh->face_lines, std::vector<Index>{1});
    EXPECT_EQ(mesh->vertex_lines, std::vector<Index>{2});
}

TEST_F(MeshIo, SkipsWhatObjHasBesides) {
    const auto mesh = read("obj",
                           "call a b\n\n  \t\nlod x y\ng\nusemap m\ns off\nvp 1\ncurv\n"
                           "#v 9 9 9\nv 1 2 3 0.5 # w\nv 4 5 6 1 0\n# C:\\folder\\\n"
                           "\tv  7\t8 9 #x\nf 1 2 3 # 4\nV 1 2 3\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions,
              (std::vector<Vec3<double>>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{0, 1, 2}));
    EXPECT_EQ(mesh->vertex_lines, (std::vector<Index>{11, 12, 14}));
    EXPECT_EQ(mesh->face_lines, std::vector<Index>{15});
}

TEST_F(MeshIo, JoinsObjLinesAtABackslash) {
    const auto mesh = read("obj", "v 0 \\\n0 \\\r\n  0\nv 1 0 0\nv 0 1 0\nf 1\\\n2 3\\");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), 3u);
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{0, 1, 2}));
    EXPECT_EQ(mesh->vertex_lines, (std::vector<Index>{1, 4, 5}));
    EXPECT_EQ(mesh->face_lines, std::vector<Index>{6});
}

TEST_F(MeshIo, JoinsObjLinesAtABackslashBeforeBlanks) {
    const auto mesh = read("obj", "v 0 0 0\nv 1 \\ \t\n0 0\nv 0 1 0\nf 1 2\\ \r\n3\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), 3u);
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{0, 1, 2}));
    EXPECT_EQ(mesh->face_lines, std::vector<Index>{5});
}

TEST_F(MeshIo, NamesOfObjMayEndInABackslash) {
    const auto mesh = read("obj",
                           "v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib C:\\maps\\\n"
                           "usemtl wood\\\nf 1 2 3\n\tg a\\ \nf 2 3 1\no b\\\r\nf 3 1 2\n"
                           "g\\\n\nf 1 2 3\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->face_sizes.size(), 4u);
    EXPECT_EQ(mesh->material_files, std::vector<std::string>{"C:\\maps\\"});
    EXPECT_EQ(mesh->materials.names, std::vector<std::string>{"wood\\"});
    EXPECT_EQ(mesh->groups.names, std::vector<std::string>{"a\\"});
    EXPECT_EQ(mesh->objects.names, std::vector<std::string>{"b\\"});
    const auto text = format_mesh(*mesh, ".obj");
    ASSERT_TRUE(text) << text.error().message;
    const auto again = parse_mesh(*text, ".obj");
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->face_vertices, mesh->face_vertices);
    EXPECT_EQ(again->materials.names, mesh->materials.names);
}

TEST_F(MeshIo, KeepsNumbersThatAreNotFinite) {
    const auto mesh = read("obj", "v nan -inf INF\nv 1e-310 -0 1e308\nf 1 1 1\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(std::isnan(mesh->positions[0].x));
    EXPECT_EQ(mesh->positions[0].y, -std::numeric_limits<double>::infinity());
    EXPECT_EQ(mesh->positions[0].z, std::numeric_limits<double>::infinity());
    EXPECT_EQ(mesh->positions[1], Vec3<double>(1e-310, 0, 1e308));
    EXPECT_TRUE(std::signbit(mesh->positions[1].y));
}

TEST_F(MeshIo, ReadsObjTags) {
    const auto mesh = read("obj",
                           "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
                           "t crease 2/1/0 0 1  3.5\n"
                           "t creasemethod 0/0/1 chaikin\n"
                           "t hole 1/0/0 0\n"
                           "t vertexedit 4/3/3 1 0 \\\n -1 2 0 0 1e-1 add P value\n"
                           "t interpolateboundary 0/0/0\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    const std::vector<Tag>& tags = mesh->tags;
    ASSERT_EQ(tags.size(), 5u);
    EXPECT_EQ(tags[0].name, "crease");
    EXPECT_EQ(tags[0].ints, (std::vector<int>{0, 1}));
    EXPECT_EQ(tags[0].floats, std::vector<double>{3.5});
    EXPECT_TRUE(tags[0].text.empty());
    EXPECT_EQ(tags[0].line, 5u);
    EXPECT_EQ(tags[1].name, "creasemethod");
    EXPECT_EQ(tags[1].text, std::vector<std::string>{"chaikin"});
    EXPECT_EQ(tags[2].name, "hole");
    EXPECT_EQ(tags[2].ints, std::vector<int>{0});
    EXPECT_EQ(tags[3].name, "vertexedit");
    EXPECT_EQ(tags[3].ints, (std::vector<int>{1, 0, -1, 2}));
    EXPECT_EQ(tags[3].floats, (std::vector<double>{0, 0, 0.1}));
    EXPECT_EQ(tags[3].text, (std::vector<std::string>{"add", "P", "value"}));
    EXPECT_EQ(tags[3].line, 8u);
    EXPECT_EQ(tags[4].name, "interpolateboundary");
    EXPECT_EQ(tags[4].line, 10u);
}

TEST_F(MeshIo, RefusesBrokenObjVertices) {
    using enum ErrorCode;
    const std::vector<Refusal> refusals = {
        {"v 0 0 0\nv 1 2\n", FileFormat, 1, 2, "vertex 1 has 2 coordinates"},
        {"v\n", FileFormat, 0, 1, "vertex 0 has 0 coordinates"},
        {"v 0 0 0\n\nv 1 x2 0\n", FileFormat, 1, 3, "vertex 1 has 'x2' where a number"},
        {"v 1 2 3,5\n", FileFormat, 0, 1, "'3,5'"},
        {"v 1 2 1e400\n", FileFormat, 0, 1, "'1e400'"},
        {"v +-1 2 3\n", FileFormat, 0, 1, "'+-1'"},
        {"v + 2 3\n", FileFormat, 0, 1, "'+'"},
        {"v 0x10 2 3\n", FileFormat, 0, 1, "'0x10'"},
        {"v 1 # 2 3\n", FileFormat, 0, 1, "1 coordinates"},
        {"v 1 2 3#4\n", FileFormat, 0, 1, "'3#4'"},
        {"v 1 2 \x01\xC3\xA4\n", FileFormat, 0, 1,
         "has '??"
         "?' where"},
    };
    for (const Refusal& refusal : refusals)
        expect_refusal(read("obj", refusal.content), refusal);
}

TEST_F(MeshIo, RefusesBrokenObjFaces) {
    using enum ErrorCode;
    const std::vector<Refusal> refusals = {
        {"v 0 0 0\nf 1 0 3\n", IndexOutOfRange, 0, 2, "face 0 names vertex 0, but OBJ"},
        {"v 0 0 0\nf 1 -0 3\n", IndexOutOfRange, 0, 2, "names vertex 0"},
        {"v 0 0 0\nv 0 0 0\nf 1 2 -9\n", IndexOutOfRange, 0, 3,
         "face 0 names vertex -9, but only 2 vertices precede it"},
        {"f 1 2 -1\nv 0 0 0\n", IndexOutOfRange, 0, 1, "only 0 vertices"},
        {"f 1 2 4294967296\n", IndexOutOfRange, 0, 1, "names vertex 4294967295, which"},
        {"f 1 2 99999999999999999999\n", IndexOutOfRange, 0, 1, "beyond 32 bits"},
        {"f 1 2 -99999999999999999999\n", IndexOutOfRange, 0, 1, "precede it"},
        {"f 1 2 3\nf 1 2 a\n", FileFormat, 1, 2, "face 1 has 'a' where a corner"},
        {"f 1 2 3.0\n", FileFormat, 0, 1, "'3.0'"},
        {"f 1 2 3/x\n", FileFormat, 0, 1, "'3/x'"},
        {"f 1 2 3/1/1/1\n", FileFormat, 0, 1, "'3/1/1/1'"},
        {"f 1 2 /3\n", FileFormat, 0, 1, "'/3'"},
        {"f 1 2 3/1 /1\n", FileFormat, 0, 1, "'/1'"},
        {"v 0 0 0\nf 1 2 \\\n x\n", FileFormat, 0, 2, "'x'"},
    };
    for (const Refusal& refusal : refusals)
        expect_refusal(read("obj", refusal.content), refusal);
}

// As with other faces that no surface has: the check of the mesh refuses them, a repair drops them.
TEST_F(MeshIo, LeavesSmallFacesToTheLaterCheck) {
    for (const auto& [extension, content] :
         {std::pair("obj", "v 0 0 0\nf\nf 1 1\nf 1 1 1\n"),
          {"off", "OFF\n1 3 0\n0 0 0\n0\n2 0 0\n3 0 0 0\n"}}) {
        const auto mesh = read(extension, content);
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->face_sizes, (std::vector<Index>{0, 2, 3}));
        EXPECT_EQ(mesh->face_lines.size(), 3u);
        EXPECT_EQ(build_topology(*mesh).error().code, ErrorCode::FaceTooSmall);
    }
}

TEST_F(MeshIo, RefusesBrokenObjTags) {
    const auto refuse = [&](std::string_view content, std::string_view message) {
        const Refusal expected{content, ErrorCode::FileFormat, kNone, 2, message};
        expect_refusal(read("obj", "v 0 0 0\n" + std::string(content)), expected);
    };
    refuse("t\n", "a tag needs a name and its counts");
    refuse("t crease\n", "a tag needs a name and its counts");
    refuse("t crease 2/1 0 1 2\n", "tag crease has '2/1' where the counts");
    refuse("t crease 2/1/0/0 0 1 2\n", "'2/1/0/0'");
    refuse("t crease 2/-1/0 0 1 2\n", "'2/-1/0'");
    refuse("t crease a/1/0 0 1 2\n", "'a/1/0'");
    refuse("t crease 2/1/0 0 1\n", "tag crease announces 3 values, but has 2");
    refuse("t crease 2/1/0 0 1 2 3\n", "tag crease announces 3 values, but has 4");
    refuse("t crease 4294967295/4294967295/4294967295 1\n", "but has 1");
    refuse("t crease 99999999999999999999/0/0 1\n", "where the counts");
    refuse("t crease 2/1/0 0 1.5 2\n", "tag crease has '1.5' where an integer");
    refuse("t crease 2/1/0 0 2147483648 2\n", "'2147483648' where an integer");
    refuse("t crease 2/1/0 0 1 sharp\n", "tag crease has 'sharp' where a number");
}

// ---- OFF ----

TEST_F(MeshIo, ReadsOffWithCountsInTheFirstLineCommentsAndColours) {
    const auto mesh =
        read("off",
             "# before\n\nOFF 4 2 # counts\n# vertices\n0 0 0\n1 0 0 # b\n\n"
             "1 1 0 255 0 0\n0 1 0\n# faces\n3 0 1 2 255 0 0\n"
             "4 0 1 2 3 0.1 # c\n\n# after\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions,
              (std::vector<Vec3<double>>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh->face_sizes, (std::vector<Index>{3, 4}));
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{0, 1, 2, 0, 1, 2, 3}));
    EXPECT_EQ(mesh->vertex_lines, (std::vector<Index>{5, 6, 8, 9}));
    EXPECT_EQ(mesh->face_lines, (std::vector<Index>{11, 12}));
}

TEST_F(MeshIo, RefusesBrokenOffFiles) {
    using enum ErrorCode;
    const std::vector<Refusal> refusals = {
        {"# c\nXOFF\n1 1 0\n", FileFormat, kNone, 2, "'XOFF' where OFF"},
        {"CSTOFF\n", FileFormat, kNone, 1, "'CSTOFF'"},
        {"4OFF\n1 1 0\n", FileFormat, kNone, 1, "4OFF has points of other than three"},
        {"8 x 0\n", FileFormat, kNone, 1, "'8' where OFF"},
        {"OFF BINARY\n1 1 0\n", FileFormat, kNone, 1, "binary OFF, which is not read"},
        {"OFF\nBINARY\n", FileFormat, kNone, 2, "lacks the numbers"},
        {"STOFF\n1 1 0\n0 0 0 1\n", FileFormat, 0, 3, "vertex 0 lacks its texture"},
        {"STNOFF\n1 1 0\n0 0 0 1 1 1 2 x\n", FileFormat, 0, 3, "vertex 0 has 'x'"},
        {"OFF\n", FileFormat, kNone, 1, "lacks the numbers"},
        {"OFF\n8\n", FileFormat, kNone, 2, "lacks the numbers"},
        {"OFF\n8 x 0\n", FileFormat, kNone, 2, "'x' where the number of faces"},
        {"OFF\n-8 6 0\n", FileFormat, kNone, 2, "'-8' where the number of vertices"},
        {"OFF\n2 1 0\n0 0 0\n", FileFormat, 1, 3, "the file ends before vertex 1 of 2"},
        {"OFF\n1 2 0\n0 0 0\n3 0 0 0\n\n", FileFormat, 1, 5, "ends before face 1 of 2"},
        {"OFF\n1 1 0\n0 0\n3 0 0 0\n", FileFormat, 0, 3, "vertex 0 has 2 coordinates"},
        {"OFF\n1 1 0\n0 y 0\n", FileFormat, 0, 3, "vertex 0 has 'y' where a number"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0\n", FileFormat, 0, 4,
         "face 0 announces 3 vertices, but has 2"},
        {"OFF\n1 1 0\n0 0 0\n99999999999999999999 0 0\n", FileFormat, 0, 4, "but has 2"},
        {"OFF\n1 1 0\n0 0 0\nz 0 0\n", FileFormat, 0, 4, "'z' where the number of"},
        {"OFF\n1 1 0\n0 0 0\n-3 0 0\n", FileFormat, 0, 4, "'-3' where the number of"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0 0.5\n", FileFormat, 0, 4, "'0.5' where a vertex"},
        {"OFF\n1 2 0\n0 0 0\n3 0 0 0\n3 0 -1 0\n", IndexOutOfRange, 1, 5,
         "face 1 names vertex -1, but the format counts vertices from 0"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0 4294967295\n", IndexOutOfRange, 0, 4, "32 bits"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0 0\n3 0 0 0\n", FileFormat, kNone, 5, "goes on"},
        // Counts that no memory could hold.
        {"OFF\n9000000000000000000 1 0\n0 0 0\n", FileFormat, 1, 3, "before vertex 1"},
        {"OFF\n1 99999999999999999999 0\n0 0 0\n", FileFormat, 0, 3, "before face 0"},
    };
    for (const Refusal& refusal : refusals)
        expect_refusal(read("off", refusal.content), refusal);
}

// ---- PLY ----

template <class T>
void append(std::string& bytes, T value, std::endian order) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (order != std::endian::native)
        std::ranges::reverse(raw);
    bytes.append(raw.data(), raw.size());
}

std::string_view name_of(std::endian order) {
    return order == std::endian::big ? "binary_big_endian" : "binary_little_endian";
}

/// The cube with properties and elements around those that count, faces before vertices.
std::string binary_cube(std::endian order) {
    std::string bytes = "ply\nformat " + std::string(name_of(order)) + " 1.0\n" +
                        "comment C:\\a\\\nobj_info 1 2\n"
                        "element camera 1\nproperty list uint16 float view\n"
                        "property uchar kind\n"
                        "element face 6\nproperty uchar red\n"
                        "property list char short flags\n"
                        "property list uint16 uint32 vertex_index\nproperty double area\n"
                        "element vertex 9\nproperty float nx\nproperty double z\n"
                        "property double x\nproperty list uchar ushort y2\n"
                        "property double y\nproperty int16 tail\nend_header\n";
    append(bytes, std::uint16_t{2}, order);
    append(bytes, 1.5f, order);
    append(bytes, 2.5f, order);
    append(bytes, std::uint8_t{7}, order);
    const Index* v = kFaceVertices.data();
    for (const Index n : kFaceSizes) {
        append(bytes, std::uint8_t{255}, order);
        append(bytes, std::int8_t{1}, order);
        append(bytes, std::int16_t{-1}, order);
        append(bytes, static_cast<std::uint16_t>(n), order);
        for (Index c = 0; c < n; ++c)
            append(bytes, *v++, order);
        append(bytes, 0.5, order);
    }
    for (const Vec3<double>& p : kPositions) {
        append(bytes, 0.0f, order);
        append(bytes, p.z, order);
        append(bytes, p.x, order);
        append(bytes, std::uint8_t{0}, order);
        append(bytes, p.y, order);
        append(bytes, std::int16_t{-2}, order);
    }
    return bytes;
}

TEST_F(MeshIo, ReadsBinaryPlyOfBothByteOrders) {
    for (const std::endian order : {std::endian::little, std::endian::big}) {
        SCOPED_TRACE(name_of(order));
        const auto mesh = read("ply", binary_cube(order));
        expect_cube(mesh);
        ASSERT_TRUE(mesh);
        EXPECT_TRUE(mesh->vertex_lines.empty());
        EXPECT_TRUE(mesh->face_lines.empty());
    }
}

TEST_F(MeshIo, SkipsOtherPropertiesAndElementsOfTextPly) {
    const auto mesh =
        read("ply",
             "ply\nformat ascii 1.0\nelement nothing 4000000000000000000\n"
             "element face 1\nproperty float q\n"
             "property list int int vertex_index\nproperty list uchar uchar c\n"
             "element edge 2\nproperty list uchar float w\n"
             "element vertex 3\nproperty int8 y\nproperty double z\n"
             "property list uchar char l\nproperty float32 x\nend_header\n"
             "0.5 3 2 1 0 2 8 9\n\n1 nan\n0\n2 5 2 7 7 1\n3 6 0 +2\n-128 7 0 3\n"
             "\n");
    ASSERT_TRUE(mesh) << mesh.error().message << ", line " << mesh.error().line;
    EXPECT_EQ(mesh->positions,
              (std::vector<Vec3<double>>{{1, 2, 5}, {2, 3, 6}, {3, -128, 7}}));
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{2, 1, 0}));
    EXPECT_EQ(mesh->face_lines, std::vector<Index>{16});
    EXPECT_EQ(mesh->vertex_lines, (std::vector<Index>{20, 21, 22}));
}

/// A number that the other types of the width of T would read as another one.
template <class T>
constexpr int kTelling = std::is_signed_v<T> ? -100 : 200;

/// A triangle (0,0,0) (1,0,0) (0,2,kTelling) with each number in type T, called `name`.
template <class T>
std::string triangle_ply(std::endian order, const std::string& name) {
    const std::string integer = std::is_integral_v<T> ? name : "uchar";
    using Integer = std::conditional_t<std::is_integral_v<T>, T, std::uint8_t>;
    std::string bytes = "ply\nformat " + std::string(name_of(order)) +
                        " 1.0\nelement vertex 3\nproperty " + name + " x\nproperty " +
                        name + " y\nproperty " + name +
                        " z\nelement face 1\nproperty list " + integer + " " + integer +
                        " vertex_indices\nend_header\n";
    for (const int value : {0, 0, 0, 1, 0, 0, 0, 2, kTelling<T>})
        append(bytes, static_cast<T>(value), order);
    for (const int value : {3, 0, 1, 2})
        append(bytes, static_cast<Integer>(value), order);
    return bytes;
}

template <class T>
void expect_triangles(const std::function<Result<MeshData>(const std::string&)>& read_ply,
                      const std::string& old_name, const std::string& new_name) {
    for (const std::endian order : {std::endian::little, std::endian::big}) {
        for (const std::string& name : {old_name, new_name}) {
            const auto mesh = read_ply(triangle_ply<T>(order, name));
            ASSERT_TRUE(mesh) << name << ": " << mesh.error().message;
            EXPECT_EQ(mesh->positions, (std::vector<Vec3<double>>{
                                           {0, 0, 0}, {1, 0, 0}, {0, 2, kTelling<T>}}))
                << name;
            EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{0, 1, 2})) << name;
        }
    }
}

TEST_F(MeshIo, ReadsEveryTypeOfPlyByBothNames) {
    const auto read_ply = [&](const std::string& bytes) { return read("ply", bytes); };
    expect_triangles<std::int8_t>(read_ply, "char", "int8");
    expect_triangles<std::uint8_t>(read_ply, "uchar", "uint8");
    expect_triangles<std::int16_t>(read_ply, "short", "int16");
    expect_triangles<std::uint16_t>(read_ply, "ushort", "uint16");
    expect_triangles<std::int32_t>(read_ply, "int", "int32");
    expect_triangles<std::uint32_t>(read_ply, "uint", "uint32");
    expect_triangles<float>(read_ply, "float", "float32");
    expect_triangles<double>(read_ply, "double", "float64");
}

TEST_F(MeshIo, RefusesBrokenPlyHeaders) {
    const auto refuse = [&](std::string_view content, Index line,
                            std::string_view message) {
        const Refusal expected{content, ErrorCode::FileFormat, kNone, line, message};
        expect_refusal(read("ply", content), expected);
    };
    const std::string xy =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\n"
        "property int y\n";
    refuse("plyx\n", 1, "does not start with ply");
    refuse("ply\nformat ascii 1.0\n", 2, "ends before end_header");
    refuse("ply\nend_header\n", 2, "no format line");
    refuse("ply\nformat ascii 2.0\n", 2, "the format is none of");
    refuse("ply\nformat text 1.0\n", 2, "the format is none of");
    refuse("ply\nformat ascii\n", 2, "the format is none of");
    refuse("ply\nformat ascii 1.0\nvertices 3\n", 3, "'vertices' where");
    refuse("ply\nelement vertex\n", 2, "'element name count'");
    refuse("ply\nelement vertex -1\n", 2, "'element name count'");
    refuse("ply\nelement vertex x\n", 2, "'element name count'");
    refuse("ply\nelement vertex 1\nelement vertex 1\n", 3, "vertex is declared twice");
    refuse("ply\nproperty int x\n", 2, "after an element line");
    refuse("ply\nelement vertex 1\nproperty int\n", 3, "a property line is not");
    refuse("ply\nelement vertex 1\nproperty set int int x\n", 3,
           "a property line is not");
    refuse("ply\nelement vertex 1\nproperty int64 x\n", 3, "property x has a type");
    refuse("ply\nelement face 1\nproperty list float int x\n", 3,
           "property x has a type");
    refuse("ply\nelement face 1\nproperty list uchar real x\n", 3,
           "property x has a type");
    refuse(xy + "property int x\n", 6, "property x is declared twice");
    refuse(xy + "end_header\n", 3, "element vertex has no number z");
    refuse(xy + "property list int int z\nend_header\n", 3, "no number z");
    refuse(xy + "property int z\nelement face 1\nproperty int a\nend_header\n", 7,
           "element face has no list of integers");
    refuse(
        xy + "property int z\nelement face 1\nproperty int vertex_indices\nend_header\n",
        7, "element face has no list of integers");
    refuse(xy + "property int z\nelement face 1\nproperty list int float vertex_index\n"
                "end_header\n",
           7, "element face has no list of integers");
}

const std::string kTextHeader =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    "property int z\nelement face 2\nproperty list uchar int vertex_indices\n"
    "end_header\n";  // the data starts in line 10

TEST_F(MeshIo, RefusesBrokenTextPlyData) {
    using enum ErrorCode;
    const std::vector<Refusal> refusals = {
        {"", FileFormat, 0, 9, "the file ends before vertex 0 of 1"},
        {"0 0\n", FileFormat, 0, 10, "vertex 0 has too few values"},
        {"0 b 0\n", FileFormat, 0, 10, "vertex 0 has 'b' where a number"},
        {"0 0 0.5\n", FileFormat, 0, 10, "vertex 0 has '0.5' where an integer"},
        {"0 0 0\n3 0 0 0\n", FileFormat, 1, 11, "the file ends before face 1 of 2"},
        {"0 0 0\n3 0 0 0\n3 0 0\n", FileFormat, 1, 12, "face 1 has too few values"},
        {"0 0 0\nx 0 0 0\n", FileFormat, 0, 11, "face 0 has 'x' where an integer"},
        {"0 0 0\n3 0 0 x\n", FileFormat, 0, 11, "face 0 has 'x' where an integer"},
        {"0 0 0\n-1\n", FileFormat, 0, 11, "face 0 has a list of -1 values"},
        {"0 0 0\n99999999999999999999 0\n", FileFormat, 0, 11, "too few values"},
        {"0 0 0\n3 0 -1 0\n", IndexOutOfRange, 0, 11, "face 0 names vertex -1, but"},
        {"0 0 0\n3 0 4294967295 0\n", IndexOutOfRange, 0, 11, "beyond 32 bits"},
        {"0 0 0\n3 0 0 0\n3 0 0 0\n3 0 0 0\n", FileFormat, kNone, 13, "goes on"},
    };
    for (const Refusal& refusal : refusals)
        expect_refusal(read("ply", kTextHeader + std::string(refusal.content)), refusal);
}

std::string binary_header(const std::string& n_vertices, const std::string& n_faces) {
    return "ply\nformat binary_big_endian 1.0\nelement vertex " + n_vertices +
           "\nproperty uchar x\nproperty uchar y\nproperty uchar z\nelement face " +
           n_faces + "\nproperty list int short vertex_indices\nend_header\n";
}

TEST_F(MeshIo, RefusesBrokenBinaryPlyData) {
    const auto refuse = [&](const std::string& header, std::string_view data,
                            ErrorCode code, Index element, std::string_view message) {
        expect_refusal(read("ply", header + std::string(data)),
                       {header, code, element, 0, message});
    };
    using namespace std::string_view_literals;
    using enum ErrorCode;
    const std::string h = binary_header("2", "1");
    const std::string v = "\1\2\3\1\2\3";
    refuse(h, "", FileFormat, 0, "the file ends before vertex 0 of 2");
    refuse(h, "\1\2", FileFormat, 0, "vertex 0 is cut off");
    refuse(h, "\1\2\3", FileFormat, 1, "the file ends before vertex 1 of 2");
    refuse(h, v, FileFormat, 0, "the file ends before face 0 of 1");
    refuse(h + v, "\0\0\0"sv, FileFormat, 0, "face 0 is cut off");
    refuse(h + v, "\0\0\0\3\0\0\0\0\0"sv, FileFormat, 0, "face 0 is cut off");
    refuse(h + v, "\177\0\0\3\0\0\0\0"sv, FileFormat, 0, "face 0 is cut off");
    refuse(h + v, "\377\377\377\377"sv, FileFormat, 0, "face 0 has a list of -1 values");
    refuse(h + v, "\0\0\0\3\0\0\377\376\0\1"sv, IndexOutOfRange, 0,
           "names vertex -2, but");
    refuse(h + v, "\0\0\0\3\0\0\0\1\0\1x"sv, FileFormat, kNone, "goes on");
    refuse(binary_header("4000000000000000000", "1"), v, FileFormat, 2,
           "before vertex 2");
    refuse(binary_header("2", "4000000000000000000"), v, FileFormat, 0, "before face 0");

    // A line end after the data does no harm.
    EXPECT_TRUE(read("ply", h + v + std::string("\0\0\0\3\0\0\0\1\0\1\r\n"sv)));
}

// ---- Channels ----

/// The first channel, of which it tells all.
void expect_channel(const Result<MeshData>& mesh, std::string_view name, int n,
                    const std::vector<double>& values, std::size_t i = 0) {
    ASSERT_TRUE(mesh) << mesh.error().message << ", line " << mesh.error().line;
    ASSERT_LT(i, mesh->channels.size());
    EXPECT_EQ(mesh->channels[i].name, name);
    EXPECT_EQ(mesh->channels[i].n, n);
    EXPECT_EQ(mesh->channels[i].values, values);
}

TEST_F(MeshIo, ReadsColoursOfObj) {
    expect_channel(
        read("obj", "v 0 0 0 1 0 .5\nv 1 0 0 0.1 2 -1\nf 1 2 3\nv 0 1 0 1e-3 0 1\n"),
        "color", 3, {1, 0, 0.5, 0.1, 2, -1, 1e-3, 0, 1});
    expect_channel(
        read("obj", "v 0 0 0 1 0 0 .5\nv 1 0 0 0 1 0 1 9 # alpha, and what\nf 1 2 1\n"),
        "color", 4, {1, 0, 0, 0.5, 0, 1, 0, 1});
    // Left to the check of the mesh, as positions are.
    const auto nan = read("obj", "v 0 0 0 1 nan 0\nf 1 1 1\n");
    ASSERT_TRUE(nan) << nan.error().message;
    EXPECT_TRUE(std::isnan(nan->channels[0].values[1]));
}

TEST_F(MeshIo, RefusesBrokenColoursOfObj) {
    using enum ErrorCode;
    const std::vector<Refusal> refusals = {
        {"v 0 0 0 1 1 1\nf 1 1 1\nv 1 0 0\n", FileFormat, 1, 3,
         "vertex 1 has no colour, unlike those before it"},
        {"v 0 0 0\nv 1 0 0 0.5\nv 1 0 0 1 1 1\n", FileFormat, 2, 3,
         "vertex 2 has a colour, unlike those before it"},
        {"v 0 0 0 1 1 1\nv 1 0 0 1 1 1 1\n", FileFormat, 1, 2,
         "vertex 1 has a colour of 4 numbers, those before it of 3"},
        {"v 0 0 0 1 red 1\n", FileFormat, 0, 1, "colour of vertex 0 has 'red' where"},
    };
    for (const Refusal& refusal : refusals)
        expect_refusal(read("obj", refusal.content), refusal);
}

constexpr std::string_view kOffFace = "3 0 1 2\n";

TEST_F(MeshIo, ReadsColoursOfOff) {
    const auto read_off = [&](const std::string& header, const std::string& vertices) {
        return read("off", header + "\n3 1 0\n" + vertices + std::string(kOffFace));
    };
    // Of 1, of 255, and of 1 as integers; the last number is alpha.
    expect_channel(read_off("COFF", "0 0 0 1 0.5 0\n1 0 0 1 1 1\n0 1 0 0 0 3\n"), "color",
                   3, {1, 0.5, 0, 1, 1, 1, 0, 0, 3});
    expect_channel(
        read_off("COFF", "0 0 0 255 0 51 255\n1 0 0 1 1 1 0\n0 1 0 0 0 102 0\n"), "color",
        4, {1, 0, 0.2, 1, 1 / 255., 1 / 255., 1 / 255., 0, 0, 0, 0.4, 0});
    expect_channel(read_off("COFF", "0 0 0 1 0 0\n1 0 0 1 1 1\n0 1 0 0 0 1\n"), "color",
                   3, {1, 0, 0, 1, 1, 1, 0, 0, 1});
    expect_channel(
        read_off("CNOFF", "0 0 0 9 9 9 1 0 0\n1 0 0 9 9 9 1 1 1\n0 1 0 9 9 9 0 0 1\n"),
        "color", 3, {1, 0, 0, 1, 1, 1, 0, 0, 1});
    const auto normals = read_off("NOFF", "0 0 0 9 9 9\n1 0 0 9 9 9\n0 1 0 9 9 9\n");
    ASSERT_TRUE(normals) << normals.error().message;
    EXPECT_TRUE(normals->channels.empty());
}

TEST_F(MeshIo, ReadsOffWithoutItsFirstLine) {
    const auto mesh = read("off", "# cube\n" + std::string(kCubeOff.substr(4)));
    expect_cube(mesh);
    expect_warning(mesh, {"", WarningCode::MissingHeader, 2, "no line OFF"});
}

TEST_F(MeshIo, ReadsTextureCoordinatesOfOff) {
    const auto expect = [&](const std::string& keyword, const std::string& before,
                            bool has_color) {
        SCOPED_TRACE(keyword);
        const auto mesh =
            read("off", keyword + "\n3 1 0\n0 0 0" + before + " 0.5 7\n1 0 0" + before +
                            " 1 8\n0 1 0" + before + " 2 9\n" + std::string(kOffFace));
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->uvs, (std::vector<Vec2<double>>{{0.5, 7}, {1, 8}, {2, 9}}));
        EXPECT_EQ(mesh->face_uvs, mesh->face_vertices);
        EXPECT_EQ(mesh->channels.size(), has_color ? 1u : 0u);
        if (has_color) {
            EXPECT_EQ(mesh->channels[0].values[0], 1);
        }
    };
    expect("STOFF", "", false);
    expect("STNOFF", " 9 9 9", false);
    expect("STCOFF", " 255 0 0", true);
    expect("STCNOFF", " 9 9 9 255 0 0 255", true);
}

TEST_F(MeshIo, RefusesBrokenColoursOfOff) {
    using enum ErrorCode;
    const std::vector<Refusal> refusals = {
        {"COFF\n2 1 0\n0 0 0 1 1 1\n0 0 0\n", FileFormat, 1, 4,
         "the colour of vertex 1 has 0 numbers instead of 3 or 4"},
        {"COFF\n2 1 0\n0 0 0 1 1\n", FileFormat, 0, 3, "has 2 numbers instead"},
        {"CNOFF\n2 1 0\n0 0 0 1 1\n", FileFormat, 0, 3, "has 0 numbers instead"},
        {"COFF\n2 1 0\n0 0 0 1 1 1\n0 0 0 1 1 1 1\n", FileFormat, 1, 4,
         "vertex 1 has a colour of 4 numbers, those before it of 3"},
        {"COFF\n1 1 0\n0 0 0 1 1 x\n", FileFormat, 0, 3, "vertex 0 has 'x' where"},
    };
    for (const Refusal& refusal : refusals)
        expect_refusal(read("off", refusal.content), refusal);
}

// Normals, lists and what belongs to faces are no channels.
TEST_F(MeshIo, ReadsChannelsOfTextPly) {
    const auto mesh = read(
        "ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float weight\n"
        "property uchar blue\nproperty float nx\nproperty float x\nproperty float y\n"
        "property float z\nproperty ushort red\nproperty double green\n"
        "property double move_0\nproperty float move_1\nproperty int move_2\n"
        "property int move_4\nproperty list uchar float many\nproperty int one_0\n"
        "element face 1\nproperty uchar red\nproperty list uchar int vertex_indices\n"
        "end_header\n"
        "0.1 51 9 0 0 0 65535 0.3 1 2 3 4 1 0 -5\n1 255 9 1 0 0 13107 2 5 6 7 8 0 -6\n"
        "-2 0 9 0 1 0 0 -1 9 10 11 12 0 -7\n255 3 0 1 2\n");
    ASSERT_TRUE(mesh) << mesh.error().message << ", line " << mesh.error().line;
    ASSERT_EQ(mesh->channels.size(), 5u);
    expect_channel(mesh, "color", 3, {1, 0.3, 0.2, 0.2, 2, 1, 0, -1, 0}, 0);
    expect_channel(mesh, "weight", 1, {0.1, 1, -2}, 1);
    expect_channel(mesh, "move", 3, {1, 2, 3, 5, 6, 7, 9, 10, 11}, 2);
    expect_channel(mesh, "move_4", 1, {4, 8, 12}, 3);
    expect_channel(mesh, "one_0", 1, {-5, -6, -7}, 4);
    EXPECT_EQ(mesh->positions,
              (std::vector<Vec3<double>>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

TEST_F(MeshIo, ReadsChannelsOfBinaryPlyOfBothByteOrders) {
    for (const std::endian order : {std::endian::little, std::endian::big}) {
        SCOPED_TRACE(name_of(order));
        std::string bytes = "ply\nformat " + std::string(name_of(order)) +
                            " 1.0\nelement vertex 3\nproperty uchar alpha\n"
                            "property uchar red\nproperty uchar green\n"
                            "property uchar blue\nproperty double x\nproperty double y\n"
                            "property double z\nproperty int id\nproperty float w_0\n"
                            "property double w_1\nelement face 1\n"
                            "property list uchar uchar vertex_indices\nend_header\n";
        for (int v = 0; v < 3; ++v) {
            for (const int color : {255, 51 * v, 102, 0})
                append(bytes, static_cast<std::uint8_t>(color), order);
            for (const double x : {1.0, 2.0, 3.0})
                append(bytes, x * v, order);
            append(bytes, std::int32_t{-70000 * v}, order);
            append(bytes, 0.1f, order);
            append(bytes, 0.1, order);
        }
        for (const int value : {3, 0, 1, 2})
            append(bytes, static_cast<std::uint8_t>(value), order);
        const auto mesh = read("ply", bytes);
        expect_channel(mesh, "color", 4, {0, 0.4, 0, 1, 0.2, 0.4, 0, 1, 0.4, 0.4, 0, 1},
                       0);
        expect_channel(mesh, "id", 1, {0, -70000, -140000}, 1);
        expect_channel(mesh, "w", 2, {0.1f, 0.1, 0.1f, 0.1, 0.1f, 0.1}, 2);
    }
}

TEST_F(MeshIo, RefusesChannelsOfPlyThatAreNoNumbers) {
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        "property float z\nproperty float w\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n";
    expect_refusal(read("ply", header + "0 0 0 1\n0 0 0\n"),
                   {header, ErrorCode::FileFormat, 1, 12, "vertex 1 has too few values"});
    expect_refusal(
        read("ply", header + "0 0 0 1\n0 0 0 x\n"),
        {header, ErrorCode::FileFormat, 1, 12, "vertex 1 has 'x' where a number"});
}

// ---- Texture coordinates of PLY ----

std::string uv_ply(const std::string& vertex, const std::string& face,
                   const std::string& rows) {
    return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
           "property float y\nproperty float z\n" +
           vertex + "element face 2\n" + face + "end_header\n" + rows;
}
constexpr const char* kPlyCorners = "property list uchar int vertex_indices\n";

TEST_F(MeshIo, ReadsTextureCoordinatesOfVerticesOfPly) {
    for (const auto& [u, v] :
         {std::pair("s", "t"), {"u", "v"}, {"texture_u", "texture_v"}}) {
        const auto mesh =
            read("ply", uv_ply(std::string("property float ") + v +
                                   "\nproperty float w\n" + "property float " + u + "\n",
                               kPlyCorners,
                               "0 0 0 1 5 2\n1 0 0 3 6 4\n1 1 0 5 7 6\n0 1 0 7 8 8\n"
                               "3 0 1 2\n3 0 2 3\n"));
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->uvs, (std::vector<Vec2<double>>{{2, 1}, {4, 3}, {6, 5}, {8, 7}}));
        EXPECT_EQ(mesh->face_uvs, mesh->face_vertices);
        ASSERT_EQ(mesh->channels.size(), 1u);
        EXPECT_EQ(mesh->channels[0].name, "w");
        const auto back = parse_mesh(*format_mesh(*mesh, ".ply"), ".ply");
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_EQ(back->uvs, mesh->uvs);
        EXPECT_EQ(back->face_uvs, mesh->face_uvs);
    }
}

// Corners of a vertex share what is the same there.
TEST_F(MeshIo, TextureCoordinatesOfCornersOfPlyReadBack) {
    const std::string points = "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n";
    const std::string texcoord = std::string("property list uchar float texcoord\n");
    const auto mesh =
        read("ply", uv_ply("property float s\n", texcoord + kPlyCorners,
                           points + "6 0 0 1 0 1 1 3 0 1 2\n6 0 0 0.1 1 5 5 3 0 2 3\n"));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->face_uvs, (std::vector<Index>{0, 1, 2, 0, 3, 4}));
    EXPECT_EQ(mesh->uvs,
              (std::vector<Vec2<double>>{{0, 0}, {1, 0}, {1, 1}, {0.1, 1}, {5, 5}}));
    const auto back = parse_mesh(*format_mesh(*mesh, ".ply"), ".ply");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->uvs, mesh->uvs);
    EXPECT_EQ(back->face_uvs, mesh->face_uvs);
    EXPECT_EQ(back->face_vertices, mesh->face_vertices);

    const auto missing =
        read("ply", uv_ply("property float s\n", texcoord + kPlyCorners,
                           points + "0 3 0 1 2\n6 1 1 1 1 2 2 3 0 2 3\n"));
    expect_warning(missing, {"", WarningCode::MissingTexcoords, 16, "3 of 6"});
    const auto uneven =
        read("ply", uv_ply("property float s\n", texcoord + kPlyCorners,
                           points + "5 0 0 1 0 1 3 0 1 2\n6 1 1 1 1 2 2 3 0 2 3\n"));
    expect_warning(uneven, {"", WarningCode::InvalidTexcoords, 16, "3 of 6"});
}

TEST_F(MeshIo, RefusesToWriteChannelsThatWouldBeTextureCoordinatesOfPly) {
    MeshData mesh = *parse_mesh(kCubeObj, ".obj");
    mesh.channels = {{"t", 1, std::vector<double>(9)}, {"s", 1, std::vector<double>(9)}};
    const auto text = format_mesh(mesh, ".ply");
    ASSERT_FALSE(text);
    EXPECT_EQ(text.error().code, ErrorCode::WriteFailed);
    mesh.uvs = {{0, 0}};
    mesh.face_uvs.assign(mesh.face_vertices.size(), 0);
    const auto back = parse_mesh(*format_mesh(mesh, ".ply"), ".ply");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->channels.size(), 2u);
    mesh.face_uvs[0] = 1;
    EXPECT_FALSE(format_mesh(mesh, ".ply"));
}

TEST_F(MeshIo, LeavesOutValuesThatPlyDoesNotDeclare) {
    const auto mesh = read("ply", uv_ply("", kPlyCorners,
                                         "0 0 0\n1 0 0 7\n1 1 0\n0 1 0\n3 0 1 2 9 1\n"
                                         "3 0 2 3 9 1\n"));
    expect_warning(mesh, {"", WarningCode::ExtraValues, 11, "vertex 1 has more values"});
    ASSERT_TRUE(mesh);
    EXPECT_NE(mesh->warnings[0].message.find("3 rows"), std::string::npos);
    EXPECT_EQ(mesh->face_vertices, (std::vector<Index>{0, 1, 2, 0, 2, 3}));
}

/// A cube with a colour, a weight and a vector of numbers that differ between float and double.
MeshData cube_with_channels(bool as_bytes = false) {
    MeshData mesh = *parse_mesh(kCubeObj, ".obj");
    mesh.channels = {{"weight", 1, {}}, {"color", 3, {}}, {"velocity", 2, {}}};
    for (int v = 0; v < 9; ++v) {
        mesh.channels[0].values.push_back(0.25 * v);
        for (int k = 0; k < 3; ++k)
            mesh.channels[1].values.push_back(as_bytes ? (31 * v + k) / 255.
                                                       : v / 9. + k);
        for (int k = 0; k < 2; ++k)
            mesh.channels[2].values.push_back(1 / (v + 3.) - k);
    }
    return mesh;
}

const NamedChannels& channel_of(const MeshData& mesh, std::string_view name) {
    static const NamedChannels none;
    const NamedChannels* found = find_channels(mesh.channels, name);
    EXPECT_TRUE(found) << name;
    return found ? *found : none;
}

TEST_F(MeshIo, ColoursReadBackFromEveryFormat) {
    for (const bool as_bytes : {false, true}) {
        for (const int n : {3, 4}) {
            MeshData mesh = cube_with_channels(as_bytes);
            NamedChannels& color = mesh.channels[1];
            color.n = n;
            color.values.resize(9 * static_cast<std::size_t>(n), 1.0);
            for (const std::string_view extension : {".obj", ".off", ".ply"}) {
                SCOPED_TRACE(extension);
                const auto text = format_mesh(mesh, extension);
                ASSERT_TRUE(text) << text.error().message;
                const auto back = parse_mesh(*text, extension);
                expect_cube(back);
                ASSERT_TRUE(back);
                EXPECT_EQ(channel_of(*back, "color").n, n);
                EXPECT_EQ(channel_of(*back, "color").values, color.values);
                EXPECT_EQ(back->channels.size(), extension == ".ply" ? 3u : 1u);
            }
        }
    }
    // Integers beyond 1 are still what they are.
    MeshData mesh = cube_with_channels();
    mesh.channels[1].values.assign(27, 2);
    const auto back = parse_mesh(*format_mesh(mesh, ".off"), ".off");
    EXPECT_EQ(channel_of(*back, "color").values, mesh.channels[1].values);
}

TEST_F(MeshIo, ChannelsReadBackFromPlyInTheLeastExactType) {
    const MeshData mesh = cube_with_channels(true);
    const auto text = format_mesh(mesh, ".ply");
    ASSERT_TRUE(text) << text.error().message;
    const auto back = parse_mesh(*text, ".ply");
    expect_cube(back);
    ASSERT_TRUE(back);
    ASSERT_EQ(back->channels.size(), 3u);
    for (const NamedChannels& c : mesh.channels) {
        EXPECT_EQ(channel_of(*back, c.name).n, c.n);
        EXPECT_EQ(channel_of(*back, c.name).values, c.values);
    }
    for (const std::string_view line :
         {"property float weight", "property uchar blue", "property double velocity_1"})
        EXPECT_NE(text->find(std::string(line) + "\n"), std::string::npos) << *text;
}

TEST_F(MeshIo, RefusesToWriteChannelsThatPlyCannotTellApart) {
    const auto refuse = [](const auto& break_it, ErrorCode code,
                           std::string_view message) {
        MeshData mesh = cube_with_channels();
        break_it(mesh);
        const auto text = format_mesh(mesh, ".ply");
        ASSERT_FALSE(text);
        EXPECT_EQ(text.error().code, code);
        EXPECT_NE(text.error().message.find(message), std::string::npos)
            << text.error().message;
    };
    using enum ErrorCode;
    for (const std::string name : {"", "two words", "line\n"}) {
        refuse([&](MeshData& m) { m.channels[0].name = name; }, WriteFailed,
               "not one word");
    }
    for (const std::string name : {"x", "nz", "red", "velocity_1"}) {
        refuse([&](MeshData& m) { m.channels[0].name = name; }, WriteFailed,
               "would be the property " + name);
    }
    refuse([](MeshData& m) { m.channels[2].values.pop_back(); }, SizeMismatch,
           "channel velocity has 17 values, but 9 vertices need 2 each");
    refuse([](MeshData& m) { m.channels[1].n = 5; }, SizeMismatch, "colours have 3 or 4");
    refuse([](MeshData& m) { m.channels[0].n = 0; }, SizeMismatch,
           "channel weight has 0");
}

// ---- Names of faces ----

constexpr std::string_view kNamedObj =
    "mtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    "o  my   box\ng left right # c\nusemtl red\nf 1 2 3\ng never\ng top\nf 2 3 1\n"
    "usemtl blue\no\nmtllib c.mtl\ng left right\nf 3 1 2\nusemtl\nf 1 2 3\n";

void expect_names(const Result<MeshData>& mesh) {
    ASSERT_TRUE(mesh) << mesh.error().message;
    using Names = std::vector<std::string>;
    EXPECT_EQ(mesh->groups.names, (Names{"left right", "top"}));
    EXPECT_EQ(mesh->groups.faces, (std::vector<Index>{kNone, 0, 1, 0, 0}));
    EXPECT_EQ(mesh->objects.names, Names{"my box"});
    EXPECT_EQ(mesh->objects.faces, (std::vector<Index>{kNone, 0, 0, kNone, kNone}));
    EXPECT_EQ(mesh->materials.names, (Names{"red", "blue"}));
    EXPECT_EQ(mesh->materials.faces, (std::vector<Index>{kNone, 0, 0, 1, kNone}));
    EXPECT_EQ(mesh->material_files, (Names{"a b.mtl", "c.mtl"}));
}

TEST_F(MeshIo, ReadsAndWritesNamesOfObj) {
    const auto mesh = parse_mesh(kNamedObj, ".obj");
    expect_names(mesh);
    ASSERT_TRUE(mesh);
    const auto text = format_mesh(*mesh, ".obj");
    ASSERT_TRUE(text) << text.error().message;
    expect_names(parse_mesh(*text, ".obj"));
    EXPECT_TRUE(parse_mesh(kCubeObj, ".obj")->groups.faces.empty());
}

TEST_F(MeshIo, RefusesNamesThatObjCannotHold) {
    const MeshData good = *parse_mesh(kNamedObj, ".obj");
    const auto refuse = [&](const MeshData& mesh, ErrorCode code, Index element) {
        const auto text = format_mesh(mesh, ".obj");
        ASSERT_FALSE(text);
        EXPECT_EQ(text.error().code, code) << text.error().message;
        EXPECT_EQ(text.error().element, element);
    };
    for (const std::string name : {"", " a", "a  b", "a #b", "a\nf 1 1 1", "a\tb"}) {
        MeshData mesh = good;
        mesh.groups.names[1] = name;
        refuse(mesh, ErrorCode::WriteFailed, kNone);
        mesh = good;
        mesh.material_files[0] = name;
        refuse(mesh, ErrorCode::WriteFailed, kNone);
    }
    MeshData mesh = good;
    mesh.objects.faces.pop_back();
    refuse(mesh, ErrorCode::SizeMismatch, kNone);
    mesh = good;
    mesh.materials.faces[3] = 2;
    refuse(mesh, ErrorCode::IndexOutOfRange, 3);
}

}  // namespace
}  // namespace osdx
