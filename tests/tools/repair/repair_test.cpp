// protect and repair, as a user runs them.
#include <cstring>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/files/file_bytes.h"
#include "io/parity/parity.h"
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

class RepairCommands : public CommandLine {
 protected:
  void SetUp() override {
    works("phantom --dims 90,80,70 -q -o a.nhdr");
    works("encode a.nhdr -q");
    plain_ = content("a.tag");
  }
  void expect_repaired(const std::string& damaged, const std::string& whole) {
    EXPECT_EQ(tagrid({"verify", damaged, "-q"}).code, broken_input);
    expect_ok(tagrid({"repair", damaged, "-f", "-o", "whole.tag", "-q"}));
    EXPECT_TRUE(content("whole.tag") == whole);
  }
  /// The file with other bytes from `begin` on.
  static std::string damaged(std::string bytes, std::size_t begin, std::size_t count) {
    for (std::size_t i = begin; i < begin + count; ++i) bytes[i] = static_cast<char>(~bytes[i]);
    return bytes;
  }

  std::string plain_;
};

// Parity brings bytes back, whatever they are.
TEST_F(RepairCommands, BringBackAFileOfANewerVersion) {
  auto* const bytes = reinterpret_cast<std::byte*>(plain_.data());
  store_little_endian<std::uint32_t>(bytes + 8, 6);
  const auto header = load_little_endian<std::uint32_t>(bytes + 12);
  store_little_endian(bytes + header - 8, checksum_of({std::span(bytes, header - 8)}));
  file("new.tag", plain_);
  for (const bool beside : {false, true}) {
    std::string parity;
    write_parity(FileSource(path("new.tag")), 5000, beside ? 0 : plain_.size(),
                 [&](std::uint64_t at, std::span<const std::byte> part) {
                   at -= beside ? 0 : plain_.size();
                   parity.resize(std::max<std::size_t>(parity.size(), at + part.size()));
                   std::memcpy(parity.data() + at, part.data(), part.size());
                 });
    const std::string whole = beside ? plain_ : plain_ + parity;
    file("a.tag", whole);
    if (beside) file("a.tag.parity", parity);
    const Ending verified = tagrid({"verify", "a.tag"});
    EXPECT_EQ(verified.code, broken_input);
    EXPECT_TRUE(has(verified.out, "nothing else of it can be checked by this version"));
    EXPECT_TRUE(has(verified.err, "of a newer version: update tagrid"));
    for (const std::size_t begin : {std::size_t{20}, plain_.size() / 2, plain_.size() - 30}) {
      file("a.tag", damaged(whole, begin, 30));
      const Ending repaired = tagrid({"repair", "a.tag", "-f", "-o", "whole.tag"});
      EXPECT_EQ(repaired.code, 0) << repaired.err;
      EXPECT_TRUE(has(repaired.err, "newer version"));
      EXPECT_TRUE(content("whole.tag") == whole);
    }
  }
}

// Another file has taken the place of the one that was protected, and differs in a few bytes.
TEST_F(RepairCommands, ParityOfAnotherFileIsRefused) {
  works("encode a.nhdr -q -f -o a.tag --strip");
  works("protect a.tag -q --parity 50% --beside");
  std::string samples = content("a.raw");
  samples.back() = static_cast<char>(samples.back() ^ 1);
  file("a.raw", samples);
  works("encode a.nhdr -q -f -o a.tag --strip");
  fails("repair a.tag -o whole.tag", broken_input, "is not what a.tag.parity protects");
  EXPECT_FALSE(std::filesystem::exists(path("whole.tag")));
}

// Only the header and the checksums of all blocks differ, which parity could make good.
TEST_F(RepairCommands, ParityOfTheFileBeforeItWasWrittenAnewIsRefused) {
  works("protect a.tag -q --parity 20% --beside");
  std::string header = content("a.nhdr");
  header.insert(header.find("encoding:"), "content: another\n");
  file("a.nhdr", header);
  const Ending ending = tagrid({"encode", "a.nhdr", "-f", "--strip"});
  EXPECT_TRUE(has(ending.err, "a.tag.parity: may be of an earlier file"));
  file("a.tag", damaged(content("a.tag"), plain_.size() / 2, 4));
  EXPECT_EQ(tagrid({"repair", "a.tag", "-o", "whole.tag"}).code, broken_input);
  EXPECT_FALSE(std::filesystem::exists(path("whole.tag")));
}

TEST_F(RepairCommands, ParityInTheFileHelpsWhereThatBesideItDoesNot) {
  works("encode a.nhdr -q -o b.tag --parity 5%");
  const std::string whole = content("b.tag");
  works("phantom --dims 40,40,40 -q -o other.nhdr");
  works("encode other.nhdr -q");
  works("protect other.tag -q --parity 5% --beside");
  std::filesystem::rename(path("other.tag.parity"), path("b.tag.parity"));
  file("b.tag", damaged(whole.substr(0, whole.size() - 60), 2000, 1));
  expect_repaired("b.tag", whole);
}

