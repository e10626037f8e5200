// encode --resume: the leftovers of an interruption are enough to continue, and nothing else is continued.
// TAGRID_KILLS sets how many random moments are tried for each signal, and TAGRID_SEED selects them.
#include <sys/file.h>

#include "tests/support/resumed_runs.h"

namespace tagrid {
namespace {

class Resume : public ResumedRuns {};

TEST_F(Resume, ARunThatIsNotInterruptedLeavesNothingButTheSameFile) {
  make_volume("23,19,21");
  const Ending ending = tagrid(command());
  EXPECT_EQ(ending.err, "");
  expect_result(ending);
  // As after a kill between the end of the run and that of the process.
  const Ending again = tagrid(command());
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(
      again.err,
      "tagrid: new.tag: already exists, and is what this run would write; it was compared with the input\n");
  expect_result(Ending{.code = 0});
  expect_result(tagrid(command({"-f"})));
}

TEST_F(Resume, GoesOnAfterASignalBeforeAnyCallOnAFile) {
  make_volume("23,19,21");
  const std::vector<Call> calls = calls_of_command();
  std::map<std::string, std::size_t> seen;
  std::size_t kills = 0;
  for (std::size_t i = 0; i < calls.size() && !HasFailure(); ++i) {
    // Only some of long rows of the same call: parts are alike.
    const std::string name = std::filesystem::path(calls[i].path).filename().string();
    const bool part =
        name.find_first_of("0123456789") != name.npos && calls[i].path.find(".parts/") != name.npos;
    const std::size_t number = ++seen[calls[i].name + " " + (part ? "part" : name)];
    if ((number > 2 && number % 16 != 0) || i % stride != 0) continue;
    for (const auto& [signal, kind] :
         {std::pair{SIGKILL, "SIGKILL"}, {SIGTERM, "SIGTERM"}, {SIGINT, "SIGINT"}}) {
      if (signal == SIGINT && kills % 8 != 0) continue;
      SCOPED_TRACE(std::string(kind) + " before call " + std::to_string(i + 1) + ", " + calls[i].name + " " +
                   calls[i].path);
      const Ending ending = ended_at(i + 1, kind);
      const bool early = ending.signal == signal && calls[i].path.find("new.tag") == std::string::npos;
      // There is nothing to continue from yet, or no longer.
      const bool complete = std::filesystem::exists(path("new.tag")) && parts().empty();
      const bool gone =
          ending.signal == signal && (complete || !std::filesystem::exists(path(".new.tag.parts")));
      if (signal == SIGKILL) {
        EXPECT_EQ(ending.signal, SIGKILL) << ending.err;
      } else {
        EXPECT_TRUE(ending.code == resumable || early || gone) << ending.code << " " << ending.err;
      }
      expect_no_half_file();
      // A completed run has no record, but perhaps still has its directory.
      const bool was_done =
          std::filesystem::exists(path("new.tag")) && !std::filesystem::exists(path(".new.tag.parts/run"));
      if (!was_done) expect_result(tagrid(command(kills % 2 ? Arguments{"-T1"} : Arguments{})));
      begin_anew();
      ++kills;
    }
  }
  std::cout << kills << " signals before " << calls.size() << " calls\n";
  EXPECT_GT(kills, 20U);
}

TEST_F(Resume, GoesOnAfterSignalsAtAnyMoment) {
  make_volume("64,60,56");
  const Ending good = tagrid(command());
  expect_result(good);
  const unsigned long count = number_in_environment("TAGRID_KILLS", stride > 1 ? 1 : 4),
                      seed = number_in_environment("TAGRID_SEED", std::random_device()());
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> moment(0, good.seconds);
  for (unsigned long i = 0; i < count && !HasFailure(); ++i)
    for (const int signal : {SIGKILL, SIGTERM, SIGINT}) {
      SCOPED_TRACE("TAGRID_SEED=" + std::to_string(seed));
      begin_anew();
      // Killed several times in a row.
      for (int times = 0; times < 3; ++times) {
        Process process(with({program_under_test()}, command()), folder_.string());
        usleep(static_cast<useconds_t>(moment(random) * 1e6));
        process.send(signal);
        const Ending ending = process.finish();
        EXPECT_TRUE(ending.signal == signal || ending.code == 0 ||
                    (ending.code == resumable && signal != SIGKILL))
            << ending.code << " " << ending.err;
        expect_no_half_file();
        if (ending.code == 0 || std::filesystem::exists(path("new.tag"))) break;
      }
      if (!std::filesystem::exists(path("new.tag")) || std::filesystem::exists(path(".new.tag.parts/run")))
        expect_result(tagrid(command()));
    }
}

// Ended between the naming of the file and the end of the record: other settings are still refused.
TEST_F(Resume, ARecordOfAFileThatHasItsNameIsStillThatOfItsSettings) {
  make_volume("23,19,21");
  const std::vector<Call> calls = calls_of_command();
  std::size_t naming = 0;
  while (naming < calls.size() &&
         !(calls[naming].name.starts_with("rename") && calls[naming].path == path("new.tag")))
    ++naming;
  ASSERT_LT(naming + 1, calls.size());
  for (std::size_t i = naming + 1; i < calls.size(); ++i) {
    SCOPED_TRACE(calls[i].name + " " + calls[i].path);
    begin_anew();
    EXPECT_EQ(ended_at(i + 1, "SIGKILL").signal, SIGKILL);
    ASSERT_TRUE(std::filesystem::exists(path("new.tag")));
    if (!std::filesystem::exists(path(".new.tag.parts/run"))) break;
    expect_error(tagrid(command({"--max-error=3"})), usage, "--max-error was 2, now 3");
    expect_result(tagrid(command()));
  }
}

// Another program may give the file its name while the run looks at its input.
TEST_F(Resume, AFileThatAppearsIsComparedAndNotTakenForTheResult) {
  make_volume("23,19,21");
  const std::vector<Call> calls = calls_of_command();
  std::size_t at = 0;
  while (calls.at(at).path != path(".new.tag.parts")) ++at;
  const auto around = [&](const std::string& meanwhile) {
    begin_anew();
    std::string words;
    for (const std::string& word : command()) words += " " + word;
    return script("LD_PRELOAD=" TAGRID_FAULT_INJECTION
                  " ASAN_OPTIONS=verify_asan_link_order=0 TAGRID_FAULT_FOLDER=$PWD TAGRID_FAULT_KIND=SIGSTOP "
                  "TAGRID_FAULT_AT=" +
                  std::to_string(at + 1) + " $TAGRID" + words +
                  " & first=$!\n"
                  "until grep -q '^State:.T' /proc/$first/status; do sleep 0.01; done\n" +
                  meanwhile + "; kill -CONT $first; wait $first");
  };
  expect_error(around("$TAGRID encode volume.nhdr -o new.tag --max-error 9 -q"), usage,
               "new.tag: already exists, and is not what this run would write");
  EXPECT_FALSE(content("new.tag") == plain_);
  std::string same;
  for (const std::string& setting : settings_) same += " " + setting;
  expect_result(around("$TAGRID encode volume.nhdr -o new.tag -q" + same));
}

// A directory with the name of the directory of parts that is not one stays as it is.
TEST_F(Resume, FoldersThatAreNoRecordAreLeftAlone) {
  make_volume("23,19,21");
  const auto expect_untouched = [&](const std::string& kept, std::string_view why) {
    expect_error(tagrid(command()), usage, why);
    EXPECT_EQ(content(kept), "precious") << why;
    EXPECT_FALSE(std::filesystem::exists(path("new.tag")));
    begin_anew();
  };
  expect_ok(script("mkdir other && ln -s other .new.tag.parts && printf precious > other/a"));
  expect_untouched("other/a", "is not a directory");
  file(".new.tag.parts", "precious");
  expect_untouched(".new.tag.parts", "is not a directory");
  expect_ok(script("mkdir .new.tag.parts && printf precious > .new.tag.parts/000001.dcm"));
  expect_untouched(".new.tag.parts/000001.dcm", "contains 000001.dcm");
  // If the file lies beside a record, it stays, and so does the directory.
  make_record();
  for (const std::string name : {"notes", ".somenotes", "00001", "1.part"})
    file(".new.tag.parts/" + name, "precious");
  EXPECT_EQ(tagrid(command()).code, 0);
  EXPECT_TRUE(content("new.tag") == plain_);
  for (const std::string name : {"notes", ".somenotes", "00001", "1.part"})
    EXPECT_EQ(content(".new.tag.parts/" + name), "precious");
  EXPECT_FALSE(std::filesystem::exists(path(".new.tag.parts/run")));
}

// The report of a run that was killed before its output had a name does not block the next run.
TEST_F(Resume, AReportThatIsThereAlreadyIsReplaced) {
  make_volume("23,19,21");
  const Arguments report = {"--json", "report.json"};
  const std::vector<Call> calls = calls_of_command(report);
  for (std::size_t i = 0; i < calls.size(); ++i) {
    if (calls[i].path != path("report.json") || !calls[i].name.starts_with("rename")) continue;
    begin_anew();
    EXPECT_EQ(ended_at(i + 2, "SIGKILL", report).signal, SIGKILL);
    EXPECT_TRUE(std::filesystem::exists(path("report.json")));
    EXPECT_FALSE(std::filesystem::exists(path("new.tag")));
    EXPECT_EQ(tagrid(command(report)).code, 0);
    EXPECT_TRUE(content("new.tag") == plain_);
    return;
  }
  ADD_FAILURE() << "no report was named";
}

TEST_F(Resume, PartsThatAreCompleteAreNotMadeAgain) {
  make_volume("23,19,21");
  make_record();
  std::map<std::string, ino_t> before;
  for (const std::string& part : parts())
    before[part] = status_of(".new.tag.parts/" + part.substr(part.rfind('/') + 1)).st_ino;
  // Until just before the end.
  Ending ending;
  const std::vector<Call> calls = calls_of({"", command()}, ending);
  expect_result(ending);
  for (const auto& [part, inode] : before)
    EXPECT_FALSE(std::ranges::any_of(
        calls, [&, p = part](const Call& c) { return c.name == "rename" && c.path == p; }))
        << part << " was made again";
}

TEST_F(Resume, DamagedPartsAreMadeAgain) {
  make_volume("23,19,21");
  make_record();
  const std::vector<std::string> complete = parts();
  const auto name = [&](std::size_t i) {
    return ".new.tag.parts/" + complete[i].substr(complete[i].rfind('/') + 1);
  };
  std::string bytes = content(name(0));
  bytes[bytes.size() / 3] ^= 1;
  file(name(0), bytes);
  file(name(1), content(name(1)).substr(0, 70));
  expect_result(tagrid(command()));
}

TEST_F(Resume, OtherSettingsAreRefusedAndNamedAndTheInputMayBeCalledByAnotherPath) {
  make_volume("23,19,21");
  make_record();
  expect_error(tagrid(command({"--accuracy=30"})), usage, "--accuracy was 20, now 30");
  expect_error(tagrid(command({"--grid-only"})), usage, "--grid-only was not given, now given");
  Arguments elsewhere = command({"-T1"});
  elsewhere[1] = path("volume.nhdr");
  expect_result(tagrid(elsewhere));
}

TEST_F(Resume, AnotherInputIsRefused) {
  make_volume("23,19,21");
  make_record();
  const std::string raw = content("volume.raw");
  std::string other = raw;
  other[other.size() / 2] ^= 1;
  timespec times[2] = {{0, UTIME_OMIT}, status_of("volume.raw").st_mtim};
  file("volume.raw", other);
  expect_error(tagrid(command()), usage, "volume.raw has changed since: modified 20");
  // Even if the change is hidden by setting the time back.
  ASSERT_EQ(utimensat(AT_FDCWD, path("volume.raw").c_str(), times, 0), 0);
  expect_error(tagrid(command()), usage, "volume.raw has changed since: its content differs");
  file("volume.raw", raw);
  ASSERT_EQ(utimensat(AT_FDCWD, path("volume.raw").c_str(), times, 0), 0);
  expect_error(tagrid(command()), usage, "volume.raw has changed since: written to");
  std::filesystem::remove_all(path(".new.tag.parts"));
  expect_result(tagrid(command()));
}

TEST_F(Resume, AFullDiskLeavesTheRecord) {
  make_volume("23,19,21");
  const std::vector<Call> calls = calls_of_command();
  std::size_t tried = 0;
  for (std::size_t i = 0; i < calls.size() && !HasFailure(); ++i) {
    if (!calls[i].needs_space() || i % std::max<std::size_t>(stride, 23) != 0) continue;
    SCOPED_TRACE("call " + std::to_string(i + 1) + ", " + calls[i].name + " " + calls[i].path);
    const Ending failed = run({"", command()}, std::to_string(i + 1), std::to_string(ENOSPC), true);
    if (failed.code != 0) expect_error(failed, world, "No space left");
    expect_no_half_file();
    if (failed.code != 0) expect_result(tagrid(command()));
    begin_anew();
    ++tried;
  }
  EXPECT_GT(tried, 3U);
}

TEST_F(Resume, TwoRunsAtOnceAndADamagedRecordAreRefused) {
  make_volume("23,19,21");
  make_record();
  const int lock = open(path(".new.tag.parts/lock").c_str(), O_RDWR);
  ASSERT_EQ(flock(lock, LOCK_EX | LOCK_NB), 0);
  expect_error(tagrid(command()), held, "another process is working on this run");
  close(lock);
  const std::string record = content(".new.tag.parts/run");
  std::string damaged = record;
  damaged[20] ^= 1;
  file(".new.tag.parts/run", damaged);
  expect_error(tagrid(command()), usage, "remove .new.tag.parts to start again");
  file(".new.tag.parts/run", record);
  expect_result(tagrid(command()));
}

TEST_F(Resume, AReportInTheFolderOfThePartsIsRefusedBeforeAnyWork) {
  make_volume("23,19,21");
  const auto expect_clash = [&](const std::string& report) {
    const std::vector<std::string> before = names();
    expect_error(tagrid(command({"--json", report})), usage,
                 "--json " + report +
                     ": .new.tag.parts is the directory for the parts of the run; choose a file outside it");
    EXPECT_EQ(names(), before);
  };
  for (const std::string report :
       {".new.tag.parts", "./.new.tag.parts", ".new.tag.parts/report.json", ".new.tag.parts/a/../b/c.json"})
    expect_clash(report);
  make_record();
  const std::size_t done = parts().size();
  for (const std::string report : {".new.tag.parts", ".new.tag.parts/report.json", ".new.tag.parts/run"})
    expect_clash(report);
  EXPECT_EQ(parts().size(), done);
  expect_ok(tagrid(command({"--json", ".new.tag.parts.json"})));
}

TEST_F(Resume, NeedsAFileOnBothSides) {
  make_volume("23,19,21");
  expect_error(tagrid({"encode", "-", "-o", "new.tag", "--resume"}, "x"), usage, "--resume: the input");
  fails("encode volume.nhdr -o - --resume", usage, "--resume: the output");
  fails("encode nothing.nhdr -o new.tag --resume", world, "nothing.nhdr");
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nhdr", "volume.raw"}));
}

TEST_F(Resume, AnInterruptionSaysHowToGoOn) {
  make_volume("23,19,21");
  const Ending ending = ended_at(calls_of_command().size() / 2, "SIGTERM");
  expect_error(ending, resumable, "interrupted; the same command continues");
  expect_result(tagrid(command()));
}

TEST_F(Resume, AlsoRemovesTheInputAndWritesAReport) {
  make_volume("23,19,21");
  make_record();
  expect_ok(tagrid(command({"--rm", "--json=new.json"})));
  EXPECT_EQ(names(), (std::vector<std::string>{"new.json", "new.tag"}));
  EXPECT_EQ(json_of("new.json")["bytes_out"], plain_.size());
}

TEST_F(Resume, TakesCompressedVolumesAndRangesOfData) {
  phantom("volume.nhdr", {"--dims", "23,19,21", "--type", "float32"});
  expect_ok(
      script("gzip < volume.raw > packed.gz; sed 's/encoding: raw/encoding: gzip/; s/volume.raw/packed.gz/' "
             "volume.nhdr > "
             "packed.nhdr; grep -q gzip packed.nhdr"));
  for (const char* name : {"volume.nhdr", "packed.nhdr"}) {
    expect_ok(tagrid(with({"encode", name, "-fo", "plain.tag"}, settings_)));
    for (const Arguments& more : {Arguments{}, Arguments{"--spool", "."}}) {
      expect_ok(tagrid(with(with({"encode", name, "-fo", "new.tag", "--resume"}, settings_), more)));
      EXPECT_TRUE(content("new.tag") == content("plain.tag")) << name;
    }
  }
}

}  // namespace
}  // namespace tagrid
