// Volumes with more voxels and bytes than 32 bits can count.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "tests/support/command_line.h"
#include "tests/support/program.h"

namespace tagrid {
namespace {

class LargeVolume : public CommandLine {
 protected:
  static constexpr std::uint64_t voxels = 1300ull * 1300 * 1271;
  static_assert(voxels > std::uint64_t{1} << 31 && 2 * voxels > std::uint64_t{1} << 32);

  void SetUp() override {
    if (program_is_sanitized()) GTEST_SKIP() << "under a sanitizer this would take a quarter of an hour";
  }

  /// Air, with some different voxels around numbers of 31, 32 and 33 bits. Takes no disk space.
  void make_volume(const std::string& name) const {
    std::ofstream(path(name), std::ios::binary).put(0);
    std::filesystem::resize_file(path(name), 2 * voxels);
    std::fstream file(path(name), std::ios::binary | std::ios::in | std::ios::out);
    const std::uint64_t bits_31 = std::uint64_t{1} << 31;
    for (const std::uint64_t voxel : {std::uint64_t{0}, bits_31 / 2 - 1, bits_31 / 2, bits_31 - 1, bits_31,
                                      bits_31 + 1, voxels - 1300, voxels - 1}) {
      const std::array<char, 2> sample = {static_cast<char>(1 + voxel % 100), 3};
      file.seekp(static_cast<std::streamoff>(2 * voxel));
      file.write(sample.data(), sample.size());
    }
    ASSERT_TRUE(file.flush().good());
  }
};

TEST_F(LargeVolume, ComesBack) {
  make_volume("a.raw");
  expect_ok(tagrid({"encode", "a.raw", "--dims", "1300,1300,1271", "--type", "int16", "-M", "200M", "-T", "2",
                    "-o", "a.tag"}));
  expect_ok(script("$TAGRID decode a.tag -M 300M -T 2 -o - | cmp - a.raw"));
  // Every point of the grid is checked, too.
  expect_ok(tagrid({"verify", "a.tag", "-q", "-M", "200M", "-T", "2"}));
}

}  // namespace
}  // namespace tagrid
