// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <limits>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "far/mesh/formats/body.h"
#include "far/mesh/formats/formats.h"
#include "far/mesh/formats/output.h"
#include "far/mesh/formats/ply_channels.h"
#include "far/mesh/formats/scan.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

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
enum class Role : std::uint8_t { X, Y, Z, U, V, Corners, CornerUvs, Channel, None };

struct PlyProperty {
    std::string_view name;
    Scalar type;
    bool is_list = false;
    Scalar count_type = Scalar::UInt8;  ///< of a list
    Role role = Role::None;
    std::size_t channels = 0;  ///< in PlyHeader, of Role::Channel; and which of them
    int channel = 0;
    double unit = 1;  ///< what the number 1 of the file is in MeshData, over 1
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
    std::vector<NamedChannels> channels;  ///< without values
    bool has_vertex_uvs = false;
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

/// Whether a property of vertices is one of a channel, but for colours.
bool is_value(const PlyProperty& p) {
    return !p.is_list && p.role == Role::None &&
           std::ranges::find(kPlyNormals, p.name) == kPlyNormals.end();
}

/// Starts channels with a property as their first.
void start_channels(PlyHeader& header, std::string_view name, PlyProperty& p) {
    p.role = Role::Channel;
    p.channels = header.channels.size();
    header.channels.push_back({std::string(name), 1, {}});
}

/// Adds a property to the channels that were started last.
void add_channel(PlyHeader& header, PlyProperty& p) {
    p.role = Role::Channel;
    p.channels = header.channels.size() - 1;
    p.channel = header.channels.back().n++;
}

void add_color(PlyHeader& header, PlyElement& element) {
    const auto value = [&](std::size_t k) {
        PlyProperty* p = find_property(element, kPlyColors[k]);
        return p && is_value(*p) ? p : nullptr;
    };
    if (!value(0) || !value(1) || !value(2))
        return;
    for (std::size_t k = 0; k < kPlyColors.size(); ++k) {
        PlyProperty* p = value(k);
        if (!p)
            return;
        if (k == 0)
            start_channels(header, kColorName, *p);
        else
            add_channel(header, *p);
        if (p->type == Scalar::UInt8)
            p->unit = 255;
        if (p->type == Scalar::UInt16)
            p->unit = 65535;
    }
}

/// The properties NAME_0, NAME_1, ... that stand together are channels NAME, others have a
/// name of their own.
void add_values(PlyHeader& header, std::vector<PlyProperty>& properties) {
    for (std::size_t i = 0; i < properties.size(); ++i) {
        if (!is_value(properties[i]))
            continue;
        std::string_view name = properties[i].name;
        const auto follows = [&](std::size_t k) {
            return i + 1 < properties.size() && is_value(properties[i + 1]) &&
                   properties[i + 1].name == fmt::format("{}_{}", name, k);
        };
        if (name.ends_with("_0") && name.size() > 2) {
            name.remove_suffix(2);
            if (!follows(1))
                name = properties[i].name;
        }
        start_channels(header, name, properties[i]);
        if (name == properties[i].name)
            continue;
        for (std::size_t k = 1; follows(k); ++k)
            add_channel(header, properties[++i]);
    }
}

/// The first pair of names that is there, unless the corners of faces have their own.
void add_vertex_uvs(PlyHeader& header, PlyElement& element) {
    for (PlyElement& other : header.elements) {
        const PlyProperty* p =
            other.name == "face" ? find_property(other, kPlyCornerUvs) : nullptr;
        if (p && p->is_list)
            return;
    }
    for (const auto& [u_name, v_name] : kPlyVertexUvs) {
        PlyProperty* u = find_property(element, u_name);
        PlyProperty* v = find_property(element, v_name);
        if (!u || !v || !is_value(*u) || !is_value(*v))
            continue;
        u->role = Role::U;
        v->role = Role::V;
        header.has_vertex_uvs = true;
        return;
    }
}

/// Finds the coordinates and channels of vertices and the corners of faces.
Status assign_roles(PlyElement& element, PlyHeader& header) {
    if (element.name == "vertex") {
        for (const Role role : {Role::X, Role::Y, Role::Z}) {
            const std::string_view name = kPlyPositions[static_cast<std::size_t>(role)];
            PlyProperty* p = find_property(element, name);
            if (!p || p->is_list) {
                return header_error(fmt::format("element vertex has no number {}", name),
                                    element.line);
            }
            p->role = role;
        }
        add_vertex_uvs(header, element);
        add_color(header, element);
        add_values(header, element.properties);
    } else if (element.name == "face") {
        PlyProperty* p = find_property(element, "vertex_indices");
        if (!p)
            p = find_property(element, "vertex_index");
        if (!p || !p->is_list || !is_integer(p->type)) {
            return header_error("element face has no list of integers vertex_indices",
                                element.line);
        }
        p->role = Role::Corners;
        p = find_property(element, kPlyCornerUvs);
        if (p && p->is_list)
            p->role = Role::CornerUvs;
    }
    return ok();
}

Status check_ply_header(PlyHeader& header, Index line) {
    if (!header.format)
        return header_error("the header has no format line", line);
    for (PlyElement& element : header.elements) {
        if (Status status = assign_roles(element, header); !status)
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
    Vec2<double> uv{0};
    std::vector<double> corner_uvs{};
};

/// Texture coordinates of corners, which PLY has without numbers: corners of a vertex with the
/// same ones share them, so that no seam lies between.
class PlyCornerUvs {
public:
    /// Those of the face whose corners start at `first`, two numbers each.
    void add(MeshData& mesh, std::size_t first, std::span<const double> numbers) {
        const std::size_t n = mesh.face_vertices.size() - first;
        if (numbers.empty())
            return;
        for (std::size_t k = 0; k < n; ++k) {
            const bool fits = numbers.size() == 2 * n;
            add_uv(mesh, first + k,
                   fits ? number(mesh, mesh.face_vertices[first + k],
                                 {numbers[2 * k], numbers[2 * k + 1]})
                        : kInvalidIndex);
        }
    }

private:
    struct Key {
        Index vertex;
        std::uint64_t u, v;
        bool operator==(const Key&) const = default;
    };
    struct Hash {
        std::size_t operator()(const Key& key) const noexcept {
            constexpr std::uint64_t kMix =
                0x9e3779b97f4a7c15u;  // 2^64 by the golden ratio
            std::uint64_t h = (key.vertex * kMix ^ key.u) * kMix;
            h = ((h ^ h >> 32) + key.v) * kMix;
            return static_cast<std::size_t>(h ^ h >> 32);
        }
    };

    Index number(MeshData& mesh, Index vertex, const Vec2<double>& uv) {
        const Key key{vertex, std::bit_cast<std::uint64_t>(uv.x),
                      std::bit_cast<std::uint64_t>(uv.y)};
        const auto [at, is_new] =
            numbers_.try_emplace(key, static_cast<Index>(mesh.uvs.size()));
        if (is_new)
            mesh.uvs.push_back(uv);
        return at->second;
    }

    std::unordered_map<Key, Index, Hash> numbers_;
};

/// Items with more values than the header declares.
struct ExtraValues {
    std::size_t n = 0;
    std::string first;  ///< its name
    Index line = 0;

    void add(const PlyItem& item) {
        if (n++ > 0)
            return;
        first = fmt::format("{} {}", printable(item.element), item.number);
        line = item.line;
    }
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
    if (property.role == Role::Channel) {
        NamedChannels& c = mesh.channels[property.channels];
        c.values[mesh.positions.size() * static_cast<std::size_t>(c.n) +
                 static_cast<std::size_t>(property.channel)] = *value / property.unit;
    } else if (property.role == Role::CornerUvs) {
        item.corner_uvs.push_back(*value);
    } else if (property.role == Role::U || property.role == Role::V) {
        item.uv[property.role == Role::V] = *value;
    } else if (property.role != Role::None) {
        item.position[static_cast<int>(property.role)] = *value;
    }
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

/// What is gathered from item to item, beside the mesh.
struct PlyState {
    bool has_vertex_uvs;
    PlyCornerUvs corner_uvs{};
    ExtraValues extra{};
};

template <class Source>
Status read_item(Source& source, const PlyElement& element, std::int64_t i,
                 MeshData& mesh, PlyState& state) {
    const std::size_t first = mesh.face_vertices.size();
    PlyItem item{.element = element.name, .number = i, .line = source.line()};
    if (element.name == "vertex") {
        for (NamedChannels& c : mesh.channels)
            c.values.resize(c.values.size() + static_cast<std::size_t>(c.n));
    }
    for (const PlyProperty& property : element.properties) {
        if (Status status = read_property(source, property, item, mesh); !status)
            return status;
    }
    if (!source.end())
        state.extra.add(item);
    if (element.name == "vertex") {
        add_vertex(mesh, item.position, item.line);
        if (state.has_vertex_uvs)
            mesh.uvs.push_back(item.uv);
    }
    if (element.name == "face") {
        state.corner_uvs.add(mesh, first, item.corner_uvs);
        end_face(mesh, first, item.line);
    }
    return ok();
}

template <class Source>
Status read_items(Source& source, const PlyHeader& header, MeshData& mesh) {
    PlyState state{.has_vertex_uvs = header.has_vertex_uvs};
    for (const PlyElement& element : header.elements) {
        if (element.properties.empty())
            continue;  // takes no room in the file, whatever its count
        for (std::int64_t i = 0; i < element.count; ++i) {
            if (!source.begin()) {
                return ends_early(printable(element.name), i, element.count,
                                  source.line());
            }
            if (Status status = read_item(source, element, i, mesh, state); !status)
                return status;
        }
    }
    if (state.extra.n > 0) {
        mesh.warnings.push_back(
            {WarningCode::ExtraValues,
             fmt::format("{} has more values than the header declares, which are left "
                         "out; so it is in {} rows",
                         state.extra.first, state.extra.n),
             state.extra.line});
    }
    if (header.has_vertex_uvs)
        set_vertex_uvs(mesh);
    settle_uvs(mesh);
    return ok();
}

}  // namespace

Result<MeshData> read_ply(std::string_view text) {
    LineScanner lines(text, {});
    const auto header = read_ply_header(lines);
    if (!header)
        return header.error();
    MeshData mesh;
    mesh.channels = header->channels;
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

Status check_ply(const MeshData& mesh) {
    if (Status status = check_shapes(mesh); !status)
        return status;
    if (Status status = check_uvs(mesh); !status)
        return status;
    return check_ply_names(mesh.channels, !mesh.face_uvs.empty());
}

void write_ply(std::ostream& stream, const MeshData& mesh) {
    Output out(stream);
    const std::vector<PlyColumn> columns = ply_columns(mesh.channels);
    const bool has_uvs = !mesh.face_uvs.empty();
    const Index most = std::numeric_limits<std::uint8_t>::max() / (has_uvs ? 2 : 1);
    const bool small =
        std::ranges::all_of(mesh.face_sizes, [&](Index n) { return n <= most; });
    const std::string_view count_type = small ? "uchar" : "uint";
    out.text(
        "ply\n"
        "format ascii 1.0\n"
        "element vertex {}\n"
        "property double x\nproperty double y\nproperty double z\n",
        mesh.positions.size());
    for (const PlyColumn& column : columns)
        out.text("property {} {}\n", ply_type_name(column.type), column.name);
    out.text(
        "element face {}\n"
        "property list {} uint vertex_indices\n",
        mesh.face_sizes.size(), count_type);
    if (has_uvs) {
        const bool are_floats = std::ranges::all_of(mesh.uvs, [](const Vec2<double>& uv) {
            return is_float(uv.x) && is_float(uv.y);
        });
        out.text("property list {} {} {}\n", count_type, are_floats ? "float" : "double",
                 kPlyCornerUvs);
    }
    out.text("end_header\n");
    write_body(
        out, mesh,
        [&](std::size_t v) {
            for (const PlyColumn& column : columns) {
                if (column.type == PlyNumber::Byte)
                    out.text(" {}", column.byte(v));
                else
                    out.text(" {}", column.value(v));
            }
        },
        [&](std::size_t first, std::size_t n) {
            if (!has_uvs)
                return;
            out.text(" {}", 2 * n);
            for (std::size_t c = first; c < first + n; ++c) {
                const Vec2<double>& uv = mesh.uvs[mesh.face_uvs[c]];
                out.text(" {} {}", uv.x, uv.y);
            }
        });
}

}  // namespace osdx::inline OSDX_ABI::detail
