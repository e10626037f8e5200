// Volumes that a program reads slice by slice, or whose places it tells.

#include "io/programs/volumes.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdint>
#include <random>

#include "io/errors/errors.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using testing::HasSubstr;

class ProgramSourceTest : public TemporaryFolder {
 protected:
  std::unique_ptr<VolumeSource> open(const std::string& text) {
    return open_with_reader(TAGRID_RAMP_READER, file("a.ramp", text), {});
  }
  static void expect_slices(VolumeSource& source, std::int64_t count) {
    const auto first = static_cast<std::uint32_t>(source.next_sample());
    std::vector<std::uint32_t> samples(static_cast<std::size_t>(count * source.slice_samples()));
    source.read_slices(reinterpret_cast<std::byte*>(samples.data()), count);
    for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_EQ(samples[i], first + i);
  }
};

TEST_F(ProgramSourceTest, SlicesComeInAnyOrder) {
  for (const char* order : {"any", "next"}) {
    const auto source = open(std::string("7 5 20 ") + order);
    EXPECT_EQ(source->info().dims, (Index3{7, 5, 20}));
    EXPECT_TRUE(source->traits().again && source->traits().whole_slices && !source->traits().any_rows);
    EXPECT_TRUE(source->facts().holds_other_bytes);
    EXPECT_EQ(source->bytes_read(), std::string(order).size() + 7);
    std::mt19937 random(1);
    for (int i = 0; i < 40; ++i) {
      const auto from = static_cast<std::int64_t>(random() % 20);
      source->seek_slice(from);
      expect_slices(*source, 1 + static_cast<std::int64_t>(random()) % (20 - from));
    }
    source->rewind();
    for (int z = 0; z < 20; z += 4) expect_slices(*source, 4);
    source->finish();
  }
}

TEST_F(ProgramSourceTest, ADescriptionTakesNoMoreMemoryThanItMay) {
  if (sanitized) GTEST_SKIP() << "sanitizers take memory of their own";
  const std::string greedy = file("a.ramp", "7 5 3 greedy");
  const auto open_with = [&](std::uint64_t mebibytes) {
    return open_with_reader(TAGRID_RAMP_READER, greedy, {}, mebibytes << 20);
  };
  try {
    open_with(64);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const UsageError& error) {
    EXPECT_EQ(error.what(),
              greedy + ": to describe it, its reader needs more memory than its limit (64 MiB)");
    EXPECT_EQ(error.detail().problem, Problem::program_memory);
  }
  const auto source = open_with(512);
  expect_slices(*source, 3);
}

TEST_F(ProgramSourceTest, AnErrorBetweenSlicesComesAtItsSlice) {
  const auto source = open("7 5 20 broken");
  expect_slices(*source, 2);
  try {
    expect_slices(*source, 1);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const BrokenInput& error) {
    EXPECT_STREQ(error.what(), "slice 2 cannot be read");
  }
}

TEST_F(ProgramSourceTest, AFileThatChangesIsNoticedWhenItIsReadAgain) {
  const auto source = open("7 5 20 next");
  expect_slices(*source, 3);
  file("a.ramp", "7 5 21 next");
  source->rewind();
  EXPECT_THROW(expect_slices(*source, 1), BrokenInput);
}

TEST_F(ProgramSourceTest, ErrorsAndListsArrive) {
  EXPECT_THROW(open("7 5"), BrokenInput);
  try {
    open_with_reader(TAGRID_RAMP_READER, file("a.ramp", "7 5 3 any"), {{"series", "all"}});
    ADD_FAILURE() << "nothing was thrown";
  } catch (const UsageError& error) {
    EXPECT_THAT(
        error.detail().choices,
        testing::ElementsAre(Choice{"a", "the first"}, Choice{"b", "the second"}, Choice{"a", "the third"}));
  }
}

TEST_F(ProgramSourceTest, ANameOfTwoVolumesMeansNeither) {
  const std::string path = file("a.ramp", "7 5 3 any");
  try {
    open_with_reader(TAGRID_RAMP_READER, path, {{"series", "a"}});
    ADD_FAILURE() << "nothing was thrown";
  } catch (const UsageError& error) {
    EXPECT_EQ(error.what(),
              path + ": has 2 volumes that are called a; move the files of one of them to another directory");
  }
  // Other names, and numbers, say which.
  for (const char* series : {"b", "1", "3"})
    EXPECT_TRUE(open_with_reader(TAGRID_RAMP_READER, path, {{"series", series}}));
  EXPECT_THROW(open_with_reader(TAGRID_RAMP_READER, path, {{"series", "4"}}), UsageError);
}

