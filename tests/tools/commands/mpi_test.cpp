// tagrid-mpi: the same files with any number of processes, and an end of the whole job if one of them fails.
#include "tests/support/mpi_runs.h"

namespace tagrid {
namespace {

class Mpi : public MpiRuns {};

TEST_F(Mpi, AnyNumberOfProcessesWritesTheSameFile) {
  make_volume("50,41,45");
  for (const int processes : {1, 2, 3, 4, 7})
    for (const char* threads : {"-T1", "-T3"}) {
      SCOPED_TRACE(std::to_string(processes) + threads);
      const Ending ending = by(processes, with({"encode", "volume.nhdr", "-fo", "new.tag", threads},
                                               {"--cube=8", "--brick=1", "--max-error=2"}));
      expect_result(ending);
      expect_names({"new.tag", "volume.nhdr", "volume.raw"});
      if (HasFailure()) return;
    }
}

TEST_F(Mpi, AnyNumberOfProcessesWritesTheSameParity) {
  make_volume("50,41,45");
  const Arguments encode = {"encode", "volume.nhdr", "--cube=8", "--brick=1", "--parity=5%", "-fo"};
  expect_ok(tagrid(with(encode, {"a.tag"})));
  for (const int processes : {1, 2, 3}) {
    expect_ok(by(processes, with(encode, {"b.tag"})));
    EXPECT_TRUE(content("b.tag") == content("a.tag")) << processes;
  }
  expect_ok(tagrid({"verify", "b.tag", "-q"}));
}

// One process sums and encodes what many have read, each with its rows, also after one was killed.
TEST_F(Mpi, AnyNumberOfProcessesWritesTheSameOverviews) {
  for (const char* type : {"int16", "float32"}) {
    SCOPED_TRACE(type);
    phantom("volume.nhdr", {"--dims", "50,41,45", "--type", type});
    const Arguments encode = {"encode",        "volume.nhdr",      "--cube=8", "--brick=1",
                              "--max-error=2", "--overviews=4,16", "-fo"};
    expect_ok(tagrid(with(encode, {"a.tag", "-T1"})));
    for (const int processes : {1, 2, 3, 7})
      for (const Arguments& more : {Arguments{"-T2"}, {"-T1", "--resume"}}) {
        expect_ok(by(processes, with(with(encode, {"b.tag"}), more)));
        EXPECT_TRUE(content("b.tag") == content("a.tag")) << processes << more.back();
      }
    std::filesystem::remove(path("b.tag"));
    with_fault(3, "30", "SIGKILL", with(encode, {"b.tag", "--resume"}));
    expect_ok(by(2, with(encode, {"b.tag", "--resume"})));
    EXPECT_TRUE(content("b.tag") == content("a.tag"));
    expect_ok(by(3, {"verify", "b.tag", "--against", "volume.nhdr", "-q"}));
    for (const std::string& name : names()) std::filesystem::remove_all(path(name));
  }
}

TEST_F(Mpi, AlsoOverTcp) {
  make_volume("23,19,21");
  expect_result(
      by(4, with({"encode", "volume.nhdr", "-o", "new.tag"}, settings_), {"--mca", "btl", "tcp,self"}));
  expect_ok(by(3, {"decode", "new.tag", "-o", "back.raw", "-q"}, {"--mca", "btl", "tcp,self"}));
}

TEST_F(Mpi, DecodesAsOneProcess) {
  make_volume("50,41,45");
  expect_ok(tagrid(with({"encode", "volume.nhdr", "-o", "new.tag"}, settings_)));
  for (const char* name : {"x.nrrd", "x.nhdr", "x.raw"}) {
    expect_ok(tagrid({"decode", "new.tag", "-fo", name}));
    const std::string expected = content(name), samples = content("x.raw");
    for (const int processes : {2, 3, 7}) {
      const Ending ending = by(processes, {"decode", "new.tag", "-fo", name});
      EXPECT_EQ(ending.code, 0) << ending.err;
      EXPECT_TRUE(content(name) == expected) << name << " by " << processes;
      EXPECT_TRUE(content("x.raw") == samples) << name << " by " << processes;
    }
  }
}

TEST_F(Mpi, WritesValuesAsOneProcess) {
  make_volume("50,41,45");
  const std::string header = content("volume.nhdr");
  file("scaled.nhdr", header + "rescale_slope:=1\nrescale_intercept:=-100\n");
  expect_ok(tagrid(with({"encode", "scaled.nhdr", "-o", "new.tag"}, settings_)));
  for (const char* name : {"x.nrrd", "x.mha", "x.nii", "x.tif"})
    for (const Arguments& more : {Arguments{}, {"--values"}, {"--samples"}}) {
      const Ending alone = tagrid(with({"decode", "new.tag", "-fo", name}, more));
      EXPECT_EQ(alone.code, 0) << alone.err;
      const std::string expected = content(name);
      const Ending ending = by(3, with({"decode", "new.tag", "-fo", name}, more));
      EXPECT_EQ(ending.code, 0) << ending.err;
      EXPECT_TRUE(content(name) == expected) << name;
    }
}

TEST_F(Mpi, OtherCommandsAreDoneByOneProcess) {
  make_volume("23,19,21");
  expect_ok(tagrid(with({"encode", "volume.nhdr", "-o", "new.tag"}, settings_)));
  const Ending info = by(3, {"info", "new.tag", "--json"});
  EXPECT_EQ(info.code, 0) << info.err;
  EXPECT_EQ(nlohmann::json::parse(info.out)["bytes"]["file"], plain_.size());
  EXPECT_EQ(by(3, {"mesh", "new.tag", "-o", "mesh.vtu", "-q"}).code, 0);
  const Ending help = by(2, {"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.out.find("Usage"), help.out.rfind("Usage"));
}

TEST_F(Mpi, AFailureEndsTheJobWithItsCodeAndOneMessageAndLeavesNothing) {
  make_volume("23,19,21");
  expect_one_error(by(3, {"encode", "volume.nhdr", "-o", "new.tag", "--nonsense"}), usage, "unknown option");
  expect_one_error(by(3, {"encode", "nothing.nhdr", "-o", "new.tag"}), world, "nothing.nhdr");
  expect_one_error(by(3, {"encode", "volume.nhdr", "-o", "no/new.tag"}), world, "no/");
  expect_names({"volume.nhdr", "volume.raw"});
  // A damaged file; the rank that decodes that part finds the damage.
  expect_ok(tagrid(with({"encode", "volume.nhdr", "-o", "new.tag"}, settings_)));
  std::string bytes = content("new.tag");
  bytes[bytes.size() / 2] ^= 1;
  file("new.tag", bytes);
  expect_one_error(by(3, {"decode", "new.tag", "-o", "back.nrrd"}), broken_input, "brick");
  expect_names({"new.tag", "volume.nhdr", "volume.raw"});
}

class MpiFaults : public MpiRuns {
 protected:
  Arguments without_resume() const { return with({"encode", "volume.nhdr", "-o", "new.tag"}, settings_); }
};

TEST_F(MpiFaults, ARankWhoseDiskFailsEndsTheJob) {
  make_volume("50,41,45");
  int failures = 0;
  for (const int at : {6, 20, 33, 60}) {
    SCOPED_TRACE(at);
    const Ending ending = with_fault(3, std::to_string(at), std::to_string(EIO), without_resume());
    if (ending.code == 0) {  // the other ranks were faster
      expect_result(ending);
      begin_anew();
      continue;
    }
    EXPECT_EQ(ending.code, world) << ending.err;
    EXPECT_TRUE(has(ending.err, "rank 1: "));
    expect_names({"volume.nhdr", "volume.raw"});
    ++failures;
  }
  EXPECT_GT(failures, 0);
}

TEST_F(MpiFaults, ARankThatIsKilledEndsTheJobAndTheNextOneGoesOn) {
  make_volume("50,41,45");
  for (const int victim : {0, 1, 3})
    for (const int at : {8, 30, 70}) {
      SCOPED_TRACE(std::to_string(victim) + " at " + std::to_string(at));
      Ending ending = with_fault(4, std::to_string(at), "SIGKILL", command(), victim);
      if (ending.code != 0) {
        expect_no_half_file();
        expect_result(by(2, command()));
      }
      begin_anew();
      // Without --resume it leaves nothing but what SIGKILL leaves.
      ending = with_fault(4, std::to_string(at), "SIGKILL", without_resume(), victim);
      if (ending.code != 0 && victim != 0) {
        EXPECT_FALSE(std::filesystem::exists(path("new.tag")));
      }
      expect_no_half_file();
      begin_anew();
      if (HasFailure()) return;
    }
}

TEST_F(Mpi, GoesOnAfterSignalsAtAnyMoment) {
  make_volume("64,60,56");
  const unsigned long count = number_in_environment("TAGRID_KILLS", stride > 1 ? 1 : 3),
                      seed = number_in_environment("TAGRID_SEED", std::random_device()());
  std::mt19937_64 random(seed);
  const Ending good = by(4, command());
  expect_result(good);
  std::uniform_real_distribution<double> moment(0, good.seconds);
  for (unsigned long i = 0; i < count && !HasFailure(); ++i)
    for (const int signal : {SIGKILL, SIGTERM, SIGINT}) {
      SCOPED_TRACE("TAGRID_SEED=" + std::to_string(seed));
      begin_anew();
      Process process(with(mpirun(4), command()), folder_.string());
      usleep(static_cast<useconds_t>(moment(random) * 1e6));
      process.send(signal);
      const Ending ending = process.finish();
      EXPECT_NE(ending.code == 0, ending.signal != 0 || ending.code > 0);
      wait_for_all_processes();
      expect_no_half_file();
      if (!std::filesystem::exists(path("new.tag")) || std::filesystem::exists(path(".new.tag.parts/run")))
        expect_result(by(3, command()));
    }
}

TEST_F(Mpi, WhatManyBeganOneProcessCompletes) {
  make_volume("50,41,45");
  make_record();
  expect_result(by(3, command()));
  begin_anew();
  make_record();
  expect_error(tagrid(command({"--max-error=3"})), usage, "--max-error was 2, now 3");
  EXPECT_EQ(by(2, command({"--max-error=3"})).code, usage);
  expect_result(tagrid(command()));
}

}  // namespace
}  // namespace tagrid
