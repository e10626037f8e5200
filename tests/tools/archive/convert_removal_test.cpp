// convert --remove-verified: a separate pass removes originals whose outputs have been verified once more.
#include "tests/support/conversions.h"

namespace tagrid {
namespace {

class ConvertRemoval : public Conversions<CommandLine> {
 protected:
  Ending remove(const Arguments& more = {}) const {
    return convert(this->with(Arguments{"--remove-verified"}, more));
  }
  /// One small volume, which was encoded and removed.
  void only_output() const {
    converted(1);
    expect_ok(remove());
  }
  /// Expects that the pass keeps the only remaining original, and says why.
  void expect_kept(const std::string& original, std::string_view why, const Arguments& more = {}) const {
    const Ending ending = remove(more);
    EXPECT_EQ(ending.code, broken_input) << why;
    EXPECT_EQ(last()["status"], "kept") << why;
    EXPECT_TRUE(has(error_of_last(), why));
    EXPECT_TRUE(exists(original)) << why;
  }
};

TEST_F(ConvertRemoval, OriginalsGoInAPassOfTheirOwnAndComeBackFromTheirOutputs) {
  volumes(2);
  volume("c.nhdr", 3);
  file("list.tsv", "a.nrrd\nb.nrrd\tmax-error=5\nc.nhdr\n");
  const std::string a = content("a.nrrd"), c = content("c.raw");
  expect_ok(convert());
  expect_ok(convert({"--skip-done"}));
  expect_ok(convert({"-f"}));
  EXPECT_TRUE(exists("a.nrrd") && exists("b.nrrd") && exists("c.nhdr") && exists("c.raw"));
  const std::string tag = content("out/a.tag");
  expect_ok(remove({"--json", "sums.json"}));
  EXPECT_FALSE(exists("a.nrrd") || exists("b.nrrd") || exists("c.nhdr") || exists("c.raw"));
  EXPECT_EQ(statuses(3), "a removed, b removed, c removed");
  EXPECT_EQ(json_of("sums.json")["removed"], 3);
  EXPECT_EQ(json_of("sums.json")["ok"], 0);
  EXPECT_TRUE(content("out/a.tag") == tag) << "nothing is encoded";
  // Neither pass has anything left to do.
  expect_ok(remove());
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(6), "a skipped, b skipped, c skipped, a skipped, b skipped, c skipped");
  for (const Arguments& options : {Arguments{}, {"-f"}}) {
    const Ending again = convert(options);
    EXPECT_EQ(again.code, broken_input);
    for (const std::string words : {"a.nrrd: was removed by --remove-verified",
                                    "give --skip-done to leave out", "tagrid restore --records out"})
      EXPECT_TRUE(has(again.err, words)) << again.err;
    EXPECT_FALSE(has(again.err, "cannot open")) << again.err;
  }
  expect_ok(remove());
  works("decode out/a.tag -o a.nrrd");
  works("decode out/c.tag -o c.raw");
  EXPECT_TRUE(content("a.nrrd") == a);
  EXPECT_TRUE(content("c.raw") == c);
}

TEST_F(ConvertRemoval, ABoundThatMayWipeOutAMaskKeepsIt) {
  std::string mask(10 * 10 * 10, '\0');
  mask[555] = mask[556] = '\1';
  file("a.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 10 10 10\nencoding: raw\n\n" + mask);
  file("list.tsv", "a.nrrd\tmax-error=2\n");
  const Ending ending = convert();
  EXPECT_EQ(ending.code, 0);
  EXPECT_TRUE(has(ending.err, "structure, such as that of a mask, may be lost")) << ending.err;
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_TRUE(has(error_of_last(), "not below the range of the samples"));
  EXPECT_TRUE(exists("a.nrrd"));
}

TEST_F(ConvertRemoval, AnOutputThatIsNoLongerWhatWasWrittenKeepsItsOriginal) {
  converted(3);
  damage("out/a.tag");
  // A good file of the right volume is still not the file that was written.
  expect_ok(script("$TAGRID encode b.nrrd -fo out/b.tag --max-error 3"));
  std::filesystem::remove(path("out/c.tag"));
  const Ending ending = remove();
  EXPECT_EQ(ending.code, broken_input);
  EXPECT_EQ(statuses(3), "a damaged, b damaged, c damaged");
  EXPECT_TRUE(has(error_of_last(), "c.tag: has changed since it was written"));
  EXPECT_TRUE(exists("a.nrrd") && exists("b.nrrd") && exists("c.nrrd"));
  // The size of a.tag is right, but its record says that its content is not.
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(3), "a ok, b ok, c ok");
  expect_ok(remove());
  EXPECT_FALSE(exists("a.nrrd") || exists("b.nrrd") || exists("c.nrrd"));
}

