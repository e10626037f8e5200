// Damaged files are found out: small files bit by bit, and large ones.
#include <malloc.h>
#include <sys/resource.h>

#include <iostream>

#include "io/errors/errors.h"
#include "pipeline/decode/graph.h"
#include "tests/support/graph_ends.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

// Damaged files give an error every time, never other voxels.

class Damage : public TemporaryFolder {
 protected:
  // A small file of a few bricks.
  std::string small_file(bool grid, unsigned seed = 1) {
    const Index3 dims{11, 6, 10};
    write_nrrd(path("in.nrrd"), dims, blobs<std::uint8_t>(dims, seed));
    EncodeOptions options{.grid_only = grid, .max_error = 4, .cube_size = 4, .brick_edge = 2};
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
    return file_content(path("a.tag"));
  }
  void expect_broken(const std::string& content, const std::string& what) {
    write_content(path("b.tag"), content);
    EXPECT_THROW(decode_volume(path("b.tag"), path("out.raw"), format_named("raw"), true, Resources(1)),
                 BrokenInput)
        << what;
    EXPECT_FALSE(std::filesystem::exists(path("out.raw"))) << what;
    EXPECT_THROW(verify_file(path("b.tag"), std::nullopt, {}, Resources(1)), BrokenInput) << what;
  }
};

TEST_F(Damage, EveryFlippedBitAndEveryOtherLengthIsFound) {
  for (const bool grid : {false, true}) {
    const std::string whole = small_file(grid);
    for (std::size_t bit = 0; bit < 8 * whole.size(); bit += damage_stride)
      expect_broken(flipped(whole, bit / 8, 1 << bit % 8), "bit " + std::to_string(bit));
    for (std::size_t size = 0; size < whole.size(); ++size)
      expect_broken(whole.substr(0, size), std::to_string(size));
    expect_broken(whole + '\0', "one more byte");
    std::cout << 8 * whole.size() / damage_stride << " flipped bits, " << whole.size() << " truncations\n";
  }
}

TEST_F(Damage, BricksSwappedRepeatedOrOfAnotherFileAreFound) {
  const std::string a = small_file(false, 1), b = small_file(false, 2);
  ASSERT_GE(frames(a).size(), 4U);
  ASSERT_EQ(frames(a).size(), frames(b).size());
  expect_broken(with_bricks(a, 1, 2, frame_of(a, 2) + frame_of(a, 1)), "swapped");
  expect_broken(with_bricks(a, 1, 2, frame_of(a, 1) + frame_of(a, 1)), "repeated");
  expect_broken(with_bricks(a, 1, 1, ""), "left out");
  expect_broken(with_bricks(a, 1, 1, frame_of(b, 1)), "of another file with the same header");
}

TEST_F(Damage, ABrickOfAFileWithAnotherHeaderIsFound) {
  const std::string a = small_file(false);
  EncodeOptions options{.max_error = 5, .cube_size = 4, .brick_edge = 2};
  encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
  expect_broken(with_bricks(a, 1, 1, frame_of(content("a.tag"), 1)), "another header");
}

// Damages a file of some megabytes at random: every damage is found, and only true voxels are written before
// that. TAGRID_DAMAGES sets how many damages are tried for each file, and TAGRID_SEED selects them.

unsigned long setting(const char* name, unsigned long usual) {
  const char* given = std::getenv(name);
  return given ? std::strtoul(given, nullptr, 10) : usual;
}

std::size_t peak_memory() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

class LargeDamage : public TemporaryFolder, public testing::WithParamInterface<bool> {
 protected:
  LargeDamage() {
    whole_ = encoded(1);
    foreign_ = encoded(2);
    frames_ = frames(whole_);
    truth_ = decoded(whole_, false);
  }

