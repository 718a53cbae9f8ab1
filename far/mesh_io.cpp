// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include "far/mesh_data.h"

// The parsers are our own on purpose: libraries lose the line of the file, drop faces that
// they dislike, and some turn nan into 0.

namespace osdx {
namespace {

// ---- Lines, words, numbers ----

using Words = std::span<const std::string_view>;

bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/// What a line may hold besides words.
struct LineSyntax {
    bool comments = false;       ///< from a word that starts with '#' to the end
    bool continuations = false;  ///< a backslash at the end joins the next line
};

/// Splits a text into lines of words. Lines without words are passed over.
class LineScanner {
public:
    LineScanner(std::string_view text, LineSyntax syntax)
        : rest_(text), syntax_(syntax) {}

    /// Goes to the next line; false at the end of the text.
    bool next() {
        words_.clear();
        while (words_.empty() && !rest_.empty()) {
            line_ = n_lines_ + 1;
            while (take_line()) {
            }
        }
        return !words_.empty();
    }

    Words words() const { return words_; }
    Index line() const { return line_; }  ///< the first one, of lines that are joined
    std::string_view rest() const { return rest_; }  ///< what follows this line

private:
    /// Appends the words of one line; true when the next line belongs to it.
    bool take_line() {
        const std::size_t end = std::min(rest_.find('\n'), rest_.size());
        std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(std::min(end + 1, rest_.size()));
        ++n_lines_;
        if (line.ends_with('\r'))
            line.remove_suffix(1);
        const bool joined = syntax_.continuations && line.ends_with('\\');
        if (joined)
            line.remove_suffix(1);
        const char* c = line.data();
        const char* const stop = c + line.size();
        while (true) {
            c = std::find_if_not(c, stop, is_space);
            if (c == stop)
                return joined && !rest_.empty();
            if (syntax_.comments && *c == '#')
                return false;  // a path in a comment may well end in a backslash
            const char* const first = c;
            c = std::find_if(c, stop, is_space);
            words_.emplace_back(first, static_cast<std::size_t>(c - first));
        }
    }

