// convert: lists of volumes, records, shards, and repeated runs.

#include "io/errors/errors.h"
#include "tests/support/conversions.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

using Names = std::vector<std::string>;

class Convert : public Conversions<CommandLine> {
 protected:
  void later(const std::string& name) const {
    std::filesystem::last_write_time(path(name),
                                     std::filesystem::last_write_time(path(name)) + std::chrono::seconds(7));
  }
};

TEST_F(Convert, EveryVolumeIsWhatEncodeMakesOfIt) {
  volumes(2);
  volume("c.raw", 3, {"--type", "uint16"});
  file("d.bin", "seven b" + content("c.raw"));
  file("list.tsv",
       "a.nrrd\n"
       "# the next one is of noise\n"
       "\n"
       "b.nrrd\tmax-error=9\tsurface-error=2\t\r\n"
       "c.raw\tdims=21,18,13\ttype=uint16\tspacing=1,1,2.5\tmax-error=0\n"
       "d.bin\tdims=21,18,13\ttype=int16\tendian=big\toffset=7\tgrid-only=true\trange=-1024:3072");
  expect_ok(convert({"--max-error=3", "--cube", "8"}));
  const std::string raw = " --dims 21,18,13 --cube 8 ";
  expect_ok(
      script("$TAGRID encode a.nrrd --max-error 3 --cube 8 && "
             "$TAGRID encode b.nrrd --max-error 9 --surface-error 2 --cube 8 && "
             "$TAGRID encode c.raw --type uint16 --spacing 1,1,2.5" +
             raw +
             "&& $TAGRID encode d.bin --type int16 --endian big --offset 7 --grid-only --max-error 3 "
             "--range=-1024:3072" +
             raw));
  EXPECT_EQ(outputs(), (Names{"a.tag", "b.tag", "c.tag", "d.tag"}));
  for (const std::string name : {"a.tag", "b.tag", "c.tag", "d.tag"})
    EXPECT_TRUE(content("out/" + name) == content(name)) << name;
  EXPECT_EQ(statuses(), "a ok, b ok, c ok, d ok");
  EXPECT_EQ(records()[1]["options"], Json({{"cube", "8"}, {"max-error", "9"}, {"surface-error", "2"}}));
}

TEST_F(Convert, AnOutputOfAnotherVolumeIsNotReplaced) {
  converted(1);
  const std::string before = content("out/a.tag");
  expect_ok(script("mkdir other && $TAGRID phantom --dims 9,9,9 -qo other/a.nrrd"));
  file("list.tsv", "other/a.nrrd\n");
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  EXPECT_TRUE(content("out/a.tag") == before);
}

TEST_F(Convert, ARecordSaysWhatWasDone) {
  volume("a.nhdr", 1);
  file("list.tsv", "a.nhdr\tmax-error=5");
  expect_ok(convert());
  const Json record = last();
  EXPECT_EQ(record["input"], "../a.nhdr");
  EXPECT_EQ(record["output"], "a.tag");
  EXPECT_EQ(record["status"], "ok");
  EXPECT_TRUE(record["error"].is_null());
  EXPECT_EQ(record["code"], 0);
  EXPECT_EQ(record["dims"], Json({21, 18, 13}));
  EXPECT_EQ(record["type"], "int16");
  EXPECT_EQ(record["bytes_in"], content("a.nhdr").size() + content("a.raw").size());
  EXPECT_EQ(record["bytes_out"], content("out/a.tag").size());
  EXPECT_EQ(record["input_files"][1]["path"], "../a.raw");
  EXPECT_EQ(record["input_files"][1]["bytes"], content("a.raw").size());
  EXPECT_EQ(record["input_files"][1]["modified_ns"].get<std::int64_t>() / 1'000'000'000,
            status_of("a.raw").st_mtim.tv_sec);
  EXPECT_EQ(record["input_xxh3"], checksum(content("a.raw")));
  EXPECT_EQ(record["output_xxh3"], checksum(content("out/a.tag")));
  EXPECT_GT(record["seconds"], 0);
  EXPECT_GT(record["finished"], 1.7e9);
  EXPECT_EQ(record["achieved"], info("out/a.tag")["achieved"]);
  EXPECT_EQ(record["achieved"]["max_error"], 5);
  EXPECT_EQ(record["settings"]["max_error"], 5);
  EXPECT_EQ(record["options"], Json({{"max-error", "5"}}));
}

