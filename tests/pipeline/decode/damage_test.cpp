// Damaged files give an error every time, never other voxels.
#include <gtest/gtest.h>

#include <iostream>

#include "io/errors/errors.h"
#include "tests/support/frames.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class Damage : public TemporaryFolder {
 protected:
  // A small file of a few bricks.
  std::string small_file(bool grid, unsigned seed = 1) {
    const Index3 dims{11, 6, 10};
    write_nrrd(path("in.nrrd"), dims, blobs<std::uint8_t>(dims, seed));
    EncodeOptions options;
    options.cube_size = 4;
    options.brick_edge = 2;
    options.grid_only = grid;
    options.max_error = 4;
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
    return file_content(path("a.tag"));
  }
  void expect_broken(const std::string& content, const std::string& what) {
    write_content(path("b.tag"), content);
    EXPECT_THROW(decode_volume(path("b.tag"), path("out.raw"), format_named("raw"), true, Resources(1)),
                 BrokenInput)
        << what;
    EXPECT_FALSE(std::filesystem::exists(path("out.raw"))) << what;
    EXPECT_THROW(verify_file(path("b.tag"), "", {}, Resources(1)), BrokenInput) << what;
  }
};

TEST_F(Damage, EveryFlippedBitIsFound) {
  for (const bool grid : {false, true}) {
    const std::string whole = small_file(grid);
    for (std::size_t bit = 0; bit < 8 * whole.size(); bit += damage_stride) {
      std::string damaged = whole;
      damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
      expect_broken(damaged, "byte " + std::to_string(bit / 8) + " bit " + std::to_string(bit % 8));
    }
    std::cout << 8 * whole.size() / damage_stride << " flipped bits\n";
  }
}

TEST_F(Damage, EveryTruncationIsFound) {
  for (const bool grid : {false, true}) {
    const std::string whole = small_file(grid);
    for (std::size_t size = 0; size < whole.size(); ++size)
      expect_broken(whole.substr(0, size), std::to_string(size));
    std::cout << whole.size() << " truncations\n";
  }
}

TEST_F(Damage, TrailingBytesAreFound) { expect_broken(small_file(false) + '\0', "one more byte"); }

TEST_F(Damage, BricksSwappedRepeatedOrOfAnotherFileAreFound) {
  const std::string a = small_file(false, 1), b = small_file(false, 2);
  const auto in_a = frames(a), in_b = frames(b);
  ASSERT_GE(in_a.size(), 4U);
  ASSERT_EQ(in_a.size(), in_b.size());
  const auto with = [&](std::size_t first, std::size_t second, const std::string& bricks) {
    return a.substr(0, in_a[first].first) + bricks + a.substr(in_a[second].first + in_a[second].second);
  };
  const auto frame = [](const std::string& file, std::pair<std::size_t, std::size_t> f) {
    return file.substr(f.first, f.second);
  };
  expect_broken(with(1, 2, frame(a, in_a[2]) + frame(a, in_a[1])), "swapped");
  expect_broken(with(1, 2, frame(a, in_a[1]) + frame(a, in_a[1])), "repeated");
  expect_broken(with(1, 1, ""), "left out");
  expect_broken(with(1, 1, frame(b, in_b[1])), "of another file with the same header");
}

TEST_F(Damage, ABrickOfAFileWithAnotherHeaderIsFound) {
  const std::string a = small_file(false);
  EncodeOptions options;
  options.cube_size = 4;
  options.brick_edge = 2;
  options.max_error = 5;
  encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
  const std::string b = file_content(path("a.tag"));
  const auto fa = frames(a)[1], fb = frames(b)[1];
  expect_broken(a.substr(0, fa.first) + b.substr(fb.first, fb.second) + a.substr(fa.first + fa.second),
                "another header");
}

}  // namespace
}  // namespace tagrid
