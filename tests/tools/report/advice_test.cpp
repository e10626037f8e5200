// What the program says while it runs and where it fails: advice, progress, printable output.
#include <cstdio>
#include <thread>

#include "pipeline/job/options.h"
#include "tests/support/command_line.h"
#include "tools/commands/commands.h"
#include "tools/options/command_line.h"
#include "tools/report/damage.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"
#include "tools/report/progress.h"

namespace tagrid {
namespace {

// The same error, as a user of the library and a user of the command line read it.

constexpr Problem last_problem = Problem::mesh_fills_no_space;

// The message of the exception of validate(), in words of the command line.
std::string refusal_of(const EncodeOptions& options) {
  try {
    options.validate();
  } catch (const UsageError& error) {
    EXPECT_FALSE(has(error.what(), "--"));
    return words_of(error);
  }
  return "";
}

TEST(Advice, FollowsWhatHappened) {
  EXPECT_EQ(words_of(UsageError("a.tag: already exists", Problem::output_exists)),
            "a.tag: already exists; give -f to overwrite it");
  EXPECT_EQ(words_of(UsageError("a.tag: is gone")), "a.tag: is gone");
}

TEST(Advice, IsACommandThatAShellReads) {
  EXPECT_EQ(repair_command("a/b-1.tag"), "tagrid repair a/b-1.tag -o OUT");
  EXPECT_EQ(word_of_command("my scan.tag"), "'my scan.tag'");
  EXPECT_EQ(word_of_command("-x.tag"), "./-x.tag");
  EXPECT_EQ(word_of_command("~/\u00e4.tag"), "'~/\u00e4.tag'");
  for (const std::string path : {"it's a scan.tag", "$(x)`y`\\.tag", "a\nb\\'c.tag", "\x1b\xff.tag", "-"}) {
    const std::string command = "bash -c " + word_of_command("printf %s " + word_of_command(path));
    FILE* shell = popen(command.c_str(), "r");
    std::string read;
    for (int c = 0; (c = std::fgetc(shell)) != EOF;) read += static_cast<char>(c);
    pclose(shell);
    EXPECT_EQ(read, (path.starts_with('-') ? "./" : "") + path) << command;
  }
}

TEST(Advice, IsThereForEveryProblem) {
  for (int problem = 1; problem <= static_cast<int>(last_problem); ++problem) {
    const ErrorDetail detail = {.problem = static_cast<Problem>(problem), .memory = MemoryNeeds{.needed = 1}};
    EXPECT_GT(words_of(UsageError("x", detail)).size(), 5U) << problem;
  }
}

TEST(Advice, NamesTheSmallestLimitOnMemoryAndWhatLowersIt) {
  const MemoryLimit with_spool("encoding",
                               {.needed = (9 << 20) + 1, .allowed = 1 << 20, .with_spool = 5 << 20});
  EXPECT_STREQ(with_spool.what(), "encoding needs at least 10 MiB of memory, but the limit is 1 MiB");
  const auto smaller = [](std::uint64_t needed) {
    return MemoryNeeds{.needed = 9 << 20, .allowed = 4 << 20, .smaller_brick = SmallerBrick{2, needed}};
  };
  const std::pair<MemoryNeeds, const char*> advice[] = {
      {{.needed = (9 << 20) + 1, .allowed = 1 << 20, .with_spool = 5 << 20},
       "10 MiB of memory, but the limit is 1 MiB; give -M 10M, or --spool DIR, a directory for the samples, "
       "and -M 5M"},
      // A directory for samples that gains nothing.
      {{.needed = (9 << 20) + 1, .allowed = 1 << 20, .with_spool = (9 << 20) + 1},
       "10 MiB of memory, but the limit is 1 MiB; give -M 10M"},
      {{.needed = 1, .allowed = 17}, "1 MiB of memory, but the limit is 17 B; give -M 1M"},
      {smaller(4 << 20), "9 MiB of memory, but the limit is 4 MiB; give -M 9M, or smaller bricks: --brick 2"},
      {smaller(5 << 20),
       "9 MiB of memory, but the limit is 4 MiB; give -M 9M, or smaller bricks: --brick 2 and -M 5M"},
      {smaller(9 << 20), "9 MiB of memory, but the limit is 4 MiB; give -M 9M"}};
  for (const auto& [needs, words] : advice)
    EXPECT_EQ(words_of(MemoryLimit("encoding", needs)), std::string("encoding needs at least ") + words);
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
  const std::pair<EncodeOptions, const char*> refused[] = {
      {{.max_error = -1}, "--max-error -1 must be a finite number of at least 0"},
      {{.max_error = 1, .surface_error = 2}, "--surface-error must be below --max-error"},
      {{.mesh_error = 1, .max_level = 3},
       "a grid that is limited by --max-level cannot keep a bound; leave out --mesh-error"},
      {{.range = std::pair(2.0, 1.0)}, "--range must be lo:hi with lo < hi"},
      {{.range = std::pair(2.0, 1.0), .field_scale = 1},
       "--field-scale and --range have the same meaning; give only one"},
      {{.cube_size = 33}, "--cube must be a power of two from 4 to 256"}};
  for (const auto& [options, words] : refused) EXPECT_EQ(refusal_of(options), words);
}

TEST(Advice, KeepsTheRankThatFailed) {
  const ErrorDetail detail = {.problem = Problem::output_exists, .with_options = "rank 2: --level: exists"};
  EXPECT_EQ(words_of(UsageError("rank 2: the level: exists", detail)),
            "rank 2: --level: exists; give -f to overwrite it");
}
using namespace std::chrono_literals;

TEST(Progress, PlainIsALineEveryHalfMinuteWithRateAndRemainingTime) {
  testing::internal::CaptureStderr();
  {
    ProgressMeter meter(ProgressStyle::plain, false, "encode", 1000000);
    const auto start = ProgressMeter::Clock::now();
    // A quarter of an hour for 1500 MB, ten updates a second.
    for (int tenth = 0; tenth <= 3050; ++tenth)
      meter.update(static_cast<std::uint64_t>(tenth) / 6, 1500, start + tenth * 100ms);
  }
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10) << text;
  EXPECT_EQ(text.substr(0, text.find('\n')), "encode   3 %  1.7 MB/s  14:30 left");
}

TEST(Progress, WorkThatIsDoneAgainHasATimeOfItsOwn) {
  testing::internal::CaptureStderr();
  {
    ProgressMeter meter(ProgressStyle::plain, false, "try", 1000000);
    const auto start = ProgressMeter::Clock::now();
    meter.update(1000, 1000, start + 20s);
    meter.update(0, 1000, start + 10min);
    meter.update(250, 1000, start + 12min);
    meter.begin(start + 20min);
    meter.update(500, 1000, start + 21min);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "try   0 %  0.0 MB/s  ? left\ntry  25 %  2.1 MB/s  6:00 left\ntry  50 %  8.3 MB/s  1:00 left\n");
}

TEST(Progress, QuietOrNoneSaysNothing) {
  testing::internal::CaptureStderr();
  const auto later = ProgressMeter::Clock::now() + 1h;
  ProgressMeter(ProgressStyle::none, false, "encode", 1).update(1, 2, later);
  ProgressMeter(ProgressStyle::plain, true, "encode", 1).update(1, 2, later);
  ProgressMeter(ProgressStyle::bar, true, "encode", 1).update(1, 2, later);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Progress, OfAListCountsVolumesBytesRateAndTheTimeThatIsLeft) {
  ListMeter meter(ProgressStyle::none, false, 12);
  EXPECT_EQ(meter.text(10), "0 of 12 volumes, 0 B, 0.0 MB/s, ? left");
  meter.begin_volume("a.nrrd");
  meter.update(50'000'000, 100'000'000);
  EXPECT_EQ(meter.text(10), "0 of 12 volumes, 50.0 MB, 5.0 MB/s, 3:50 left; 50 % of a.nrrd");
  // What has no place is left out from the left.
  meter.begin_volume("scans/\xC3\xA9t\xC3\xA9/knee.nrrd");
  meter.update(50'000'000, 100'000'000);
  const std::string counted = "0 of 12 volumes, 50.0 MB, 5.0 MB/s, 3:50 left";
  EXPECT_EQ(meter.text(10, counted.size() + 30), counted + "; 50 % of scans/\xC3\xA9t\xC3\xA9/knee.nrrd");
  EXPECT_EQ(meter.text(10, counted.size() + 29), counted + "; 50 % of scans/\xC3\xA9t\xC3\xA9/knee.nrrd");
  EXPECT_EQ(meter.text(10, counted.size() + 28), counted + "; 50 % of ...s/\xC3\xA9t\xC3\xA9/knee.nrrd");
  EXPECT_EQ(meter.text(10, counted.size() + 24), counted + "; 50 % of ...\xC3\xA9/knee.nrrd");
  EXPECT_EQ(meter.text(10, counted.size() + 18), counted + "; 50 % of ....nrrd");
  EXPECT_EQ(meter.text(10, counted.size() + 17), counted);
  EXPECT_EQ(meter.text(10, 3), counted);
  meter.end_volume(100'000'000);
  EXPECT_EQ(meter.text(20), "1 of 12 volumes, 100 MB, 5.0 MB/s, 3:40 left");
  // What was skipped says nothing about the rate.
  for (int i = 0; i < 10; ++i) meter.end_volume(0);
  EXPECT_EQ(meter.text(20), "11 of 12 volumes, 100 MB, 5.0 MB/s, 0:20 left");
  meter.begin_volume("b.nrrd");
  EXPECT_EQ(meter.text(25), "11 of 12 volumes, 100 MB, 4.0 MB/s, 0:25 left; b.nrrd");
  meter.end_volume(100'000'000);
  EXPECT_EQ(meter.text(40), "12 of 12 volumes, 200 MB, 5.0 MB/s, 0:00 left");
}

TEST(Progress, OfAListThatIsBeingMadeCountsWhatIsFound) {
  ListMeter meter(ProgressStyle::none, false, std::nullopt);
  meter.begin_volume(".");
  EXPECT_EQ(meter.text(10), "0 volumes found; .");
  meter.end_volume(0);
  EXPECT_EQ(meter.text(10), "1 volume found");
  meter.begin_volume("scans/2019/knees");
  EXPECT_EQ(meter.text(10, 26), "1 volume found; ...9/knees");
}

TEST(Progress, OfAListIsShownEvenWhileNothingIsCounted) {
  testing::internal::CaptureStderr();
  {
    ListMeter meter(ProgressStyle::plain, false, 3, 20ms);
    meter.begin_volume("a.nrrd");
    std::this_thread::sleep_for(300ms);
  }
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_GE(std::count(text.begin(), text.end(), '\n'), 3) << text;
  EXPECT_TRUE(text.starts_with("0 of 3 volumes, 0 B, 0.0 MB/s, ? left; a.nrrd\n")) << text;
}

TEST(Progress, LinesAppearAboveWhatIsShown) {
  testing::internal::CaptureStderr();
  show_status("half");
  say_line("a warning");
  show_status("");
  say_line("another one");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "\r\033[Khalf\r\033[Ka warning\nhalf\r\033[Kanother one\n");
}

