// Bytes: sizes of memory as text, and Zstandard.
#include <gtest/gtest.h>

#include <string_view>

#include "io/bytes/checksum.h"
#include "io/bytes/memory_size.h"
#include "io/bytes/zstd_bytes.h"
#include "io/errors/errors.h"
#include "io/formats/zarr/crc32c.h"

namespace tagrid {
namespace {

// A size of 64 bits does not become a smaller one where memory has 32.

TEST(MemorySize, IsTheSameNumberOrRefused) {
  EXPECT_EQ(memory_size<std::uint32_t>(0), 0U);
  EXPECT_EQ(memory_size<std::uint32_t>(0xFFFFFFFFU), 0xFFFFFFFFU);
  for (const std::uint64_t size : {std::uint64_t{1} << 32, (std::uint64_t{1} << 32) + 24, ~std::uint64_t{0}})
    EXPECT_THROW(memory_size<std::uint32_t>(size), std::length_error) << size;
  EXPECT_EQ(memory_size(std::uint64_t{5} << 40), std::size_t{5} << 40);
}

TEST(MemorySize, ThatIsRefusedIsALackOfMemory) {
  try {
    memory_size<std::uint32_t>(std::uint64_t{1} << 32);
  } catch (...) {
    EXPECT_EQ(sorted_error(std::current_exception()).kind, ErrorKind::memory);
  }
}
std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

TEST(ZstdBytes, WhatIsPackedComesBackAtAnySize) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1023}, std::size_t{1024},
                                 std::size_t{1025}, std::size_t{100000}, std::size_t{3} << 20}) {
    std::vector<std::byte> bytes(size), again;
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * i >> 7);
    const auto packed = zstd_compress(bytes);
    ASSERT_TRUE(zstd_decompress(packed, size, again).ok()) << size;
    EXPECT_TRUE(again == bytes) << size;
    EXPECT_FALSE(zstd_decompress(packed, size + 1, again).ok());
    if (size > 0) {
      EXPECT_FALSE(zstd_decompress(packed, size - 1, again).ok());
    }
  }
}

// Magic number, a descriptor without a content size, the window, and one raw block of one byte.
std::vector<std::byte> frame_with_window(int log) {
  std::vector<std::byte> frame = bytes_of(std::string_view("\x28\xB5\x2F\xFD\x00", 5));
  frame.push_back(static_cast<std::byte>((log - 10) << 3));
  for (const int byte : {9, 0, 0, int{'x'}}) frame.push_back(static_cast<std::byte>(byte));
  return frame;
}

TEST(ZstdBytes, AWindowThatTheSizeDoesNotNeedIsRefused) {
  std::vector<std::byte> out;
  EXPECT_TRUE(zstd_decompress(frame_with_window(10), 1, out).ok());
  EXPECT_EQ(out, bytes_of("x"));
  for (const int log : {11, 20, 27, 30})
    EXPECT_FALSE(zstd_decompress(frame_with_window(log), 1, out).ok()) << log;
}

TEST(ZstdBytes, WhatIsNoFrameIsRefused) {
  std::vector<std::byte> out;
  EXPECT_FALSE(zstd_decompress({}, 0, out).ok());
  EXPECT_FALSE(zstd_decompress(bytes_of(std::string_view("\x50\x2A\x4D\x18\0\0\0\0", 8)), 0, out).ok())
      << "a skippable frame";
  EXPECT_FALSE(zstd_decompress(bytes_of("no frame"), 8, out).ok());
}

TEST(Checksums, Crc32cIsThatOfTheStandard) {
  // The check value of the catalogue, and RFC 3720, appendix B.4.
  EXPECT_EQ(crc32c(bytes_of("123456789")), 0xe3069283u);
  EXPECT_EQ(crc32c(bytes_of(std::string(32, '\0'))), 0x8a9136aau);
  EXPECT_EQ(crc32c(bytes_of(std::string(32, '\xff'))), 0x62a8ab43u);
  EXPECT_EQ(crc32c({}), 0u);
}

TEST(Checksums, DifferWhereTheyDiffer) {
  EXPECT_TRUE(checksums_agree(1, 1));
  EXPECT_FALSE(checksums_agree(1, 2)) << "only fuzzers may look behind them";
}

}  // namespace
}  // namespace tagrid
