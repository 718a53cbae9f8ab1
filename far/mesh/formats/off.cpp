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
    bool has_colors = false, has_normals = false;
    std::int64_t n_vertices = 0, n_faces = 0;
};

/// Reads "OFF", "COFF", "NOFF" or "CNOFF" and the counts after it, on the same line or on the
/// next.
Result<OffHeader> read_off_header(LineScanner& lines) {
    OffHeader header;
    std::string_view name = lines.words().front();
    for (auto [letter, has] :
         {std::pair('C', &header.has_colors), std::pair('N', &header.has_normals)}) {
        *has = name.starts_with(letter);
        name.remove_prefix(*has);
    }
    if (name != "OFF") {
        return unexpected("the header", lines.words().front(), "OFF, COFF, NOFF or CNOFF",
                          kInvalidIndex, lines.line());
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
    header.n_vertices = counts[0];
    header.n_faces = counts[1];
    return header;
}

/// The position, perhaps a normal, which is left out, and a colour.
/// \param are_integers  set to false where its numbers are not
Status read_off_vertex(Words words, Index line, const OffHeader& header, MeshData& mesh,
                       bool& are_integers) {
    if (Status status = read_vertex(words, line, mesh); !status || !header.has_colors)
        return status;
    const std::size_t first = header.has_normals ? 6 : 3;
    const std::size_t n = std::max(words.size(), first) - first;
    if (n != 3 && n != 4) {
        const Index v = next_vertex(mesh) - 1;
        return fail(
            ErrorCode::FileFormat,
            fmt::format("the colour of vertex {} has {} numbers instead of 3 or 4", v, n),
            v, line);
    }
    for (const std::string_view word : words.last(n))
        are_integers = are_integers && parse<std::int64_t>(word);
    return read_color(words.last(n), line, mesh);
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
    return end_face(mesh, first, line);
}

}  // namespace

Result<MeshData> read_off(std::string_view text) {
    MeshData mesh;
    LineScanner lines(text, {.comments = true});
    if (!lines.next())
        return finish(std::move(mesh));
    const auto header = read_off_header(lines);
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
    return finish(std::move(mesh));
}

void write_off(std::ostream& stream, const MeshData& mesh) {
    Output out(stream);
    const NamedChannels* const color = find_channels(mesh.channels, kColorName);
    out.text("{}OFF\n{} {} 0\n", color ? "C" : "", mesh.positions.size(),
             mesh.face_sizes.size());
    write_body(out, mesh, [&](std::size_t v) {
        if (color)
            write_color(out, *color, v);
    });
}

}  // namespace osdx::inline OSDX_ABI::detail
