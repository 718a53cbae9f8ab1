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

}  // namespace

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

void write_off(std::ostream& stream, const MeshData& mesh) {
    Output out(stream);
    out.text("OFF\n{} {} 0\n", mesh.positions.size(), mesh.face_sizes.size());
    write_body(out, mesh);
}

}  // namespace osdx::inline OSDX_ABI::detail
