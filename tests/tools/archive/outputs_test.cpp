// convert: paths of outputs. output=NAME, --keep-folders, lists without volumes, and the keys of records.
#include <regex>
#include <set>

#include "tests/support/conversions.h"

namespace tagrid {
namespace {

using Names = std::vector<std::string>;

class ConvertOutputs : public Conversions<CommandLine> {
 protected:
  /// Volumes with the same name in different directories, and a list of them.
  void patients() const {
    for (const std::string year : {"2019", "2020/may"}) std::filesystem::create_directories(path(year));
    volume("2019/knee.nrrd", 1);
    volume("2020/knee.nhdr", 2);
    volume("2020/may/knee.nrrd", 3);
    file("list.tsv", "2019/knee.nrrd\n./2020//knee.nhdr\n2020/may/knee.nrrd\n");
  }
  static inline const Names tags_ = {"2019/knee.tag", "2020/knee.tag", "2020/may/knee.tag"};

  Names files_below(const std::string& folder) const {
    Names names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path(folder)))
      if (!entry.is_directory() && entry.path().extension() != ".jsonl")
        names.push_back(entry.path().lexically_relative(path(folder)).string());
    std::sort(names.begin(), names.end());
    return names;
  }
  static std::set<std::string> keys_of(const Json& record) {
    std::set<std::string> keys;
    for (const auto& [key, value] : record.items()) keys.insert(key);
    return keys;
  }
};

TEST_F(ConvertOutputs, AColumnSaysTheOutputBelowTheFolderAndTheEndingIsAddedWhereItIsMissing) {
  volumes(4);
  file("list.tsv",
       "a.nrrd\toutput=x/y/one.tag\n"
       "b.nrrd\tmax-error=4\toutput=./x//two\n"
       "c.nrrd\toutput=three.v1\n"
       "d.nrrd\n");
  expect_ok(convert());
  EXPECT_EQ(files_below("out"), (Names{"d.tag", "three.v1.tag", "x/two.tag", "x/y/one.tag"}));
  EXPECT_EQ(statuses(), "x/y/one ok, x/two ok, three.v1 ok, d ok");
  EXPECT_EQ(records()[1]["options"], Json({{"max-error", "4"}}));
  works("verify out/x/two.tag --against b.nrrd -q");
}

TEST_F(ConvertOutputs, VolumesOfOneNameAreOneListWhenItsFoldersAreKept) {
  patients();
  expect_error(convert(), usage, "list.tsv: line 2: knee.tag would also be the output of line 1");
  EXPECT_FALSE(exists("out"));
  expect_ok(convert({"--keep-folders"}));
  EXPECT_EQ(files_below("out"), tags_);
  EXPECT_EQ(statuses(), "2019/knee ok, 2020/knee ok, 2020/may/knee ok");
  const Names originals = {"2019/knee.nrrd", "2020/knee.nhdr", "2020/may/knee.nrrd"};
  for (std::size_t i = 0; i < tags_.size(); ++i)
    expect_ok(tagrid({"verify", "out/" + tags_[i], "--against", originals[i], "-q"}));
}

TEST_F(ConvertOutputs, AColumnIsBelowTheFolderOfTheOutputsAlsoWhereFoldersAreKept) {
  patients();
  file("list.tsv", "2019/knee.nrrd\n" + path("2020/knee.nhdr") + "\toutput=other/knee\n");
  expect_ok(convert({"--keep-folders"}));
  EXPECT_EQ(files_below("out"), (Names{"2019/knee.tag", "other/knee.tag"}));
}

TEST_F(ConvertOutputs, PathsWhoseFoldersCannotBeMirroredAreRefusedWithAdvice) {
  patients();
  for (const std::string& name : {path("2019/knee.nrrd"), std::string("../knee.nrrd"),
                                  std::string("2019/../2019/knee.nrrd"), std::string("2019/..//knee.nrrd")}) {
    file("list.tsv", name + "\n");
    expect_error(convert({"--keep-folders"}), usage, "list.tsv: line 1: " + name + ": --keep-folders needs");
    expect_error(convert({"--keep-folders"}), usage, "output=NAME");
  }
  EXPECT_FALSE(exists("out"));
}

