// Runs inputs that once caused failures, and all seeds, through the targets of the fuzzers.
// tests/regressions/<target>/ holds such inputs; the name of a file says what was wrong.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "io/bytes/checksum.h"
#include "tests/fuzz/seeds.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

static void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }

namespace {

std::vector<std::filesystem::path> regressions_of(std::string_view target) {
  std::vector<std::filesystem::path> paths;
  const std::filesystem::path folder = std::filesystem::path(TAGRID_SOURCE_DIR "/tests/regressions") / target;
  if (std::filesystem::is_directory(folder))
    for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

class Targets : public testing::TestWithParam<Target> {};

TEST(ThisProgram, LooksBehindChecksums) {
  EXPECT_TRUE(checksums_agree(1, 2)) << "and so a fuzzer, which could not guess one, gets past them";
}

// A target ends the program if a claim does not hold.
TEST_P(Targets, HoldOnEveryInputThatOnceWasTrouble) {
  for (const auto& path : regressions_of(GetParam().name)) {
    SCOPED_TRACE(path);
    std::ifstream file(path, std::ios::binary);
    const std::vector<std::uint8_t> input{std::istreambuf_iterator<char>(file), {}};
    EXPECT_NO_THROW(GetParam().run(input));
  }
}

TEST_P(Targets, HoldOnTheirSeedsAndAllTheirPrefixes) {
  static const auto all = make_seeds(TAGRID_SOURCE_DIR "/tests/golden/1.0");
  const Seeds& seeds = all.at(std::string(GetParam().name));
  ASSERT_FALSE(seeds.empty());
  for (const auto& seed : seeds)
    for (std::size_t size = 0; size <= seed.size(); size += seed.size() > 2000 ? 997 : 7) {
      EXPECT_NO_THROW(GetParam().run(Bytes(seed).first(size)));
      if (size == 0) {
        EXPECT_NO_THROW(GetParam().run(seed));
      }
    }
}

INSTANTIATE_TEST_SUITE_P(All, Targets, testing::ValuesIn(targets),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace tagrid::fuzz