TEST_F(ConvertRemoval, AnUnreadableRecordIsNamedAndItsOriginalKept) {
  converted(2);
  const std::string whole = content("out/results.jsonl");
  file("out/results.jsonl", "[" + whole.substr(1));
  const Ending ending = remove();
  EXPECT_EQ(ending.code, broken_input);
  EXPECT_TRUE(has(ending.err,
                  "tagrid: warning: out/results.jsonl: line 1 is not a record; volumes without a later "
                  "record count as not done\n"));
  EXPECT_TRUE(has(ending.err, "a.nrrd: no record says that it was encoded to out/a.tag; it is kept"));
  EXPECT_TRUE(exists("a.nrrd"));
  EXPECT_FALSE(exists("b.nrrd"));
}

TEST_F(ConvertRemoval, ARefusalDoesNotEndTheDoubtThatAnUnreadableRecordLeaves) {
  only_output();
  std::string lines = content("out/results.jsonl");
  lines[lines.find('\n') + 1] = 'X';  // the record of the removal
  file("out/results.jsonl", lines);
  const std::string only_copy = content("out/a.tag");
  volume("a.nrrd", 7);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(convert({"-f"}).code, broken_input) << i;
    EXPECT_NE(remove().code, 0) << i;
    EXPECT_NE(convert({"--skip-done", "-f"}).code, 0) << i;
  }
  EXPECT_TRUE(content("out/a.tag") == only_copy);
  EXPECT_TRUE(exists("a.nrrd"));
}

// Two machines, one of whose clocks is wrong.
TEST_F(ConvertRemoval, IsNotHiddenByAnOlderRecordOfALaterClock) {
  volumes(2);
  const std::string a = content("a.nrrd");
  expect_ok(convert());
  std::string lines;
  for (Json record : records()) {
    record["finished"] = 4e9;
    lines += record.dump() + "\n";
  }
  file("out/results-1-of-2.jsonl", lines);
  std::filesystem::remove(path("out/results.jsonl"));
  expect_ok(remove());
  EXPECT_FALSE(exists("a.nrrd") || exists("b.nrrd"));
  EXPECT_EQ(last()["sequence"], 2);
  // The only copy is not replaced, and nothing is missed.
  volume("a.nrrd", 7);
  EXPECT_EQ(convert({"-f"}).code, broken_input);
  std::filesystem::remove(path("a.nrrd"));
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(2).substr(0, 9), "a skipped");
  works("restore --records out");
  EXPECT_TRUE(content("a.nrrd") == a);
  // An original that is there again is one that can be removed again.
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(2), "a ok, b ok");
  expect_ok(remove());
  EXPECT_EQ(statuses(2), "a removed, b removed");
}

TEST_F(ConvertRemoval, AtTheSameTimeAsAnotherRecordIsWhatCounts) {
  only_output();
  Json other = records()[0];
  other["sequence"] = 2;
  other["finished"] = 4e9;
  file("out/results-1-of-2.jsonl", other.dump() + "\n");
  works("restore --records out");
  EXPECT_TRUE(exists("a.nrrd"));
}

