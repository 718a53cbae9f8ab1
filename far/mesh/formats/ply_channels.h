// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <osdx/channels.h>
#include <osdx/result.h>

/// Channels as properties of PLY's vertices.
///
/// "color" is red, green, blue and alpha. Others are a property NAME each, or where n > 1 the
/// properties NAME_0, NAME_1, ..., one after the other.
namespace osdx::inline OSDX_ABI::detail {

inline constexpr std::array<std::string_view, 4> kPlyColors = {"red", "green", "blue",
                                                               "alpha"};
/// Of a vertex, and what we leave out: normals are those of the surface.
inline constexpr std::array<std::string_view, 3> kPlyPositions = {"x", "y", "z"};
inline constexpr std::array<std::string_view, 3> kPlyNormals = {"nx", "ny", "nz"};
/// Texture coordinates of vertices, by whichever names; and of the corners of a face.
inline constexpr std::array<std::array<std::string_view, 2>, 4> kPlyVertexUvs = {
    {{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}}};
inline constexpr std::string_view kPlyCornerUvs = "texcoord";

enum class PlyNumber : std::uint8_t { Byte, Float, Double };

/// A channel as a property.
struct PlyColumn {
    std::string name;
    PlyNumber type;
    const NamedChannels* channels;
    int k;  ///< which of them

    double value(std::size_t i) const noexcept { return channels->view()[i][k]; }
    /// \pre type == PlyNumber::Byte
    std::uint8_t byte(std::size_t i) const noexcept {
        return static_cast<std::uint8_t>(std::lround(255 * value(i)));
    }
};

/// Whether float holds it.
inline bool is_float(double x) noexcept {
    return !(std::abs(x) > std::numeric_limits<float>::max()) &&
           static_cast<double>(static_cast<float>(x)) == x;
}

/// The least type that reads back to the same value; of colours with so many bits bytes are
/// in 255ths.
inline PlyNumber ply_number(const NamedChannels& channels) {
    const auto is_byte = [](double x) {
        return x >= 0 && x <= 1 && !std::signbit(x) &&
               static_cast<double>(std::lround(255 * x)) / 255 == x;
    };
    if (channels.name == kColorName && std::ranges::all_of(channels.values, is_byte))
        return PlyNumber::Byte;
    return std::ranges::all_of(channels.values, is_float) ? PlyNumber::Float
                                                          : PlyNumber::Double;
}

inline std::vector<PlyColumn> ply_columns(std::span<const NamedChannels> all) {
    std::vector<PlyColumn> columns;
    for (const NamedChannels& c : all) {
        const PlyNumber type = ply_number(c);
        for (int k = 0; k < c.n; ++k) {
            const std::string name =
                c.name == kColorName
                    ? std::string(kPlyColors[static_cast<std::size_t>(k)])
                : c.n == 1 ? c.name
                           : fmt::format("{}_{}", c.name, k);
            columns.push_back({name, type, &c, k});
        }
    }
    return columns;
}

inline std::string_view ply_type_name(PlyNumber type) {
    constexpr std::array<std::string_view, 3> kNames = {"uchar", "float", "double"};
    return kNames[static_cast<std::size_t>(type)];
}

/// \param has_uvs  of the corners of faces: then those of vertices are channels
/// \return WriteFailed for names that PLY cannot tell apart, or that are not one word
/// \pre check_channels()
inline Status check_ply_names(std::span<const NamedChannels> all, bool has_uvs) {
    std::vector<std::string> names;
    for (const auto& taken : {kPlyPositions, kPlyNormals})
        names.insert(names.end(), taken.begin(), taken.end());
    for (const NamedChannels& c : all) {
        if (c.name.empty() ||
            !std::ranges::all_of(c.name, [](char x) { return x > ' ' && x != '\x7f'; })) {
            return fail(
                ErrorCode::WriteFailed,
                fmt::format("the channel '{}' has a name that is not one word of PLY",
                            c.name));
        }
    }
    for (const PlyColumn& column : ply_columns(all)) {
        if (std::ranges::find(names, column.name) != names.end()) {
            return fail(
                ErrorCode::WriteFailed,
                fmt::format("the channel {} would be the property {} of PLY, which "
                            "is there already",
                            column.channels->name, column.name));
        }
        names.push_back(column.name);
    }
    const auto is_there = [&](std::string_view name) {
        return std::ranges::find(names, name) != names.end();
    };
    for (const auto& [u, v] : kPlyVertexUvs) {
        if (!has_uvs && is_there(u) && is_there(v)) {
            return fail(ErrorCode::WriteFailed,
                        fmt::format("the channels {} and {} would be texture coordinates "
                                    "of PLY",
                                    u, v));
        }
    }
    return ok();
}

}  // namespace osdx::inline OSDX_ABI::detail
