// tools/slurm: runs the batch scripts with stand-ins for Slurm's programs on PATH, which report how they were
// called.
#include <set>

#include "tests/support/conversions.h"
#include "tests/support/mpi_runs.h"

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
  converted(5, {"--max-error", "3"});
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
  const Ending outside_of_slurm = batch(body("convert_array.sbatch") + "list.tsv out");
  EXPECT_EQ(outside_of_slurm.code, usage);
  EXPECT_TRUE(has(outside_of_slurm.err, "sbatch --array")) << outside_of_slurm.err;
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

TEST_F(Slurm, AnInterruptedEncodingOfALargeVolumeIsQueuedAgainAndACancelledOneIsNot) {
  const std::string run = "TAGRID_LAUNCHER=srun" + body("encode_large.sbatch") + "a.nhdr a.tag";
  program("tagrid-mpi", "trap 'exit 75' TERM; touch started; while :; do sleep 0.02; done");
  EXPECT_EQ(interrupted(run).code, 75);
  EXPECT_EQ(content("requeued"), "requeue 17\n");
  std::filesystem::remove(path("started"));
  const Ending cancelled = interrupted(run, "TERM");
  EXPECT_EQ(cancelled.code, 75);
  EXPECT_TRUE(has(cancelled.out, "cancelled")) << cancelled.out;
  EXPECT_EQ(content("requeued"), "requeue 17\n");
  // A launcher that is ended by the signal.
  program("srun", "touch started; exec sleep 300");
  std::filesystem::remove(path("started"));
  EXPECT_EQ(interrupted(run, "TERM").code, 128 + SIGTERM);
  std::filesystem::remove(path("started"));
  EXPECT_EQ(interrupted(run).code, 75);
  EXPECT_EQ(content("requeued"), "requeue 17\nrequeue 17\n");
  // Killed for another reason, such as too much memory.
  program("srun", "kill -KILL $$");
  EXPECT_EQ(batch(run).code, 128 + SIGKILL);
  EXPECT_EQ(content("requeued"), "requeue 17\nrequeue 17\n");
}

// convert with many processes: the same files and records as with one, and nothing is lost if one of them
// fails.

class MpiConvert : public Conversions<MpiRuns> {
 protected:
  using Records = std::multiset<std::string>;

  Ending convert_by(int processes, const Arguments& more = {}, const Arguments& of_mpirun = {}) const {
    return by(processes, with(command_, more), of_mpirun);
  }
  /// Without the parts that depend on the time.
  Records timeless(const std::string& name = "out/results.jsonl") const {
    Records texts;
    for (Json record : records(name)) {
      record.erase("seconds");
      record.erase("finished");
      texts.insert(record.dump());
    }
    return texts;
  }
  std::map<std::string, std::string> tags() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path("out")))
      if (const std::string name = entry.path().lexically_relative(path("out")).string();
          entry.is_regular_file() && entry.path().extension() != ".jsonl")
        files[name] = content("out/" + name);
    return files;
  }
};

TEST_F(MpiConvert, AnyNumberOfProcessesMakesTheSameFilesAndRecords) {
  volumes(6);
  file("c.nrrd", content("c.nrrd").substr(0, 4000));
  expect_ok(script("mkdir -p x/y && mv d.nrrd x && mv e.nrrd x/y"));
  file("list.tsv", "a.nrrd\nb.nrrd\toutput=x/first/b\nc.nrrd\nx/d.nrrd\nx/y/e.nrrd\nf.nrrd\nnone.nrrd\n");
  const Arguments options = words("--max-error=3 --keep-folders --json=sums.json -f");
  EXPECT_EQ(convert(options).code, broken_input);
  const auto files = tags();
  const Records expected = timeless();
  ASSERT_EQ(files.size(), 5U);
  EXPECT_TRUE(files.contains("x/first/b.tag") && files.contains("x/y/e.tag"));
  ASSERT_EQ(expected.size(), 7U);
  const Json sums = json_of("sums.json");
  for (const auto& [processes, of_mpirun] : {std::pair(1, Arguments()),
                                             {2, Arguments()},
                                             {3, Arguments()},
                                             {3, Arguments{"--mca", "btl", "tcp,self"}}}) {
    SCOPED_TRACE(processes);
    std::filesystem::remove_all(path("out"));
    const Ending ending = convert_by(processes, with(options, {"-T1"}), of_mpirun);
    EXPECT_EQ(ending.code, broken_input) << ending.err;
    EXPECT_TRUE(tags() == files);
    EXPECT_EQ(timeless(), expected);
    // One line per failure, in any order, and one for all.
    EXPECT_EQ(std::count(ending.err.begin(), ending.err.end(), '\n'), 3) << ending.err;
    EXPECT_TRUE(has(ending.err, "tagrid: 2 of 7 volumes failed; see out/results.jsonl\n"));
    for (const char* key : {"files", "ok", "failed", "bytes_in", "bytes_out"})
      EXPECT_EQ(json_of("sums.json")[key], sums[key]) << key;
  }
}

