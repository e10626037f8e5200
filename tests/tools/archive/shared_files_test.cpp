// encode --rm and convert --remove-verified: a data file that others may use stays, with its header.
#include <cstring>

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
    expect_error(tagrid({"encode", "a.mhd", "--max-error", "3", "--rm", "-o", "x.tag"}), usage, why);
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
  expect_kept("all.raw: cannot be removed: it lies beside a.mhd, whose name it does not have");
  // Names that only begin alike.
  for (const std::string name : {"ab.raw", "a_b.raw"}) {
    header("a.mhd", name);
    samples(name);
    expect_kept(name + ": cannot be removed: it lies beside a.mhd");
  }
}

TEST_F(SharedFiles, ThatAnotherHeaderNamesAreKept) {
  header("a.mhd", "a.raw");
  samples("a.raw");
  const std::string nrrd =
      "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 9 7 5\nencoding: raw\nendian: little\n";
  const std::pair<std::string, std::string> others[] = {
      {"b.mhd", "ElementDataFile = a.raw\n"},
      {"b.nhdr", nrrd + "data file: a.raw\n"},
      {"b.NHDR", nrrd + "data file: ./a.raw\r\n"},
      {"b.nhdr", nrrd + "data file: LIST\nz.raw\na.raw\n"},
      {"b.vrt", "<VRTDataset><SourceFilename relativeToVRT=\"1\">a.raw</SourceFilename></VRTDataset>"},
      {"b.vrt", "<VRTDataset><SourceFilename>C:\\scans\\a.raw</SourceFilename></VRTDataset>"},
      {"b.json", R"({"data": {"file": "a.raw", "type": "uint16"}})"},
      {"b.vgi", "[file1]\nName = a.raw\n"},
      {"b.h5", std::string("\x89HDF\r\n\x1a\n\0\0\0\1a.raw\0/v\0", 22)},
      {"a.hdr", "ENVI\nsamples = 9\n"},  // it names no file: that of its own name is meant
  };
  for (const auto& [name, text] : others) {
    SCOPED_TRACE(name + ": " + text);
    file(name, text);
    expect_kept("a.raw: cannot be removed: " + name + ", which lies beside it, names it, too");
    std::filesystem::remove(path(name));
  }
  // The header itself, too.
  file("b.xdmf", "<DataItem>a.mhd</DataItem>");
  expect_kept("a.mhd: cannot be removed: b.xdmf, which lies beside it, names it, too");
}

TEST_F(SharedFiles, OfNumberedSlicesAreThoseOfBothHeaders) {
  header("a.mhd", "a_1.raw");
  samples("a_1.raw");
  file("b.nhdr",
       "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 9 7 5\nencoding: raw\ndata file: a_%d.raw 1 5 1 2\n");
  expect_kept("a_1.raw: cannot be removed: b.nhdr, which lies beside it, names it, too");
}

TEST_F(SharedFiles, ThatNobodyElseNamesAreRemoved) {
  for (const std::string data : {"a.raw", "a_001.raw", "a-2.raw", "a7.raw"}) {
    SCOPED_TRACE(data);
    header("a.mhd", data);
    samples(data);
    // Lists, checksums, reports of tagrid and headers of other files keep nothing.
    file("SHA256SUMS", "00  a.mhd\n00  " + data + "\n");
    file("list.txt", "a.mhd\n" + data + "\n");
    header("c.mhd", "a.raws");
    header("ca.mhd", "ca.raw");
    expect_ok(tagrid({"encode", "a.mhd", "-o", "first.tag", "--json", "report.json", "-f"}));
    expect_ok(tagrid({"encode", "a.mhd", "--rm", "-o", "x.tag"}));
    EXPECT_FALSE(exists("a.mhd") || exists(data));
    expect_ok(script("rm x.tag"));
  }
}

}  // namespace
}  // namespace tagrid
