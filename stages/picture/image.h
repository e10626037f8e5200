// A picture of pixels in memory, colors, and text in a font of 5 x 8 pixels that is enlarged by whole
// numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace tagrid {

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;

  friend constexpr bool operator==(const Colour&, const Colour&) = default;
};

static_assert(sizeof(Colour) == 3);

/// `share` parts of 256 of `over`, and the rest of `under`.
constexpr Colour mixed(Colour under, Colour over, int share) {
  const auto mix = [share](int a, int b) {
    return static_cast<std::uint8_t>((a * (256 - share) + b * share + 128) / 256);
  };
  return {mix(under.red, over.red), mix(under.green, over.green), mix(under.blue, over.blue)};
}

/// The color of a level from 0 (coarse) to `deepest`: from dark violet over red to light yellow, so that
/// finer levels are lighter also where colors are not seen. REQUIRES: 0 <= level <= deepest.
constexpr Colour colour_of_level(int level, int deepest) {
  constexpr std::array<Colour, 6> stops = {
      {{44, 18, 120}, {40, 100, 190}, {20, 160, 150}, {110, 200, 80}, {240, 205, 50}, {255, 245, 190}}};
  constexpr int parts = static_cast<int>(stops.size()) - 1;
  if (deepest == 0) return stops[0];
  const int place = level * parts * 256 / deepest;
  const int stop = std::min(place / 256, parts - 1);
  const auto at = static_cast<std::size_t>(stop);
  return mixed(stops[at], stops[at + 1], place - stop * 256);
}

/// Pixels from left to right, rows from top to bottom. What is drawn outside of the image is left out.
class Image {
 public:
  Image(int width, int height, Colour background)
      : width_(width),
        height_(height),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), background) {}

  int width() const { return width_; }
  int height() const { return height_; }
  std::span<const Colour> row(int y) const {
    return std::span(pixels_).subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_),
                                      static_cast<std::size_t>(width_));
  }
  /// Red, green and blue of each pixel.
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(pixels_)); }
  Colour at(int x, int y) const { return row(y)[static_cast<std::size_t>(x)]; }

  void set(int x, int y, Colour colour) { fill(x, y, 1, 1, colour); }
  /// A rectangle whose upper left pixel is (x, y).
  void fill(int x, int y, int width, int height, Colour colour) {
    const int left = std::max(x, 0), right = std::min(x + width, width_);
    for (int v = std::max(y, 0); v < std::min(y + height, height_); ++v)
      for (int u = left; u < right; ++u)
        pixels_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(u)] = colour;
  }

 private:
  int width_, height_;
  std::vector<Colour> pixels_;
};

/// Height of a line in font pixels, without the space between lines.
inline constexpr int text_height = 8;

/// Width of a text in pixels of the picture. The font has the printable ASCII characters; any other character
/// of UTF-8 is an empty box. Any bytes are safe.
int text_width(std::string_view text, int scale);

/// Draws text whose upper left corner is (x, y). Each pixel of the font is a square of `scale` pixels.
void draw_text(Image& image, int x, int y, std::string_view text, int scale, Colour colour);

}  // namespace tagrid