TEST_F(ConvertOutputs, AnOutputThatWouldLeaveTheFolderIsRefusedBeforeAnythingIsDone) {
  volumes(1);
  const std::pair<const char*, const char*> lines[] = {
      {"a.nrrd\nb.nrrd\toutput=../b", "must not contain .."},
      {"a.nrrd\nb.nrrd\toutput=x/../b", "must not contain .."},
      {"a.nrrd\nb.nrrd\toutput=x/..", "must not contain .."},
      {"a.nrrd\nb.nrrd\toutput=/tmp/b", "inside the output directory"},
      {"a.nrrd\nb.nrrd\toutput=x/", "is not the name of a file"},
      {"a.nrrd\nb.nrrd\toutput=.", "is not the name of a file"},
      {"a.nrrd\nb.nrrd\toutput=./", "is not the name of a file"},
      {"a.nrrd\nb.nrrd\toutput=results.jsonl/b", "is a name for a file of records"},
      {"a.nrrd\nb.nrrd\toutput=results-0-of-2.jsonl/b", "is a name for a file of records"},
      {"a.nrrd\nb.nrrd\toutput=a", "a.tag would also be the output of line 1"},
      {"a.nrrd\nb.nrrd\toutput=./a.tag", "would also be the output of line 1"},
      {"a.nrrd\nb.nrrd\toutput=a.tag/b", "a.tag is the output of line 1"},
      {"a.nrrd\toutput=x.tag/y\nb.nrrd\toutput=x",
       "x.tag would also be a directory of the output of line 1"}};
  for (const auto& [list, what] : lines) {
    file("list.tsv", list);
    expect_error(convert(), usage, what);
    EXPECT_FALSE(exists("out")) << list;
  }
}

TEST_F(ConvertOutputs, NoOutputGoesThroughALinkToAnotherPlace) {
  volumes(2);
  file("list.tsv", "a.nrrd\toutput=x/a\nb.nrrd\toutput=y/b\n");
  // Leftovers of a killed run do not belong to this run either.
  expect_ok(
      script("mkdir -p out elsewhere && ln -s ../elsewhere out/x && touch elsewhere/.a.tag.partabcdef"));
  for (const Arguments& more : {Arguments{}, {"-f"}, {"--skip-done"}}) {
    EXPECT_EQ(convert(more).code, broken_input);
    EXPECT_EQ(records()[records().size() - 2]["code"], usage);
    EXPECT_TRUE(
        has(records()[records().size() - 2]["error"].get<std::string>(), "out/x: is a symbolic link"));
  }
  EXPECT_EQ(files_below("elsewhere"), Names{".a.tag.partabcdef"});
  EXPECT_TRUE(exists("out/y/b.tag"));
  // An original is not removed because of a file at the other end of the link.
  expect_ok(script("rm out/x && mkdir out/x"));
  expect_ok(convert({"--skip-done"}));
  expect_ok(script("mv out/x away && ln -s ../away out/x"));
  EXPECT_EQ(convert({"--remove-verified"}).code, broken_input);
  EXPECT_TRUE(exists("a.nrrd"));
  EXPECT_FALSE(exists("b.nrrd"));
}

TEST_F(ConvertOutputs, AFileInThePlaceOfAFolderOrOneThatCannotBeMadeFailsThatVolumeAlone) {
  volumes(3);
  file("list.tsv",
       "a.nrrd\toutput=x/y/a\nb.nrrd\toutput=" + std::string(300, 'x') + "/b\nc.nrrd\toutput=y/c\n");
  expect_ok(script("mkdir out && echo precious > out/x"));
  EXPECT_EQ(convert({"-f"}).code, broken_input);
  EXPECT_TRUE(has(records()[0]["error"].get<std::string>(), "out/x: is not a directory"));
  EXPECT_EQ(records()[1]["code"], world);
  EXPECT_EQ(last()["status"], "ok");
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  EXPECT_EQ(last()["status"], "skipped");
  EXPECT_EQ(content("out/x"), "precious\n");
}

TEST_F(ConvertOutputs, AFileIsNoFolderForOutputs) {
  volumes(1);
  file("out", "precious");
  for (const Arguments& more : {Arguments{}, Arguments{"-f"}, Arguments{"--remove-verified"}})
    expect_error(convert(more), usage, "out: is not a directory; give the directory for the outputs");
  EXPECT_EQ(content("out"), "precious");
}

