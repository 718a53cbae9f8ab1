// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
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
    /// Lines that start so hold names, which may end in a backslash: nothing joins them.
    std::span<const std::string_view> names = {};
};

/// Splits a text into lines of words. Lines without words are passed over. A line ends with
/// LF, CR LF or CR.
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
    /// As std::find does, which looks at one byte after the other.
    static const char* find(const char* first, const char* stop, char c) {
        const void* at = std::memchr(first, c, static_cast<std::size_t>(stop - first));
        return at ? static_cast<const char*>(at) : stop;
    }

    /// The next line, which leaves the rest.
    std::string_view cut_line() {
        const char* const first = rest_.data();
        const char* const stop = first + rest_.size();
        // Texts without LF are not searched again for each of their lines.
        if (feed_ == nullptr || feed_ < first)
            feed_ = find(first, stop, '\n');
        const char* const end = find(first, feed_, '\r');
        const bool is_pair = end + 1 == feed_ && feed_ != stop;
        const auto n = static_cast<std::size_t>(end - first);
        rest_.remove_prefix(std::min(n + 1 + is_pair, rest_.size()));
        ++n_lines_;
        return {first, n};
    }

    /// Removes what joins a line to the next, a backslash and perhaps blanks after it.
    static bool remove_joint(std::string_view& line) {
        std::string_view rest = line;
        while (!rest.empty() && is_space(rest.back()))
            rest.remove_suffix(1);
        if (!rest.ends_with('\\'))
            return false;
        line = rest.substr(0, rest.size() - 1);
        return true;
    }

    bool holds_name(std::string_view line) const {
        std::string_view keyword;
        if (!words_.empty()) {
            keyword = words_.front();
        } else {
            const char* const stop = line.data() + line.size();
            const char* const first = std::find_if_not(line.data(), stop, is_space);
            const char* const last = std::find_if(first, stop, is_space);
            keyword = {first, static_cast<std::size_t>(last - first)};
        }
        return std::ranges::find(syntax_.names, keyword) != syntax_.names.end();
    }

    /// Appends the words of one line; true when the next line belongs to it.
    bool take_line() {
        std::string_view line = cut_line();
        std::string_view without_joint = line;
        const bool joined =
            syntax_.continuations && remove_joint(without_joint) && !holds_name(line);
        if (joined)
            line = without_joint;
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
    const char* feed_ = nullptr;  // the next LF, or the end of the text
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
void end_face(MeshData& mesh, std::size_t first, Index line);

/// Gives a corner texture coordinates; those before it that have none stay without.
/// \param uv  their number; whatever is not in the list is left to settle_uvs()
void add_uv(MeshData& mesh, std::size_t corner, Index uv);

/// Each vertex has the texture coordinates of its number.
void set_vertex_uvs(MeshData& mesh);

/// Corners without texture coordinates, and those whose are not there or not finite, get (0, 0),
/// a value of their own, and the mesh a warning. Where no corner has sound ones the mesh has none.
void settle_uvs(MeshData& mesh);

Error ends_early(std::string_view item, std::int64_t i, std::int64_t n, Index line);

/// Refuses what has no vertices or no faces.
Result<MeshData> finish(MeshData mesh);

}  // namespace osdx::inline OSDX_ABI::detail