TEST_F(MpiConvert, ShardsAndSkippingAndRemovalAreThoseOfOneProcess) {
  converted(5);
  const auto files = tags();
  std::filesystem::remove_all(path("out"));
  expect_ok(convert_by(2, {"--shard=1/2"}));
  EXPECT_EQ(outputs(), (std::vector<std::string>{"b.tag", "d.tag"}));
  EXPECT_EQ(timeless("out/results-1-of-2.jsonl").size(), 2U);
  expect_ok(convert_by(3, {"--skip-done", "--shard=0/1"}));
  EXPECT_TRUE(tags() == files);
  std::map<std::string, std::string> status;
  for (const Json& record : records("out/results-0-of-1.jsonl")) status[record["output"]] = record["status"];
  EXPECT_EQ(
      status,
      (std::map<std::string, std::string>{
          {"a.tag", "ok"}, {"b.tag", "skipped"}, {"c.tag", "ok"}, {"d.tag", "skipped"}, {"e.tag", "ok"}}));
  expect_ok(convert_by(3, {"--remove-verified"}));
  EXPECT_EQ(statuses(), "a removed, b removed, c removed, d removed, e removed");
  EXPECT_FALSE(exists("a.nrrd") || exists("b.nrrd") || exists("c.nrrd") || exists("d.nrrd") ||
               exists("e.nrrd"));
}

TEST_F(MpiConvert, WhatCannotBeIsRefusedOnceBeforeAnythingIsDone) {
  volumes(2);
  file("list.tsv", "a.nrrd\nb.nrrd\nelsewhere/b.nhdr\n");
  expect_error(convert_by(3), usage, "list.tsv: line 3: b.tag would also be the output of line 2");
  file("list.tsv", "a.nrrd\nb.nrrd\tmax-eror=5\n");
  expect_error(convert_by(3), usage, "list.tsv: line 2: unknown option --max-eror");
  EXPECT_FALSE(exists("out"));
  // More processes than volumes, and no volume at all.
  file("list.tsv", "a.nrrd\n");
  expect_ok(convert_by(3));
  EXPECT_EQ(statuses(), "a ok");
  expect_ok(convert_by(2, {"--shard=1/2"}));
  file("list.tsv", "");
  const Ending nothing = convert_by(2);
  EXPECT_EQ(nothing.code, 0);
  EXPECT_TRUE(has(nothing.err, "list.tsv: contains no volumes; nothing is left to do")) << nothing.err;
}

TEST_F(MpiConvert, ARankThatIsKilledEndsTheJobAndLosesNothing) {
  converted(5);
  const auto whole = tags();
  int killed = 0;
  for (const int victim : {0, 1, 2})
    for (const int at : {12, 45, 80}) {
      SCOPED_TRACE(std::to_string(victim) + " at " + std::to_string(at));
      std::filesystem::remove_all(path("out"));
      expect_ok(convert({"--shard=4/5"}));
      expect_ok(script("mv out/results-4-of-5.jsonl out/results.jsonl"));
      const std::string before = content("out/results.jsonl");
      const Ending ending =
          with_fault(3, std::to_string(at), "SIGKILL", with(command_, {"--skip-done"}), victim);
      killed += ending.code != 0;
      EXPECT_FALSE(has(ending.err, "tagrid: "));
      EXPECT_EQ(content("out/results.jsonl").rfind(before, 0), 0U);
      for (const Json& record : records()) {
        EXPECT_TRUE(exists("out/" + record["output"].get<std::string>())) << record;
      }
      for (const std::string& name : outputs()) {
        EXPECT_TRUE(name.starts_with(".") || content("out/" + name) == whole.at(name)) << name;
      }
      const Ending next = convert_by(2, {"--skip-done"});
      EXPECT_EQ(next.code, 0) << next.err;
      std::set<std::string> good;
      for (const Json& record : records())
        if (record["status"] == "ok") good.insert(record["output"].get<std::string>());
      EXPECT_EQ(good.size(), 5U);
      for (const auto& [name, bytes] : whole) EXPECT_TRUE(content("out/" + name) == bytes) << name;
      if (HasFailure()) return;
    }
  EXPECT_GT(killed, 0);
}

TEST_F(MpiConvert, ARankWhoseDiskFailsFailsItsVolumeAndTheOthersAreDone) {
  volumes(5);
  // From the call that creates the temporary file of the first volume; the first rank writes records.
  Ending good;
  const std::vector<Call> calls = calls_of({"", with(command_, {})}, good);
  std::size_t at = 0;
  while (calls[at].path.find(".a.tag.part") == std::string::npos) ++at;
  std::filesystem::remove_all(path("out"));
  const Ending ending = with_fault(3, std::to_string(at), std::to_string(EIO), command_, 1, true);
  EXPECT_EQ(records().size(), 5U);
  for (const Json& record : records()) {
    EXPECT_TRUE(record["status"] == "ok" || record["code"] == world) << record;
    EXPECT_EQ(record["status"] == "ok", exists("out/" + record["output"].get<std::string>()));
  }
  const bool any = statuses().find("failed") != std::string::npos;
  EXPECT_EQ(ending.code, any ? broken_input : 0) << ending.err;
}

TEST_F(MpiConvert, ResultsThatCannotBeWrittenEndTheJob) {
  volumes(6);
  std::filesystem::create_directory(path("out"));
  const std::string record = R"({"output":"x","finished":0,"status":"kept","error":")";
  const std::string before = record + std::string((std::size_t{1} << 24) - record.size() - 3, '-') + "\"}\n";
  file("out/results.jsonl", before);
  // The first rank writes them, and may not write files of more than 16 MiB.
  Arguments command = mpirun(3);
  command.insert(command.end() - 1,
                 {"bash", "-c", "[ $OMPI_COMM_WORLD_RANK != 0 ] || ulimit -f 16384; exec \"$0\" \"$@\""});
  const Ending ending = Process(with(command, command_), folder_.string()).finish();
  expect_one_error(ending, world, "out/results.jsonl: cannot write");
  EXPECT_TRUE(content("out/results.jsonl") == before);
}

}  // namespace
}  // namespace tagrid
