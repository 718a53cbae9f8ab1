// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <ostream>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <osdx/channels.h>
#include <osdx/file.h>
#include <osdx/result.h>
#include <osdx/types.h>

/// What writers of files share.
namespace osdx::inline OSDX_ABI::detail {

/// Appends a number to `bytes`, lowest byte first whatever the machine.
template <class Bytes, class T>
void append_bytes(Bytes& bytes, T value) {
    auto raw = std::bit_cast<std::array<unsigned char, sizeof(T)>>(value);
    if constexpr (std::endian::native == std::endian::big)
        std::ranges::reverse(raw);
    for (const unsigned char byte : raw)
        bytes.push_back(static_cast<typename Bytes::value_type>(byte));
}

/// Gathers output, so that the stream gets large blocks.
class Output {
public:
    explicit Output(std::ostream& stream) : stream_(stream) {}
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;
    ~Output() { flush(); }

    template <class... Args>
    void text(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(buffer_), format, std::forward<Args>(args)...);
        flush_if_full();
    }

    template <class T>
    void bytes(T value) {
        append_bytes(buffer_, value);
        flush_if_full();
    }
    void bytes(const Vec3<float>& v) {
        for (int i = 0; i < 3; ++i)
            bytes(v[i]);
    }

private:
    void flush_if_full() {
        constexpr std::size_t kBlock = 1 << 16;  // thousands of numbers for one call
        if (buffer_.size() >= kBlock)
            flush();
    }
    void flush() {
        stream_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
        buffer_.clear();
    }

    std::ostream& stream_;
    std::string buffer_;
};

/// The numbers of an element after its position, as OBJ and OFF have them. They bear a point or
/// an exponent: OFF's integers may be of 255.
inline void write_color(Output& out, const NamedChannels& color, std::size_t i) {
    for (int k = 0; k < color.n; ++k)
        out.text(" {:#}", color.view()[i][k]);
}

inline std::string lower_case(std::string_view text) {
    std::string lower(text);
    std::ranges::transform(lower, lower.begin(),
                           [](unsigned char c) { return std::tolower(c); });
    return lower;
}

/// What is done for an extension; `check` says whether `write` can.
template <class T>
struct WriteFormat {
    std::string_view extension;
    Status (*check)(const T&);
    void (*write)(std::ostream&, const T&);
};

/// The format for an extension, once its check has taken the object.
template <class T>
Result<WriteFormat<T>> find_format(std::string_view extension, const T& object,
                                   std::span<const WriteFormat<T>> formats) {
    const std::string lower = lower_case(extension);
    std::string known;
    for (const WriteFormat<T>& format : formats) {
        if (format.extension == lower) {
            if (const Status status = format.check(object); !status)
                return status.error();
            return format;
        }
        known += fmt::format(" {}", format.extension);
    }
    return fail(ErrorCode::InvalidOption,
                fmt::format("the extension '{}' is none of{}", lower, known));
}

template <class T>
Status write_as(const std::filesystem::path& path, const T& object,
                std::span<const WriteFormat<T>> formats) {
    const auto format = find_format(path.extension().string(), object, formats);
    if (!format)
        return format.error();
    return write_file(path, [&](std::ostream& stream) { format->write(stream, object); });
}

template <class T>
Result<std::string> format_as(std::string_view extension, const T& object,
                              std::span<const WriteFormat<T>> formats) {
    const auto format = find_format(extension, object, formats);
    if (!format)
        return format.error();
    std::ostringstream stream;
    format->write(stream, object);
    if (!stream)
        return fail(ErrorCode::WriteFailed, "the format did not take all of the data");
    return std::move(stream).str();
}

}  // namespace osdx::inline OSDX_ABI::detail
