// A file says the same whether it is read front to back or by its index, and both ways find the same damage.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstddef>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/verify/verifier.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr Index3 dims{21, 18, 19};

// The standard input of this process, as long as this object exists.
class StandardInput {
 public:
  explicit StandardInput(int descriptor) : kept_(dup(STDIN_FILENO)) {
    dup2(descriptor, STDIN_FILENO);
    close(descriptor);
  }
  ~StandardInput() {
    dup2(kept_, STDIN_FILENO);
    close(kept_);
  }
  StandardInput(const StandardInput&) = delete;
  StandardInput& operator=(const StandardInput&) = delete;

 private:
  int kept_;
};

class WaysToRead : public TemporaryFolder {
 protected:
  void encode(bool grid_only) {
    write_nrrd(path("in.nrrd"), dims, blobs<std::int16_t>(dims, 3));
    EncodeOptions options{.grid_only = grid_only, .cube_size = 8, .brick_edge = 1};
    encode_volume(path("in.nrrd"), {}, tag_, true, options, Resources(1));
    bytes_ = content("a.tag");
  }
  static bool is_whole_front_to_back(const std::string& bytes) {
    try {
      verify_bytes(std::make_unique<SourceStream>(std::make_shared<MemorySource>(bytes)), Resources(1));
      return true;
    } catch (const BrokenInput&) {
      return false;
    }
  }
  // Rows are verified last to first, each by itself.
  static bool is_whole_in_parts(const std::string& bytes) {
    try {
      const TagBricks file(std::make_shared<MemorySource>(bytes));
      const BrickGrid bricks = file.parameters().bricks();
      Verifier verifier(file, file.index(), verify_setup("", file.header(), "", {}, Resources(1)));
      Watch unwatched;
      Statistics counted;
      OpenFacePairs faces(bricks);
      for (std::int64_t z = bricks.bricks(2) - 1; z >= 0; --z)
        for (std::int64_t y = bricks.bricks(1) - 1; y >= 0; --y) {
          const Findings found = verifier.verify({y, y + 1, z, z + 1}, unwatched);
          counted.add(found.counted);
          faces.add(found.open_faces);
        }
      if (const auto two = faces.first_difference()) verifier.tell_difference(*two);
      verifier.finish(counted, true, file.sizes());
      return true;
    } catch (const BrokenInput&) {
      return false;
    }
  }

  const std::string tag_ = path("a.tag");
  std::string bytes_;
};

TEST_F(WaysToRead, BricksFromAnyNumberOnAreThoseOfTheWholeFile) {
  encode(false);
  std::vector<BrickBytes> all;
  TagReader reader(tag_);
  for (BrickBytes brick; reader.read_brick(brick);) all.push_back(brick);
  const TagBricks file(std::make_shared<FileSource>(tag_));
  ASSERT_EQ(static_cast<std::int64_t>(all.size()), file.count());
  for (std::int64_t first = 0; first <= file.count(); ++first) {
    BricksInOrder bricks(file, first);
    EXPECT_EQ(bricks.name(), reader.name());
    auto expected = static_cast<std::size_t>(first);
    for (BrickBytes brick; bricks.read_brick(brick); ++expected) {
      ASSERT_LT(expected, all.size());
      EXPECT_EQ(brick.id, all[expected].id);
      EXPECT_EQ(brick.activity, all[expected].activity);
      EXPECT_EQ(brick.values, all[expected].values);
    }
    EXPECT_EQ(expected, all.size());
  }
}

TEST_F(WaysToRead, ASummaryIsThatOfAFileAPipeOrTheRestOfTheStandardInput) {
  encode(false);
  const TagSummary expected = summary_of(tag_);
  EXPECT_EQ(expected.sizes.file, bytes_.size());
  const auto expect_same = [&](const TagSummary& summary) {
    EXPECT_EQ(serialize_header(summary.header), serialize_header(expected.header));
    EXPECT_EQ(summary.index.total.active, expected.index.total.active);
    EXPECT_EQ(summary.sizes.file, expected.sizes.file);
    EXPECT_EQ(summary.sizes.values, expected.sizes.values);
  };
  {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    ASSERT_EQ(write(ends[1], bytes_.data(), bytes_.size()), static_cast<ssize_t>(bytes_.size()));
    close(ends[1]);
    const StandardInput input(ends[0]);
    expect_same(summary_of("-"));
  }
  const std::string before = "read by somebody else", later = file("later", before + bytes_);
  const int descriptor = open(later.c_str(), O_RDONLY);
  lseek(descriptor, static_cast<off_t>(before.size()), SEEK_SET);
  const StandardInput input(descriptor);
  expect_same(summary_of("-"));
}

TEST_F(WaysToRead, PartsFindTheDamageThatIsFoundFrontToBack) {
  for (const bool grid_only : {false, true}) {
    encode(grid_only);
    EXPECT_TRUE(is_whole_front_to_back(bytes_));
    EXPECT_TRUE(is_whole_in_parts(bytes_));
    for (std::size_t at = 0; at < bytes_.size(); at += sanitized ? 211 : 41) {
      std::string bad = bytes_;
      bad[at] = static_cast<char>(bad[at] ^ 4);
      EXPECT_FALSE(is_whole_front_to_back(bad)) << at;
      EXPECT_FALSE(is_whole_in_parts(bad)) << at;
    }
    for (const std::string& more : {std::string("x"), bytes_}) {
      EXPECT_FALSE(is_whole_front_to_back(bytes_ + more));
      EXPECT_FALSE(is_whole_in_parts(bytes_ + more));
    }
  }
}

}  // namespace
}  // namespace tagrid