TEST_F(Convert, AVolumeThatFailsIsRecordedAndPassedOver) {
  volumes(6);
  file("a.nrrd", content("a.nrrd").substr(0, 4000));
  std::filesystem::remove(path("b.nrrd"));
  std::filesystem::create_directory(path("out"));
  file("out/c.tag", "precious");
  std::filesystem::remove(path("d.nrrd"));
  ASSERT_EQ(mkfifo(path("d.nrrd").c_str(), 0600), 0);
  std::filesystem::create_directory(path("out/e.tag"));
  const Ending ending = convert({"--json", "sums.json"});
  EXPECT_EQ(ending.code, broken_input);
  EXPECT_EQ(std::count(ending.err.begin(), ending.err.end(), '\n'), 6) << ending.err;
  EXPECT_TRUE(has(ending.err, "tagrid: 5 of 6 volumes failed; see out/results.jsonl\n"));
  EXPECT_EQ(statuses(), "a failed, b failed, c failed, d failed, e failed, f ok");
  const std::vector<Json> all = records();
  const std::pair<int, const char*> expected[] = {
      {65, "a.nrrd: "},
      {74, "b.nrrd: cannot open"},
      {64, "out/c.tag: already exists; give --skip-done to leave out"},
      {64, "d.nrrd: is neither a file nor a directory"},
      {64, "out/e.tag: exists and is not a regular file"}};
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    EXPECT_EQ(all[i]["code"], expected[i].first) << all[i];
    EXPECT_TRUE(has(all[i]["error"].get<std::string>(), expected[i].second)) << all[i];
    EXPECT_TRUE(has(ending.err, "tagrid: " + all[i]["error"].get<std::string>() + "\n"));
  }
  EXPECT_EQ(outputs(), (Names{"c.tag", "e.tag", "f.tag"}));
  EXPECT_EQ(content("out/c.tag"), "precious");
  const Json sums = json_of("sums.json");
  EXPECT_EQ(sums["command"], "convert");
  EXPECT_EQ(sums["files"], 6);
  EXPECT_EQ(sums["ok"], 1);
  EXPECT_EQ(sums["failed"], 5);
  EXPECT_EQ(sums["skipped"], 0);
  EXPECT_EQ(sums["bytes_in"], content("f.nrrd").size());
  EXPECT_EQ(sums["bytes_out"], content("out/f.tag").size());
  EXPECT_GT(sums["seconds"], 0);
}

TEST_F(Convert, PathsStartAtTheFolderOfTheList) {
  volumes(2);
  expect_ok(script(
      "mkdir -p x/y && mv a.nrrd x && echo ../a.nrrd > x/y/list && echo \"$PWD/b.nrrd\" >> x/y/list && "
      "$TAGRID convert --manifest x/y/list --output-dir out"));
  EXPECT_EQ(outputs(), (Names{"a.tag", "b.tag"}));
  EXPECT_EQ(records()[0]["input"], "../x/a.nrrd");
  // A list from a pipe: paths start at the current folder.
  expect_ok(script("cd x && echo a.nrrd | $TAGRID convert --manifest - --output-dir ../piped"));
  EXPECT_TRUE(exists("piped/a.tag"));
  expect_ok(script("cd x && $TAGRID convert --manifest <(echo a.nrrd) --output-dir ../substituted"));
  EXPECT_TRUE(exists("substituted/a.tag"));
  expect_ok(script(
      "cd x && echo a.nrrd > list && $TAGRID convert --manifest /dev/stdin --output-dir ../in < list"));
  EXPECT_TRUE(exists("in/a.tag"));
}

// A slice is larger than the amount that is read at a time from other volumes, 1 MiB.
TEST_F(Convert, WideOpenVdbVolumes) {
  works("phantom --dims 1400,1300,2 -qo a.vdb");
  file("list.tsv", "a.vdb\n");
  expect_ok(convert({"--range", "auto"}));
  EXPECT_EQ(statuses(), "a ok");
}

