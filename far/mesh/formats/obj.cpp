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
#include <unordered_map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "far/mesh/formats/body.h"
#include "far/mesh/formats/formats.h"
#include "far/mesh/formats/obj_names.h"
#include "far/mesh/formats/output.h"
#include "far/mesh/formats/scan.h"

namespace osdx::inline OSDX_ABI::detail {
namespace {

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
/// \return below 0 where there is none
std::int64_t obj_index(std::int64_t index, std::size_t n) {
    if (index == 0)
        return -1;
    return index > 0 ? index - 1
                     : std::max<std::int64_t>(index + static_cast<std::int64_t>(n), -1);
}

Status add_obj_vertex(MeshData& mesh, std::int64_t number, Index line) {
    const std::int64_t index = obj_index(number, mesh.positions.size());
    if (index >= 0)
        return add_corner(mesh, index, line);
    const Index f = next_face(mesh);
    return fail(
        ErrorCode::IndexOutOfRange,
        number == 0
            ? fmt::format("face {} names vertex 0, but OBJ counts vertices from 1", f)
            : fmt::format("face {} names vertex {}, but only {} vertices "
                          "precede it",
                          f, number, mesh.positions.size()),
        f, line);
}

Status add_obj_corner(MeshData& mesh, std::string_view word, Index line) {
    const Index f = next_face(mesh);
    const auto corner = parse_obj_corner(word);
    if (!corner) {
        return unexpected(fmt::format("face {}", f), word,
                          "a corner v, v/vt, v//vn or v/vt/vn", f, line);
    }
    if (Status status = add_obj_vertex(mesh, corner->vertex, line); !status)
        return status;
    if (corner->uv) {
        const std::int64_t uv = obj_index(*corner->uv, mesh.uvs.size());
        add_uv(mesh, mesh.face_vertices.size() - 1,
               std::in_range<Index>(uv) ? static_cast<Index>(uv) : kInvalidIndex);
    }
    return ok();
}

Status read_obj_face(Words words, Index line, MeshData& mesh) {
    const std::size_t first = mesh.face_vertices.size();
    for (const std::string_view word : words) {
        if (Status status = add_obj_corner(mesh, word, line); !status)
            return status;
    }
    end_face(mesh, first, line);
    return ok();
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

/// The words of a line with one space between them.
std::string joined(Words words) {
    return fmt::format("{}", fmt::join(words, " "));
}

/// Names of faces as the reader comes by them. A name is one once a face has it; a line
/// without a name ends the one before.
class ReadNames {
public:
    explicit ReadNames(FaceNames& names) : names_(names) {}

    void start(Words words) { name_ = joined(words); }

    /// Face f has the name, if there is one.
    void add_face(Index f) {
        if (name_.empty() && names_.faces.empty())
            return;
        names_.faces.resize(f, kInvalidIndex);
        names_.faces.push_back(name_.empty() ? kInvalidIndex : number());
    }

private:
    Index number() {
        const auto [at, is_new] =
            numbers_.try_emplace(name_, static_cast<Index>(names_.names.size()));
        if (is_new)
            names_.names.push_back(name_);
        return at->second;
    }

    FaceNames& names_;
    std::string name_;
    std::unordered_map<std::string, Index> numbers_;
};

/// "x y z", "x y z w", "x y z r g b" or "x y z r g b a"; w and what follows is left out.
Status read_obj_vertex(Words words, Index line, MeshData& mesh) {
    if (Status status = read_vertex(words, line, mesh); !status)
        return status;
    return read_color(
        words.size() < 6 ? Words() : words.subspan(3, words.size() == 6 ? 3 : 4), line,
        mesh);
}

void write_tag(Output& out, const Tag& tag) {
    out.text("t {} {}/{}/{}", tag.name, tag.ints.size(), tag.floats.size(),
             tag.text.size());
    for (const int value : tag.ints)
        out.text(" {}", value);
    for (const double value : tag.floats)
        out.text(" {}", value);
    for (const std::string& word : tag.text)
        out.text(" {}", word);
    out.text("\n");
}

}  // namespace

Result<MeshData> read_obj(std::string_view text) {
    MeshData mesh;
    ReadNames groups(mesh.groups), objects(mesh.objects), materials(mesh.materials);
    static constexpr std::array<std::string_view, 4> kNames = {"g", "o", "usemtl",
                                                               "mtllib"};
    LineScanner lines(text, {.comments = true, .continuations = true, .names = kNames});
    while (lines.next()) {
        const std::string_view keyword = lines.words().front();
        const Words words = lines.words().subspan(1);
        Status status = ok();
        if (keyword == "v") {
            status = read_obj_vertex(words, lines.line(), mesh);
        } else if (keyword == "vt") {
            status = read_obj_uv(words, lines.line(), mesh);
        } else if (keyword == "f") {
            const Index f = next_face(mesh);
            for (ReadNames* names : {&groups, &objects, &materials})
                names->add_face(f);
            status = read_obj_face(words, lines.line(), mesh);
        } else if (keyword == "t") {
            status = read_tag(words, lines.line(), mesh);
        } else if (keyword == "g") {
            groups.start(words);
        } else if (keyword == "o") {
            objects.start(words);
        } else if (keyword == "usemtl") {
            materials.start(words);
        } else if (keyword == "mtllib" && !words.empty()) {
            mesh.material_files.push_back(joined(words));
        }
        if (!status)
            return status.error();
    }
    settle_uvs(mesh);
    return finish(std::move(mesh));
}

Status check_obj(const MeshData& mesh) {
    if (Status status = check_shapes(mesh); !status)
        return status;
    for (std::size_t i = 0; i < mesh.tags.size(); ++i) {
        const Tag& tag = mesh.tags[i];
        const auto is_whole = [](std::string_view word) {
            return is_word(word) && !word.ends_with('\\');
        };
        if (!is_whole(tag.name) || !std::ranges::all_of(tag.text, is_whole)) {
            return fail(ErrorCode::WriteFailed,
                        fmt::format("tag {} has a text that is not one word", i));
        }
    }
    if (const std::string* bad = bad_name(mesh)) {
        return fail(ErrorCode::WriteFailed,
                    fmt::format("the name '{}' is not of words with one space between",
                                printable(*bad)));
    }
    return ok();
}

void write_obj(std::ostream& stream, const MeshData& mesh) {
    Output out(stream);
    WrittenNames names(out, mesh);
    const NamedChannels* const color = find_channels(mesh.channels, kColorName);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const Vec3<double>& p = mesh.positions[v];
        out.text("v {} {} {}", p.x, p.y, p.z);
        if (color)
            write_color(out, *color, v);
        out.text("\n");
    }
    for (const Vec2<double>& uv : mesh.uvs)
        out.text("vt {} {}\n", uv.x, uv.y);
    std::size_t corner = 0, f = 0;
    for_each_face(mesh, [&](std::span<const Index> face) {
        names.start_face(f++);
        out.text("f");
        for (const Index v : face) {
            out.text(" {}", std::uint64_t{v} + 1);
            if (!mesh.face_uvs.empty())
                out.text("/{}", std::uint64_t{mesh.face_uvs[corner++]} + 1);
        }
        out.text("\n");
    });
    for (const Tag& tag : mesh.tags)
        write_tag(out, tag);
}

}  // namespace osdx::inline OSDX_ABI::detail