TEST_F(ConvertRemoval, RecordsWithImpossibleNamesDoNotKeepOthersFromComingBack) {
  converted(3);
  expect_ok(remove());
  std::string lines;
  const std::string ends_early("a\0.tag", 6);
  for (const std::string& name :
       std::vector<std::string>{"../x.tag", "/x.tag", "x", "", "a//b.tag", ends_early}) {
    Json forged = last();
    forged["output"] = name;
    lines += forged.dump() + "\n";
  }
  for (const Json& files : {Json::array(), Json({{{"path", ""}, {"bytes", 1}, {"modified_ns", 1}}})}) {
    Json forged = last();
    forged["output"] = files.empty() ? "d.tag" : "e.tag";
    forged["input_files"] = files;
    lines += forged.dump() + "\n";
  }
  file("out/results-forged.jsonl", lines);
  const Ending ending = tagrid({"restore", "--records", "out"});
  EXPECT_EQ(ending.code, broken_input);
  EXPECT_TRUE(has(ending.err, "originals: 11, 3 restored, 0 were there, 8 failed"));
  EXPECT_TRUE(exists("a.nrrd") && exists("b.nrrd") && exists("c.nrrd"));
}

TEST_F(ConvertRemoval, AnOutputThatDecodesToSomethingElseKeepsItsOriginal) {
  converted(1);
  // The record of a file that was never right: its checksum fits, but its voxels do not.
  volume("other.nrrd", 2);
  works("encode other.nrrd -fo out/a.tag");
  Json forged = last();
  forged["output_xxh3"] = checksum(content("out/a.tag"));
  forged["bytes_out"] = content("out/a.tag").size();
  file("out/results.jsonl", forged.dump() + "\n");
  expect_kept("a.nrrd", "they differ by more than 0");
}

TEST_F(ConvertRemoval, AnOriginalThatIsNoLongerWhatWasEncodedIsKept) {
  volume("a.nhdr", 1);
  file("list.tsv", "a.nhdr\n");
  expect_ok(convert());
  file("a.nhdr", content("a.nhdr") + "patient:=moved\n");
  expect_kept("a.nhdr", "a.nhdr: has changed since it was encoded: a.nhdr has 127 bytes instead of 112");
  volume("a.nhdr", 2);
  expect_kept("a.raw",
              "a.nhdr: has changed since it was encoded; it is kept; --skip-done -f encodes it again");
  file("a.raw", content("a.raw") + "x");
  expect_kept("a.raw", "a.nhdr: has changed since it was encoded");
}

TEST_F(ConvertRemoval, AChangeWithinTheBoundIsAChange) {
  volume("a.raw", 1, {"--type", "uint8"});
  file("list.tsv", "a.raw\tdims=21,18,13\ttype=uint8\tmax-error=200\n");
  EXPECT_EQ(convert().code, 0);  // with a warning of the bound
  std::string bytes = content("a.raw");
  // Two voxels with equal codes change places: every sum stays the same.
  std::swap(bytes[0], *std::find_if(bytes.begin(), bytes.end(), [&](char b) { return b != bytes[0]; }));
  file("a.raw", bytes);
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_EQ(last()["status"], "kept");
  EXPECT_EQ(content("a.raw"), bytes);
}

// The reader of the volume changes a sample when it is asked for the n-th time: each check opens the volume
// anew.
TEST_F(ConvertRemoval, AVolumeThatChangesBetweenTwoChecksIsKept) {
  std::filesystem::create_directory(path("readers"));
  file("readers/tagrid-read-late", R"sh(#!/bin/sh
cd "$(dirname "$0")" || exit 1
echo '{"tagrid-reader": 1, "name": "late", "version": "1"}'
while read -r request; do
  n=$(($(cat count) + 1))
  echo $n > count
  if [ $n = "$(cat at)" ]; then printf '\377' | dd of=../a.late bs=1 seek=2000 conv=notrunc 2> log; fi
  echo '{"answer": "volume", "dims": [16, 16, 16], "type": "uint8", "spacing": [1, 1, 1], "units": "mm", "places": [{"slices": 16}], "complete": true}'
done
)sh");
  expect_ok(script("chmod 700 readers/tagrid-read-late"));
  file("list.tsv", "a.late\n");
  const std::string whole(4096, '\0');
  const std::string all =
      "TAGRID_READER_PATH=$PWD/readers $TAGRID convert --manifest list.tsv --output-dir out "
      "--max-error 5 ";
  int at = 0, asked = 0;
  do {
    file("a.late", whole);
    file("readers/at", "0");
    file("readers/count", "0");
    expect_ok(script(all + "-f"));
    file("readers/at", std::to_string(++at));
    file("readers/count", "0");
    const Ending ending = script(all + "--remove-verified");
    asked = std::stoi(content("readers/count"));
    EXPECT_EQ(ending.code, asked < at ? 0 : broken_input) << at << ": " << ending.err;
    EXPECT_EQ(exists("a.late"), asked >= at) << at;
    std::filesystem::remove_all(path("out"));
  } while (asked >= at);
  EXPECT_GT(at, 4);
}

