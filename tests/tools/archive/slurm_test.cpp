// tools/slurm: runs the batch scripts with stand-ins for Slurm's programs on PATH, which report how they were
// called.
#include <filesystem>

#include "tests/support/conversions.h"

namespace tagrid {
namespace {

class Slurm : public Conversions<CommandLine> {
 protected:
  static void expect_done(const Ending& ending) {
    EXPECT_EQ(ending.code, 0) << ending.err;
    EXPECT_TRUE(has(ending.err, "volumes: ")) << "a log says what was done: " << ending.err;
  }
  Slurm() {
    std::filesystem::create_directory(path("bin"));
    program("scontrol", "echo \"$*\" >> requeued");
    const std::string launcher =
        "while [[ $1 != *tagrid-mpi ]]; do printf '%s\\n' \"$1\" >> launched; shift; done; exec \"$@\"";
    program("srun", launcher);
    program("mpirun", launcher);
  }
  void program(const std::string& name, const std::string& body) const {
    file("bin/" + name, "#!/bin/bash\n" + body + "\n");
    std::filesystem::permissions(path("bin/" + name), std::filesystem::perms::owner_all);
  }
  static std::string body(const std::string& name) {
    return " bash '" TAGRID_SOURCE_DIR "/tools/slurm/" + name + "' ";
  }
  static constexpr const char* with_bin_ = "export PATH=\"$PWD/bin:$PATH\" SLURM_JOB_ID=17; ";

