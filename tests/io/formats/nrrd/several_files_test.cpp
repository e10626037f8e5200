// Headers that name several data files.

#include <rapidcheck.h>

#include <numeric>

#include "io/errors/errors.h"
#include "io/formats/nrrd/header.h"
#include "io/formats/table/open_volume.h"
#include "tests/support/gzipped.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using Samples = std::vector<std::uint16_t>;

const std::string header = "NRRD0005\ntype: uint16\ndimension: 3\nsizes: 4 3 6\nendian: big\n";
constexpr std::int64_t slice = 12, slices = 6;

Samples samples() {
  Samples all(static_cast<std::size_t>(slice * slices));
  std::iota(all.begin(), all.end(), std::uint16_t{250});
  return all;
}

/// Slices first to last - 1, as in a file.
std::string bytes_of(std::int64_t first, std::int64_t last) {
  std::string bytes;
  const Samples all = samples();
  for (std::int64_t i = first * slice; i < last * slice; ++i) {
    const std::uint16_t sample = all[static_cast<std::size_t>(i)];
    bytes += static_cast<char>(sample >> 8);
    bytes += static_cast<char>(sample & 255);
  }
  return bytes;
}

Samples read_to_end(VolumeSource& source) {
  Samples all(static_cast<std::size_t>(slice * slices));
  source.read_slices(reinterpret_cast<std::byte*>(all.data()), slices);
  source.finish();
  return all;
}

class SeveralFiles : public TemporaryFolder {
 protected:
  /// Writes s0.raw and so on, of which each has `in_file` slices.
  void write_files(std::int64_t in_file) const {
    for (std::int64_t z = 0; z < slices; z += in_file)
      file("s" + std::to_string(z) + ".raw", bytes_of(z, z + in_file));
  }
  std::unique_ptr<VolumeSource> open(const std::string& fields) const {
    return open_volume(file("h.nhdr", header + fields));
  }
  Samples read(const std::string& fields) const { return read_to_end(*open(fields)); }
};

TEST_F(SeveralFiles, NumbersAndListsNameThem) {
  write_files(1);
  EXPECT_EQ(read("encoding: raw\ndata file: s%d.raw 0 5 1\n"), samples());
  EXPECT_EQ(read("encoding: raw\ndatafile: s%d.raw  0 5 1  2\n"), samples());
  EXPECT_EQ(read("encoding: raw\ndata file: LIST\ns0.raw\ns1.raw\ns2.raw\ns3.raw\ns4.raw\ns5.raw\n"),
            samples());
  EXPECT_EQ(read("encoding: raw\ndata file: "
                 "LIST\r\ns0.raw\r\ns1.raw\r\ns2.raw\r\ns3.raw\r\ns4.raw\r\ns5.raw\r\n\r\n"),
            samples());
  write_files(2);
  EXPECT_EQ(read("encoding: raw\ndata file: s%d.raw 0 5 2 3\n"), samples());
  EXPECT_EQ(read("encoding: raw\ndata file: LIST 3\ns0.raw\ns2.raw\ns4.raw\n"), samples());
  write_files(6);
  EXPECT_EQ(read("encoding: raw\ndata file: s%d.raw 0 0 1 3\n"), samples());
}

TEST_F(SeveralFiles, NumbersAreThoseOfPrintf) {
  const auto names = [](const std::string& value) {
    return parse_nrrd_header(
               "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 1 1 3\nencoding: raw\ndata file: " + value + "\n")
        .data_files;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names("a%03d.raw 8 10 1"), (Names{"a008.raw", "a009.raw", "a010.raw"}));
  EXPECT_EQ(names("%i 8 12 2"), (Names{"8", "10", "12"}));
  EXPECT_EQ(names("%i 8 13 2"), (Names{"8", "10", "12"}));
  EXPECT_EQ(names("a%03dz 1 -1 -1"), (Names{"a001z", "a000z", "a-01z"}));
  EXPECT_EQ(names("a%3u 9 11 1"), (Names{"a  9", "a 10", "a 11"}));
  EXPECT_EQ(names("a%d%d 1 3 1"), (Names{"a1%d", "a2%d", "a3%d"}));
}

