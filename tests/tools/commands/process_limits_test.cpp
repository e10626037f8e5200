// Limits of processes and threads.
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

// Limits that a shell or a batch system sets: exit code 74, the file, the reason, and nothing left behind.

struct Output {
  const char *words, *name;
};

class ProcessLimits : public CommandLine {
 protected:
  static constexpr Output outputs[] = {
      {"encode volume.nrrd", "new.tag"},          {"decode volume.tag", "new.nrrd"},
      {"decode volume.tag", "new.raw"},           {"mesh volume.tag", "new.vtu"},
      {"surface volume.tag --iso 40", "new.vtp"}, {"surface volume.tag --iso 40", "new.stl"},
      {"preview volume.tag", "new.png"}};
};

// The signal SIGXFSZ would end the process.
TEST_F(ProcessLimits, AFileThatMayNotGrowIsAnErrorAndTheAdviceHelps) {
  make_tag();
  const std::vector<std::string> before = names();
  for (const auto& [words, name] : outputs) {
    SCOPED_TRACE(name);
    const std::string command = std::string("$TAGRID ") + words + " -q -o " + name;
    for (const char* kibibytes : {"0", "1", "8"}) {
      const Ending ending = script("ulimit -S -f " + std::string(kibibytes) + "; " + command);
      expect_error(ending, world, "File too large; raise the limit on the size of files (ulimit -f)");
      EXPECT_TRUE(ending.err.find(name) != ending.err.npos ||
                  ending.err.find("a temporary file in") != ending.err.npos)
          << ending.err;
      EXPECT_EQ(names(), before);
    }
    expect_ok(script("ulimit -S -f 0; ulimit -S -f unlimited; " + command));
    std::filesystem::remove(path(name));
  }
}

TEST_F(ProcessLimits, TooFewOpenFilesAreAnErrorAndTheAdviceHelps) {
  make_tag();
  std::filesystem::create_directory(path("slices"));
  for (int z = 100; z < 136; ++z) file("slices/" + std::to_string(z) + ".raw", std::string(52 * 40 * 2, 'x'));
  std::vector<Output> all(std::begin(outputs), std::end(outputs));
  all.push_back({"encode slices --dims 52,40,36 --type int16", "new.tag"});
  const std::vector<std::string> before = names();
  for (const auto& [words, name] : all) {
    SCOPED_TRACE(std::string(words) + " " + name);
    const std::string command = std::string("$TAGRID ") + words + " -q -o " + name;
    int failed = 0;
    // The first ones are those of this test, and one that the loader needs.
    constexpr int loader_failed = 127;
    for (int files = 4; files < 40; ++files) {
      const Ending ending = script("ulimit -S -n " + std::to_string(files) + "; exec " + command);
      if (ending.code == 0) break;
      if (ending.code == loader_failed) continue;
      ++failed;
      expect_error(ending, world, "Too many open files; raise the limit on open files (ulimit -n)");
      EXPECT_EQ(names(), before);
    }
    EXPECT_GT(failed, 0);
    EXPECT_LT(failed, 16) << "not even with many";
    std::filesystem::remove(path(name));
  }
}

// Root has no limit on processes.
TEST_F(ProcessLimits, TooManyProcessesAreAnErrorAndTheAdviceHelps) {
  make_tag();
  const std::string as_other =
      geteuid() == 0 ? "setpriv --reuid=54321 --regid=54321 --clear-groups --no-new-privs " : "";
  if (geteuid() == 0 &&
      script("chmod 777 . && " + as_other + "test -x $TAGRID && " + as_other + "test -w \"$PWD\"").code != 0)
    GTEST_SKIP() << "there is no setpriv, or another user cannot run the program or write where it runs";
  const std::vector<std::string> before = names();
  const auto decode = [&](const std::string& limit) {
    return script(as_other + "bash -c 'ulimit -S -u " + limit +
                  "; exec \"$0\" decode volume.tag -T1 -qo new.h5' $TAGRID");
  };
  expect_error(decode("1"), world,
               "tagrid-write-hdf5: cannot start a process for it, as there are too many; raise");
  EXPECT_EQ(names(), before);
  expect_ok(decode("unlimited"));
}

TEST_F(ProcessLimits, AFileSystemThatIsReadOnlyIsAnErrorThatSaysSo) {
  make_tag();
  if (script("unshare -m bash -c 'mkdir ro && mount --bind ro ro && mount -o remount,bind,ro ro'").code != 0)
    GTEST_SKIP() << "this user cannot mount";
  for (const auto& [words, name] : outputs) {
    SCOPED_TRACE(name);
    expect_error(script("unshare -m bash -c 'mount --bind ro ro && mount -o remount,bind,ro ro && exec $0 " +
                        std::string(words) + " -q -o ro/" + name + "' $TAGRID"),
                 world, "Read-only file system; choose another directory");
  }
  EXPECT_EQ(script("ls -A ro").out, "");
}

// A thread that the system refuses costs time, and nothing else: the run goes on with fewer.