  /// A task of an array 0-2.
  static std::string task(int i) {
    return "SLURM_ARRAY_TASK_ID=" + std::to_string(i) +
           " SLURM_ARRAY_TASK_MIN=0 SLURM_ARRAY_TASK_MAX=2 SLURM_ARRAY_TASK_COUNT=3 "
           "TAGRID=${PROGRAM:-$TAGRID}" +
           body("convert_array.sbatch") + "list.tsv out ";
  }
  Ending batch(const std::string& text) const { return script(with_bin_ + text); }
  /// Runs it, and sends it a signal when a file `started` appears: USR1 as Slurm does when the time is nearly over, TERM
  /// as scancel does.
  Ending interrupted(const std::string& text, const std::string& signal = "USR1") const {
    return batch(text + " & job=$!; while [ ! -e started ]; do sleep 0.02; done; kill -" + signal +
                 " $job; wait $job");
  }
};

TEST_F(Slurm, ScriptsAreWellFormed) {
  const std::string all = "'" TAGRID_SOURCE_DIR "'/tools/slurm/*.sbatch";
  expect_ok(script("for f in " + all + "; do bash -n \"$f\" || exit; done"));
  if (script("command -v shellcheck").code != 0) GTEST_SKIP() << "shellcheck is not installed";
  const Ending ending = script("shellcheck " + all);
  EXPECT_EQ(ending.code, 0) << ending.out;
}

TEST_F(Slurm, TasksOfAnArrayTogetherDoTheWholeList) {
  volumes(5);
  expect_ok(convert({"--max-error", "3"}));
  expect_ok(script("mv out whole"));
  for (int i = 0; i < 3; ++i) expect_done(batch(task(i) + "--max-error 3"));
  for (const std::string name : {"a.tag", "b.tag", "c.tag", "d.tag", "e.tag"})
    EXPECT_TRUE(content("out/" + name) == content("whole/" + name)) << name;
  EXPECT_EQ(statuses(9, "out/results-0-of-3.jsonl"), "a ok, d ok");
  EXPECT_EQ(statuses(9, "out/results-2-of-3.jsonl"), "c ok");
  EXPECT_FALSE(exists("requeued"));
  for (const std::string name : {"a.nrrd", "e.nrrd"}) EXPECT_TRUE(exists(name));
  // Once more: nothing is left to do.
  expect_done(batch(task(0) + "--max-error 3"));
  EXPECT_EQ(statuses(2, "out/results-0-of-3.jsonl"), "a skipped, d skipped");
}

TEST_F(Slurm, SomeTasksOfAnArrayNeedTheNumberOfShards) {
  volumes(5);
  const std::string some =
      "SLURM_ARRAY_TASK_ID=1 SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_MAX=2 "
      "SLURM_ARRAY_TASK_COUNT=2 TAGRID=$TAGRID" +
      body("convert_array.sbatch") + "list.tsv out";
  const Ending refused = batch(some);
  EXPECT_EQ(refused.code, usage);
  EXPECT_TRUE(has(refused.err, "TAGRID_SHARDS"));
  EXPECT_FALSE(exists("out"));
  expect_done(batch("TAGRID_SHARDS=3 " + some));
  EXPECT_EQ(statuses(9, "out/results-1-of-3.jsonl"), "b ok, e ok");
  EXPECT_EQ(batch(body("convert_array.sbatch") + "list.tsv").code, usage);
}

TEST_F(Slurm, ATaskThatIsInterruptedIsQueuedAgainAndGoesOn) {
  volumes(3);
  // The first one runs until it is ended.
  program("slow",
          "echo $TMPDIR > tmpdir; [ -e started ] && exec \"$TAGRID\" \"$@\"; touch started; exec sleep 300");
  const Ending ending = interrupted("export PROGRAM=slow TAGRID SLURM_TMPDIR=/scratch; " + task(1));
  EXPECT_EQ(ending.code, 75) << ending.err;
  EXPECT_EQ(content("requeued"), "requeue 17\n");
  EXPECT_EQ(content("tmpdir"), "/scratch\n");
  EXPECT_LT(ending.seconds, 300);
  expect_done(batch(task(1)));
  EXPECT_EQ(statuses(9, "out/results-1-of-3.jsonl"), "b ok");
}

TEST_F(Slurm, ATaskThatIsCancelledEndsAndIsNotQueuedAgain) {
  volumes(3);
  program("slow", "[ -e started ] && exec \"$TAGRID\" \"$@\"; touch started; exec sleep 300");
  const Ending ending = interrupted("export PROGRAM=slow TAGRID; " + task(1), "TERM");
  EXPECT_EQ(ending.code, 128 + SIGTERM) << ending.err;
  EXPECT_TRUE(has(ending.out, "cancelled")) << ending.out;
  EXPECT_LT(ending.seconds, 300);
  // Also if the time is nearly over when it is cancelled.
  std::filesystem::remove(path("started"));
  program("slow", "trap '' TERM; touch started; read -t 2 < <(sleep 3); trap - TERM; kill $$");
  EXPECT_EQ(interrupted("export PROGRAM=slow TAGRID; " + task(1), "USR1 $job; sleep 0.5; kill -TERM").code,
            128 + SIGTERM);
  EXPECT_FALSE(exists("requeued"));
}

TEST_F(Slurm, ATaskThatFailsOrSucceedsIsNotQueuedAgain) {
  volumes(3);
  file("b.nrrd", "broken");
  EXPECT_EQ(batch(task(1)).code, broken_input);
  expect_done(batch(task(0)));
  // It ends well although it was told to stop.
  program("quick", "trap 'exit 0' TERM; touch started; while :; do sleep 0.02; done");
  EXPECT_EQ(interrupted("export PROGRAM=quick; " + task(0)).code, 0);
  EXPECT_FALSE(exists("requeued"));
}

TEST_F(Slurm, ALargeVolumeIsEncodedByManyProcessesAndCanGoOn) {
  program("tagrid-mpi",
          "[ $1 != --version ] || exec echo 1; echo \"$*\" > arguments; echo $TMPDIR > tmpdir; exit $CODE");
  const std::string run = "SLURM_TMPDIR=/scratch SLURM_CPUS_PER_TASK=8 SLURM_NTASKS=3" +
                          body("encode_large.sbatch") + "'my volume.nhdr' big.tag --max-error 5";
  for (const int code : {0, 64, 65, 74, 139})
    EXPECT_EQ(batch("export CODE=" + std::to_string(code) + "; " + run).code, code);
  EXPECT_FALSE(exists("requeued"));
  EXPECT_EQ(content("arguments"),
            "encode my volume.nhdr -o big.tag --resume --progress plain --spool /scratch --max-error 5\n");
  EXPECT_EQ(content("tmpdir"), "/scratch\n");
  EXPECT_EQ(content("launched").substr(0, 18), "--cpus-per-task=8\n");
  std::filesystem::remove(path("launched"));
  // Interrupted, but not by Slurm.
  EXPECT_EQ(batch("export CODE=75 TAGRID_LAUNCHER=mpirun; " + run).code, 75);
  EXPECT_FALSE(exists("requeued"));
  EXPECT_EQ(content("launched"), "-n\n3\n--map-by\nslot:PE=8\n");
  EXPECT_EQ(batch("export CODE=0 TAGRID_LAUNCHER=sh; " + run).code, usage);
  // Without scratch space on the node, there is no --spool.
  expect_ok(batch("export CODE=0;" + body("encode_large.sbatch") + "a b"));
  EXPECT_EQ(content("arguments"), "encode a -o b --resume --progress plain\n");
}

TEST_F(Slurm, TheLauncherIsTheFirstWhoseProcessesWorkTogether) {
  // By mpirun, one process says the version for all. Slurm's processes know each other by PMIx, if at all.
  program("tagrid-mpi", "[ $1 != --version ] || exec echo 1; echo \"$*\" > arguments");
  const std::string skip = "while [[ $1 != *tagrid-mpi ]]; do shift; done; ";
  const std::string run =
      "SLURM_CPUS_PER_TASK=8 SLURM_NTASKS=3" + body("encode_large.sbatch") + "a.nhdr a.tag";
  const auto launcher = [&] {
    const Ending ending = batch(run);
    expect_ok(ending);
    return ending.out;
  };
  const std::string is = "encode_large.sbatch: the launcher is ";
  EXPECT_EQ(launcher(), is + "srun --cpus-per-task=8\n");
  program("srun", "twice=$2; " + skip + "[ $twice = --mpi=pmix ] || \"$@\"; exec \"$@\"");
  EXPECT_EQ(launcher(), is + "srun --cpus-per-task=8 --mpi=pmix\n");
  program("srun", "echo 'no PMI' >&2; exit 1");
  EXPECT_EQ(launcher(), is + "mpirun -n 3 --map-by slot:PE=8\n");
  std::filesystem::remove(path("arguments"));
  program("mpirun", skip + "\"$@\"; \"$@\"; \"$@\"");
  const Ending ending = batch(run);
  EXPECT_EQ(ending.code, world);
  EXPECT_TRUE(has(ending.err, "neither srun nor mpirun starts processes of tagrid-mpi that work together"));
  EXPECT_FALSE(exists("arguments"));
}

TEST_F(Slurm, AnInterruptedEncodingOfALargeVolumeIsQueuedAgain) {
  const std::string run = "TAGRID_LAUNCHER=srun" + body("encode_large.sbatch") + "a.nhdr a.tag";
  program("tagrid-mpi", "trap 'exit 75' TERM; touch started; while :; do sleep 0.02; done");
  EXPECT_EQ(interrupted(run).code, 75);
  EXPECT_EQ(content("requeued"), "requeue 17\n");
  // A launcher that is ended by the signal.
  std::filesystem::remove(path("started"));
  program("srun", "touch started; exec sleep 300");
  EXPECT_EQ(interrupted(run).code, 75);
  EXPECT_EQ(content("requeued"), "requeue 17\nrequeue 17\n");
  // Killed for another reason, such as too much memory.
  program("srun", "kill -KILL $$");
  EXPECT_EQ(batch(run).code, 128 + SIGKILL);
  EXPECT_EQ(content("requeued"), "requeue 17\nrequeue 17\n");
}

TEST_F(Slurm, ACancelledEncodingOfALargeVolumeIsNotQueuedAgain) {
  const std::string run = "TAGRID_LAUNCHER=srun" + body("encode_large.sbatch") + "a.nhdr a.tag";
  program("tagrid-mpi", "trap 'exit 75' TERM; touch started; while :; do sleep 0.02; done");
  const Ending ending = interrupted(run, "TERM");
  EXPECT_EQ(ending.code, 75);
  EXPECT_TRUE(has(ending.out, "cancelled")) << ending.out;
  std::filesystem::remove(path("started"));
  program("srun", "touch started; exec sleep 300");
  EXPECT_EQ(interrupted(run, "TERM").code, 128 + SIGTERM);
  EXPECT_FALSE(exists("requeued"));
}

}  // namespace
}  // namespace tagrid
