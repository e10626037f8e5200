// convert with many processes: the same files and records as with one, and nothing is lost if one of them
// fails.
#include <set>

#include "tests/support/conversions.h"
#include "tests/support/mpi_runs.h"

namespace tagrid {
namespace {

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
    for (const std::string& name : outputs()) files[name] = content("out/" + name);
    return files;
  }
};

TEST_F(MpiConvert, AnyNumberOfProcessesMakesTheSameFilesAndRecords) {
  volumes(6);
  file("c.nrrd", content("c.nrrd").substr(0, 4000));
  file("list.tsv", content("list.tsv") + "none.nrrd\n");
  const Ending alone = convert({"--max-error=3", "--json=sums.json"});
  EXPECT_EQ(alone.code, broken_input);
  const auto files = tags();
  const Records expected = timeless();
  ASSERT_EQ(files.size(), 5U);
  ASSERT_EQ(expected.size(), 7U);
  const Json sums = json_of("sums.json");
  for (const auto& [processes, of_mpirun] : {std::pair(1, Arguments()),
                                             {2, Arguments()},
                                             {3, Arguments()},
                                             {3, Arguments{"--mca", "btl", "tcp,self"}}}) {
    SCOPED_TRACE(processes);
    std::filesystem::remove_all(path("out"));
    const Ending ending =
        convert_by(processes, {"--max-error=3", "-T1", "-f", "--json=sums.json"}, of_mpirun);
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
  volumes(5);
  expect_ok(convert());
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

TEST_F(MpiConvert, FoldersAndNamesOfOutputsAreThoseOfOneProcess) {
  std::string list;
  for (const std::string folder : {"x", "x/y", "z"}) {
    std::filesystem::create_directories(path(folder));
    for (const std::string name : {"knee.nrrd", "skull.nrrd"}) {
      volume(folder + "/" + name, static_cast<int>(list.size()) + 1);
      list += folder + "/" + name + (list.empty() ? "\toutput=x/first/knee" : "") + "\n";
    }
  }
  file("list.tsv", list);
  const auto files = [&] {
    std::map<std::string, std::string> found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path("out")))
      if (entry.path().extension() == ".tag")
        found[entry.path().lexically_relative(path("out")).string()] = content(entry.path().string());
    return found;
  };
  expect_ok(convert({"--keep-folders"}));
  const auto alone = files();
  const Records expected = timeless();
  EXPECT_EQ(alone.size(), 6U);
  EXPECT_TRUE(alone.contains("x/first/knee.tag") && alone.contains("x/y/skull.tag"));
  std::filesystem::remove_all(path("out"));
  expect_ok(convert_by(3, {"--keep-folders"}));
  EXPECT_TRUE(files() == alone);
  EXPECT_EQ(timeless(), expected);
  std::filesystem::remove(path("out/x/y/skull.tag"));
  expect_ok(convert_by(2, {"--keep-folders", "--skip-done"}));
  EXPECT_TRUE(files() == alone);
  EXPECT_EQ(records().size(), 12U);
  expect_ok(convert_by(2, {"--keep-folders", "--remove-verified"}));
  EXPECT_FALSE(exists("x/knee.nrrd") || exists("z/skull.nrrd"));
}

TEST_F(MpiConvert, ARankThatIsKilledEndsTheJobAndLosesNothing) {
  volumes(5);
  expect_ok(convert());
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
