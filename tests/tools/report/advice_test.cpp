// The same error, as a user of the library and a user of the command line read it.
#include "tools/report/advice.h"

#include <gtest/gtest.h>

#include "pipeline/job/options.h"
#include "tools/commands/commands.h"
#include "tools/options/command_line_error.h"

namespace tagrid {
namespace {

constexpr Problem last_problem = Problem::mesh_fills_no_space;

// The message of the exception of validate(), in words of the command line.
std::string refusal_of(const EncodeOptions& options) {
  try {
    options.validate();
  } catch (const UsageError& error) {
    EXPECT_EQ(std::string(error.what()).find("--"), std::string::npos) << error.what();
    return words_of(error);
  }
  return "";
}

TEST(Advice, FollowsWhatHappened) {
  EXPECT_EQ(words_of(UsageError("a.tag: already exists", Problem::output_exists)),
            "a.tag: already exists; give -f to overwrite it");
  EXPECT_EQ(words_of(UsageError("a.tag: is gone")), "a.tag: is gone");
}

TEST(Advice, IsThereForEveryProblem) {
  for (int problem = 1; problem <= static_cast<int>(last_problem); ++problem) {
    const ErrorDetail detail{static_cast<Problem>(problem), "", {}, {1}};
    EXPECT_GT(words_of(UsageError("x", detail)).size(), 5U) << problem;
  }
}

TEST(Advice, NamesTheSmallestLimitOnMemory) {
  const MemoryLimit with_spool("encoding", 1 << 20, (9 << 20) + 1, 5 << 20);
  EXPECT_STREQ(with_spool.what(), "encoding needs at least 10 MiB of memory, but the limit is 1 MiB");
  EXPECT_EQ(
      words_of(with_spool),
      "encoding needs at least 10 MiB of memory, but the limit is 1 MiB; give -M 10M, or --spool DIR, a "
      "folder for the samples, and -M 5M");
  EXPECT_EQ(words_of(MemoryLimit("decoding", 17, 1, {})),
            "decoding needs at least 1 MiB of memory, but the limit is 17 B; give -M 1M");
}

TEST(Advice, NamesNoFolderForSamplesWhereThatGainsNothing) {
  EXPECT_EQ(words_of(MemoryLimit("encoding", 1 << 20, (9 << 20) + 1, (9 << 20) + 1)),
            "encoding needs at least 10 MiB of memory, but the limit is 1 MiB; give -M 10M");
}

TEST(Advice, OnMemoryIsAboutOptionsThatTheCommandHas) {
  for (const auto& add : {add_encode_command, add_decode_command, add_info_command, add_verify_command,
                          add_mesh_command, add_convert_command, add_phantom_command}) {
    CLI::App app;
    const Action action = add(app);
    const CLI::App& command = *app.get_subcommands({}).front();
    const std::string advice = memory_advice(command);
    for (const std::string option : {"--brick", "-M", "-T"})
      EXPECT_TRUE(advice.find(option) == advice.npos || command.get_option_no_throw(option) != nullptr)
          << command.get_name() << ": " << advice;
    EXPECT_EQ(advice.empty(), command.get_option_no_throw("-T") == nullptr) << command.get_name();
  }
}

TEST(Advice, CallsSettingsByTheirOptions) {
  EncodeOptions options;
  options.max_error = -1;
  EXPECT_EQ(refusal_of(options), "--max-error -1 must be a finite number of at least 0");
  options.max_error = 1;
  options.surface_error = 2;
  EXPECT_EQ(refusal_of(options), "--surface-error must be below --max-error");
  options = {};
  options.max_level = 3;
  options.mesh_error = 1;
  EXPECT_EQ(refusal_of(options),
            "a grid that is limited by --max-level cannot keep a bound; leave out --mesh-error");
  options = {};
  options.range = {2, 1};
  EXPECT_EQ(refusal_of(options), "--range must be lo:hi with lo < hi");
  options.field_scale = 1;
  EXPECT_EQ(refusal_of(options), "--field-scale and --range have the same meaning; give only one");
  options = {};
  options.cube_size = 33;
  EXPECT_EQ(refusal_of(options), "--cube must be a power of two from 4 to 256");
}

TEST(Advice, KeepsTheRankThatFailed) {
  ErrorDetail detail{Problem::output_exists, "rank 2: ", {"{}: exists", {Setting{"level", "the level"}}}, {}};
  EXPECT_EQ(words_of(UsageError("rank 2: the level: exists", detail)),
            "rank 2: --level: exists; give -f to overwrite it");
}

}  // namespace
}  // namespace tagrid
