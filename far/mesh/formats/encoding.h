// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <osdx/types.h>

/// UTF-16, which some editors write, as the UTF-8 that the readers take.
namespace osdx::inline OSDX_ABI::detail {

/// Appends a code point below 0x110000.
inline void append_utf8(std::string& text, std::uint32_t c) {
    const auto add = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
    if (c < 0x80) {
        add(c);
    } else if (c < 0x800) {
        add(0xC0 | c >> 6);
        add(0x80 | (c & 0x3F));
    } else {
        if (c < 0x10000) {
            add(0xE0 | c >> 12);
        } else {
            add(0xF0 | c >> 18);
            add(0x80 | (c >> 12 & 0x3F));
        }
        add(0x80 | (c >> 6 & 0x3F));
        add(0x80 | (c & 0x3F));
    }
}

/// Halves of pairs that stand alone become U+FFFD; a byte that is left at the end is dropped.
/// \param text  without its mark
inline std::string from_utf16(std::string_view text, bool big_endian) {
    const std::size_t n = text.size() / 2;
    const auto unit = [&](std::size_t i) -> std::uint32_t {
        const auto byte = [&](std::size_t k) {
            return std::uint32_t{static_cast<unsigned char>(text[2 * i + k])};
        };
        return big_endian ? byte(0) << 8 | byte(1) : byte(1) << 8 | byte(0);
    };
    std::string result;
    result.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t c = unit(i);
        if (c < 0xD800 || c > 0xDFFF) {
            append_utf8(result, c);
        } else if (c < 0xDC00 && i + 1 < n && (unit(i + 1) & 0xFC00) == 0xDC00) {
            append_utf8(result, 0x10000 + ((c & 0x3FF) << 10 | (unit(++i) & 0x3FF)));
        } else {
            append_utf8(result, 0xFFFD);
        }
    }
    return result;
}

}  // namespace osdx::inline OSDX_ABI::detail