TEST_F(ConvertRemoval, WhatWasNotEncodedSoIsKept) {
  volumes(1);
  expect_error(remove(), world, "out: does not exist; nothing has been converted to it yet");
  expect_ok(script("mkdir out"));
  expect_failed(remove(), "a.nrrd: no record says that it was encoded to out/a.tag; it is kept");
  EXPECT_EQ(last()["status"], "kept");
  expect_ok(convert({"--max-error", "5", "--cube", "16"}));
  expect_kept("a.nrrd", "was encoded with other options: max-error was 5, now 2",
              {"--max-error", "2", "--cube", "16"});
  expect_kept("a.nrrd", "was encoded with other options: effort was not given, now best",
              {"--effort", "best", "--max-error", "5", "--cube", "16"});
  expect_kept("a.nrrd", "was encoded with other options: cube was 16, now not given", {"--max-error", "5"});
  file("list.tsv", "a.nrrd\tmax-error=0\n");
  expect_kept("a.nrrd", "was encoded with other options: max-error was 5, now 0", {"--cube", "16"});
  expect_ok(script("mkdir other && cp a.nrrd other && echo other/a.nrrd > list.tsv"));
  expect_kept("other/a.nrrd", "is recorded as made from");
  // Settings are compared, not their texts.
  file("list.tsv", "a.nrrd\tmax-error=5.0\tcube=16\teffort=default\n");
  expect_ok(remove());
  EXPECT_FALSE(exists("a.nrrd"));
}

TEST_F(ConvertRemoval, AVolumeThatTheLastRunFailedWithIsKept) {
  volumes(1);
  const std::string whole = content("a.nrrd"), failed = "a.nrrd: its last encoding failed: ";
  const Arguments bound = {"--max-error", "5"};
  // Before it was ever encoded, and after.
  for (int i = 0; i < 2; ++i) {
    file("a.nrrd", whole.substr(0, whole.size() - 9));
    EXPECT_EQ(convert(with(bound, {"--skip-done"})).code, broken_input);
    file("a.nrrd", whole);
    expect_kept("a.nrrd", failed, bound);
    expect_kept("a.nrrd", failed);
    expect_ok(convert(with(bound, {"--skip-done"})));
  }
  expect_ok(remove({"--max-error", "5.0"}));
  EXPECT_FALSE(exists("a.nrrd"));
}

// Nothing was encoded, and the output is what its record says.
TEST_F(ConvertRemoval, ARefusedRunDoesNotKeepAnOriginal) {
  converted(3, {"--max-error", "5"});
  for (const Arguments& other : {Arguments{"--skip-done"}, {}, {"--max-error", "7"}})
    EXPECT_EQ(convert(other).code, broken_input);
  EXPECT_EQ(last()["status"], "failed");
  EXPECT_EQ(last()["code"], usage);
  EXPECT_EQ(script("flock out/results.jsonl $TAGRID convert --manifest list.tsv --output-dir out -f").code,
            held);
  expect_kept("a.nrrd", "was encoded with other options: max-error was 5, now not given");
  expect_ok(remove({"--max-error", "5"}));
  EXPECT_FALSE(exists("a.nrrd") || exists("b.nrrd") || exists("c.nrrd"));
}