TEST_F(ConvertOutputs, WhatIsDoneIsKnownByItsPathAndNotByItsName) {
  patients();
  expect_ok(convert({"--keep-folders"}));
  // One of three outputs with the same name is gone, and the volume of another one has changed.
  std::filesystem::remove(path("out/2020/knee.tag"));
  volume("2020/may/knee.nrrd", 4);
  EXPECT_EQ(convert({"--keep-folders", "--skip-done"}).code, broken_input);
  EXPECT_EQ(statuses(3), "2019/knee skipped, 2020/knee ok, 2020/may/knee failed");
  expect_ok(convert({"--keep-folders", "--skip-done", "-f"}));
  EXPECT_EQ(statuses(3), "2019/knee skipped, 2020/knee skipped, 2020/may/knee ok");
  works("verify out/2020/may/knee.tag --against 2020/may/knee.nrrd -q");
  // Other options are refused for all volumes; with -f they replace the outputs.
  EXPECT_EQ(convert({"--keep-folders", "--skip-done", "--max-error=3"}).code, broken_input);
  expect_ok(convert({"--keep-folders", "--skip-done", "--max-error=3", "-f"}));
  EXPECT_EQ(statuses(3), "2019/knee ok, 2020/knee ok, 2020/may/knee ok");
  // Without the records, the outputs are compared with their volumes.
  std::filesystem::remove(path("out/results.jsonl"));
  const auto inode = status_of("out/2020/may/knee.tag").st_ino;
  expect_ok(convert({"--keep-folders", "--skip-done", "--max-error=3"}));
  EXPECT_EQ(statuses(), "2019/knee ok, 2020/knee ok, 2020/may/knee ok");
  EXPECT_EQ(status_of("out/2020/may/knee.tag").st_ino, inode);
}

TEST_F(ConvertOutputs, OriginalsAreRemovedForTheirOwnOutputsAlone) {
  patients();
  const std::string knee = content("2019/knee.nrrd");
  expect_ok(convert({"--keep-folders"}));
  damage("out/2020/knee.tag");
  EXPECT_EQ(convert({"--keep-folders", "--remove-verified"}).code, broken_input);
  EXPECT_EQ(statuses(3), "2019/knee removed, 2020/knee damaged, 2020/may/knee removed");
  EXPECT_TRUE(exists("2020/knee.nhdr") && exists("2020/knee.raw"));
  EXPECT_FALSE(exists("2019/knee.nrrd") || exists("2020/may/knee.nrrd"));
  // The same volumes under other names are unknown.
  file("list.tsv", "2020/knee.nhdr\n");
  expect_failed(convert({"--remove-verified"}),
                "2020/knee.nhdr: no record says that it was encoded to out/knee.tag; it is kept");
  EXPECT_EQ(last()["status"], "kept");
  works("decode out/2019/knee.tag -o back.nrrd");
  EXPECT_TRUE(content("back.nrrd") == knee);
}

TEST_F(ConvertOutputs, ShardsTogetherMakeAllFolders) {
  patients();
  for (int i = 0; i < 2; ++i) expect_ok(convert({"--keep-folders", "--shard", std::to_string(i) + "/2"}));
  EXPECT_EQ(files_below("out"), tags_);
  expect_ok(convert({"--keep-folders", "--skip-done"}));
  EXPECT_EQ(statuses(), "2019/knee skipped, 2020/knee skipped, 2020/may/knee skipped");
  expect_ok(convert({"--keep-folders", "--shard", "5/6"}));
}

TEST_F(ConvertOutputs, WhatKilledRunsLeftInFoldersGoes) {
  patients();
  if (!is_on_local_file_system()) GTEST_SKIP() << "temporaries are removed on local file systems only";
  expect_ok(
      script("mkdir -p out/2020/may other && touch out/2020/may/.knee.tag.partabcdef "
             "out/2020/.knee.tag.partabcdef out/2020/.elbow.tag.partabcdef"));
  expect_ok(convert({"--keep-folders", "--skip-done"}));
  Names expected = tags_;
  expected.insert(expected.begin() + 1, "2020/.elbow.tag.partabcdef");
  EXPECT_EQ(files_below("out"), expected) << "that of another output stays";
}