TEST_F(Convert, AColumnNamesTheGridOfAnOpenVdbFile) {
  volumes(1);
  expect_ok(script(
      "$TAGRID encode -q a.nrrd && $TAGRID decode -q a.tag -o b.vdb --vdb-grid density && cp b.vdb c.vdb"));
  file("list.tsv", "a.nrrd\nb.vdb\tvdb-grid=density\nc.vdb\tvdb-grid=heat\n");
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_EQ(statuses(), "a ok, b ok, c failed");
  EXPECT_TRUE(has(error_of_last(), "heat"));
  EXPECT_TRUE(header_and_bricks(content("out/b.tag")) == header_and_bricks(content("a.tag")));
}

TEST_F(Convert, SaysWhatWasDoneWhereSomebodyLooks) {
  volumes(3);
  file("b.nrrd", "no volume");
  EXPECT_FALSE(has(convert({"--skip-done"}).err, "volumes: "));
  const std::string text = convert({"--skip-done", "--progress", "plain"}).err;
  EXPECT_TRUE(has(text, "volumes: 3, 2 skipped, 1 failed\n"));
  expect_error(convert({"--remove-verified", "--output-dir", "elsewhere"}), world,
               "nothing has been converted to it yet");
}

TEST_F(Convert, AWarningNamesTheVolumeAsTheListDoesAndIsInItsRecord) {
  volumes(2);
  expect_ok(script("mkdir sub && mv a.nrrd sub"));
  file("list.tsv", "sub/a.nrrd\tmax-error=0.5\nb.nrrd\n");
  const std::string warning = "sub/a.nrrd: --max-error 0.5: samples are integers, so this is 0 (lossless)";
  const Ending ending = convert();
  EXPECT_EQ(ending.code, 0);
  EXPECT_EQ(ending.err, "tagrid: warning: " + warning + "\n");
  EXPECT_EQ(records()[0]["warnings"], Json({warning}));
  EXPECT_EQ(records()[1]["warnings"], Json::array());
}

TEST_F(Convert, HowABoundFollowsFromTheSamplesIsInTheRecordAndIsSaidWithV) {
  volumes(2);
  file("list.tsv", "a.nrrd\tmax-error=noise:0.5\nb.nrrd\n");
  const Ending ending = convert();
  EXPECT_EQ(ending.code, 0);
  const std::string words = "so the maximum error is set to ";
  EXPECT_FALSE(has(ending.err, words)) << ending.err;
  EXPECT_TRUE(has(records()[0]["settings"]["reason_of_max_error"].get<std::string>(), words));
  EXPECT_FALSE(records()[1]["settings"].contains("reason_of_max_error"));
  EXPECT_TRUE(has(convert({"-f", "-v"}).err, words));
}

TEST_F(Convert, OutputsThatWereOnlyComparedAreCountedApart) {
  converted(2);
  expect_ok(script("rm out/results.jsonl"));
  volume("c.nrrd", 3);
  file("list.tsv", "a.nrrd\nb.nrrd\nc.nrrd\n");
  const Ending ending = convert({"--skip-done", "--progress", "plain", "--json", "x.json"});
  EXPECT_EQ(ending.code, 0);
  EXPECT_TRUE(has(ending.err, "volumes: 3, 1 encoded, 2 already there and compared; ")) << ending.err;
  EXPECT_EQ(json_of("x.json")["ok"], 3);
  EXPECT_EQ(json_of("x.json")["compared"], 2);
  EXPECT_EQ(records()[0]["compared"], true);
  EXPECT_EQ(records()[2]["compared"], false);
}

TEST_F(Convert, TwoVolumesWithOneOutputAreRefusedBeforeAnythingIsDone) {
  volumes(3);
  file("list.tsv", "a.nrrd\nb.nrrd\nc.nrrd\nelsewhere/b.nhdr\n");
  // Neither volume belongs to this shard.
  expect_error(convert({"--shard", "0/2"}), usage,
               "list.tsv: line 4: b.tag would also be the output of line 2");
  EXPECT_FALSE(exists("out"));
}