// Nothing was tried, so the record of the encoding still holds. With other options, the output is not what was
// asked for last.
TEST_F(ConvertRemoval, ARunThatFoundTheSameOutputsDoesNotUndoTheirRecords) {
  converted(2, {"--max-error", "5"});
  EXPECT_EQ(convert({"--max-error", "5.0"}).code, broken_input);
  EXPECT_EQ(statuses(2), "a exists, b exists");
  EXPECT_EQ(last()["code"], usage);
  EXPECT_EQ(last()["output_xxh3"], checksum(content("out/b.tag")));
  file("list.tsv", "a.nrrd\n");
  expect_ok(remove({"--max-error", "5"}));
  EXPECT_FALSE(exists("a.nrrd"));
  file("list.tsv", "b.nrrd\n");
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_EQ(last()["status"], "failed");
  expect_kept("b.nrrd", "was encoded with other options: max-error was 5, now not given");
  // A failure is not forgotten because a later run tried nothing.
  const std::string whole = content("b.nrrd");
  file("b.nrrd", whole.substr(0, whole.size() - 9));
  EXPECT_EQ(convert({"-f", "--max-error", "5"}).code, broken_input);
  file("b.nrrd", whole);
  EXPECT_EQ(convert({"--max-error", "5"}).code, broken_input);
  expect_kept("b.nrrd", "b.nrrd: its last encoding failed: ", {"--max-error", "5"});
}

// Both hold, so a bound beside a rule is an option like any other.
TEST_F(ConvertRemoval, AnotherBoundBesideAPsnrKeepsTheOriginal) {
  for (const bool skip : {false, true}) {
    volumes(1);
    expect_ok(script("rm -rf out"));
    EXPECT_EQ(convert({"--psnr", "45", "--max-error", "5"}).code, 0);
    const Arguments lossless = {"--psnr", "45", "--max-error", "0"};
    EXPECT_EQ(convert(skip ? with(lossless, {"--skip-done"}) : lossless).code, broken_input);
    EXPECT_EQ(last()["status"], "failed");
    expect_kept("a.nrrd", "a.nrrd: was encoded with other options: max-error was 5, now 0", lossless);
  }
}

// Another volume of the name, an output without a record, and one that was found damaged.
TEST_F(ConvertRemoval, AnOutputThatIsNotProvedIsAFailureAndNotOneThatExists) {
  volumes(2);
  expect_ok(script("mkdir out other && cp a.nrrd other && $TAGRID encode b.nrrd -o out/b.tag -q"));
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_EQ(statuses(2), "a ok, b failed");
  expect_ok(script("echo other/a.nrrd > list.tsv"));
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_EQ(last()["status"], "failed");
  expect_ok(script("echo a.nrrd > list.tsv"));
  expect_ok(convert({"--skip-done"}));
  damage("out/a.tag");
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_EQ(last()["status"], "damaged");
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_EQ(last()["status"], "failed");
  EXPECT_TRUE(exists("a.nrrd") && exists("b.nrrd"));
}

TEST_F(ConvertRemoval, FilesThatEncodeWouldNotRemoveAreKept) {
  volume("a.nhdr", 1);
  volume("b.nrrd", 2);
  volume("c.raw", 3);
  expect_ok(
      script("mkdir deep && mv a.raw deep && sed -i 's|a.raw|deep/a.raw|' a.nhdr && mv b.nrrd deep && "
             "ln -s deep/b.nrrd b.nrrd && (echo 12345678; cat c.raw) > d.raw"));
  file("list.tsv", "a.nhdr\nb.nrrd\nd.raw\tdims=21,18,13\ttype=int16\toffset=9\tstrip=true\n");
  expect_ok(convert());
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_EQ(statuses(3), "a kept, b kept, d kept");
  const std::vector<Json> all = records();
  const std::string why[] = {"may be in a different directory", "is a symbolic link",
                             "--strip drops its files"};
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_TRUE(has(all[3 + i]["error"].get<std::string>(), why[i])) << all[3 + i];
  for (const std::string name : {"a.nhdr", "deep/a.raw", "b.nrrd", "deep/b.nrrd", "d.raw"})
    EXPECT_TRUE(exists(name)) << name;
}