// Text from files, names and lists is shown without the terminal acting on it.

class PrintableOutput : public CommandLine {
 protected:
  static void expect_harmless(const Ending& ending) {
    for (const std::string& text : {ending.out, ending.err})
      for (const char c : text) EXPECT_TRUE(c == '\n' || (c >= 32 && c < 127)) << static_cast<int>(c) << text;
  }
  const std::string name_ = "a\x1b[31m\xff\x9b\n.nrrd", tag_ = "a\x1b[31m\xff\x9b\n.tag";
};

TEST_F(PrintableOutput, NamesOfFilesAreNotObeyed) {
  phantom(name_);
  const std::vector<Arguments> commands = {{"encode", name_, "-v"},
                                           {"encode", name_},
                                           {"encode", name_ + "x"},
                                           {"decode", tag_, "-o", "x.nrrd", "-v"},
                                           {"decode", tag_},
                                           {"verify", tag_, "--against", name_},
                                           {"info", tag_},
                                           {"info", name_},
                                           {"mesh", tag_, "-v", "-o", "x.vtu"},
                                           {"encode", "x", name_},
                                           {"encode", "--" + name_},
                                           {name_}};
  for (const Arguments& command : commands) expect_harmless(tagrid(command));
  EXPECT_TRUE(has(tagrid({"info", name_}).err, "a\\x1b[31m\\xff\\x9b\\n.nrrd"));
  const Ending bar = tagrid({"encode", name_, "-f", "--progress=bar"});
  EXPECT_FALSE(has(bar.err, "\x1b[31m"));
}