TEST_F(ProgramSourceTest, SamplesThatLiePlainlyAreReadWithoutTheProgram) {
  const std::string program = file("reader", R"(#!/bin/sh
echo '{"tagrid-reader": 1}'
read -r line
echo '{"answer": "volume", "dims": [2, 1, 3], "type": "uint16", "places": [{"offset": 1, "slices": 3, "big_endian": true}]}'
while read -r line; do echo more; done
)");
  chmod(program.c_str(), 0700);
  const auto source = open_with_reader(program,
                                       file("a.x",
                                            "\x7f"
                                            "ABCDEFGHIJKL"),
                                       {});
  EXPECT_TRUE(source->traits().any_rows);
  std::uint16_t samples[6];
  source->read_slices(reinterpret_cast<std::byte*>(samples), 3);
  EXPECT_THAT(samples, testing::ElementsAre(0x4142, 0x4344, 0x4546, 0x4748, 0x494a, 0x4b4c));
  // Where they should lie and do not.
  EXPECT_THROW(open_with_reader(program,
                                file("b.x",
                                     "\x7f"
                                     "ABCDEFGHIJK"),
                                {}),
               BrokenInput);
}

TEST_F(ProgramSourceTest, AReaderMayDeclareMoreMemoryThanItDescribesWith) {
  const std::string program = file("reader", R"(#!/bin/sh
echo '{"tagrid-reader": 1}'
read -r line
echo '{"answer": "volume", "dims": [1, 1, 1], "type": "uint8", "memory": 3000000000}'
read -r line
echo "{\"answer\": \"slices\", \"from\": 0, \"to\": 1}"
limit=$(ulimit -d)
if [ "$limit" = unlimited ] || [ "$limit" -gt 2000000 ]; then printf 1; else printf 0; fi
)");
  chmod(program.c_str(), 0700);
  const auto source = open_with_reader(program, file("a.x", ""), {});
  char sample = 0;
  source->read_slices(reinterpret_cast<std::byte*>(&sample), 1);
  EXPECT_EQ(sample, '1');
}

// A reader that gives too much has most likely misread its file.
TEST_F(ProgramSourceTest, BytesAfterTheLastSliceAreAnErrorThatNamesTheReader) {
  const std::string program = file("reader", R"(#!/bin/sh
echo '{"tagrid-reader": 1}'
read -r line
echo '{"answer": "volume", "dims": [2, 1, 3], "type": "uint8", "order": "'$(cat $0.order)'"}'
read -r line
echo '{"answer": "slices", "from": 0, "to": 3}'
printf "abcdef%$(cat $0.more)s" ''
read -r line
exit $(cat $0.code)
)");
  chmod(program.c_str(), 0700);
  for (const char* order : {"any", "next"})
    for (const auto& [more, code] : {std::pair("0", "0"), {"1", "0"}, {"1000", "0"}, {"0", "3"}}) {
      SCOPED_TRACE(std::string(order) + " " + more + " " + code);
      file("reader.order", order);
      file("reader.more", more);
      file("reader.code", code);
      const auto source = open_with_reader(program, file("a.x", ""), {});
      std::byte samples[6];
      source->read_slices(samples, 3);
      const bool is_good = *more == '0' && *code == '0';
      try {
        source->finish();
        EXPECT_TRUE(is_good);
      } catch (const WorldError& error) {
        EXPECT_FALSE(is_good) << error.what();
        EXPECT_THAT(error.what(), HasSubstr(program));
      }
      if (!is_good) continue;
      // It can be read again.
      source->rewind();
      source->read_slices(samples, 3);
      EXPECT_EQ(samples[5], std::byte{'f'});
    }
}

TEST_F(ProgramSourceTest, AReadThatWaitsCanBeStopped) {
  const std::string program = file("reader", R"(#!/bin/sh
echo '{"tagrid-reader": 1}'
read -r line
echo '{"answer": "volume", "dims": [2, 1, 3], "type": "uint16"}'
sleep 1000
)");
  chmod(program.c_str(), 0700);
  const auto source = open_with_reader(program, file("a.x", ""), {});
  const std::atomic<bool> stop = true;
  source->stop_when(stop);
  std::uint16_t samples[6];
  EXPECT_THROW(source->read_slices(reinterpret_cast<std::byte*>(samples), 3), WorldError);
}

}  // namespace
}  // namespace tagrid