TEST_F(RepairCommands, DamagedParityInTheFileIsRebuiltOrMissedThoughThatBesideItIsWhole) {
  works("protect a.tag -q --parity 20% --beside");
  works("protect a.tag -q --parity 5%");
  const std::string whole = content("a.tag");
  for (const std::size_t begin : {std::size_t{2000}, plain_.size() + 500}) {
    file("a.tag", damaged(damaged(whole, begin, 1), whole.size() - 40, 30));
    expect_repaired("a.tag", whole);
  }
  // More than parity in the file can repair, or all of it.
  const std::size_t more = whole.size() - plain_.size();
  for (const std::string& bytes :
       {damaged(damaged(whole, plain_.size() - more / 2, more - 500), whole.size() - 40, 40),
        damaged(whole, plain_.size(), more), damaged(whole, plain_.size() - 2 * more, 2 * more)}) {
    file("a.tag", bytes);
    const Ending ending = tagrid({"repair", "a.tag", "-fo", "whole.tag"});
    EXPECT_EQ(ending.code, 0) << ending.err;
    EXPECT_TRUE(content("whole.tag") == plain_);
    EXPECT_TRUE(
        has(ending.err, std::to_string(more) +
                            " bytes after the end, such as parity, were left out; protect whole.tag again"))
        << ending.err;
  }
}

// Without the word that it is one, a user might replace the file.
TEST_F(RepairCommands, AFileWhoseBeginningIsDamagedIsKnownByItsEndOrItsParity) {
  const std::string beginning = "c.tag: the beginning of this .tag file is damaged";
  works("protect a.tag -q --parity 5% --beside");
  std::filesystem::rename(path("a.tag.parity"), path("c.tag.parity"));
  for (const bool is_protected : {true, false}) {
    file("c.tag", damaged(plain_, 0, 20));
    for (const char* command : {"verify", "info", "decode", "mesh", "preview"}) {
      const Ending ending = tagrid({command, "c.tag"});
      expect_error(ending, broken_input, beginning);
      EXPECT_EQ(has(ending.err, "tagrid repair c.tag -o OUT rebuilds what is damaged"), is_protected);
      EXPECT_FALSE(has(ending.err, "encode it first")) << ending.err;
    }
    // Only the parity shows what it was.
    file("c.tag", damaged(damaged(plain_, 0, 20), plain_.size() - 20, 20));
    fails("info c.tag", broken_input, is_protected ? beginning : "not a .tag file, or its");
    std::filesystem::remove(path("c.tag.parity"));
  }
  works("protect a.tag -q --parity 5%");
  file("c.tag", damaged(content("a.tag"), 0, 20));
  fails("info c.tag", broken_input, beginning);
  // Parity of the file that was there before does not make one of another format.
  file("a.tag.parity", "TAG PAR\n");
  file("a.tag", "NRRD0004\n");
  fails("info a.tag", broken_input, "not a .tag file, but an NRRD volume; encode it first");
}

TEST_F(RepairCommands, EveryCommandThatReadsADamagedFileAdvisesToRepairIt) {
  works("protect a.tag -q --parity 5%");
  file("c.tag", damaged(content("a.tag"), plain_.size() / 2, 30));
  const std::string advice = "; tagrid repair c.tag -o OUT rebuilds what is damaged";
  const auto before = names();
  for (const char* command : {"decode c.tag", "mesh c.tag", "mesh c.tag --coarsen 5", "surface c.tag --iso 9",
                              "restore c.tag -o files", "verify c.tag"})
    fails(command, broken_input, advice);
  EXPECT_EQ(names(), before);
  const std::string message = tagrid({"decode", "c.tag"}).err;
  EXPECT_LT(message.find(advice), message.find("; tagrid decode c.tag --salvage decodes the intact bricks"))
      << message;
  file("c.tag", damaged(plain_, plain_.size() / 2, 30));
  EXPECT_FALSE(has(tagrid({"decode", "c.tag"}).err, "repair"));
  // Parity beside a file that cannot be read is not passed over.
  file("b.tag", plain_);
  for (const std::string& other : {std::string(), std::string(30000, 'x')}) {
    file("b.tag.parity", other);
    fails("verify b.tag", broken_input, "nothing of b.tag.parity can be read");
  }
}

TEST_F(RepairCommands, WhatIsNoRegularFileIsRefused) {
  const std::string protect = "protect --parity 5% ", repair = "repair -o whole.tag ";
  for (const auto& [command, name] : {std::pair(protect, "protect"), {repair, "repair"}}) {
    const std::string why =
        std::string(": the file to ") + name + " must be a regular file; save it as one first";
    fails(command + "/dev/null", usage, "/dev/null" + why);
    fails(command + "-", usage, "standard input" + why);
    fails(command + ".", usage, ".: is a directory, not a .tag file");
    fails(command + "missing.tag", world, "missing.tag: cannot open");
  }
  fails("repair a.tag -o -", usage, "standard output: the output must be");
}

TEST_F(RepairCommands, ALinkStandsForTheFileThatItNames) {
  std::filesystem::rename(path("a.tag"), path("real.tag"));
  std::filesystem::create_symlink("real.tag", path("a.tag"));
  works("protect a.tag -q --parity 5% --beside");
  EXPECT_TRUE(std::filesystem::exists(path("real.tag.parity")));
  const Ending ending = tagrid({"protect", "a.tag", "--parity", "5%"});
  EXPECT_EQ(ending.code, 0);
  EXPECT_TRUE(has(ending.err, "real.tag.parity: is of the file without parity"));
  EXPECT_TRUE(std::filesystem::is_symlink(path("a.tag")));
  EXPECT_GT(content("real.tag").size(), plain_.size());
}

}  // namespace
}  // namespace tagrid