TEST_F(Convert, WhatCannotBeIsRefusedBeforeAnythingIsDone) {
  volumes(1);
  const std::pair<const char*, const char*> lines[] = {
      {"b.nrrd\tmax-eror=5", "line 2: unknown option --max-eror; did you mean --max-error?"},
      {"b.nrrd\tmax-error=five", "line 2: --max-error: five: must be a finite number, such as 0.5"},
      {"b.nrrd\tmax-error", "line 2: max-error: must be option=value"},
      {"b.nrrd\tmax-error=", "must be option=value"},
      {"b.nrrd\t=5", "must be option=value"},
      {"b.nrrd\tmax-error=5\tcube=16\tmax-error=3", "line 2: max-error is given twice"},
      {"b.nrrd\toutput=x\toutput=x", "line 2: output is given twice"},
      {"b.nrrd\tforce=true", "unknown option --force"},
      {"b.nrrd\tdims=4,4", "--dims"},
      {"b.nrrd\tdims=4,4,4", "--dims: only for samples without a header, and --type is missing"},
      {"b.nrrd\ttype=int16", "--type: only for samples without a header, and --dims is missing"},
      {"b.nrrd\tendian=big",
       "--endian: only for samples without a header, and --dims and --type are missing"},
      {"b.nrrd\tendian=middle", "--endian"},
      {"b.nrrd\tsurface-error=5", "--surface-error needs --max-error"},
      {"b.nrrd\trange=1:2\tfield-scale=3", "have the same meaning"},
      {"x/..", "is not the name of a file or a directory"}};
  for (const auto& [line, what] : lines) {
    file("list.tsv", std::string("a.nrrd\n") + line + "\n");
    expect_error(convert(), usage, what);
  }
  volumes(1);
  for (const std::string shard : {"1", "1/1", "2/1", "-1/2", "0/0", "a/2", "0/2/3", "/2", "0/"})
    expect_error(convert({"--shard=" + shard}), usage, "--shard");
  expect_error(convert({"--max-error", "-1"}), usage, "--max-error");
  expect_error(convert({"--skip-done", "--remove-verified"}), usage, "--remove-verified");
  expect_error(convert({"--json", "list.tsv"}), usage, "list.tsv: is the input itself");
  fails("convert --manifest list.tsv", usage, "--output-dir");
  fails("convert --output-dir out", usage, "--manifest");
  fails("convert --manifest none --output-dir out", world, "none: cannot open");
  fails("convert --manifest list.tsv --output-dir none/out", world, "none/out");
  EXPECT_FALSE(exists("out"));
}

TEST_F(Convert, ShardsTogetherAreTheWholeRun) {
  volumes(7);
  file("list.tsv", "# not counted\n" + content("list.tsv"));
  expect_ok(convert());
  const Names all = outputs();
  ASSERT_EQ(all.size(), 7U);
  expect_ok(script("mv out whole"));
  for (int i = 0; i < 3; ++i) expect_ok(convert({"--shard", std::to_string(i) + "/3"}));
  EXPECT_EQ(outputs(), all);
  for (const std::string& name : all) EXPECT_TRUE(content("out/" + name) == content("whole/" + name)) << name;
  EXPECT_EQ(statuses(9, "out/results-0-of-3.jsonl"), "a ok, d ok, g ok");
  EXPECT_EQ(statuses(9, "out/results-1-of-3.jsonl"), "b ok, e ok");
  EXPECT_EQ(statuses(9, "out/results-2-of-3.jsonl"), "c ok, f ok");
  EXPECT_FALSE(exists("out/results.jsonl"));
  // More shards than volumes.
  expect_ok(convert({"--shard", "8/9"}));
  EXPECT_EQ(content("out/results-8-of-9.jsonl"), "");
  // Finished volumes stay finished, whichever shard encoded them.
  expect_ok(convert({"--skip-done", "--shard", "1/2"}));
  EXPECT_EQ(statuses(9, "out/results-1-of-2.jsonl"), "b skipped, d skipped, f skipped");
}

