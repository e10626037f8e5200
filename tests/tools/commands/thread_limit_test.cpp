// A thread that the system refuses costs time, and nothing else: the run goes on with fewer.

#include "tests/support/command_line.h"

namespace tagrid {
namespace {

struct CommandRun {
  std::string name;
  std::vector<std::string> arguments;
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
    std::string words;
    for (const std::string& word : GetParam().arguments) words += " '" + word + "'";
    return script(before + " $TAGRID" + words + " -T" + threads);
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
        CommandRun{"Encode",
                   {"encode", "-q", "volume.nrrd", "-fo", "new.tag", "--cube", "8", "--brick", "1"},
                   "new.tag"},
        CommandRun{"EncodeMesh",
                   {"encode", "-q", "volume.nrrd", "-fo", "new.tag", "--mesh-error", "50", "--cube", "8"},
                   "new.tag"},
        CommandRun{"EncodeByNoise",
                   {"encode", "-q", "volume.nrrd", "-fo", "new.tag", "--max-error", "noise:1"},
                   "new.tag"},
        CommandRun{"EncodeSlices", {"encode", "-q", "slices", "-fo", "new.tag"}, "new.tag"},
        CommandRun{"Decode", {"decode", "-q", "volume.tag", "-fo", "new.raw"}, "new.raw"},
        CommandRun{"DecodeRegion",
                   {"decode", "-q", "volume.tag", "--region", "3:40,2:30,4:20", "-fo", "new.raw"},
                   "new.raw"},
        CommandRun{"Verify", {"verify", "-q", "volume.tag"}, ""},
        CommandRun{"VerifyAgainst", {"verify", "-q", "volume.tag", "--against", "volume.nrrd"}, ""},
        CommandRun{"Restore", {"restore", "-q", "volume.tag", "-fo", "."}, "volume.nrrd"},
        CommandRun{
            "Mesh", {"mesh", "-q", "volume.tag", "--region", "0:17,0:17,0:17", "-fo", "new.vtu"}, "new.vtu"},
        CommandRun{
            "CoarsestMesh",
            {"mesh", "-q", "volume.tag", "--region", "0:17,0:17,0:17", "-fo", "new.vtu", "--coarsen", "200"},
            "new.vtu"},
        CommandRun{"Surface", {"surface", "-q", "volume.tag", "--iso", "300", "-fo", "new.stl"}, "new.stl"},
        CommandRun{"Preview", {"preview", "-q", "volume.tag", "-fo", "new.png"}, "new.png"},
        CommandRun{"Estimate", {"estimate", "volume.nrrd", "--errors", "9"}, ""},
        CommandRun{
            "Convert",
            {"convert", "-q", "--manifest", "list", "--output-dir", "converted", "-f", "--max-error", "9"},
            "converted/volume.tag"},
        CommandRun{"Phantom", {"phantom", "-q", "--dims", "52,40,36", "-fo", "new.raw"}, "new.raw"}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace tagrid