TEST_F(SeveralFiles, EachIsSkippedAndUnpackedByItself) {
  for (const std::int64_t z : {0, 2, 4}) {
    const std::string bytes = bytes_of(z, z + 2), name = std::to_string(z);
    file("g" + name, gzipped("ab" + bytes));
    file("k" + name, "a line\nabc" + bytes);
    file("e" + name, std::string(static_cast<std::size_t>(z), 'x') + bytes);
  }
  EXPECT_EQ(read("encoding: gzip\nbyte skip: 2\ndata file: g%d 0 4 2 3\n"), samples());
  EXPECT_EQ(read("encoding: raw\nline skip: 1\nbyte skip: 3\ndata file: k%d 0 4 2 3\n"), samples());
  EXPECT_EQ(read("encoding: raw\nbyte skip: -1\ndata file: e%d 0 4 2 3\n"), samples());
  EXPECT_TRUE(open("encoding: raw\nbyte skip: -1\ndata file: e%d 0 4 2 3\n")->facts().holds_other_bytes);
}

TEST_F(SeveralFiles, AnyRowsAreReadInAnyOrder) {
  write_files(2);
  const auto source = open("encoding: raw\ndata file: s%d.raw 0 4 2 3\n");
  ASSERT_TRUE(source->traits().any_rows);
  const Samples all = samples();
  rc::check([&] {
    const auto z = *rc::gen::inRange<std::int64_t>(0, slices), y = *rc::gen::inRange<std::int64_t>(0, 3),
               last = *rc::gen::inRange<std::int64_t>(y, 3);
    if (*rc::gen::inRange(0, 4) == 0) {
      source->seek_slice(z);
      const auto count = *rc::gen::inRange<std::int64_t>(0, (slices - z) * slice + 1);
      Samples read(static_cast<std::size_t>(count));
      source->read_samples(reinterpret_cast<std::byte*>(read.data()), count);
      RC_ASSERT(std::equal(read.begin(), read.end(), all.begin() + z * slice));
    }
    Samples rows(static_cast<std::size_t>(4 * (last - y + 1)));
    source->read_rows(reinterpret_cast<std::byte*>(rows.data()), {{0, y, z}, {3, last, z}});
    RC_ASSERT(std::equal(rows.begin(), rows.end(), all.begin() + z * slice + y * 4));
  });
}

TEST_F(SeveralFiles, SlicesAreReadAgain) {
  for (const std::int64_t z : {0, 2, 4}) file("g" + std::to_string(z), gzipped(bytes_of(z, z + 2)));
  const auto source = open("encoding: gzip\ndata file: g%d 0 4 2 3\n");
  EXPECT_FALSE(source->traits().any_rows);
  EXPECT_EQ(read_to_end(*source), samples());
  for (std::int64_t z = slices - 1; z >= 0; --z) {
    source->seek_slice(z);
    Samples one(slice);
    source->read_slices(reinterpret_cast<std::byte*>(one.data()), 1);
    const Samples all = samples();
    EXPECT_TRUE(std::equal(one.begin(), one.end(), all.begin() + z * slice));
  }
  source->rewind();
  EXPECT_EQ(read_to_end(*source), samples());
}

TEST_F(SeveralFiles, BytesAndFilesAreThoseOfAll) {
  write_files(2);
  const auto source = open("encoding: raw\ndata file: LIST 3\ns0.raw\ns2.raw\ns4.raw\n");
  EXPECT_EQ(source->files(),
            (std::vector<std::string>{path("h.nhdr"), path("s0.raw"), path("s2.raw"), path("s4.raw")}));
  const std::uint64_t all = 2 * slice * slices + std::filesystem::file_size(path("h.nhdr"));
  read_to_end(*source);
  EXPECT_EQ(source->bytes_read(), all);
  source->rewind();
  const std::uint64_t header_bytes = std::filesystem::file_size(path("h.nhdr"));
  EXPECT_EQ(source->bytes_read(), header_bytes);
  read_to_end(*source);
  EXPECT_EQ(source->bytes_read(), all);
  // A file that is named again is one file.
  EXPECT_EQ(open("encoding: raw\ndata file: LIST 3\ns0.raw\ns0.raw\ns4.raw\n")->files().size(), 3U);
}

