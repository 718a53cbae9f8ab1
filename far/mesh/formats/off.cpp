// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "far/mesh/formats/body.h"
#include "far/mesh/formats/formats.h"
#include "far/mesh/formats/output.h"
#include "far/mesh/formats/scan.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

struct OffHeader {
    bool has_uvs = false, has_colors = false, has_normals = false;
    std::int64_t n_vertices = 0, n_faces = 0;
};

/// "OFF" after ST, C and N, each of which may be missing.
Status read_off_keyword(std::string_view word, Index line, OffHeader& header) {
    std::string_view name = word;
    for (auto [prefix, has] : {std::pair<std::string_view, bool*>("ST", &header.has_uvs),
                               {"C", &header.has_colors},
                               {"N", &header.has_normals}}) {
        *has = name.starts_with(prefix);
        name.remove_prefix(*has ? prefix.size() : 0);
    }
    if (name == "OFF")
        return ok();
    if (name == "4OFF" || name == "nOFF" || name == "4nOFF") {
        return fail(ErrorCode::FileFormat,
                    fmt::format("{} has points of other than three coordinates, which "
                                "are not read",
                                printable(word)),
                    kInvalidIndex, line);
    }
    return unexpected("the header", word, "OFF, perhaps after ST, C and N", kInvalidIndex,
                      line);
}

/// Reads the keyword, which may be missing, and the counts after it, on the same line or on
/// the next.
Result<OffHeader> read_off_header(LineScanner& lines, MeshData& mesh) {
    OffHeader header;
    Words words = lines.words();
    if (words.size() > 1 && parse<std::int64_t>(words[0]) &&
        parse<std::int64_t>(words[1])) {
        mesh.warnings.push_back({WarningCode::MissingHeader,
                                 "the file has no line OFF; it is taken as if it had one",
                                 lines.line()});
    } else {
        if (Status status = read_off_keyword(words[0], lines.line(), header); !status)
            return status.error();
        words = words.subspan(1);
    }
    if (!words.empty() && words[0] == "BINARY") {
        return fail(ErrorCode::FileFormat,
                    "the file is binary OFF, which is not read: let the program that "
                    "made it write OFF as text, or PLY",
                    kInvalidIndex, lines.line());
    }
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
    header.n_vertices = counts[0];
    header.n_faces = counts[1];
    return header;
}

Status read_off_uv(Words words, Index line, MeshData& mesh) {
    const Index v = next_vertex(mesh) - 1;
    if (words.size() < 2) {
        return fail(ErrorCode::FileFormat,
                    fmt::format("vertex {} lacks its texture coordinates", v), v, line);
    }
    Vec2<double> uv;
    for (int k = 0; k < 2; ++k) {
        const auto x = parse<double>(words[k]);
        if (!x) {
            return unexpected(fmt::format("vertex {}", v), words[k], "a number", v, line);
        }
        uv[k] = *x;
    }
    mesh.uvs.push_back(uv);
    return ok();
}

/// The position, perhaps a normal, which is left out, a colour and texture coordinates.
/// \param are_integers  set to false where the numbers of the colour are not
Status read_off_vertex(Words words, Index line, const OffHeader& header, MeshData& mesh,
                       bool& are_integers) {
    if (Status status = read_vertex(words, line, mesh); !status)
        return status;
    const std::size_t first = header.has_normals ? 6 : 3;
    words = words.subspan(std::min(first, words.size()));
    if (header.has_colors) {
        const std::size_t n_uvs = header.has_uvs ? 2 : 0;
        const std::size_t n = std::max(words.size(), n_uvs) - n_uvs;
        if (n != 3 && n != 4) {
            const Index v = next_vertex(mesh) - 1;
            return fail(
                ErrorCode::FileFormat,
                fmt::format("the colour of vertex {} has {} numbers instead of 3 or 4", v,
                            n),
                v, line);
        }
        for (const std::string_view word : words.first(n))
            are_integers = are_integers && parse<std::int64_t>(word);
        if (Status status = read_color(words.first(n), line, mesh); !status)
            return status;
        words = words.subspan(n);
    }
    return header.has_uvs ? read_off_uv(words, line, mesh) : ok();
}

/// Colours as integers, one of them beyond 1, are of 255.
void scale_bytes(MeshData& mesh) {
    std::vector<double>& values = mesh.channels[0].values;
    if (std::ranges::any_of(values, [](double x) { return x > 1; })) {
        for (double& x : values)
            x /= 255;
    }
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
    end_face(mesh, first, line);
    return ok();
}

}  // namespace

Result<MeshData> read_off(std::string_view text) {
    MeshData mesh;
    LineScanner lines(text, {.comments = true});
    if (!lines.next())
        return finish(std::move(mesh));
    const auto header = read_off_header(lines, mesh);
    if (!header)
        return header.error();
    bool are_integers = header->has_colors;
    for (std::int64_t v = 0; v < header->n_vertices; ++v) {
        if (!lines.next())
            return ends_early("vertex", v, header->n_vertices, lines.line());
        if (const Status status =
                read_off_vertex(lines.words(), lines.line(), *header, mesh, are_integers);
            !status)
            return status.error();
    }
    if (are_integers && !mesh.channels.empty())
        scale_bytes(mesh);
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
    if (header->has_uvs)
        set_vertex_uvs(mesh);
    settle_uvs(mesh);
    return finish(std::move(mesh));
}

void write_off(std::ostream& stream, const MeshData& mesh) {
    Output out(stream);
    const NamedChannels* const color = find_channels(mesh.channels, kColorName);
    out.text("{}OFF\n{} {} 0\n", color ? "C" : "", mesh.positions.size(),
             mesh.face_sizes.size());
    write_body(
        out, mesh,
        [&](std::size_t v) {
            if (color)
                write_color(out, *color, v);
        },
        [](std::size_t, std::size_t) {});
}

}  // namespace osdx::inline OSDX_ABI::detail
