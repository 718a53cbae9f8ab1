// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/image.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <string>

#include <fmt/format.h>
#include <png.h>
#include <stb_easy_font.h>

#include <osdx/file.h>
#include <osdx/files/tessellation_file.h>

namespace osdx::render {
namespace {

static_assert(sizeof(Color) == 3, "libpng reads the pixels in place");

/// How much of the pixel [i, i + 1] lies in [lo, hi].
double overlap(int i, double lo, double hi) noexcept {
    return std::max(0.0, std::min(hi, i + 1.0) - std::max(lo, double(i)));
}

/// Pixels first .. last - 1.
struct PixelRange {
    int first, last;
};

/// Those of `size` that [lo, hi] covers, in part at least; last >= first.
PixelRange covered(double lo, double hi, int size) noexcept {
    const auto inside = [&](double x) {
        return static_cast<int>(std::clamp(x, 0.0, double(size)));
    };
    const int first = inside(std::floor(lo));
    return {first, std::max(first, inside(std::ceil(hi)))};
}

/// Calls f(x, y, area) for the pixels that a box covers, area in (0, 1].
template <class F>
void for_each_covered(const Image& image, const Box& box, F&& f) {
    const PixelRange columns = covered(box.x0, box.x1, image.width),
                     rows = covered(box.y0, box.y1, image.height);
    for (int y = rows.first; y < rows.last; ++y) {
        for (int x = columns.first; x < columns.last; ++x) {
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

double HeightMap::at(Vec2<double> uv) const noexcept {
    struct Place {
        int before, after;
        double part;
    };
    const auto place = [](double x, int n) -> Place {
        const double pixel = (x - std::floor(x)) * n - 0.5, low = std::floor(pixel);
        // A texture coordinate that is not finite, or too large for a place, is at 0.
        if (!(std::abs(x) < 1e15))
            return {0, 0, 0};
        const int i = static_cast<int>(low);  // -1 .. n - 1
        return {(i + n) % n, (i + 1) % n, pixel - low};
    };
    const Place x = place(uv.x, width), y = place(1 - uv.y, height);
    const auto value = [&](int i, int j) {
        return double(values[static_cast<std::size_t>(j) * width + i]);
    };
    return std::lerp(
        std::lerp(value(x.before, y.before), value(x.after, y.before), x.part),
        std::lerp(value(x.before, y.after), value(x.after, y.after), x.part), y.part);
}

Result<HeightMap> read_heights(const std::filesystem::path& path) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    const auto unreadable = [&] {
        return fail(ErrorCode::FileUnreadable,
                    fmt::format("{}: {}", path.string(), png.message));
    };
    const Result<std::string> bytes = read_file(path);
    if (!bytes) {
        return fail(bytes.error().code,
                    fmt::format("{}: {}", path.string(), bytes.error().message));
    }
    if (!png_image_begin_read_from_memory(&png, bytes->data(), bytes->size()))
        return unreadable();
    // In the bits that the file has: another width would be bent by a curve.
    const bool wide = (png.format & PNG_FORMAT_FLAG_LINEAR) != 0;
    png.format = wide ? PNG_FORMAT_LINEAR_Y : PNG_FORMAT_GRAY;
    HeightMap map{static_cast<int>(png.width), static_cast<int>(png.height), {}};
    const std::size_t n = std::size_t{png.width} * png.height;
    map.values.reserve(n);
    if (wide) {
        std::vector<std::uint16_t> pixels(n);
        if (!png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr))
            return unreadable();
        for (const std::uint16_t x : pixels)
            map.values.push_back(static_cast<float>(x) / 65535);
    } else {
        std::vector<std::uint8_t> pixels(n);
        if (!png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr))
            return unreadable();
        for (const std::uint8_t x : pixels)
            map.values.push_back(static_cast<float>(x) / 255);
    }
    return map;
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
    Box bounds{x, y, x, y};
    std::vector<Box> strokes;
    for (int i = 0; i < n_quads; ++i) {
        const Vertex &a = vertices[4 * i], &c = vertices[4 * i + 2];
        strokes.push_back(
            {x + scale * a.x, y + scale * a.y, x + scale * c.x, y + scale * c.y});
        bounds.x1 = std::max(bounds.x1, strokes.back().x1);
        bounds.y1 = std::max(bounds.y1, strokes.back().y1);
    }
    const PixelRange columns = covered(bounds.x0, bounds.x1, image.width),
                     rows = covered(bounds.y0, bounds.y1, image.height);
    const std::size_t stride = columns.last - columns.first;
    std::vector<double> cover(stride * (rows.last - rows.first));
    const auto area_at = [&](int px, int py) -> double& {
        return cover[(py - rows.first) * stride + (px - columns.first)];
    };
    for (const Box& stroke : strokes) {
        for_each_covered(image, stroke,
                         [&](int px, int py, double area) { area_at(px, py) += area; });
    }
    for_each_covered(image, bounds, [&](int px, int py, double) {
        blend(image.at(px, py), color, std::min(area_at(px, py), 1.0));
    });
}

double text_width(std::string_view text, double scale) {
    std::string line = printable(text);
    return scale * stb_easy_font_width(line.data());
}

}  // namespace osdx::render