TEST_F(Convert, ASecondRunSaysHowToGoOn) {
  volumes(1);
  file("list.tsv",
       "\xEF\xBB\xBF"
       "a.nrrd\r\n");  // a mark of the order of bytes
  expect_ok(convert());
  const std::string before = content("out/a.tag");
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_TRUE(has(content("out/results.jsonl"),
                  "give --skip-done to leave out volumes that are done, or -f to encode them again"));
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(last()["status"], "skipped") << "the failure has not made it worse";
  expect_error(
      script("flock out/results.jsonl $TAGRID convert --manifest list.tsv --output-dir out --skip-done"),
      held, "out/results.jsonl: another run is using it; repeat the command when that run has ended");
  expect_ok(convert({"-f"}));
  EXPECT_TRUE(content("out/a.tag") == before);
}

TEST_F(Convert, SkipDonePassesOverWhatIsAsItWas) {
  converted(2, {"--skip-done"});
  EXPECT_EQ(statuses(), "a ok, b ok");
  const std::string before = content("out/a.tag");
  const auto inode = status_of("out/a.tag").st_ino;
  const auto again = [&](const std::string& what, const std::string& expected) {
    std::filesystem::remove(path("sums.json"));
    expect_ok(convert({"--skip-done", "--json=sums.json"}));
    EXPECT_EQ(statuses(2), expected) << what;
  };
  again("nothing has changed", "a skipped, b skipped");
  EXPECT_EQ(json_of("sums.json")["skipped"], 2);
  EXPECT_EQ(status_of("out/a.tag").st_ino, inode);
  later("a.nrrd");
  again("the time of an input", "a ok, b skipped");
  EXPECT_TRUE(content("out/a.tag") == before);
  file("out/b.tag", content("out/b.tag") + "x");
  again("the size of an output", "a skipped, b ok");
  std::filesystem::remove(path("out/b.tag"));
  again("no output", "a skipped, b ok");
}

// A source may be damaged after its encoding. Then the output is the only good copy.
TEST_F(Convert, AVolumeThatChangedReplacesItsOutputOnlyByForce) {
  converted(2);
  const std::string before = content("out/a.tag");
  const auto refused = [&](std::string_view why) {
    const Ending ending = convert({"--skip-done"});
    EXPECT_EQ(ending.code, broken_input) << why;
    EXPECT_EQ(statuses(2), "a failed, b skipped") << why;
    const Json record = records()[records().size() - 2];
    EXPECT_EQ(record["code"], broken_input);
    EXPECT_TRUE(has(ending.err, why));
    EXPECT_TRUE(content("out/a.tag") == before) << why;
  };
  volume("a.nrrd", 7);
  refused("a.nrrd: has changed since it was encoded (its samples differ); ");
  volume("a.nrrd", 1, {"--dims", "21,18,12"});
  refused("it is 21 x 18 x 12 int16 instead of 21 x 18 x 13 int16");
  volume("a.nrrd", 1, {"--type", "uint16"});
  refused("it is 21 x 18 x 13 uint16 instead of 21 x 18 x 13 int16");
  volume("a.nrrd", 1);
  std::string header = content("a.nrrd");
  header.insert(header.find("\n\n"), "\n# moved");
  file("a.nrrd", header);
  refused("bytes instead of");
  file("a.nrrd", header.substr(0, header.size() / 2));
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  // An output of another size may be all that is left, too.
  volume("a.nrrd", 7);
  file("out/a.tag", before + "x");
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  EXPECT_TRUE(content("out/a.tag") == before + "x");
  expect_ok(convert({"--skip-done", "-f"}));
  EXPECT_EQ(statuses(2), "a ok, b skipped");
  EXPECT_TRUE(content("out/a.tag") != before);
  volume("a.nrrd", 9);
  std::filesystem::remove(path("out/a.tag"));
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(2), "a ok, b skipped") << "nothing is lost";
}

