// encode --rm and convert --remove-verified: a data file that others may use stays, with its header.
#include <map>
#include <utility>

#include "tests/support/conversions.h"

namespace tagrid {
namespace {

class SharedFiles : public Conversions<CommandLine> {
 protected:
  /// A MetaImage header of these samples.
  void header(const std::string& name, const std::string& samples) const {
    file(name,
         "ObjectType = Image\nNDims = 3\nDimSize = 9 7 5\nElementType = MET_USHORT\nElementDataFile = " +
             samples + "\n");
  }
  void samples(const std::string& name) const {
    std::string bytes;
    for (int i = 0; i < 5 * 7 * 9; ++i) {
      const auto sample = static_cast<std::uint16_t>(i * 7919 % 4000);
      bytes.append(reinterpret_cast<const char*>(&sample), sizeof sample);
    }
    file(name, bytes);
  }
  /// Expects that neither way of removing removes anything of a.mhd, and that both say why.
  void expect_kept(const std::string& why) const {
    std::map<std::string, std::string> before;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      if (entry.is_regular_file())
        before[entry.path().filename().string()] = content(entry.path().filename().string());
    fails("encode a.mhd --max-error 3 --rm -o x.tag", usage, why);
    EXPECT_FALSE(exists("x.tag"));
    file("list.tsv", "a.mhd\n");
    expect_ok(convert());
    expect_failed(convert({"--remove-verified"}), why);
    EXPECT_EQ(last()["status"], "kept");
    for (const auto& [name, bytes] : before) EXPECT_TRUE(exists(name) && content(name) == bytes) << name;
    expect_ok(script("rm -r out list.tsv"));
  }
};

TEST_F(SharedFiles, WithoutTheNameOfTheHeaderAreKept) {
  header("a.mhd", "all.raw");
  samples("all.raw");
  expect_kept("all.raw: cannot be removed: it does not have the name of a.mhd");
  // Names that only begin alike.
  for (const std::string name : {"ab.raw", "a_b.raw"}) {
    header("a.mhd", name);
    samples(name);
    expect_kept(name + ": cannot be removed: it does not have the name of a.mhd");
  }
}

TEST_F(SharedFiles, ThatAnotherHeaderNamesAreKept) {
  header("a.mhd", "a.raw");
  samples("a.raw");
  const std::string nrrd =
      "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 9 7 5\nencoding: raw\nendian: little\n";
  const std::string hdf5 = "\x89HDF\r\n\x1a\n";
  const auto many = [](const std::string& part) {
    std::string all;
    while (all.size() < 3000000) all += part;
    return all;
  };
  const std::pair<std::string, std::string> others[] = {
      {"b.mhd", "ElementDataFile = a.raw\n"},
      {"b.nhdr", nrrd + "data file: a.raw\n"},
      {"b.NHDR", nrrd + "data file: ./a.raw\r\n"},
      {"b.nhdr", nrrd + "data file: LIST\nz.raw\na.raw\n"},
      {"b.vrt", "<VRTDataset><SourceFilename relativeToVRT=\"1\">a.raw</SourceFilename></VRTDataset>"},
      {"b.vrt", "<VRTDataset><SourceFilename>C:\\scans\\a.raw</SourceFilename></VRTDataset>"},
      {"b.vrt", "<VRTDataset>\n\n<SourceFilename>a&#46;raw</SourceFilename></VRTDataset>"},
      {"b.json", R"({"version": 1, "refs": {"v/0.0": ["scans/a.raw", 0, 630]}})"},
      {"b.json", R"({"v/.zarray": "{}", "v/0.0": ["\u0061.raw", 0, 630]})"},
      {"b.vgi", "[file1]\nName = a.raw\n"},
      {"b.bov", "TIME: 0\nDATA_FILE: a.raw\n"},
      {"b.dat", "ObjectFileName: a.raw\nFormat: USHORT\n"},
      {"b.companion.ome", "<OME><UUID FileName=\"a.raw\">urn</UUID></OME>"},
      {"b.mhd", "ElementDataFile = A.RAW\n"},
      // Far from their beginning, and across the blocks in which they are read.
      {"b.nhdr", nrrd + "data file: LIST\n" + many("slice_of_the_scan.raw\n") + "a.raw\n"},
      {"b.xdmf", "<Xdmf>" + many("<i/>") + "<DataItem>a.raw</DataItem>"},
      {"b.h5", hdf5 + std::string("\0\0\1a.raw\0/v\0", 12)},
      {"b.h5", hdf5 + std::string(2000000, '\7') + std::string("\0a.raw\0/v\0", 10)},
      {"b.h5", hdf5 + std::string((1 << 20) - 12, '\0') + std::string("a.raw\0/v\0", 9)},
      {"a.hdr", "ENVI\nsamples = 9\n"},  // it names no file: that of its own name is meant
  };
  for (const auto& [name, text] : others) {
    SCOPED_TRACE(name + ": " + text.substr(0, 200));
    file(name, text);
    expect_kept("a.raw: cannot be removed: another header, " + name + ", also names it");
    std::filesystem::remove(path(name));
  }
  // The header itself, too.
  file("b.xdmf", "<DataItem>a.mhd</DataItem>");
  expect_kept("a.mhd: cannot be removed: another header, b.xdmf, also names it");
}

TEST_F(SharedFiles, WhoseNamesAreWrittenOtherwiseAreKept) {
  // Of XML and JSON.
  header("a&b.mhd", "a&b.raw");
  samples("a&b.raw");
  file("b.vrt", "<SourceFilename>a&amp;b.raw</SourceFilename>");
  fails("encode a&b.mhd --rm -o x.tag", usage, "another header, b.vrt, also names it");
  header("\u00e4.mhd", "\u00e4.raw");
  samples("\u00e4.raw");
  file("b.json", R"({"refs": {"v/0": ["\u00e4.raw", 0, 630]}})");
  expect_error(tagrid({"encode", "\u00e4.mhd", "--rm", "-o", "x.tag"}), usage,
               "another header, b.json, also names it");
  // By a symbolic link.
  header("a.mhd", "a.raw");
  samples("a.raw");
  header("b.mhd", "link.raw");
  std::filesystem::create_symlink("a.raw", path("link.raw"));
  expect_kept("a.raw: cannot be removed: another header, b.mhd, also names it");
}

TEST_F(SharedFiles, ThatHeadersInDirectoriesAboveAndBelowNameAreKept) {
  std::filesystem::create_directories(path("scan/below"));
  header("scan/a.mhd", "a.raw");
  samples("scan/a.raw");
  // Those are of files of the same name in other directories.
  header("scan/below/a.mhd", "a.raw");
  header("b.mhd", "other/a.raw");
  const auto refused = [&](const std::string& why) { fails("encode scan/a.mhd --rm -o x.tag", usage, why); };
  header("scan/below/b.mhd", "../a.raw");
  refused("scan/a.raw: cannot be removed: another header, below/b.mhd, also names it");
  header("scan/below/b.mhd", "link.raw");
  std::filesystem::create_symlink("../a.raw", path("scan/below/link.raw"));
  refused("scan/a.raw: cannot be removed: another header, below/b.mhd, also names it");
  std::filesystem::remove(path("scan/below/link.raw"));
  header("b.mhd", "scan/a.raw");
  refused("scan/a.raw: cannot be removed: another header, ../b.mhd, also names it");
  std::filesystem::remove(path("b.mhd"));
  works("encode scan/a.mhd --rm -o x.tag");
  EXPECT_FALSE(exists("scan/a.raw"));
}

TEST_F(SharedFiles, OfNumberedSlicesAreThoseOfBothHeaders) {
  header("a.mhd", "a_1.raw");
  samples("a_1.raw");
  file("b.nhdr",
       "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 9 7 5\nencoding: raw\ndata file: a_%d.raw 1 5 1 2\n");
  expect_kept("a_1.raw: cannot be removed: another header, b.nhdr, also names it");
}

TEST_F(SharedFiles, ThatNobodyElseNamesAreRemoved) {
  for (const std::string data : {"a.raw", "a_001.raw", "a-2.raw", "a7.raw"}) {
    SCOPED_TRACE(data);
    header("a.mhd", data);
    samples(data);
    // Lists, checksums, reports, descriptions and headers of other files keep nothing.
    file("log.json", R"({"input": "a.mhd", "samples": ")" + data + R"("})");
    file("sidecar.json", R"({"IntendedFor": "perf/a.mhd", "Sources": [")" + data + R"("]})");
    file("meta.xml", "<first>" + data + "</first>");
    file("project.vgl", "<p>" + data + "</p>");
    file("b.nhdr", "NRRD0004\n# from " + data + "\ncontent: " + data + "\ndata file: b.raw\n");
    file("attached.nrrd", "NRRD0004\ncontent: " + data + "\n\ndata file: " + data + "\n");
    file("SHA256SUMS", "00  a.mhd\n00  " + data + "\n");
    file("list.txt", "a.mhd\n" + data + "\n");
    header("c.mhd", "a.raws");
    header("ca.mhd", "ca.raw");
    works("encode a.mhd -o first.tag --json report.json -f");
    works("encode a.mhd --rm -o x.tag");
    EXPECT_FALSE(exists("a.mhd") || exists(data));
    expect_ok(script("rm x.tag"));
  }
}

TEST_F(SharedFiles, WithNumbersAsNamesAreNotMeantByNumbers) {
  header("1.mhd", "1");
  samples("1");
  file("b.vgi", "[representation]\nsize = 1 1 1\n");
  file("b.xdmf", "<DataItem Dimensions=\"1\">1 1</DataItem>");
  file("b.nhdr", "NRRD0004\ndimension: 1\ndata file: b.raw\n");
  works("encode 1.mhd --rm -o x.tag");
  EXPECT_FALSE(exists("1"));
}

TEST_F(SharedFiles, BesideManyPatternsTakeNoTime) {
  header("a.mhd", "a_1.raw");
  samples("a_1.raw");
  for (int i = 2; i < 2000; ++i) file("a_" + std::to_string(i) + ".raw", "");
  std::string patterns;
  for (int i = 0; i < 20000; ++i) patterns += "DATA_FILE: b" + std::to_string(i) + "_%d.raw\nDATA_FILE: %d\n";
  file("b.bov", patterns);
  const auto begin = std::chrono::steady_clock::now();
  works("encode a.mhd --rm -o x.tag");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

// What happens to an archive after its conversion: it moves, its files are protected, its runs are repeated.

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
  works("protect a/out/v.tag --parity 5%");
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
  works("protect a/out/w.tag --parity 10%");
  expect_ok(in("a", {"--skip-done"}));
  EXPECT_TRUE(has_parity("a/out/w.tag"));
  works("restore --records a/out");
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
  works("restore --records .");
  EXPECT_TRUE(content("a.nrrd") == a);
}

}  // namespace
}  // namespace tagrid
