// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/types.h>

/// What readers of mesh files share: lines of words, numbers, and the parts of a mesh.
///
/// The parsers are our own on purpose: libraries lose the line of the file, drop faces that
/// they dislike, and some turn nan into 0.
namespace osdx::inline OSDX_ABI::detail {

using Words = std::span<const std::string_view>;

inline bool is_space(char c) {
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
std::string printable(std::string_view word);

Error unexpected(std::string_view where, std::string_view word, std::string_view expected,
                 Index element, Index line);

inline Index next_vertex(const MeshData& mesh) {
    return static_cast<Index>(mesh.positions.size());
}
inline Index next_face(const MeshData& mesh) {
    return static_cast<Index>(mesh.face_sizes.size());
}

/// `line` is 0 in binary files; then no lines are kept.
void add_vertex(MeshData& mesh, const Vec3<double>& position, Index line);
Status read_vertex(Words words, Index line, MeshData& mesh);

/// The colour of the last vertex, or that it has none: the channel that is alone in the mesh.
/// All vertices have as many numbers.
/// \pre numbers.size() is 0, 3 or 4
Status read_color(Words numbers, Index line, MeshData& mesh);

/// Appends a corner to the face that is being read; `index` counts from 0.
Status add_corner(MeshData& mesh, std::int64_t index, Index line);

/// Closes the face whose corners start at `first` in face_vertices.
Status end_face(MeshData& mesh, std::size_t first, Index line);

Error ends_early(std::string_view item, std::int64_t i, std::int64_t n, Index line);

/// Refuses what has no vertices or no faces.
Result<MeshData> finish(MeshData mesh);

}  // namespace osdx::inline OSDX_ABI::detail