TEST_F(Convert, OtherOptionsReplaceAnOutputOnlyByForce) {
  converted(2, {"--max-error=4"});
  const std::string before = content("out/b.tag");
  file("list.tsv", "a.nrrd\tmax-error=4.0\tcube=32\teffort=default\nb.nrrd\taccuracy=30\n");
  EXPECT_EQ(convert({"--max-error=4", "--skip-done"}).code, broken_input);
  EXPECT_EQ(statuses(2), "a skipped, b failed");
  EXPECT_TRUE(has(error_of_last(), "accuracy was not given, now 30"));
  // Also if the volume has another time.
  later("b.nrrd");
  EXPECT_EQ(convert({"--max-error=4", "--skip-done"}).code, broken_input);
  EXPECT_TRUE(content("out/b.tag") == before);
  expect_ok(convert({"--max-error=4", "--skip-done", "-f"}));
  EXPECT_EQ(statuses(2), "a skipped, b ok");
  EXPECT_TRUE(content("out/b.tag") != before);
  expect_ok(convert({"--max-error=4", "--skip-done"}));
  EXPECT_EQ(statuses(2), "a skipped, b skipped");
}

TEST_F(Convert, SkipDoneTriesAgainWhatFailed) {
  volumes(2);
  expect_ok(script("mv b.nrrd away"));
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  expect_ok(script("mv away b.nrrd"));
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(), "a ok, b failed, a skipped, b ok");
}

TEST_F(Convert, AnOutputWithoutARecordIsAdoptedIfItIsGoodAndElseKept) {
  converted(5, {"--max-error", "2"});
  std::filesystem::remove(path("out/results.jsonl"));
  const auto inode = status_of("out/a.tag").st_ino;
  expect_ok(script("cp out/a.tag out/b.tag; echo precious > out/c.tag; $TAGRID encode d.nrrd -fo out/d.tag"));
  damage("out/e.tag");
  const Names foreign = {content("out/b.tag"), content("out/c.tag"), content("out/d.tag"),
                         content("out/e.tag")};
  EXPECT_EQ(convert({"--max-error", "2", "--skip-done"}).code, broken_input);
  EXPECT_EQ(statuses(), "a ok, b failed, c failed, d failed, e failed");
  for (std::size_t i = 1; i < 5; ++i) {
    EXPECT_TRUE(has(records()[i]["error"].get<std::string>(), "already exists"));
    EXPECT_EQ(records()[i]["code"], usage);
  }
  EXPECT_EQ(status_of("out/a.tag").st_ino, inode);
  EXPECT_EQ(records()[0]["output_xxh3"], checksum(content("out/a.tag")));
  EXPECT_EQ((Names{content("out/b.tag"), content("out/c.tag"), content("out/d.tag"), content("out/e.tag")}),
            foreign);
  EXPECT_EQ(convert({"--max-error", "2", "--skip-done"}).code, broken_input);
  EXPECT_EQ(statuses(5), "a skipped, b failed, c failed, d failed, e failed");
}

TEST_F(Convert, APipeInThePlaceOfAnOutputIsRefusedAndNotWaitedFor) {
  volumes(2);
  std::filesystem::create_directories(path("out/b.tag"));
  ASSERT_EQ(mkfifo(path("out/a.tag").c_str(), 0600), 0);
  for (const std::string more : {"", "-f", "--skip-done", "--skip-done -f"}) {
    const Ending ending = script("timeout 60 $TAGRID convert --manifest list.tsv --output-dir out " + more);
    EXPECT_EQ(ending.code, broken_input) << more;
    EXPECT_TRUE(has(ending.err, "out/a.tag: exists and is not a regular file")) << more << ending.err;
    EXPECT_TRUE(has(ending.err, "out/b.tag: exists and is not a regular file")) << more << ending.err;
  }
}

