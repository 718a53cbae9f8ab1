// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/image.h"

#include <fmt/format.h>
#include <png.h>

#if __has_include(<stb/stb_easy_font.h>)
#include <stb/stb_easy_font.h>
#else
#include <stb_easy_font.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <string>

#include "osd_ext/export.h"

namespace osdx {
namespace {

static_assert(sizeof(Color) == 3, "libpng reads the pixels in place");

/// How much of the pixel [i, i + 1] lies in [lo, hi].
double overlap(int i, double lo, double hi) noexcept {
    return std::max(0.0, std::min(hi, i + 1.0) - std::max(lo, double(i)));
}

/// Calls f(x, y, area) for the pixels that a box covers, area in (0, 1].
template <class F>
void for_each_covered(const Image& image, const Box& box, F&& f) {
    const auto first = [](double lo, int size) {
        return static_cast<int>(std::clamp(std::floor(lo), 0.0, double(size)));
    };
    const auto last = [](double hi, int size) {
        return static_cast<int>(std::clamp(std::ceil(hi), 0.0, double(size)));
    };
    for (int y = first(box.y0, image.height); y < last(box.y1, image.height); ++y) {
        for (int x = first(box.x0, image.width); x < last(box.x1, image.width); ++x) {
            const double area = overlap(x, box.x0, box.x1) * overlap(y, box.y0, box.y1);
            if (area > 0)
                f(x, y, area);
        }
    }
}

void blend(Color& pixel, const Color& color, double opacity) noexcept {
    for (int c = 0; c < 3; ++c) {
        const double value = pixel[c] + opacity * (double(color[c]) - pixel[c]);
        pixel[c] = static_cast<std::uint8_t>(std::lround(value));
    }
}

/// The font has the characters ' ' to '~'. A character of several bytes (UTF-8) becomes one
/// question mark.
std::string printable(std::string_view text) {
    std::string result;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte >= ' ' && byte <= '~')
            result += c;
        else if ((byte & 0xC0) != 0x80)  // no continuation byte
            result += '?';
    }
    return result;
}

}  // namespace

Status write_png(const std::filesystem::path& path, const Image& image) {
    if (image.width < 1 || image.height < 1 ||
        image.pixels.size() != static_cast<std::size_t>(image.width) * image.height) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("a picture of {} x {} has {} pixels", image.width,
                                image.height, image.pixels.size()));
    }
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.format = PNG_FORMAT_RGB;
    png.width = static_cast<png_uint_32>(image.width);
    png.height = static_cast<png_uint_32>(image.height);
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
    std::string bytes(size, '\0');
    if (!png_image_write_to_memory(&png, bytes.data(), &size, 0, image.pixels.data(), 0,
                                   nullptr)) {
        return fail(ErrorCode::WriteFailed, fmt::format("libpng: {}", png.message));
    }
    return write_file(path, [&](std::ostream& stream) {
        stream.write(bytes.data(), static_cast<std::streamsize>(size));
    });
}

void fill_box(Image& image, const Box& box, const Color& color, double opacity) {
    for_each_covered(image, box, [&](int x, int y, double area) {
        blend(image.at(x, y), color, opacity * area);
    });
}

void draw_text(Image& image, double x, double y, std::string_view text, double scale,
               const Color& color) {
    struct Vertex {
        float x, y, z;
        unsigned char rgba[4];
    };
    static_assert(sizeof(Vertex) == 16, "the layout of stb_easy_font");

    std::string line = printable(text);
    // No character has more than 16 strokes.
    std::vector<Vertex> vertices(line.size() * 16 * 4 + 4);
    const int n_quads =
        stb_easy_font_print(0, 0, line.data(), nullptr, vertices.data(),
                            static_cast<int>(vertices.size() * sizeof(Vertex)));

    // Strokes touch and overlap: their areas add up first, and are painted once.
    std::vector<double> cover(image.pixels.size());
    Box bounds{x, y, x, y};
    for (int i = 0; i < n_quads; ++i) {
        const Vertex &a = vertices[4 * i], &c = vertices[4 * i + 2];
        const Box box{x + scale * a.x, y + scale * a.y, x + scale * c.x, y + scale * c.y};
        bounds.x1 = std::max(bounds.x1, box.x1);
        bounds.y1 = std::max(bounds.y1, box.y1);
        for_each_covered(image, box, [&](int px, int py, double area) {
            cover[static_cast<std::size_t>(py) * image.width + px] += area;
        });
    }
    for_each_covered(image, bounds, [&](int px, int py, double) {
        const double area = cover[static_cast<std::size_t>(py) * image.width + px];
        blend(image.at(px, py), color, std::min(area, 1.0));
    });
}

double text_width(std::string_view text, double scale) {
    std::string line = printable(text);
    return scale * stb_easy_font_width(line.data());
}

}  // namespace osdx
