// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx::render {

/// A colour in sRGB, as screens and PNG files have it.
using Color = Vec3<std::uint8_t>;

/// A picture, row by row from the top. Shape: pixels width * height.
struct Image {
    int width = 0, height = 0;
    std::vector<Color> pixels;

    const Color& at(int x, int y) const noexcept {
        return pixels[static_cast<std::size_t>(y) * width + x];
    }
    Color& at(int x, int y) noexcept {
        return pixels[static_cast<std::size_t>(y) * width + x];
    }
    bool operator==(const Image&) const = default;
};

/// Writes 8 bits per channel.
/// \return SizeMismatch for another shape or no pixels, WriteFailed. Nothing half-written is
///         left.
Status write_png(const std::filesystem::path& path, const Image& image);

/// A picture of one number a pixel, 0 to 1, row by row from the top. Shape: values width * height,
/// not empty.
struct HeightMap {
    int width = 0, height = 0;
    std::vector<float> values;

    /// Bilinear between the centres of pixels; repeats beyond 0 .. 1.
    /// \param uv  from the lower left corner
    double at(Vec2<double> uv) const noexcept;
};

/// Reads the grey of a PNG file, of 8 or 16 bits, without any curve of its colour space: heights
/// are no light. What is transparent is black.
/// \return FileUnreadable
Result<HeightMap> read_heights(const std::filesystem::path& path);

/// A rectangle in pixels from the upper left corner of the image.
struct Box {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Paints a rectangle; pixels that it covers in part get a part of the colour. What lies
/// outside of the image is cut off.
void fill_box(Image& image, const Box& box, const Color& color, double opacity = 1);

/// Paints one line of text with (x, y) its upper left corner; a line is kLineHeight high.
/// Characters are about 6 wide and 7 high at scale 1; those beyond ASCII become '?'.
void draw_text(Image& image, double x, double y, std::string_view text, double scale,
               const Color& color);
double text_width(std::string_view text, double scale);
inline constexpr double kLineHeight = 12;  ///< at scale 1

}  // namespace osdx::render