TEST_F(Convert, HalfALineOfResultsIsCutOffAndWhatIsNoRecordPassedOver) {
  converted(2);
  const std::string whole = content("out/results.jsonl");
  const std::size_t first = whole.find('\n') + 1;
  file("out/results.jsonl", "no record\n{}\n[1]\n" + whole.substr(0, first) + whole.substr(first, 300));
  file("out/results-9-of-9.jsonl", whole.substr(first, 300));
  const Ending ending = convert({"--skip-done"});
  EXPECT_EQ(ending.code, 0) << ending.err;
  for (const char* line : {"1", "2", "3"})
    EXPECT_TRUE(has(ending.err, std::string("tagrid: warning: out/results.jsonl: line ") + line +
                                    " is not a record; volumes without a later record count as not done\n"));
  EXPECT_FALSE(has(ending.err, "line 4")) << "a record";
  EXPECT_FALSE(has(ending.err, "results-9")) << "what a killed run leaves";
  const std::string now = content("out/results.jsonl");
  EXPECT_EQ(now.rfind("no record\n{}\n[1]\n" + whole.substr(0, first), 0), 0U);
  file("out/results.jsonl", now.substr(now.find("[1]\n") + 4));
  // The record of b was lost, but its output was not.
  EXPECT_EQ(statuses(), "a ok, a skipped, b ok");
  EXPECT_EQ(content("out/results-9-of-9.jsonl"), whole.substr(first, 300)) << "of another run";
  // The whole file is half a line.
  file("out/results.jsonl", std::string(9999, 'x'));
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(), "a ok, b ok");
}

TEST_F(Convert, ALineLongerThanAnyRecordHidesNoOther) {
  converted(2);
  const std::string whole = content("out/results.jsonl");
  file("out/results.jsonl", std::string((std::size_t{1} << 24) + 99, ' ') + whole);
  const Ending ending = convert({"--skip-done"});
  EXPECT_EQ(ending.code, 0) << ending.err;
  EXPECT_TRUE(has(ending.err, "out/results.jsonl: line 1 is not a record;"));
  const std::string now = content("out/results.jsonl");
  file("out/results.jsonl", now.substr(now.find('\n') + 1));
  // The long line held the record of a, whose output is compared with its volume again.
  EXPECT_EQ(statuses(), "b ok, a ok, b skipped");
}

TEST_F(Convert, APipeWithTheNameOfRecordsIsRefusedAndNotWaitedFor) {
  converted(1);
  for (const char* name : {"results.jsonl", "results-7-of-9.jsonl"}) {
    std::filesystem::remove(path("out/results.jsonl"));
    ASSERT_EQ(mkfifo(path(std::string("out/") + name).c_str(), 0600), 0);
    Process waiting(
        {program_under_test(), "convert", "--manifest", "list.tsv", "--output-dir", "out", "--skip-done"},
        folder_.string());
    expect_error(waiting.wait(), usage, std::string(name) + ": ");
    std::filesystem::remove(path(std::string("out/") + name));
  }
}

TEST_F(Convert, AnErrorThatDoesNotNameItsVolumeIsToldWithTheName) {
  volumes(2);
  const Ending ending = convert({"-M", "13M", "-T", "1"});
  EXPECT_EQ(ending.code, broken_input);
  const std::string error = records()[0]["error"];
  EXPECT_FALSE(has(error, "a.nrrd"));
  EXPECT_TRUE(has(ending.err, "tagrid: " + path("a.nrrd") + ": " + error + "\n"));
}

TEST_F(Convert, FileNamesNeedNotBeText) {
  volume("plain.nrrd", 1);
  const std::string name = "M\xfcller \"3\"";
  expect_ok(script("mv plain.nrrd '" + name + ".nrrd'"));
  file("list.tsv", name + ".nrrd\n");
  expect_ok(convert());
  EXPECT_TRUE(exists("out/" + name + ".tag"));
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(last()["status"], "skipped");
  expect_ok(convert({"--remove-verified"}));
  EXPECT_FALSE(exists(name + ".nrrd"));
}

// Following the advice to use -f must not cost the records of an archive.
TEST_F(Convert, TheReportOfARunReplacesNeitherRecordsNorOutputs) {
  volumes(1);
  for (const char* report : {"out/results.jsonl", "out/results-0-of-2.jsonl", "out/a.tag"})
    for (const bool overwrite : {false, true}) {
      SCOPED_TRACE(report);
      expect_error(convert(overwrite ? Arguments{"-f", "--json", report} : Arguments{"--json", report}),
                   usage, "choose another name");
      EXPECT_FALSE(exists("out"));
    }
  expect_ok(convert({"--json", "out/run.json"}));
  EXPECT_EQ(json_of("out/run.json")["ok"], 1);
  EXPECT_EQ(statuses(), "a ok");
}

}  // namespace
}  // namespace tagrid