    std::string_view rest_;
    LineSyntax syntax_;
    std::vector<std::string_view> words_;
    Index line_ = 0;
    Index n_lines_ = 0;
};

/// The number that fills `word`, as std::from_chars reads it or with a plus sign. An integer
/// too great for T becomes the greatest (or least) one.
template <class T>
std::optional<T> parse(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-"))
        word.remove_prefix(1);
    const char* const stop = word.data() + word.size();
    T value{};
    const auto [end, error] = std::from_chars(word.data(), stop, value);
    if (end != stop || error == std::errc::invalid_argument)
        return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        if (!std::is_integral_v<T>)
            return std::nullopt;
        value = word.starts_with('-') ? std::numeric_limits<T>::min()
                                      : std::numeric_limits<T>::max();
    }
    return value;
}

/// A word of the file for use in a message: one short line, whatever the file holds.
std::string printable(std::string_view word) {
    std::string text(word.substr(0, 40));
    std::ranges::replace_if(
        text, [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

Error unexpected(std::string_view where, std::string_view word, std::string_view expected,
                 Index element, Index line) {
    return fail(
        ErrorCode::FileFormat,
        fmt::format("{} has '{}' where {} is expected", where, printable(word), expected),
        element, line);
}

// ---- What the formats share: vertices and faces ----

Index next_vertex(const MeshData& mesh) {
    return static_cast<Index>(mesh.positions.size());
}
Index next_face(const MeshData& mesh) {
    return static_cast<Index>(mesh.face_sizes.size());
}

/// `line` is 0 in binary files; then no lines are kept.
void add_vertex(MeshData& mesh, const Vec3<double>& position, Index line) {
    mesh.positions.push_back(position);
    if (line > 0)
        mesh.vertex_lines.push_back(line);
}

Status read_vertex(Words words, Index line, MeshData& mesh) {
    const Index v = next_vertex(mesh);
    if (words.size() < 3) {
        return fail(
            ErrorCode::FileFormat,
            fmt::format("vertex {} has {} coordinates instead of 3", v, words.size()), v,
            line);
    }
    Vec3<double> position;
    for (int i = 0; i < 3; ++i) {
        const auto x = parse<double>(words[i]);
        if (!x)
            return unexpected(fmt::format("vertex {}", v), words[i], "a number", v, line);
        position[i] = *x;
    }
    add_vertex(mesh, position, line);
    return ok();
}

Error bad_index(const MeshData& mesh, std::int64_t index, std::string_view why,
                Index line) {
    const Index f = next_face(mesh);
    return fail(ErrorCode::IndexOutOfRange,
                fmt::format("face {} names vertex {}, {}", f, index, why), f, line);
}

/// Appends a corner to the face that is being read; `index` counts from 0.
Status add_corner(MeshData& mesh, std::int64_t index, Index line) {
    if (index < 0)
        return bad_index(mesh, index, "but the format counts vertices from 0", line);
    if (index >= kInvalidIndex)
        return bad_index(mesh, index, "which is beyond 32 bits", line);
    mesh.face_vertices.push_back(static_cast<Index>(index));
    return ok();
}

/// Closes the face whose corners start at `first` in face_vertices.
Status end_face(MeshData& mesh, std::size_t first, Index line) {
    const std::size_t n = mesh.face_vertices.size() - first;
    if (n < 3) {
        const Index f = next_face(mesh);
        return fail(ErrorCode::FaceTooSmall, fmt::format("face {} has {} vertices", f, n),
                    f, line);
    }
    mesh.face_sizes.push_back(static_cast<Index>(n));
    if (line > 0)
        mesh.face_lines.push_back(line);
    return ok();
}

Error ends_early(std::string_view item, std::int64_t i, std::int64_t n, Index line) {
    return fail(ErrorCode::FileFormat,
                fmt::format("the file ends before {} {} of {}", item, i, n),
                static_cast<Index>(i), line);
}

Result<MeshData> finish(MeshData mesh) {
    if (mesh.positions.empty())
        return fail(ErrorCode::EmptyMesh, "the file has no vertices");
    if (mesh.face_sizes.empty())
        return fail(ErrorCode::EmptyMesh, "the file has no faces");
    return mesh;
}

// ---- OBJ ----

Status read_obj_uv(Words words, Index line, MeshData& mesh) {
    const auto i = static_cast<Index>(mesh.uvs.size());
    const std::string where = fmt::format("texture coordinate {}", i);
    if (words.empty()) {
        return fail(ErrorCode::FileFormat, fmt::format("{} has no numbers", where), i,
                    line);
    }
    Vec2<double> uv(0);  // the second number may be missing
    for (int k = 0; k < 2 && k < static_cast<int>(words.size()); ++k) {
        const auto x = parse<double>(words[k]);
        if (!x)
            return unexpected(where, words[k], "a number", i, line);
        uv[k] = *x;
    }
    mesh.uvs.push_back(uv);
    return ok();
}

/// The numbers of a corner "v", "v/vt", "v//vn" or "v/vt/vn". All but the first may be missing
/// even after a slash, as some writers have it.
struct ObjCorner {
    std::int64_t vertex;
    std::optional<std::int64_t> uv;
};

std::optional<ObjCorner> parse_obj_corner(std::string_view word) {
    std::array<std::optional<std::int64_t>, 3> numbers;
    for (std::size_t n = 0;; ++n) {
        const std::string_view number = word.substr(0, word.find('/'));
        if (n == 3 || (n == 0 && number.empty()))
            return std::nullopt;
        if (!number.empty() && !(numbers[n] = parse<std::int64_t>(number)))
            return std::nullopt;
        if (number.size() == word.size())
            return ObjCorner{*numbers[0], numbers[1]};
        word.remove_prefix(number.size() + 1);
    }
}

/// From OBJ's count, from 1 or backwards from the last of `n`, to ours from 0.
Result<std::int64_t> obj_index(const MeshData& mesh, std::int64_t index, std::size_t n,
                               std::string_view what, std::string_view plural,
                               Index line) {
    const auto bad = [&](std::string_view why) {
        const Index f = next_face(mesh);
        return fail(ErrorCode::IndexOutOfRange,
                    fmt::format("face {} names {} {}, {}", f, what, index, why), f, line);
    };
    if (index == 0)
        return bad(fmt::format("but OBJ counts {} from 1", plural));
    if (index > 0)
        return index - 1;
    const auto count = static_cast<std::int64_t>(n);
    if (index < -count)
        return bad(fmt::format("but only {} {} precede it", n, plural));
    return count + index;
}

Status add_obj_corner(MeshData& mesh, std::string_view word, Index line) {
    const Index f = next_face(mesh);
    const auto corner = parse_obj_corner(word);
    if (!corner) {
        return unexpected(fmt::format("face {}", f), word,
                          "a corner v, v/vt, v//vn or v/vt/vn", f, line);
    }
    const auto vertex = obj_index(mesh, corner->vertex, mesh.positions.size(), "vertex",
                                  "vertices", line);
    if (!vertex)
        return vertex.error();
    if (corner->uv) {
        const auto uv = obj_index(mesh, *corner->uv, mesh.uvs.size(),
                                  "texture coordinate", "texture coordinates", line);
        if (!uv)
            return uv.error();
        // What is beyond 32 bits is beyond the list as well, whose check comes later.
        mesh.face_uvs.push_back(
            static_cast<Index>(std::min<std::int64_t>(*uv, kInvalidIndex)));
    }
    return add_corner(mesh, *vertex, line);
}

Status read_obj_face(Words words, Index line, MeshData& mesh) {
    const std::size_t first = mesh.face_vertices.size();
    const std::size_t first_uv = mesh.face_uvs.size();
    for (const std::string_view word : words) {
        if (Status status = add_obj_corner(mesh, word, line); !status)
            return status;
    }
    const Index f = next_face(mesh);
    const std::size_t n_uvs = mesh.face_uvs.size() - first_uv;
    if (n_uvs != 0 && n_uvs != words.size()) {
        return fail(ErrorCode::FileFormat,
                    fmt::format("face {} has texture coordinates at {} of {} corners", f,
                                n_uvs, words.size()),
                    f, line);
    }
    if (f > 0 && (n_uvs != 0) != (first_uv != 0)) {
        return fail(ErrorCode::FileFormat,
                    fmt::format("face {} has {} texture coordinates, unlike the faces "
                                "before it",
                                f, n_uvs == 0 ? "no" : "some"),
                    f, line);
    }
    return end_face(mesh, first, line);
}

/// The counts of a tag, "2/1/0".
std::optional<std::array<std::size_t, 3>> parse_tag_counts(std::string_view word) {
    std::array<std::size_t, 3> counts;
    for (int i = 0; i < 3; ++i) {
        const std::string_view part = i < 2 ? word.substr(0, word.find('/')) : word;
        const auto count = parse<std::int64_t>(part);
        if (!count || *count < 0 || *count > kInvalidIndex)
            return std::nullopt;
        counts[i] = static_cast<std::size_t>(*count);
        word.remove_prefix(std::min(part.size() + 1, word.size()));
    }
    return counts;
}

Status read_tag_values(Words words, std::string_view where,
                       const std::array<std::size_t, 3>& counts, Tag& tag) {
    for (const std::string_view word : words.first(counts[0])) {
        const auto value = parse<std::int64_t>(word);
        if (!value || !std::in_range<int>(*value))
            return unexpected(where, word, "an integer", kInvalidIndex, tag.line);
        tag.ints.push_back(static_cast<int>(*value));
    }
    for (const std::string_view word : words.subspan(counts[0], counts[1])) {
        const auto value = parse<double>(word);
        if (!value)
            return unexpected(where, word, "a number", kInvalidIndex, tag.line);
        tag.floats.push_back(*value);
    }
    for (const std::string_view word : words.last(counts[2]))
        tag.text.emplace_back(word);
    return ok();
}

Status read_tag(Words words, Index line, MeshData& mesh) {
    if (words.size() < 2) {
        return fail(ErrorCode::FileFormat,
                    "a tag needs a name and its counts ints/floats/strings",
                    kInvalidIndex, line);
    }
    const std::string where = fmt::format("tag {}", printable(words[0]));
    const auto counts = parse_tag_counts(words[1]);
    if (!counts) {
        return unexpected(where, words[1], "the counts ints/floats/strings",
                          kInvalidIndex, line);
    }
    const Words values = words.subspan(2);
    const std::size_t n = (*counts)[0] + (*counts)[1] + (*counts)[2];
    if (n != values.size()) {
        return fail(
            ErrorCode::FileFormat,
            fmt::format("{} announces {} values, but has {}", where, n, values.size()),
            kInvalidIndex, line);
    }
    Tag tag{.name = std::string(words[0]),
            .ints = {},
            .floats = {},
            .text = {},
            .line = line};
    if (Status status = read_tag_values(values, where, *counts, tag); !status)
        return status;
    mesh.tags.push_back(std::move(tag));
    return ok();
}

Result<MeshData> read_obj(std::string_view text) {
    MeshData mesh;
    LineScanner lines(text, {.comments = true, .continuations = true});
    while (lines.next()) {
        const std::string_view keyword = lines.words().front();
        const Words words = lines.words().subspan(1);
        Status status = ok();
        if (keyword == "v")
            status = read_vertex(words, lines.line(), mesh);
        else if (keyword == "vt")
            status = read_obj_uv(words, lines.line(), mesh);
        else if (keyword == "f")
            status = read_obj_face(words, lines.line(), mesh);
        else if (keyword == "t")
            status = read_tag(words, lines.line(), mesh);
        if (!status)
            return status.error();
    }
    if (const Status status = check_uvs(mesh); !status)
        return status.error();
    return finish(std::move(mesh));
}

// ---- OFF ----

struct OffCounts {
    std::int64_t n_vertices, n_faces;
};

/// Reads "OFF" and the counts after it, on the same line or on the next.
Result<OffCounts> read_off_header(LineScanner& lines) {
    if (lines.words().front() != "OFF") {
        return unexpected("the header", lines.words().front(), "OFF", kInvalidIndex,
                          lines.line());
    }
    Words words = lines.words().subspan(1);
    if (words.empty() && lines.next())
        words = lines.words();
    if (words.size() < 2) {
        return fail(ErrorCode::FileFormat,
                    "the header lacks the numbers of vertices and faces", kInvalidIndex,
                    lines.line());
    }
    std::array<std::int64_t, 2> counts;
    for (int i = 0; i < 2; ++i) {
        const auto count = parse<std::int64_t>(words[i]);
        if (!count || *count < 0) {
            return unexpected("the header", words[i],
                              i == 0 ? "the number of vertices" : "the number of faces",
                              kInvalidIndex, lines.line());
        }
        counts[i] = *count;
    }
    return OffCounts{counts[0], counts[1]};
}

/// "4 0 1 2 3", then perhaps a colour.
Status read_off_face(Words words, Index line, MeshData& mesh) {
    const Index f = next_face(mesh);
    const auto bad = [&](std::string_view word, std::string_view expected) {
        return unexpected(fmt::format("face {}", f), word, expected, f, line);
    };
    const auto n = parse<std::int64_t>(words.front());
    if (!n || *n < 0)
        return bad(words.front(), "the number of vertices");
    words = words.subspan(1);
    if (std::cmp_greater(*n, words.size())) {
        return fail(
            ErrorCode::FileFormat,
            fmt::format("face {} announces {} vertices, but has {}", f, *n, words.size()),
            f, line);
    }
    const std::size_t first = mesh.face_vertices.size();
    for (const std::string_view word : words.first(static_cast<std::size_t>(*n))) {
        const auto index = parse<std::int64_t>(word);
        if (!index)
            return bad(word, "a vertex index");
        if (Status status = add_corner(mesh, *index, line); !status)
            return status;
    }
    return end_face(mesh, first, line);
}

Result<MeshData> read_off(std::string_view text) {
    MeshData mesh;
    LineScanner lines(text, {.comments = true});
    if (!lines.next())
        return finish(std::move(mesh));
    const auto header = read_off_header(lines);
    if (!header)
        return header.error();
    for (std::int64_t v = 0; v < header->n_vertices; ++v) {
        if (!lines.next())
            return ends_early("vertex", v, header->n_vertices, lines.line());
        if (const Status status = read_vertex(lines.words(), lines.line(), mesh); !status)
            return status.error();
    }
    for (std::int64_t f = 0; f < header->n_faces; ++f) {
        if (!lines.next())
            return ends_early("face", f, header->n_faces, lines.line());
        if (const Status status = read_off_face(lines.words(), lines.line(), mesh);
            !status)
            return status.error();
    }
    if (lines.next()) {
        return fail(ErrorCode::FileFormat, "the file goes on after its last face",
                    kInvalidIndex, lines.line());
    }
    return finish(std::move(mesh));
}

// ---- PLY: header ----

enum class Scalar : std::uint8_t {
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Float32,
    Float64
};

bool is_integer(Scalar type) {
    return type < Scalar::Float32;
}

std::optional<Scalar> parse_scalar(std::string_view word) {
    using enum Scalar;
    static constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames{{
        {"char", Int8},
        {"uchar", UInt8},
        {"short", Int16},
        {"ushort", UInt16},
        {"int", Int32},
        {"uint", UInt32},
        {"float", Float32},
        {"double", Float64},
        {"int8", Int8},
        {"uint8", UInt8},
        {"int16", Int16},
        {"uint16", UInt16},
        {"int32", Int32},
        {"uint32", UInt32},
        {"float32", Float32},
        {"float64", Float64},
    }};
    for (const auto& [name, type] : kNames) {
        if (name == word)
            return type;
    }
    return std::nullopt;
}

/// What a property is to a mesh; X, Y, Z are the coordinates 0, 1, 2.
enum class Role : std::uint8_t { X, Y, Z, Corners, None };

struct PlyProperty {
    std::string_view name;
    Scalar type;
    bool is_list = false;
    Scalar count_type = Scalar::UInt8;  ///< of a list
    Role role = Role::None;
};

struct PlyElement {
    std::string_view name;
    std::int64_t count;
    std::vector<PlyProperty> properties;
    Index line;
};

enum class PlyFormat : std::uint8_t { Text, LittleEndian, BigEndian };

struct PlyHeader {
    std::optional<PlyFormat> format;
    std::vector<PlyElement> elements;
};

Error header_error(std::string message, Index line) {
    return fail(ErrorCode::FileFormat, std::move(message), kInvalidIndex, line);
}

Status read_ply_format(Words words, Index line, PlyHeader& header) {
    static constexpr std::array<std::string_view, 3> kNames{
        "ascii", "binary_little_endian", "binary_big_endian"};
    const auto name = words.size() == 3 && words[2] == "1.0"
                          ? std::ranges::find(kNames, words[1])
                          : kNames.end();
    if (name == kNames.end()) {
        return header_error(
            "the format is none of ascii, binary_little_endian and "
            "binary_big_endian in version 1.0",
            line);
    }
    header.format = static_cast<PlyFormat>(name - kNames.begin());
    return ok();
}

Status read_ply_element(Words words, Index line, PlyHeader& header) {
    const auto count = words.size() == 3 ? parse<std::int64_t>(words[2]) : std::nullopt;
    if (!count || *count < 0)
        return header_error("an element line is not 'element name count'", line);
    if (std::ranges::count(header.elements, words[1], &PlyElement::name) > 0) {
        return header_error(
            fmt::format("element {} is declared twice", printable(words[1])), line);
    }
    header.elements.push_back({words[1], *count, {}, line});
    return ok();
}

/// "property type name" or "property list count_type type name".
Status read_ply_property(Words words, Index line, PlyHeader& header) {
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (header.elements.empty() || (!is_list && words.size() != 3)) {
        return header_error(
            "a property line is not 'property [list type] type name' after "
            "an element line",
            line);
    }
    const std::string_view name = words.back();
    const auto type = parse_scalar(words[words.size() - 2]);
    const auto count_type = parse_scalar(is_list ? words[2] : "uchar");
    if (!type || !count_type || !is_integer(*count_type)) {
        return header_error(
            fmt::format("property {} has a type that PLY does not have", printable(name)),
            line);
    }
    std::vector<PlyProperty>& properties = header.elements.back().properties;
    if (std::ranges::count(properties, name, &PlyProperty::name) > 0) {
        return header_error(fmt::format("property {} is declared twice", printable(name)),
                            line);
    }
    properties.push_back({name, *type, is_list, *count_type});
    return ok();
}

PlyProperty* find_property(PlyElement& element, std::string_view name) {
    const auto p = std::ranges::find(element.properties, name, &PlyProperty::name);
    return p == element.properties.end() ? nullptr : &*p;
}

/// Finds the coordinates of vertices and the corners of faces.
Status assign_roles(PlyElement& element) {
    if (element.name == "vertex") {
        for (const Role role : {Role::X, Role::Y, Role::Z}) {
            const std::string_view name =
                std::string_view("xyz").substr(static_cast<std::size_t>(role), 1);
            PlyProperty* p = find_property(element, name);
            if (!p || p->is_list) {
                return header_error(fmt::format("element vertex has no number {}", name),
                                    element.line);
            }
            p->role = role;
        }
    } else if (element.name == "face") {
        PlyProperty* p = find_property(element, "vertex_indices");
        if (!p)
            p = find_property(element, "vertex_index");
        if (!p || !p->is_list || !is_integer(p->type)) {
            return header_error("element face has no list of integers vertex_indices",
                                element.line);
        }
        p->role = Role::Corners;
    }
    return ok();
}

Status check_ply_header(PlyHeader& header, Index line) {
    if (!header.format)
        return header_error("the header has no format line", line);
    for (PlyElement& element : header.elements) {
        if (Status status = assign_roles(element); !status)
            return status;
    }
    return ok();
}

/// Reads up to the line end_header.
Result<PlyHeader> read_ply_header(LineScanner& lines) {
    if (!lines.next() || lines.words()[0] != "ply")
        return header_error("the file does not start with ply", lines.line());
    PlyHeader header;
    while (lines.next()) {
        const Words words = lines.words();
        Status status = ok();
        if (words[0] == "format") {
            status = read_ply_format(words, lines.line(), header);
        } else if (words[0] == "element") {
            status = read_ply_element(words, lines.line(), header);
        } else if (words[0] == "property") {
            status = read_ply_property(words, lines.line(), header);
        } else if (words[0] == "end_header") {
            status = check_ply_header(header, lines.line());
            if (status)
                return header;
        } else if (words[0] != "comment" && words[0] != "obj_info") {
            return unexpected("the header", words[0], "a line of a PLY header",
                              kInvalidIndex, lines.line());
        }
        if (!status)
            return status.error();
    }
    return header_error("the file ends before end_header", lines.line());
}

// ---- PLY: data ----
//
// A source yields the values of one item (a vertex, a face, ...) after the other:
//   begin()     goes to the next item; false at the end of the file
//   next<T>()   the next value of the item; none if there is none, and problem() says why
//   end()       whether the item has no more values
//   line()      of the item; 0 in binary files

/// Values in text: a line for each item.
class TextSource {
public:
    explicit TextSource(LineScanner& lines) : lines_(lines) {}

    bool begin() {
        next_ = 0;
        return lines_.next();
    }
    bool end() const { return next_ == lines_.words().size(); }
    Index line() const { return lines_.line(); }

    template <class T>
    std::optional<T> next(Scalar type) {
        if (end()) {
            problem_ = "has too few values";
            return std::nullopt;
        }
        const std::string_view word = lines_.words()[next_++];
        const auto value = is_integer(type) ? as<T>(parse<std::int64_t>(word))
                                            : as<T>(parse<double>(word));
        if (!value) {
            problem_ = fmt::format("has '{}' where {} is expected", printable(word),
                                   is_integer(type) ? "an integer" : "a number");
        }
        return value;
    }
    const std::string& problem() const { return problem_; }

private:
    template <class T, class U>
    static std::optional<T> as(std::optional<U> value) {
        return value ? std::optional<T>(static_cast<T>(*value)) : std::nullopt;
    }

    LineScanner& lines_;
    std::size_t next_ = 0;
    std::string problem_;
};

/// Values in bytes, with nothing between them.
class BinarySource {
public:
    BinarySource(std::string_view bytes, std::endian order)
        : bytes_(bytes), swap_(order != std::endian::native) {}

    bool begin() const { return !bytes_.empty(); }
    bool end() const { return true; }
    Index line() const { return 0; }

    template <class T>
    std::optional<T> next(Scalar type) {
        switch (type) {
            case Scalar::Int8:
                return take<T, std::int8_t>();
            case Scalar::UInt8:
                return take<T, std::uint8_t>();
            case Scalar::Int16:
                return take<T, std::int16_t>();
            case Scalar::UInt16:
                return take<T, std::uint16_t>();
            case Scalar::Int32:
                return take<T, std::int32_t>();
            case Scalar::UInt32:
                return take<T, std::uint32_t>();
            case Scalar::Float32:
                return take<T, float>();
            case Scalar::Float64:
                return take<T, double>();
        }
        return std::nullopt;
    }
    std::string problem() const { return "is cut off by the end of the file"; }
    std::string_view rest() const { return bytes_; }

private:
    template <class T, class Stored>
    std::optional<T> take() {
        std::array<char, sizeof(Stored)> raw;
        if (bytes_.size() < raw.size())
            return std::nullopt;
        std::copy_n(bytes_.data(), raw.size(), raw.data());
        bytes_.remove_prefix(raw.size());
        if (swap_)
            std::ranges::reverse(raw);
        return static_cast<T>(std::bit_cast<Stored>(raw));
    }

    std::string_view bytes_;
    bool swap_;
};

/// The vertex, the face or the other item that is being read.
struct PlyItem {
    std::string_view element;
    std::int64_t number;
    Index line;
    Vec3<double> position{0};
};

Error broken(const PlyItem& item, std::string_view problem) {
    return fail(ErrorCode::FileFormat,
                fmt::format("{} {} {}", printable(item.element), item.number, problem),
                static_cast<Index>(item.number), item.line);
}

template <class Source>
Status read_value(Source& source, const PlyProperty& property, PlyItem& item,
                  MeshData& mesh) {
    if (property.role == Role::Corners) {
        const auto index = source.template next<std::int64_t>(property.type);
        return index ? add_corner(mesh, *index, item.line)
                     : broken(item, source.problem());
    }
    const auto value = source.template next<double>(property.type);
    if (!value)
        return broken(item, source.problem());
    if (property.role != Role::None)
        item.position[static_cast<int>(property.role)] = *value;
    return ok();
}

template <class Source>
Status read_property(Source& source, const PlyProperty& property, PlyItem& item,
                     MeshData& mesh) {
    if (!property.is_list)
        return read_value(source, property, item, mesh);
    const auto n = source.template next<std::int64_t>(property.count_type);
    if (!n)
        return broken(item, source.problem());
    if (*n < 0)
        return broken(item, fmt::format("has a list of {} values", *n));
    for (std::int64_t k = 0; k < *n; ++k) {
        if (Status status = read_value(source, property, item, mesh); !status)
            return status;
    }
    return ok();
}

template <class Source>
Status read_item(Source& source, const PlyElement& element, std::int64_t i,
                 MeshData& mesh) {
    const std::size_t first = mesh.face_vertices.size();
    PlyItem item{.element = element.name, .number = i, .line = source.line()};
    for (const PlyProperty& property : element.properties) {
        if (Status status = read_property(source, property, item, mesh); !status)
            return status;
    }
    if (!source.end())
        return broken(item, "has too many values");
    if (element.name == "vertex")
        add_vertex(mesh, item.position, item.line);
    if (element.name == "face")
        return end_face(mesh, first, item.line);
    return ok();
}

template <class Source>
Status read_items(Source& source, const PlyHeader& header, MeshData& mesh) {
    for (const PlyElement& element : header.elements) {
        if (element.properties.empty())
            continue;  // takes no room in the file, whatever its count
        for (std::int64_t i = 0; i < element.count; ++i) {
            if (!source.begin()) {
                return ends_early(printable(element.name), i, element.count,
                                  source.line());
            }
            if (Status status = read_item(source, element, i, mesh); !status)
                return status;
        }
    }
    return ok();
}

Result<MeshData> read_ply(std::string_view text) {
    LineScanner lines(text, {});
    const auto header = read_ply_header(lines);
    if (!header)
        return header.error();
    MeshData mesh;
    Status status = ok();
    bool goes_on = false;
    if (header->format == PlyFormat::Text) {
        TextSource source(lines);
        status = read_items(source, *header, mesh);
        goes_on = status && source.begin();
    } else {
        BinarySource source(lines.rest(), header->format == PlyFormat::BigEndian
                                              ? std::endian::big
                                              : std::endian::little);
        status = read_items(source, *header, mesh);
        goes_on = !std::ranges::all_of(source.rest(), is_space);
    }
    if (!status)
        return status.error();
    if (goes_on) {
        return fail(ErrorCode::FileFormat, "the file goes on after its last element",
                    kInvalidIndex, header->format == PlyFormat::Text ? lines.line() : 0);
    }
    return finish(std::move(mesh));
}

// ---- Files ----

Result<std::ifstream> open(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        return fail(ErrorCode::FileUnreadable, "the path names a directory");
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        return fail(ErrorCode::FileUnreadable,
                    fmt::format("the file cannot be opened: {}",
                                std::generic_category().message(errno)));
    }
    return file;
}

Result<std::string> read_text(std::ifstream& file) {
    file.seekg(0, std::ios::end);
    const auto size = static_cast<std::streamoff>(file.tellg());
    file.seekg(0);
    if (!file)
        return fail(ErrorCode::FileUnreadable, "the size of the file is unknown");
    std::string text(static_cast<std::size_t>(size), '\0');
    if (!file.read(text.data(), size))
        return fail(ErrorCode::FileUnreadable, "the file cannot be read to its end");
    return text;
}

using Reader = Result<MeshData> (*)(std::string_view text);

Reader find_reader(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::ranges::transform(extension, extension.begin(),
                           [](unsigned char c) { return std::tolower(c); });
    if (extension == ".obj")
        return read_obj;
    if (extension == ".off")
        return read_off;
    if (extension == ".ply")
        return read_ply;
    return nullptr;
}

}  // namespace

Result<MeshData> read_mesh(const std::filesystem::path& path) {
    auto file = open(path);
    if (!file)
        return file.error();
    const Reader read = find_reader(path);
    if (!read) {
        return fail(ErrorCode::FileFormat,
                    fmt::format("the extension '{}' is none of .obj, .off and .ply",
                                printable(path.extension().string())));
    }
    const auto content = read_text(*file);
    if (!content)
        return content.error();
    std::string_view text = *content;
    if (text.starts_with("\xEF\xBB\xBF"))  // the byte order mark of UTF-8
        text.remove_prefix(3);
    if (std::ranges::all_of(text, is_space))
        return fail(ErrorCode::EmptyMesh, "the file is empty");
    return read(text);
}

}  // namespace osdx