TEST_F(ConvertRemoval, FilesThatAFailedLineMayNeedAreKept) {
  volume("a.nhdr", 1);
  volume("c.nrrd", 3);
  std::filesystem::create_directory(path("deep"));
  const std::string header = content("a.nhdr");
  const std::size_t at = header.find("type: ");
  const std::string broken = header.substr(0, at) + "type: no\n" + header.substr(header.find('\n', at) + 1);
  // Of the samples of a.nhdr, beside it and elsewhere.
  for (const std::string other : {"deep/b.nhdr", "b.nhdr"}) {
    std::string text = broken;
    if (other != "b.nhdr") text.replace(text.find("a.raw"), 5, "../a.raw");
    file(other, text);
    file("list.tsv", "a.nhdr\n" + other + "\nc.nrrd\n");
    EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
    EXPECT_EQ(remove().code, broken_input);
    EXPECT_TRUE(exists("a.nhdr") && exists("a.raw")) << other;
    const Json record = records()[records().size() - 3];
    EXPECT_EQ(record["status"], "kept");
    EXPECT_TRUE(has(record["error"].get<std::string>(),
                    "a.raw: cannot be removed: another header, " + other + ", also names it"))
        << record;
    EXPECT_FALSE(exists("c.nrrd")) << "it needs nobody, and nobody it";
    if (other != "b.nhdr") std::filesystem::remove(path(other));
  }
  // The header is still there, although it is not listed.
  file("list.tsv", "a.nhdr\n");
  expect_kept("a.raw", "another header, b.nhdr, also names it");
  std::filesystem::remove(path("b.nhdr"));
  expect_ok(remove());
  EXPECT_FALSE(exists("a.nhdr") || exists("a.raw"));
}

TEST_F(ConvertRemoval, FilesOfAFolderThatCannotBeOpenedAreKept) {
  volumes(1);
  expect_ok(script("mkdir s && mv a.nrrd s && echo x > s/1.tif"));
  file("list.tsv", "s/a.nrrd\ns\toutput=s\n");
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_TRUE(exists("s/a.nrrd"));
}

// One rule: what does not come back byte for byte, but for a bound that was asked for, stays.
TEST_F(ConvertRemoval, FilesThatComeBackInAnotherFormAreKept) {
  volume("a.nhdr", 1);
  volume("b.nrrd", 2);
  volume("c.raw", 3);
  const std::string plain = content("b.nrrd");
  std::string header = plain.substr(0, plain.find("\n\n") + 2);
  header.replace(header.find("encoding: raw"), 13, "encoding: gzip");
  file("header", header);
  file("samples", samples_of(plain));
  expect_ok(
      script("gzip -nc a.raw > z.raw.gz; sed 's/raw$/gzip/; s/a.gzip/z.raw.gz/' a.nhdr > z.nhdr; "
             "(cat header; gzip -nc samples) > y.nrrd"));
  const std::string compressed[] = {"z.nhdr", "y.nrrd"};
  for (const std::string& name : compressed)
    for (const Arguments& bound : {Arguments{}, {"--max-error", "5"}}) {
      const std::string why = name +
                              ": cannot be removed: its files could not be restored byte for byte: its "
                              "samples are compressed (gzip), and come back uncompressed; leave out --rm";
      expect_error(tagrid(with({"encode", name, "-o", "x.tag", "--rm"}, bound)), usage, why);
    }
  file("list.tsv", "z.nhdr\ny.nrrd\nb.nrrd\nc.raw\tdims=21,18,13\ttype=int16\n");
  expect_ok(convert());
  EXPECT_EQ(records()[0]["restorable"], false);
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_EQ(statuses(4), "z kept, y kept, b removed, c removed");
  EXPECT_TRUE(exists("z.nhdr") && exists("z.raw.gz") && exists("y.nrrd"));
}