struct CommandRun {
  std::string name;
  std::string words;
  std::string output;  ///< the file that it writes; "": none
  friend void PrintTo(const CommandRun& run, std::ostream* out) { *out << run.name; }
};

class FewThreads : public CommandLine, public testing::WithParamInterface<CommandRun> {
 protected:
  FewThreads() {
    make_tag({"--cube", "8", "--brick", "1", "--max-error", "9", "--range", "auto"});
    std::filesystem::create_directory(path("slices"));
    file("list", "volume.nrrd\n");
    for (int z = 0; z < 9; ++z)
      phantom("slices/" + std::to_string(z) + ".tif", {"--dims", "52,40,1", "--type", "uint8"});
  }
  std::string written() const { return GetParam().output.empty() ? "" : content(GetParam().output); }
  /// Runs the command after `before`, a part of a script.
  Ending run_after(const std::string& before, const char* threads = "4") const {
    return script(before + " $TAGRID " + GetParam().words + " -T" + threads);
  }
};

TEST_P(FewThreads, GiveTheSame) {
  const Ending good = run_after("");
  expect_ok(good);
  const std::string expected = written();
  const std::vector<std::string> all = names();
  for (const auto& [first, threads] :
       {std::pair("1", "1"), {"1", "4"}, {"2", "4"}, {"3", "4"}, {"4", "4"}, {"5", "4"}, {"6", "4"}}) {
    SCOPED_TRACE(first);
    const Ending ending = run_after("LD_PRELOAD=" TAGRID_FAULT_INJECTION
                                    " ASAN_OPTIONS=verify_asan_link_order=0 TAGRID_FAULT_THREAD=" +
                                        std::string(first),
                                    threads);
    expect_ok(ending);
    // An estimate says how long it takes.
    if (GetParam().name != "Estimate") {
      EXPECT_EQ(ending.out, good.out);
    }
    EXPECT_TRUE(written() == expected);
    EXPECT_EQ(names(), all);
  }
}

// Batch systems limit the address space. The stacks of threads take much of it.
TEST_P(FewThreads, OrLittleAddressSpaceAreNoBug) {
  if (program_is_sanitized()) GTEST_SKIP() << "a sanitizer takes an address space of its own";
  int ended_well = 0, failed = 0;
  expect_ok(run_after(""));
  for (int mebibytes = 20; mebibytes <= 200; mebibytes += 18) {
    const std::string limit = "ulimit -v " + std::to_string(mebibytes << 10) + "; ";
    if (script(limit + "$TAGRID --version").code != 0) continue;  // it cannot even be loaded
    SCOPED_TRACE(mebibytes);
    const std::vector<std::string> before = names();
    const Ending ending = run_after(limit);
    if (ending.code == 0) {
      ++ended_well;
      continue;
    }
    ++failed;
    // A volume of a list that failed is 65, whatever the reason.
    EXPECT_TRUE(ending.code == world || (GetParam().name == "Convert" && ending.code == broken_input))
        << ending.err;
    EXPECT_NE(ending.err, "");
    EXPECT_EQ(names(), before);
  }
  EXPECT_GT(ended_well, 0);
  std::cout << ended_well << " runs ended well, " << failed << " with a message\n";
}

INSTANTIATE_TEST_SUITE_P(
    Command, FewThreads,
    testing::Values(
        CommandRun{"Encode", "encode -q volume.nrrd -fo new.tag --cube 8 --brick 1", "new.tag"},
        CommandRun{"EncodeMesh", "encode -q volume.nrrd -fo new.tag --mesh-error 50 --cube 8", "new.tag"},
        CommandRun{"EncodeByNoise", "encode -q volume.nrrd -fo new.tag --max-error noise:1", "new.tag"},
        CommandRun{"EncodeSlices", "encode -q slices -fo new.tag", "new.tag"},
        CommandRun{"Decode", "decode -q volume.tag -fo new.raw", "new.raw"},
        CommandRun{"DecodeRegion", "decode -q volume.tag --region 3:40,2:30,4:20 -fo new.raw", "new.raw"},
        CommandRun{"Verify", "verify -q volume.tag", ""},
        CommandRun{"VerifyAgainst", "verify -q volume.tag --against volume.nrrd", ""},
        CommandRun{"Restore", "restore -q volume.tag -fo .", "volume.nrrd"},
        CommandRun{"Mesh", "mesh -q volume.tag --region 0:17,0:17,0:17 -fo new.vtu", "new.vtu"},
        CommandRun{"CoarsestMesh", "mesh -q volume.tag --region 0:17,0:17,0:17 -fo new.vtu --coarsen 200",
                   "new.vtu"},
        CommandRun{"Surface", "surface -q volume.tag --iso 300 -fo new.stl", "new.stl"},
        CommandRun{"Preview", "preview -q volume.tag -fo new.png", "new.png"},
        CommandRun{"Estimate", "estimate volume.nrrd --errors 9 -q", ""},
        CommandRun{"Convert", "convert -q --manifest list --output-dir converted -f --max-error 9",
                   "converted/volume.tag"},
        CommandRun{"Phantom", "phantom -q --dims 52,40,36 -fo new.raw", "new.raw"}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace tagrid
