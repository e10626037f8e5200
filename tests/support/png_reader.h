// Reads PNG files with libpng.
#pragma once

#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tagrid {

struct PngPicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bytes;

  std::array<int, 3> at(int x, int y) const {
    const std::uint8_t* p = bytes.data() + 3 * (static_cast<std::ptrdiff_t>(y) * width + x);
    return {p[0], p[1], p[2]};
  }
};

/// A failure, and an empty picture, if the bytes are not a whole PNG file.
inline PngPicture png_of(const std::string& file) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  PngPicture picture;
  if (png_image_begin_read_from_memory(&image, file.data(), file.size()) == 0) {
    ADD_FAILURE() << image.message;
    return picture;
  }
  EXPECT_EQ(image.format, static_cast<png_uint_32>(PNG_FORMAT_RGB));
  image.format = PNG_FORMAT_RGB;
  picture.width = static_cast<int>(image.width);
  picture.height = static_cast<int>(image.height);
  picture.bytes.resize(PNG_IMAGE_SIZE(image));
  EXPECT_NE(png_image_finish_read(&image, nullptr, picture.bytes.data(), 0, nullptr), 0) << image.message;
  return picture;
}

}  // namespace tagrid