TEST_F(SeveralFiles, OneThatIsMissingOrHasAnotherSizeIsFoundAtOnce) {
  write_files(2);
  const std::string fields = "encoding: raw\ndata file: s%d.raw 0 4 2 3\n";
  file("s4.raw", bytes_of(4, 6).substr(1));
  EXPECT_TRUE(
      has(message_of<BrokenInput>([&] { open(fields); }), "s4.raw: 48 bytes of samples are expected"));
  file("s4.raw", bytes_of(4, 6) + "x");
  const auto longer = open(fields);
  ASSERT_EQ(longer->facts().warnings.size(), 1U);
  EXPECT_TRUE(has(longer->facts().warnings[0], "s4.raw: 1 bytes follow the samples"));
  std::filesystem::remove(path("s2.raw"));
  EXPECT_TRUE(has(message_of<WorldError>([&] { open(fields); }), "s2.raw"));
  EXPECT_TRUE(
      has(message_of<BrokenInput>([&] { open("encoding: raw\ndata file: LIST 3\ns0.raw\n-\ns4.raw\n"); }),
          "must name a file, not a stream"));
  file("s2.raw", gzipped(bytes_of(2, 4)).substr(0, 30));
  file("s0.raw", gzipped(bytes_of(0, 2)));
  file("s4.raw", gzipped(bytes_of(4, 6) + "x"));
  EXPECT_TRUE(
      has(message_of<BrokenInput>([&] { read("encoding: gzip\ndata file: s%d.raw 0 4 2 3\n"); }), "s2.raw"));
  file("s2.raw", gzipped(bytes_of(2, 4)));
  EXPECT_EQ(open("encoding: gzip\ndata file: s%d.raw 0 4 2 3\n")->facts().warnings.size(), 1U);
  file("s4.raw", gzipped(bytes_of(4, 6).substr(1)));
  EXPECT_TRUE(has(message_of<BrokenInput>([&] { read("encoding: gzip\ndata file: s%d.raw 0 4 2 3\n"); }),
                  "s4.raw: 48 bytes of samples are expected (4 x 3 x 2 uint16), but it ends after 47"));
}

TEST_F(SeveralFiles, WhatDoesNotFitTheVolumeIsRefused) {
  const std::pair<const char*, const char*> wrong[] = {
      {"s%d.raw 0 4 1", "5 files cannot hold the 6 slices of the volume, one in each"},
      {"s%d.raw 0 3 1 3", "4 files cannot hold the 6 slices of the volume, equally many in each"},
      {"s%d.raw 0 5 1 1", "2 to 3 axes"},
      {"s%d.raw 0 5 1 4", "2 to 3 axes"},
      {"s%d.raw 0 5 1 2 7", "more follows"},
      {"s%d.raw 0 5 0", "the step does not lead"},
      {"s%d.raw 5 0 1", "the step does not lead"},
      {"s%d.raw 0 5 -1", "the step does not lead"},
      {"s%d.raw 0 5 x", "not a whole number"},
      {"s%d.raw 0 9223372036854775807 1", "too large"},
      {"s%d.raw -9223372036854775808 0 1", "too large"},
      {"s%d.raw 0 1000000000 1", "more than 65536 files"},
      {"s%9999d.raw 0 5 1", "so many digits"},
      {"LIST\na\nb", "2 files cannot hold"},
      {"LIST 3\n", "no file is named"},
      {"LIST 2 3\na", "more follows"},
      {"LIST x\na", "not a whole number"}};
  for (const auto& [value, says] : wrong) {
    const std::string text = header + "encoding: raw\ndata file: " + value + "\n";
    const std::string message = message_of<BrokenInput>([&] { parse_nrrd_header(text); });
    EXPECT_TRUE(has(message, says)) << value << ": " << message;
  }
}

}  // namespace
}  // namespace tagrid