// A list is an input, too; but errors in its lines already give 64, and a script that finds no files must
// correct its command, not a file.
TEST_F(ConvertOutputs, AnEmptyListIsAWrongCommandBecauseAListSaysWhatTheCommandDoes) {
  volumes(1);
  for (const std::string list : {"", "\n", "# a.nrrd\n \t\r\n"}) {
    file("list.tsv", list);
    for (const char* option : {"--skip-done", "--remove-verified", "--shard=0/2"})
      expect_error(convert({option}), usage, "list.tsv: contains no volumes");
  }
  expect_error(script(": | $TAGRID convert --manifest - --output-dir out"), usage,
               "standard input: contains no volumes");
  EXPECT_FALSE(exists("out"));
  // Where volumes were converted before, nothing may be left of them to list.
  expect_ok(script("$TAGRID convert --find . -q > list.tsv"));
  expect_ok(convert());
  expect_ok(convert({"--remove-verified"}));
  expect_ok(script("$TAGRID convert --find . -q > list.tsv"));
  for (const char* option : {"--skip-done", "--remove-verified"}) {
    const Ending nothing = convert({option});
    EXPECT_EQ(nothing.code, 0) << option;
    EXPECT_EQ(nothing.err, "tagrid: warning: list.tsv: contains no volumes; nothing is left to do\n");
  }
  expect_ok(script("rm -r out"));
  volumes(1);
  // A shard without lines is one of more shards than volumes.
  file("list.tsv", "a.nrrd\n");
  expect_ok(convert({"--shard=3/4"}));
  EXPECT_EQ(content("out/results-3-of-4.jsonl"), "");
}

TEST_F(ConvertOutputs, RecordsOfEveryStatusHaveTheKeysThatTheirDocumentLists) {
  volumes(3);
  file("list.tsv", content("list.tsv") + "none.nrrd\n");
  EXPECT_EQ(convert().code, broken_input);
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  EXPECT_EQ(convert().code, broken_input);
  damage("out/b.tag");
  expect_ok(script("mv c.nrrd d.nrrd && ln -s d.nrrd c.nrrd"));
  file("list.tsv", content("list.tsv") + "never.nrrd\n");
  EXPECT_EQ(convert({"--remove-verified"}).code, broken_input);
  expect_ok(script("printf 'a.nrrd\\n' > list.tsv"));
  expect_ok(convert({"--remove-verified"}));

  std::ifstream document(TAGRID_SOURCE_DIR "/docs/archives.md");
  std::set<std::string> listed;
  bool in_table = false;
  const std::regex word("`([a-z0-9_]+)`");
  for (std::string line; std::getline(document, line) && !(in_table && line.empty());) {
    if (line == "| key | holds |") in_table = true;
    if (!in_table) continue;
    const std::string keys = line.substr(0, line.find('|', 1));
    for (std::sregex_iterator i(keys.begin(), keys.end(), word), end; i != end; ++i) listed.insert((*i)[1]);
  }

  std::multiset<std::string> statuses;
  for (const Json& record : records()) {
    statuses.insert(record["status"]);
    EXPECT_EQ(keys_of(record), listed) << record["status"];
    const bool is_known =
        record["status"] != "failed" &&
        record["error"].dump().find("no record says that it was encoded") == std::string::npos;
    for (const char* key : {"dims", "type", "settings", "achieved", "bytes_in", "bytes_out", "input_files",
                            "input_xxh3", "output_xxh3"})
      EXPECT_EQ(record[key].is_null(), !is_known) << key << " " << record;
  }
  for (const std::string status : {"ok", "failed", "exists", "skipped", "removed", "kept", "damaged"})
    EXPECT_TRUE(statuses.contains(status)) << status;
}

TEST_F(ConvertOutputs, ARemovalSaysNothingOfAnEarlierOneThatFailed) {
  converted(1);
  damage("out/a.tag");
  EXPECT_EQ(convert({"--remove-verified"}).code, broken_input);
  EXPECT_EQ(last()["status"], "damaged");
  damage("out/a.tag");  // the same bit again: restored
  expect_ok(convert({"--remove-verified"}));
  EXPECT_EQ(last()["status"], "removed");
  EXPECT_TRUE(last()["error"].is_null()) << last()["error"];
  EXPECT_EQ(last()["code"], 0);
}

}  // namespace
}  // namespace tagrid
