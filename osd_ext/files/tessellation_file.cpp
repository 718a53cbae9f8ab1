// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <tiny_gltf.h>

#include <osdx/files/tessellation_file.h>
#include <osdx/mesh_data.h>

#include "far/mesh/formats/obj_names.h"
#include "far/mesh/formats/output.h"
#include "far/mesh/formats/ply_channels.h"

namespace osdx::inline OSDX_ABI {
namespace {

using detail::append_bytes;
using detail::Output;
using Triangles = std::vector<std::array<Index, 3>>;

constexpr std::uint64_t kMax32 = std::numeric_limits<std::uint32_t>::max();

/// What a file is to hold.
struct Content {
    const Tessellation& t;
    const MeshData* base;  ///< with the names of faces, or null
};

// ---- Vertices of formats with one index ----

bool has_texcoords(const Tessellation& t) {
    return !t.facet_texcoords.empty();
}

/// Facet corners that agree in their point, normal and, where `with_texcoords`, texture
/// coordinate, as one vertex; in the order of the points, and without those of no facet.
struct MergedCorners {
    std::vector<std::size_t> corners;  ///< of each vertex: one of its corners
    std::vector<Index> vertices;       ///< of each corner
};

/// \pre check_shapes(t)
MergedCorners merge_corners(const Tessellation& t, bool with_texcoords) {
    const auto differ = [&](std::size_t a, std::size_t b) {
        return t.facet_normals[a] != t.facet_normals[b] ||
               (with_texcoords && t.facet_texcoords[a] != t.facet_texcoords[b]);
    };
    // A list for each point: `next` of a vertex is another vertex of its point.
    std::vector<Index> first(t.positions.size(), kInvalidIndex), next;
    MergedCorners found;
    found.vertices.resize(t.facet_points.size());
    for (std::size_t c = 0; c < t.facet_points.size(); ++c) {
        Index* v = &first[t.facet_points[c]];
        while (*v != kInvalidIndex && differ(found.corners[*v], c))
            v = &next[*v];
        if (*v == kInvalidIndex) {
            *v = static_cast<Index>(next.size());
            found.vertices[c] = *v;
            found.corners.push_back(c);
            next.push_back(kInvalidIndex);
        } else {
            found.vertices[c] = *v;
        }
    }
    std::vector<Index> number(next.size());
    MergedCorners result;
    for (const Index head : first) {
        for (Index v = head; v != kInvalidIndex; v = next[v]) {
            number[v] = static_cast<Index>(result.corners.size());
            result.corners.push_back(found.corners[v]);
        }
    }
    for (const Index v : found.vertices)
        result.vertices.push_back(number[v]);
    return result;
}

// ---- Checks ----

std::uint64_t sum(std::span<const Index> sizes) {
    std::uint64_t n = 0;
    for (const Index size : sizes)
        n += size;
    return n;
}

/// Of facet corners, into an array of n elements.
Status check_indices(std::span<const Index> indices, std::string_view name,
                     std::size_t n) {
    const auto worst = std::ranges::max_element(indices);
    if (worst != indices.end() && *worst >= n) {
        return fail(ErrorCode::IndexOutOfRange,
                    fmt::format("corner {} of the facets names {} {}, but there are {}",
                                worst - indices.begin(), name, *worst, n));
    }
    return ok();
}

Status check_shapes(const Tessellation& t) {
    if (t.facet_sizes.empty())
        return fail(ErrorCode::EmptyMesh, "the tessellation has no facets");
    for (Index i = 0; i < t.facet_sizes.size(); ++i) {
        if (t.facet_sizes[i] != 3 && t.facet_sizes[i] != 4) {
            return fail(ErrorCode::SizeMismatch,
                        fmt::format("facet {} has {} corners instead of 3 or 4", i,
                                    t.facet_sizes[i]),
                        i);
        }
    }
    if (t.facet_faces.size() != t.facet_sizes.size() ||
        t.facet_points.size() != sum(t.facet_sizes) ||
        t.facet_normals.size() != t.facet_points.size() ||
        t.facet_uvs.size() != t.facet_points.size() ||
        (has_texcoords(t) && t.facet_texcoords.size() != t.facet_points.size())) {
        return fail(ErrorCode::SizeMismatch,
                    "the arrays of the tessellation do not match in length");
    }
    if (Status status = detail::check_channel_sizes(
            t.channels, static_cast<Index>(t.positions.size()));
        !status)
        return status;
    if (Status status = check_indices(t.facet_points, "point", t.positions.size());
        !status)
        return status;
    if (Status status = check_indices(t.facet_normals, "normal", t.normals.size());
        !status)
        return status;
    return check_indices(t.facet_texcoords, "texture coordinate", t.texcoords.size());
}

/// The shapes, and that each facet lies in a face whose names are known.
Status check_content(const Content& content) {
    if (Status status = check_shapes(content.t); !status || !content.base)
        return status;
    const auto& faces = content.t.facet_faces;
    const auto worst = std::ranges::max_element(faces);
    if (*worst >= content.base->face_sizes.size()) {
        return fail(
            ErrorCode::IndexOutOfRange,
            fmt::format("facet {} lies in face {}, but there are {}",
                        worst - faces.begin(), *worst, content.base->face_sizes.size()),
            static_cast<Index>(worst - faces.begin()));
    }
    return check_face_names(*content.base);
}

Status check_obj(const Content& content) {
    if (Status status = check_content(content); !status)
        return status;
    if (content.base && detail::bad_name(*content.base)) {
        return fail(ErrorCode::WriteFailed,
                    "a name of faces is not of words with one space between");
    }
    return ok();
}

Status check_ply(const Content& content) {
    if (Status status = check_content(content); !status)
        return status;
    return detail::check_ply_names(content.t.channels, false);
}

/// Whether the positions fit into floats; not if one is nan or infinite.
Status check_floats(const Tessellation& t) {
    constexpr double kMax = std::numeric_limits<float>::max();
    for (Index i = 0; i < t.positions.size(); ++i) {
        const Vec3<double>& p = t.positions[i];
        for (int k = 0; k < 3; ++k) {
            if (!(std::abs(p[k]) <= kMax)) {
                return fail(ErrorCode::WriteFailed,
                            fmt::format("point {} is beyond the floats of the format", i),
                            i);
            }
        }
    }
    return ok();
}

std::uint64_t n_triangles(const Tessellation& t) {
    return t.facet_points.size() - 2 * std::uint64_t{t.facet_sizes.size()};
}

Status check_stl(const Content& content) {
    if (Status status = check_content(content); !status)
        return status;
    const Tessellation& t = content.t;
    if (n_triangles(t) > kMax32) {
        return fail(ErrorCode::WriteFailed,
                    fmt::format("{} triangles are too many for STL", n_triangles(t)));
    }
    return check_floats(t);
}

/// Source: IEC 61966-2-1 (sRGB), from the colours of screens and files.
double linear_light(double c) {
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

/// A channel, or all numbers of one, as an attribute of the vertices in a GLB file.
struct GlbAttribute {
    std::string name;
    const NamedChannels* channels;
    int first, n;  ///< of its numbers; n <= 4

    /// Of the vertex of a corner's point.
    float value(const Tessellation& t, std::size_t corner, int k) const noexcept {
        const double x = channels->view()[t.facet_points[corner]][first + k];
        if (!is_color())
            return static_cast<float>(x);
        const double c = std::clamp(x, 0.0, 1.0);
        return static_cast<float>(k < 3 ? linear_light(c) : c);
    }
    bool is_color() const noexcept { return channels->name == kColorName; }
};

std::vector<GlbAttribute> glb_attributes(const Tessellation& t) {
    std::vector<GlbAttribute> attributes;
    for (const NamedChannels& c : t.channels) {
        std::string name = "_";
        for (const char letter : c.name) {
            name += letter >= 'a' && letter <= 'z' ? static_cast<char>(letter - 'a' + 'A')
                                                   : letter;
        }
        if (c.name == kColorName) {
            attributes.push_back({"COLOR_0", &c, 0, c.n});
        } else if (c.n <= 4) {
            attributes.push_back({name, &c, 0, c.n});
        } else {
            for (int k = 0; k < c.n; ++k)
                attributes.push_back({fmt::format("{}_{}", name, k), &c, k, 1});
        }
    }
    return attributes;
}

/// Whether all channels can be told apart and have values that glTF takes.
Status check_attributes(const Tessellation& t) {
    const std::vector<GlbAttribute> all = glb_attributes(t);
    for (std::size_t i = 0; i < all.size(); ++i) {
        const auto same = [&](const GlbAttribute& a) { return a.name == all[i].name; };
        const std::string& name = all[i].channels->name;
        if (name.empty() || !std::ranges::all_of(name, [](char x) {
                return x > ' ' && x <= '~' && x != '"' && x != '\\';
            })) {
            return fail(ErrorCode::WriteFailed,
                        fmt::format("the channel '{}' has a name that is no attribute of "
                                    "GLB",
                                    name));
        }
        if (std::ranges::count_if(all, same) > 1) {
            return fail(ErrorCode::WriteFailed,
                        fmt::format("two channels would be the attribute {} of GLB",
                                    all[i].name));
        }
    }
    constexpr double kMax = std::numeric_limits<float>::max();
    for (const NamedChannels& c : t.channels) {
        for (Index i = 0; i < t.positions.size(); ++i) {
            for (int k = 0; k < c.n; ++k) {
                if (!(std::abs(c.view()[i][k]) <= kMax)) {
                    return fail(
                        ErrorCode::WriteFailed,
                        fmt::format("point {} has a value in the channel {} beyond "
                                    "the floats of the format",
                                    i, c.name),
                        i);
                }
            }
        }
    }
    return ok();
}

Status check_glb(const Content& content) {
    if (Status status = check_content(content); !status)
        return status;
    const Tessellation& t = content.t;
    // The lengths in the file are 32 bits wide. The headers take about 1 kB, and less than
    // half of that for an attribute but for its name, which is there once.
    std::uint64_t n_header = 4096, n_numbers = has_texcoords(t) ? 8 : 6;
    for (const GlbAttribute& a : glb_attributes(t)) {
        n_header += 512 + a.name.size();
        n_numbers += static_cast<std::uint64_t>(a.n);
    }
    // A material, with its primitive, view and accessor; letters may need six.
    if (content.base) {
        for (const std::string& name : content.base->materials.names)
            n_header += 1024 + 6 * name.size() + 24 * glb_attributes(t).size();
    }
    const std::uint64_t kMax = kMax32 - std::min(kMax32, n_header);
    const std::uint64_t n_vertices = merge_corners(t, has_texcoords(t)).corners.size();
    const std::uint64_t n_bytes = 4 * n_numbers * n_vertices + 12 * n_triangles(t);
    if (n_bytes > kMax) {
        return fail(ErrorCode::WriteFailed,
                    fmt::format("{} bytes of data are too many for GLB", n_bytes));
    }
    if (Status status = check_attributes(t); !status)
        return status;
    return check_floats(t);
}

// ---- Tessellations ----

/// Calls f(facet, first corner, end of corners).
template <class F>
void for_each_facet(const Tessellation& t, F&& f) {
    std::size_t first = 0;
    for (Index i = 0; i < t.facet_sizes.size(); ++i) {
        const std::size_t end = first + t.facet_sizes[i];
        f(i, first, end);
        first = end;
    }
}

void write_obj(std::ostream& stream, const Content& content) {
    const Tessellation& t = content.t;
    Output out(stream);
    std::optional<detail::WrittenNames> names;
    if (content.base)
        names.emplace(out, *content.base);
    const NamedChannels* const color = find_channels(t.channels, kColorName);
    for (std::size_t i = 0; i < t.positions.size(); ++i) {
        const Vec3<double>& p = t.positions[i];
        out.text("v {} {} {}", p.x, p.y, p.z);
        if (color)
            detail::write_color(out, *color, i);
        out.text("\n");
    }
    for (const Vec3<double>& n : t.normals)
        out.text("vn {} {} {}\n", n.x, n.y, n.z);
    for (const Vec2<double>& uv : has_texcoords(t) ? t.texcoords : t.facet_uvs)
        out.text("vt {} {}\n", uv.x, uv.y);
    for_each_facet(t, [&](Index i, std::size_t first, std::size_t end) {
        if (names)
            names->start_face(t.facet_faces[i]);
        out.text("f");
        for (std::size_t c = first; c < end; ++c) {
            out.text(" {}/{}/{}", std::uint64_t{t.facet_points[c]} + 1,
                     has_texcoords(t) ? std::size_t{t.facet_texcoords[c]} + 1 : c + 1,
                     std::uint64_t{t.facet_normals[c]} + 1);
        }
        out.text("\n");
    });
}

/// Colours in single precision: no more of them is ever seen.
std::vector<detail::PlyColumn> ply_columns(const Tessellation& t) {
    std::vector<detail::PlyColumn> columns = detail::ply_columns(t.channels);
    for (detail::PlyColumn& column : columns) {
        if (column.channels->name == kColorName)
            column.type = std::min(column.type, detail::PlyNumber::Float);
    }
    return columns;
}

void write_number(Output& out, const detail::PlyColumn& column, std::size_t i) {
    switch (column.type) {
        case detail::PlyNumber::Byte:
            return out.bytes(column.byte(i));
        case detail::PlyNumber::Float:
            return out.bytes(static_cast<float>(column.value(i)));
        case detail::PlyNumber::Double:
            return out.bytes(column.value(i));
    }
}

void write_ply(std::ostream& stream, const Content& content) {
    const Tessellation& t = content.t;
    const MergedCorners merged = merge_corners(t, false);
    const std::vector<detail::PlyColumn> columns = ply_columns(t);
    Output out(stream);
    out.text(
        "ply\n"
        "format binary_little_endian 1.0\n"
        "comment texcoord: {}\n"
        "element vertex {}\n"
        "property double x\nproperty double y\nproperty double z\n"
        "property float nx\nproperty float ny\nproperty float nz\n",
        has_texcoords(t) ? "texture coordinates of each corner"
                         : "u v of each corner in the face base_face of the base mesh",
        merged.corners.size());
    for (const detail::PlyColumn& c : columns)
        out.text("property {} {}\n", detail::ply_type_name(c.type), c.name);
    out.text(
        "element face {}\n"
        "property list uchar uint vertex_indices\n"
        "property uint base_face\n"
        "property list uchar float texcoord\n"
        "end_header\n",
        t.facet_sizes.size());
    for (const std::size_t c : merged.corners) {
        for (int k = 0; k < 3; ++k)
            out.bytes(t.positions[t.facet_points[c]][k]);
        out.bytes(Vec3<float>(t.normals[t.facet_normals[c]]));
        for (const detail::PlyColumn& column : columns)
            write_number(out, column, t.facet_points[c]);
    }
    for_each_facet(t, [&](Index i, std::size_t first, std::size_t end) {
        const std::size_t n = end - first;
        out.bytes(static_cast<std::uint8_t>(n));
        for (std::size_t c = first; c < end; ++c)
            out.bytes(merged.vertices[c]);
        out.bytes(t.facet_faces[i]);
        out.bytes(static_cast<std::uint8_t>(2 * n));
        for (std::size_t c = first; c < end; ++c) {
            const Vec2<double>& uv =
                has_texcoords(t) ? t.texcoords[t.facet_texcoords[c]] : t.facet_uvs[c];
            out.bytes(static_cast<float>(uv.x));
            out.bytes(static_cast<float>(uv.y));
        }
    });
}

/// Twice the area times the unit normal.
Vec3<double> area_vector(const Tessellation& t, const std::array<Index, 3>& triangle) {
    const Vec3<double> a = t.positions[triangle[0]];
    return glm::cross(t.positions[triangle[1]] - a, t.positions[triangle[2]] - a);
}

/// The vector at unit length, or `fallback` if it is zero.
Vec3<double> unit_or(const Vec3<double>& v, const Vec3<double>& fallback) {
    const double length = glm::length(v);
    return length > 0 ? v / length : fallback;
}

void write_stl(std::ostream& stream, const Content& content) {
    const Tessellation& t = content.t;
    const Triangles tris = triangles(t);
    Output out(stream);
    // Readers take a file that starts with "solid" for text.
    out.text("{:<80}", "binary STL");
    out.bytes(static_cast<std::uint32_t>(tris.size()));
    for (const std::array<Index, 3>& triangle : tris) {
        out.bytes(Vec3<float>(unit_or(area_vector(t, triangle), Vec3<double>(0))));
        for (const Index p : triangle)
            out.bytes(Vec3<float>(t.positions[p]));
        out.bytes(std::uint16_t{0});  // attribute byte count
    }
}

// ---- GLB ----

/// glTF wants normals of unit length: a vertex where the surface has none gets that of its
/// triangles.
std::vector<Vec3<double>> unit_normals(const Tessellation& t, const Triangles& corners,
                                       const MergedCorners& merged) {
    const Triangles tris = triangles(t);
    std::vector<Vec3<double>> sums(merged.corners.size(), Vec3<double>(0));
    for (std::size_t i = 0; i < tris.size(); ++i) {
        for (const Index c : corners[i])
            sums[merged.vertices[c]] += area_vector(t, tris[i]);
    }
    for (std::size_t v = 0; v < sums.size(); ++v) {
        sums[v] = unit_or(t.normals[t.facet_normals[merged.corners[v]]],
                          unit_or(sums[v], Vec3<double>(0, 0, 1)));
    }
    return sums;
}

/// Ends the view that starts where the last one ended, and describes what it holds.
tinygltf::Accessor& end_view(tinygltf::Model& model, int target, int component, int type,
                             std::size_t count) {
    tinygltf::BufferView view;
    view.buffer = 0;
    if (!model.bufferViews.empty()) {
        const tinygltf::BufferView& last = model.bufferViews.back();
        view.byteOffset = last.byteOffset + last.byteLength;
    }
    view.byteLength = model.buffers[0].data.size() - view.byteOffset;
    view.target = target;
    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model.bufferViews.size());
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = count;
    model.bufferViews.push_back(view);
    return model.accessors.emplace_back(accessor);
}

/// Appends vectors as floats; the accessor gets their bounds.
void add_vectors(tinygltf::Model& model, std::span<const Vec3<double>> vectors) {
    Vec3<float> lower(std::numeric_limits<float>::max());
    Vec3<float> upper(std::numeric_limits<float>::lowest());
    for (const Vec3<float> v : vectors) {
        lower = glm::min(lower, v);
        upper = glm::max(upper, v);
        for (int k = 0; k < 3; ++k)
            append_bytes(model.buffers[0].data, v[k]);
    }
    tinygltf::Accessor& accessor =
        end_view(model, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT,
                 TINYGLTF_TYPE_VEC3, vectors.size());
    accessor.minValues = {lower.x, lower.y, lower.z};
    accessor.maxValues = {upper.x, upper.y, upper.z};
}

/// glTF's texture coordinates run from the upper left, those of meshes from the lower left.
void add_texcoords(tinygltf::Model& model, const Tessellation& t,
                   const MergedCorners& merged) {
    for (const std::size_t c : merged.corners) {
        const Vec2<double>& uv = t.texcoords[t.facet_texcoords[c]];
        append_bytes(model.buffers[0].data, static_cast<float>(uv.x));
        append_bytes(model.buffers[0].data, static_cast<float>(1 - uv.y));
    }
    end_view(model, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT,
             TINYGLTF_TYPE_VEC2, merged.corners.size());
}

void add_attribute(tinygltf::Model& model, const Tessellation& t,
                   const MergedCorners& merged, const GlbAttribute& attribute) {
    constexpr std::array<int, 4> kTypes = {TINYGLTF_TYPE_SCALAR, TINYGLTF_TYPE_VEC2,
                                           TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4};
    for (const std::size_t c : merged.corners) {
        for (int k = 0; k < attribute.n; ++k)
            append_bytes(model.buffers[0].data, attribute.value(t, c, k));
    }
    end_view(model, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT,
             kTypes[static_cast<std::size_t>(attribute.n - 1)], merged.corners.size());
}

/// The name in UTF-8, as JSON is; what is none becomes question marks.
std::string utf8(std::string name) {
    for (std::size_t i = 0; i < name.size();) {
        const auto byte = [&](std::size_t k) {
            return static_cast<unsigned char>(name[k]);
        };
        const unsigned char lead = byte(i);
        const std::size_t n = lead < 0x80                   ? 1
                              : lead >= 0xC2 && lead < 0xE0 ? 2
                              : (lead & 0xF0) == 0xE0       ? 3
                              : lead >= 0xF0 && lead < 0xF5 ? 4
                                                            : 0;
        // No surrogates, nothing in more bytes than it needs or beyond 10FFFF.
        bool good = n > 0 && i + n <= name.size();
        for (std::size_t k = 1; good && k < n; ++k)
            good = (byte(i + k) & 0xC0) == 0x80;
        if (good && n > 2) {
            const unsigned char next = byte(i + 1);
            good = (lead != 0xE0 || next >= 0xA0) && (lead != 0xED || next < 0xA0) &&
                   (lead != 0xF0 || next >= 0x90) && (lead != 0xF4 || next < 0x90);
        }
        if (!good)
            name[i] = '?';
        i += good ? n : 1;
    }
    return name;
}

/// The triangles of each material, by its number plus one; 0: without a name.
std::map<Index, Triangles> by_material(const Content& content, const Triangles& corners) {
    const bool named = content.base && !content.base->materials.faces.empty();
    std::map<Index, Triangles> result;
    std::size_t first = 0;
    for (Index i = 0; i < content.t.facet_sizes.size(); ++i) {
        const Index face = content.t.facet_faces[i];
        Triangles& to = result[named ? content.base->materials.faces[face] + 1 : 0];
        const std::size_t end = first + content.t.facet_sizes[i] - 2;
        for (; first < end; ++first)
            to.push_back(corners[first]);
    }
    return result;
}

tinygltf::Model make_model(const Content& content) {
    const Tessellation& t = content.t;
    const MergedCorners merged = merge_corners(t, has_texcoords(t));
    const Triangles tris = triangle_corners(t);
    tinygltf::Model model;
    model.asset.version = "2.0";
    model.asset.generator = "osdx";
    model.buffers.emplace_back();

    std::vector<Vec3<double>> positions;
    for (const std::size_t c : merged.corners)
        positions.push_back(t.positions[t.facet_points[c]]);
    add_vectors(model, positions);
    add_vectors(model, unit_normals(t, tris, merged));
    if (has_texcoords(t))
        add_texcoords(model, t, merged);
    const std::vector<GlbAttribute> attributes = glb_attributes(t);
    const std::size_t first_attribute = model.accessors.size();
    for (const GlbAttribute& attribute : attributes)
        add_attribute(model, t, merged, attribute);
    tinygltf::Primitive primitive;
    primitive.attributes = {{"POSITION", 0}, {"NORMAL", 1}};
    if (has_texcoords(t))
        primitive.attributes["TEXCOORD_0"] = 2;
    for (std::size_t i = 0; i < attributes.size(); ++i)
        primitive.attributes[attributes[i].name] = static_cast<int>(first_attribute + i);
    primitive.mode = TINYGLTF_MODE_TRIANGLES;

    tinygltf::Mesh& mesh = model.meshes.emplace_back();
    for (const auto& [number, triangles] : by_material(content, tris)) {
        for (const std::array<Index, 3>& triangle : triangles) {
            for (const Index c : triangle)
                append_bytes(model.buffers[0].data, merged.vertices[c]);
        }
        end_view(model, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                 TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR,
                 3 * triangles.size());
        primitive.indices = static_cast<int>(model.accessors.size()) - 1;
        primitive.material = static_cast<int>(model.materials.size());
        mesh.primitives.push_back(primitive);

        tinygltf::Material& material = model.materials.emplace_back();
        if (number > 0)
            material.name = utf8(content.base->materials.names[number - 1]);
        material.doubleSided = true;
        material.pbrMetallicRoughness.metallicFactor =
            0;  // 1 if left out: a black mirror
    }
    model.nodes.emplace_back().mesh = 0;
    model.scenes.emplace_back().nodes.push_back(0);
    model.defaultScene = 0;
    return model;
}

void write_glb(std::ostream& stream, const Content& content) {
    const tinygltf::Model model = make_model(content);
    if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model, stream, false, true))
        stream.setstate(std::ios::failbit);
}

// ---- Files ----

constexpr std::array<detail::WriteFormat<Content>, 4> kFormats{{
    {".obj", check_obj, write_obj},
    {".ply", check_ply, write_ply},
    {".stl", check_stl, write_stl},
    {".glb", check_glb, write_glb},
}};

}  // namespace

Status write_tessellation(const std::filesystem::path& path,
                          const Tessellation& tessellation, const MeshData* base) {
    return detail::write_as<Content>(path, {tessellation, base}, kFormats);
}

Result<std::string> format_tessellation(const Tessellation& tessellation,
                                        std::string_view extension,
                                        const MeshData* base) {
    return detail::format_as<Content>(extension, {tessellation, base}, kFormats);
}

}  // namespace osdx::inline OSDX_ABI
