// What happens to an archive after its conversion: it moves, its files are protected, its runs are repeated.
#include "tests/support/conversions.h"

namespace tagrid {
namespace {

class LongArchive : public Conversions<CommandLine> {
 protected:
  /// Sources in a/src, their list in a, outputs in a/out.
  std::map<std::string, std::string> archive() const {
    std::filesystem::create_directories(path("a/src"));
    std::map<std::string, std::string> originals;
    for (const std::string name : {"v.nrrd", "w.nhdr"}) {
      volume("a/src/" + name, name[0]);
      originals[name] = content("a/src/" + name);
    }
    originals["w.raw"] = content("a/src/w.raw");
    file("a/list.tsv", "src/v.nrrd\nsrc/w.nhdr\n");
    expect_ok(in("a"));
    return originals;
  }
  Ending in(const std::string& folder, const Arguments& more = {}) const {
    return tagrid(
        with({"convert", "--manifest", folder + "/list.tsv", "--output-dir", folder + "/out"}, more));
  }
  void expect_originals(const std::string& folder,
                        const std::map<std::string, std::string>& originals) const {
    for (const auto& [name, bytes] : originals) {
      ASSERT_TRUE(exists(folder + "/src/" + name)) << folder << " " << name;
      EXPECT_TRUE(content(folder + "/src/" + name) == bytes) << name;
    }
  }
};

TEST_F(LongArchive, GoesOnWhereItWasMovedTo) {
  const auto originals = archive();
  for (const Json& record : records("a/out/results.jsonl"))
    EXPECT_TRUE(record["input"].get<std::string>().starts_with("../src/")) << record;
  expect_ok(script("mkdir deeper && mv a deeper/b"));
  expect_ok(in("deeper/b", {"--skip-done"}));
  EXPECT_EQ(statuses(2, "deeper/b/out/results.jsonl"), "v skipped, w skipped");
  expect_ok(in("deeper/b", {"--remove-verified"}));
  EXPECT_FALSE(exists("deeper/b/src/v.nrrd") || exists("deeper/b/src/w.raw"));
  expect_ok(script("mv deeper/b c && rmdir deeper && rm -r c/src"));
  expect_ok(in("c", {"--skip-done"}));
  EXPECT_EQ(statuses(2, "c/out/results.jsonl"), "v skipped, w skipped");
  const Ending restored = tagrid({"restore", "--records", "c/out"});
  EXPECT_EQ(restored.code, 0) << restored.err;
  EXPECT_TRUE(has(restored.err, "c/src: does not exist, and is created")) << restored.err;
  expect_originals("c", originals);
  EXPECT_FALSE(exists("a") || exists("deeper"));
}

// Earlier versions recorded absolute paths; so do lists that have them.
TEST_F(LongArchive, OfAbsolutePathsRestoresToThese) {
  const auto originals = archive();
  file("a/list.tsv", path("a/src/v.nrrd") + "\n" + path("a/src/w.nhdr") + "\n");
  expect_ok(in("a", {"-f"}));
  EXPECT_EQ(records("a/out/results.jsonl").back()["input"],
            std::filesystem::canonical(path("a/src/w.nhdr")).string());
  expect_ok(in("a", {"--skip-done"}));
  expect_ok(in("a", {"--remove-verified"}));
  expect_ok(script("mv a/out out && rm -r a"));
  const Ending restored = tagrid({"restore", "--records", "out"});
  EXPECT_EQ(restored.code, 0) << restored.err;
  EXPECT_TRUE(has(restored.err, "a/src: does not exist, and is created")) << restored.err;
  expect_originals("a", originals);
  // The same list with relative paths names the same volumes.
  file("a/list.tsv", "src/v.nrrd\nsrc/w.nhdr\n");
  expect_ok(script("mv out a/out"));
  expect_ok(in("a", {"--skip-done"}));
}

TEST_F(LongArchive, IsTheSameWhenItsFilesWereProtected) {
  const auto originals = archive();
  const auto has_parity = [&](const std::string& name) { return has(tagrid({"info", name}).out, "parity"); };
  expect_ok(tagrid({"protect", "a/out/v.tag", "--parity", "5%"}));
  const std::string before = content("a/out/v.tag");
  expect_ok(in("a", {"--skip-done"}));
  EXPECT_EQ(statuses(2, "a/out/results.jsonl"), "v skipped, w skipped");
  // Without records, they are compared with their volumes.
  expect_ok(script("mv a/out/results.jsonl aside"));
  expect_ok(in("a", {"--skip-done"}));
  EXPECT_EQ(statuses(2, "a/out/results.jsonl"), "v ok, w ok");
  expect_ok(script("mv aside a/out/results.jsonl"));
  EXPECT_TRUE(content("a/out/v.tag") == before && has_parity("a/out/v.tag"));
  expect_ok(in("a", {"--remove-verified"}));
  EXPECT_FALSE(exists("a/src/v.nrrd") || exists("a/src/w.raw"));
  expect_ok(tagrid({"protect", "a/out/w.tag", "--parity", "10%"}));
  expect_ok(in("a", {"--skip-done"}));
  EXPECT_TRUE(has_parity("a/out/w.tag"));
  expect_ok(tagrid({"restore", "--records", "a/out"}));
  expect_originals("a", originals);
  // What was damaged before its parity was made is not what was written.
  expect_ok(in("a", {"--skip-done"}));
  std::string damaged = content("a/out/w.tag");
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
  file("a/out/w.tag", damaged);
  EXPECT_EQ(in("a", {"--remove-verified"}).code, broken_input);
  EXPECT_TRUE(exists("a/src/w.raw"));
}

TEST_F(LongArchive, ASecondRunLearnsWhoHoldsTheRecords) {
  archive();
  file("a/out/.results.jsonl.holder", "process 17 on other.example.org\n");
  expect_error(
      script(
          "flock a/out/results.jsonl $TAGRID convert --manifest a/list.tsv --output-dir a/out --skip-done"),
      held, "a/out/results.jsonl: another run (process 17 on other.example.org) is using it");
  // Shards have records of their own.
  expect_ok(
      script("flock a/out/results.jsonl $TAGRID convert --manifest a/list.tsv --output-dir a/out --skip-done "
             "--shard 0/1"));
  // The file that a killed run left does not stay.
  expect_ok(in("a", {"--skip-done"}));
  EXPECT_FALSE(exists("a/out/.results.jsonl.holder"));
}

TEST_F(LongArchive, KeepsAnOriginalWhoseHardLinkOrOutputIsBesideIt) {
  volumes(2);
  const std::string a = content("a.nrrd");
  expect_ok(
      script("ln a.nrrd link.nrrd && ln -s b.nrrd soft.nrrd && printf 'a.nrrd\\nsoft.nrrd\\n' > list.tsv"));
  // Outputs in the directory of the sources.
  const Arguments beside = {"convert", "--manifest", "list.tsv", "--output-dir", "."};
  expect_ok(tagrid(beside));
  EXPECT_EQ(tagrid(with(beside, {"--remove-verified"})).code, broken_input);
  EXPECT_EQ(statuses(2, "results.jsonl"), "a removed, soft kept");
  EXPECT_FALSE(exists("a.nrrd"));
  EXPECT_TRUE(exists("a.tag") && exists("soft.nrrd") && exists("b.nrrd"));
  EXPECT_TRUE(content("link.nrrd") == a) << "only a name was removed";
  expect_ok(tagrid({"restore", "--records", "."}));
  EXPECT_TRUE(content("a.nrrd") == a);
}

}  // namespace
}  // namespace tagrid
