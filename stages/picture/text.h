// Text in a picture, in a font of 5 x 8 pixels that is enlarged by whole numbers.
#pragma once

#include <string_view>

#include "stages/picture/image.h"

namespace tagrid {

/// Height of a line in font pixels, without the space between lines.
inline constexpr int text_height = 8;

/// Width of a text in pixels of the picture. The font has the printable ASCII characters; any other character
/// of UTF-8 is an empty box. Any bytes are safe.
int text_width(std::string_view text, int scale);

/// Draws text whose upper left corner is (x, y). Each pixel of the font is a square of `scale` pixels.
void draw_text(Image& image, int x, int y, std::string_view text, int scale, Colour colour);

}  // namespace tagrid