TEST_F(ConvertRemoval, StrippedVolumesAreKept) {
  volume("c.raw", 3);
  const std::string why = "--strip drops its files, so they could not be restored";
  fails("encode c.raw -o x.tag --strip --rm --dims 21,18,13 --type int16 --endian big", usage,
        "c.raw: cannot be removed: " + why);
  file("list.tsv", "c.raw\tdims=21,18,13\ttype=int16\tstrip=true\n");
  expect_ok(convert());
  expect_kept("c.raw", why);
}

TEST_F(ConvertRemoval, AFileThatAnotherVolumeIsInIsKept) {
  volume("a.nhdr", 1);
  volumes(2);
  expect_ok(script("mkdir sub; sed 's|a.raw|../a.raw|' a.nhdr > sub/z.nhdr"));
  // z was not encoded, and needs the file that a is in.
  file("list.tsv", "a.nhdr\nb.nrrd\n");
  expect_ok(convert());
  file("list.tsv", "a.nhdr\nb.nrrd\nsub/z.nhdr\n");
  EXPECT_EQ(remove({"--shard=0/1"}).code, broken_input);
  EXPECT_EQ(statuses(3, "out/results-0-of-1.jsonl"), "a kept, b removed, z kept");
  EXPECT_TRUE(exists("a.raw") && exists("a.nhdr"));
}

TEST_F(ConvertRemoval, NothingGoesForAGridThatNothingBounds) {
  volumes(2);
  file("list.tsv", "a.nrrd\tgrid-only=true\nb.nrrd\tgrid-only=true\tmax-error=9\n");
  expect_ok(convert());
  expect_error(remove({"--grid-only"}), usage,
               "list.tsv: line 1: --remove-verified: a grid without a bound cannot replace a volume");
  EXPECT_TRUE(exists("a.nrrd") && exists("b.nrrd"));
  // Whatever options are given now, the file says how it was made.
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_EQ(statuses(2), "a kept, b removed");
  EXPECT_EQ(records()[2]["code"], usage);
  // And whatever a record says.
  Json forged = records()[0];
  forged["options"] = Json::object();
  forged["settings"]["max_error"] = 0;
  forged["settings"]["mode"] = "voxels";
  file("out/results.jsonl", forged.dump() + "\n");
  file("list.tsv", "a.nrrd\n");
  expect_kept("a.nrrd", "nothing bounds the error");
}

TEST_F(ConvertRemoval, ABoundThatOnlyTheLinesGiveIsABound) {
  volumes(2);
  file("list.tsv", "a.nrrd\tmax-error=5\nb.nrrd\tmax-error=9\n");
  expect_ok(convert({"--grid-only"}));
  expect_ok(remove({"--grid-only"}));
  EXPECT_EQ(statuses(2), "a removed, b removed");

  std::filesystem::remove_all(path("out"));
  volumes(2);
  file("list.tsv", "a.nrrd\tmax-error=5\nb.nrrd\n");
  expect_ok(convert({"--grid-only"}));
  expect_error(remove({"--grid-only"}), usage, "list.tsv: line 2: --remove-verified: a grid without a bound");
  EXPECT_TRUE(exists("a.nrrd") && exists("b.nrrd"));
}

TEST_F(ConvertRemoval, AfterALossyEncodingHeaderlessSamplesGoOnlyIfTheirDescriptionIsTrusted) {
  volumes(1);
  volume("b.raw", 2);
  volume("c.raw", 3);
  const std::string raw = "\tdims=21,18,13\ttype=int16";
  file("list.tsv", "a.nrrd\tmax-error=5\nb.raw\tmax-error=5" + raw + "\nc.raw" + raw + "\n");
  expect_ok(convert());
  EXPECT_EQ(records()[0]["headerless"], false);
  EXPECT_EQ(records()[1]["headerless"], true);
  expect_ok(script("cp out/results.jsonl first.jsonl"));
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_EQ(statuses(3), "a removed, b kept, c removed");
  const Json kept = records()[4];
  EXPECT_EQ(kept["code"], usage);
  EXPECT_TRUE(has(kept["error"].get<std::string>(), "it has no header")) << kept;
  EXPECT_TRUE(exists("b.raw"));
  expect_ok(remove({"--trust-description"}));
  EXPECT_EQ(statuses(3), "a skipped, b removed, c skipped");
  EXPECT_FALSE(exists("b.raw"));
}