  // The same volume except for a part that depends on the seed; the header is the same.
  std::string encoded(std::uint64_t seed) const {
    write_phantom({{160, 150, 140}, SampleType::int16, seed}, path("in.nrrd"), format_named("nrrd"), true, 2);
    EncodeOptions options{.grid_only = GetParam(), .cube_size = 16, .brick_edge = 2};
    if (options.grid_only) options.max_error = 20;
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(2));
    std::filesystem::remove(path("in.nrrd"));
    return file_content(path("a.tag"));
  }

  // The voxels that are written from a file; expects that the file is broken, or complete.
  std::string decoded(const std::string& content, bool broken) const {
    write_content(path("b.tag"), content);
    std::string out;
    bool failed = false;
    try {
      TagReader reader(path("b.tag"));
      RowsTo sink([&](const DecodedRows& rows) {
        rows.for_each_part([&](std::int64_t, std::span<const std::byte> part) {
          out.append(reinterpret_cast<const char*>(part.data()), part.size());
        });
      });
      Watch unwatched;
      decode(decode_job_of(reader.parameters(), 2), reader, sink, unwatched);
    } catch (const BrokenInput& error) {
      failed = true;
      EXPECT_TRUE(has(error.what(), "b.tag: "));
    }
    EXPECT_EQ(failed, broken);
    return out;
  }

  // One damage of any kind, and its name.
  std::pair<std::string, std::string> damaged(std::mt19937_64& random) const {
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    const std::size_t at = below(whole_.size()), brick = below(frames_.size());
    std::string file = whole_;
    switch (random() % 7) {
      case 0:
      case 1: {
        const auto bit = below(8);
        return {flipped(whole_, at, 1 << bit),
                "bit " + std::to_string(bit) + " of byte " + std::to_string(at)};
      }
      case 2:
        return {file.substr(0, at), "cut to " + std::to_string(at)};
      case 3: {
        const std::size_t size = std::min(1 + below(5000), whole_.size() - at);
        for (std::size_t i = 0; i < size; ++i) file[at + i] = static_cast<char>(~file[at + i]);
        return {file, std::to_string(size) + " bytes from " + std::to_string(at)};
      }
      case 4: {
        const std::size_t other = (brick + 1 + below(frames_.size() - 1)) % frames_.size();
        const std::size_t a = std::min(brick, other), b = std::max(brick, other);
        file = with_bricks(whole_, b, b, frame_of(whole_, a));
        return {file.substr(0, frames_[a].first) + frame_of(whole_, b) +
                    file.substr(frames_[a].first + frames_[a].second),
                "bricks " + std::to_string(a) + " and " + std::to_string(b) + " swapped"};
      }
      case 5:
        return {with_bricks(whole_, brick, brick, frame_of(whole_, brick) + frame_of(whole_, brick)),
                "brick " + std::to_string(brick) + " twice"};
      default:
        return {with_bricks(whole_, brick, brick, frame_of(foreign_, brick)),
                "brick " + std::to_string(brick) + " of another file"};
    }
  }

  std::string whole_, foreign_, truth_;
  std::vector<std::pair<std::size_t, std::size_t>> frames_;
};

TEST_P(LargeDamage, IsFoundAndOnlyTrueVoxelsGoOut) {
  ASSERT_EQ(frames_.size(), frames(foreign_).size());
  ASSERT_EQ(whole_.substr(0, frames_[0].first), foreign_.substr(0, frames_[0].first)) << "the same header";
  const unsigned long count = setting("TAGRID_DAMAGES", sanitized ? 2 : 80),
                      seed = setting("TAGRID_SEED", std::random_device()());
  std::printf("%lu damages of %zu bytes, TAGRID_SEED=%lu\n", count, whole_.size(), seed);
  std::mt19937_64 random(seed);
  // As in the program: heaps of other threads would keep freed memory.
  mallopt(M_ARENA_MAX, 1);
  const std::size_t before = peak_memory();
  for (unsigned long i = 0; i < count && !HasFailure(); ++i) {
    const auto [file, what] = damaged(random);
    SCOPED_TRACE(what);
    const std::string out = decoded(file, true);
    ASSERT_LE(out.size(), truth_.size());
    EXPECT_TRUE(truth_.compare(0, out.size(), out) == 0) << "other voxels went out";
    if (i % 8 != 0) continue;
    EXPECT_THROW(decode_volume(path("b.tag"), path("out.nrrd"), format_named("nrrd"), true, Resources(2)),
                 BrokenInput);
    EXPECT_EQ(names(), (std::vector<std::string>{"a.tag", "b.tag"}));
  }
  // Copies of the files in this test, and of the work of two threads, but no memory for sizes in a damaged file.
  if (!sanitized) {
    EXPECT_LT(peak_memory() - before, 56U << 20);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, LargeDamage, testing::Bool(),
                         [](const auto& test) { return std::string(test.param ? "grid" : "voxels"); });

}  // namespace
}  // namespace tagrid