TEST_F(PrintableOutput, AListAndItsVolumesAreNotObeyed) {
  const std::string name = "a\x1b[31m\xff.nrrd";
  phantom(name);
  file("list", name + "\n");
  expect_harmless(tagrid({"convert", "--manifest", "list", "--output-dir", "out", "-v"}));
  expect_harmless(tagrid({"convert", "--manifest", "list", "--output-dir", "out"}));
  const Ending bar = tagrid({"convert", "--manifest", "list", "--output-dir", "out", "-f", "--progress=bar"});
  EXPECT_FALSE(has(bar.err, "\x1b[31m"));
  std::istringstream lines(content("out/results.jsonl"));
  for (std::string line; std::getline(lines, line);) EXPECT_TRUE(nlohmann::json::accept(line)) << line;
}

TEST_F(PrintableOutput, JsonIsNotObeyedAndHasTheSameValues) {
  // A control character of C1, DEL, and characters that turn the direction of writing.
  const std::string text =
                        "a\xC2\x9b"
                        "31m\x7f\xE2\x80\xAE\xE2\x81\xA6\xD8\x9C\xC3\xA9",
                    name = text + ".nrrd";
  phantom(name);
  file("x.nrrd",
       "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nowner:=" + text + "\n\n12345678");
  const auto is_harmless = [](const std::string& json) {
    return json.find_first_of("\x7f\x9b\xE2\xD8") == json.npos &&
           has(json, "\\u009b31m\\u007f\\u202e\\u2066\\u061c\xC3\xA9");
  };
  works("encode x.nrrd");
  const std::string info = tagrid({"info", "x.tag", "--json"}).out;
  EXPECT_TRUE(is_harmless(info)) << info;
  EXPECT_EQ(nlohmann::json::parse(info)["source"]["pairs"]["owner"], text);
  expect_ok(tagrid({"encode", name, "--json", "x.json"}));
  EXPECT_TRUE(is_harmless(content("x.json")));
  EXPECT_EQ(json_of("x.json")["input"], name);
  file("list", name + "\n");
  works("convert --manifest list --output-dir out");
  EXPECT_TRUE(is_harmless(content("out/results.jsonl")));
  EXPECT_TRUE(
      nlohmann::json::parse(content("out/results.jsonl"))["input"].get<std::string>().ends_with("/" + name));
}

TEST_F(PrintableOutput, HeadersAreNotObeyed) {
  const std::string space = "\x1b[31m\xff\x9b", head =
                                                    "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\n"
                                                    "encoding: raw\nspacings: 1 1 1\n";
  file("a.nrrd", head + "space: " + space + "\nunits: \"" + space + "\" \"b\" \"c\"\n\n12345678");
  expect_harmless(tagrid({"encode", "a.nrrd", "-v"}));
  const Ending text = tagrid({"info", "a.tag"});
  expect_harmless(text);
  EXPECT_TRUE(has(text.out, "\\x1b[31m\\xff\\x9b"));
  EXPECT_EQ(info("a.tag")["geometry"]["space"], "\x1b[31m\xEF\xBF\xBD\xEF\xBF\xBD");
  file("b.nrrd", head + "kinds: " + space + " domain domain\n\n12345678");
  expect_harmless(tagrid({"encode", "b.nrrd"}));
  file("c.nrrd", head + "data file: " + space + "\n\n");
  expect_harmless(tagrid({"encode", "c.nrrd"}));
}

}  // namespace
}  // namespace tagrid