TEST_F(ConvertRemoval, ShardsRemoveTheirOwn) {
  converted(3);
  expect_ok(remove({"--shard", "1/2"}));
  EXPECT_EQ(statuses(9, "out/results-1-of-2.jsonl"), "b removed");
  EXPECT_TRUE(exists("a.nrrd") && !exists("b.nrrd") && exists("c.nrrd"));
}

TEST_F(ConvertRemoval, AnOutputThatIsTheLastCopyIsMissed) {
  converted(2);
  expect_ok(remove());
  const std::string tag = content("out/a.tag");
  for (const std::size_t size : {std::size_t{0}, tag.size() - 1}) {
    if (size == 0)
      std::filesystem::remove(path("out/a.tag"));
    else
      file("out/a.tag", tag.substr(0, size));
    const std::string what = "out/a.tag: is gone or has another size, and its original was removed";
    expect_failed(remove(), what);
    EXPECT_EQ(statuses(2), "a failed, b skipped");
    EXPECT_TRUE(records()[records().size() - 2]["dims"].is_null()) << "as for all that failed";
    expect_failed(convert({"--skip-done"}), what);
    EXPECT_EQ(statuses(2), "a failed, b skipped");
  }
  file("out/a.tag", tag);
  expect_ok(remove());
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(4), "a skipped, b skipped, a skipped, b skipped");
}

TEST_F(ConvertRemoval, AVolumeThatCameBackIsTheOriginalOrIsRefused) {
  volumes(2);
  file("list.tsv", "a.nrrd\nb.nrrd\tmax-error=5\n");
  expect_ok(convert());
  expect_ok(remove());
  for (const std::string name : {"a", "b"})
    expect_ok(tagrid({"decode", "out/" + name + ".tag", "-o", name + ".nrrd"}));
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  EXPECT_EQ(statuses(2), "a ok, b failed");
  EXPECT_TRUE(has(error_of_last(), "out/b.tag: may be the only copy of a volume whose original was removed"));
}

TEST_F(ConvertRemoval, ANewVolumeUnderTheNameOfARemovedOneDoesNotReplaceItsOutput) {
  converted(1);
  const std::string encoded = content("out/results.jsonl");
  expect_ok(remove());
  const std::string before = content("out/a.tag"), removed = content("out/results.jsonl");
  volume("a.nrrd", 9);
  // Also where the line may only say that the original was removed.
  for (const std::string& records : {removed, encoded + "what a disk made of the record of the removal\n"}) {
    for (const std::string options : {"-f", "--skip-done", "--skip-done -f"}) {
      file("out/results.jsonl", records);
      expect_failed(convert(words(options)), "may be the only copy of a volume whose original was removed");
    }
    EXPECT_EQ(remove().code, broken_input);
    EXPECT_TRUE(exists("a.nrrd"));
    EXPECT_TRUE(content("out/a.tag") == before);
  }
}

TEST_F(ConvertRemoval, ALineThatMaySayThatAnEncodingFailedKeepsTheOriginal) {
  converted(1);
  file("out/results.jsonl", content("out/results.jsonl") + "[1]\n");
  EXPECT_EQ(remove().code, broken_input);
  EXPECT_TRUE(exists("a.nrrd"));
  // Once its output was compared with it, nothing is in doubt.
  EXPECT_EQ(convert({"--skip-done"}).code, 0);
  EXPECT_EQ(remove().code, 0);
  EXPECT_FALSE(exists("a.nrrd"));
}

}  // namespace
}  // namespace tagrid
