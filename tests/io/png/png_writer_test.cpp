#include "io/png/png_writer.h"

#include <random>

#include "io/errors/errors.h"
#include "tests/support/png_reader.h"

namespace tagrid {
namespace {

struct Bytes : ByteSink {
  std::string bytes;
  std::size_t room = std::string::npos;

  void write(std::span<const std::byte> more) override {
    if (bytes.size() + more.size() > room) throw WorldError("the disk is full");
    bytes.append(reinterpret_cast<const char*>(more.data()), more.size());
  }
};

std::vector<std::byte> noise(int width, int height) {
  std::mt19937 random(1);
  std::vector<std::byte> pixels(static_cast<std::size_t>(3 * width * height));
  for (std::byte& b : pixels) b = static_cast<std::byte>(random());
  return pixels;
}

TEST(Png, OtherProgramsReadTheSamePixels) {
  for (const auto& [width, height] : {std::pair(1, 1), {17, 3}, {300, 200}}) {
    const auto pixels = noise(width, height);
    Bytes file;
    write_png(width, height, pixels, file);
    const PngPicture picture = png_of(file.bytes);
    EXPECT_EQ(picture.width, width);
    EXPECT_EQ(picture.height, height);
    EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(picture.bytes)), pixels));
  }
}

TEST(Png, AFullDiskIsTheErrorOfTheSink) {
  const auto pixels = noise(300, 200);
  Bytes whole;
  write_png(300, 200, pixels, whole);
  for (std::size_t room = 0; room < whole.bytes.size(); room += 1 + whole.bytes.size() / 50) {
    Bytes file;
    file.room = room;
    EXPECT_THROW(write_png(300, 200, pixels, file), WorldError) << room;
  }
}

}  // namespace
}  // namespace tagrid
