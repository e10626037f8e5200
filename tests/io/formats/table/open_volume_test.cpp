#include "io/formats/table/open_volume.h"
#include "io/metadata/text.h"

#include <rapidcheck.h>

#include <cstring>
#include <numeric>

#include "io/errors/errors.h"
#include "tests/support/gzipped.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

const Index3 dims{3, 4, 5};
const std::string header_end = "dimension: 3\nsizes: 3 4 5\n";
const std::string little = "NRRD0004\ntype: int16\nendian: little\n" + header_end;

std::vector<std::int16_t> samples() {
  std::vector<std::int16_t> result(60);
  std::iota(result.begin(), result.end(), std::int16_t{-300});
  return result;
}

/// The samples as in a file.
std::string bytes_of(bool big_endian) {
  std::string bytes;
  for (std::int16_t sample : samples()) {
    const auto bits = static_cast<std::uint16_t>(sample);
    const char low = static_cast<char>(bits & 255), high = static_cast<char>(bits >> 8);
    bytes += big_endian ? high : low;
    bytes += big_endian ? low : high;
  }
  return bytes;
}

RawDescription raw_int16() { return {dims, SampleType::int16, false, 0}; }

/// Reads a volume to its end, in steps of 2 slices.
std::vector<std::int16_t> read_rest(VolumeSource& reader, std::int64_t z = 0) {
  std::vector<std::int16_t> out(
      static_cast<std::size_t>(reader.slice_samples() * (reader.info().dims.z - z)));
  auto* to = reinterpret_cast<std::byte*>(out.data());
  for (; z < reader.info().dims.z; z += 2) {
    const std::int64_t count = std::min<std::int64_t>(2, reader.info().dims.z - z);
    reader.read_slices(to, count);
    to += count * reader.slice_samples() * 2;
  }
  reader.finish();
  return out;
}

std::vector<std::int16_t> read_all(const std::string& path,
                                   std::optional<RawDescription> raw = std::nullopt) {
  const auto reader = open_volume(path, SourceDescription(raw));
  return read_rest(*reader);
}

class OpenVolumeTest : public TemporaryFolder {
 protected:
  void expect_broken(const std::string& content) const {
    message_of<BrokenInput>([&] { read_all(file("a.nrrd", content)); });
  }
};

TEST_F(OpenVolumeTest, EveryWayToStoreAVolumeGivesTheSameSamples) {
  const std::string big = "NRRD0001\ntype: short\nendian: big\n" + header_end;
  const std::string raw = bytes_of(false);
  EXPECT_EQ(read_all(file("attached.nrrd", little + "encoding: raw\n\n" + raw)), samples());
  EXPECT_EQ(read_all(file("big.nrrd", big + "encoding: raw\n\n" + bytes_of(true))), samples());
  EXPECT_EQ(read_all(file("gzip.nrrd", little + "encoding: gzip\n\n" + gzipped(raw))), samples());
  EXPECT_EQ(read_all(file("members.nrrd", little + "encoding: gz\n\n" + gzipped(raw.substr(0, 31)) +
                                              gzipped(raw.substr(31)))),
            samples());
  EXPECT_EQ(read_all(file("gzskip.nrrd", little + "encoding: gz\nbyte skip: 3\n\n" + gzipped("abc" + raw))),
            samples());

  std::filesystem::create_directory(path("sub"));
  file("sub/data", raw);
  EXPECT_EQ(read_all(file("detached.nhdr", little + "encoding: raw\ndata file: sub/data\n")), samples());
  file("sub/data with head", "one\r\ntwo\nabc" + raw);
  EXPECT_EQ(read_all(file("skip.nhdr",
                          little + "encoding: raw\nline skip: 2\nbyte skip: 3\ndata file: sub/data with "
                                   "head\n")),
            samples());
  EXPECT_EQ(
      read_all(file("last.nhdr", little + "encoding: raw\nbyte skip: -1\ndata file: sub/data with head\n")),
      samples());

  RawDescription description = raw_int16();
  EXPECT_EQ(read_all(path("sub/data"), description), samples());
  description.offset = 12;
  EXPECT_EQ(read_all(path("sub/data with head"), description), samples());
  description.offset = 0;
  description.big_endian = true;
  EXPECT_EQ(read_all(file("big.raw", bytes_of(true)), description), samples());
}

TEST_F(OpenVolumeTest, PipesGiveTheSameSamples) {
  const FilledPipe nrrd(little + "encoding: raw\n\n" + bytes_of(false));
  EXPECT_FALSE(open_volume(FilledPipe(little + "encoding: raw\n\n").path())->traits().again);
  EXPECT_EQ(read_all(nrrd.path()), samples());
  EXPECT_EQ(read_all(FilledPipe(bytes_of(false)).path(), raw_int16()), samples());
  EXPECT_EQ(read_all(FilledPipe(little + "encoding: gzip\n\n" + gzipped(bytes_of(false))).path()), samples());
  RawDescription offset = raw_int16();
  offset.offset = 5;
  EXPECT_EQ(read_all(FilledPipe("12345" + bytes_of(false)).path(), offset), samples());
}

TEST_F(OpenVolumeTest, SlicesCanBeReadAgain) {
  for (const std::string& name :
       {file("a.nrrd", little + "encoding: raw\n\n" + bytes_of(false)),
        file("b.nrrd", little + "encoding: gzip\nbyte skip: 3\n\n" + gzipped("abc" + bytes_of(false)))}) {
    const auto reader = open_volume(name);
    ASSERT_TRUE(reader->traits().again);
    EXPECT_EQ(read_rest(*reader), samples());
    reader->rewind();
    EXPECT_EQ(read_rest(*reader), samples());
    reader->seek_slice(3);
    const auto all = samples();
    EXPECT_EQ(read_rest(*reader, 3), std::vector<std::int16_t>(all.begin() + 36, all.end()));
  }
}

TEST_F(OpenVolumeTest, ASizeThatDoesNotFitIsToldWithBothSizesBeforeAnythingIsRead) {
  for (const std::string& present : {bytes_of(false) + "x", bytes_of(false).substr(1)}) {
    const std::string name = file("a.raw", present);
    std::vector<std::string> messages = {
        message_of<BrokenInput>([&] { open_volume(name, SourceDescription(raw_int16())); })};
    // A header says where the samples end.
    if (present.size() < bytes_of(false).size()) {
      messages.push_back(message_of<BrokenInput>(
          [&] { open_volume(file("a.nhdr", little + "encoding: raw\ndata file: a.raw\n")); }));
      messages.push_back(message_of<BrokenInput>(
          [&] { open_volume(file("a.nrrd", little + "encoding: raw\n\n" + present)); }));
    }
    for (const std::string& message : messages) {
      EXPECT_TRUE(has(message, "120"));
      EXPECT_TRUE(has(message, std::to_string(present.size())));
      EXPECT_TRUE(has(message, "3 x 4 x 5 int16"));
    }
  }
}

TEST_F(OpenVolumeTest, BytesAfterTheSamplesOfAHeaderAreSaid) {
  file("a.raw", bytes_of(false) + "xyz");
  const std::string gzip = little + "encoding: gzip\n\n";
  for (const std::string& name : {file("a.nhdr", little + "encoding: raw\ndata file: a.raw\n"),
                                  file("a.nrrd", little + "encoding: raw\n\n" + bytes_of(false) + "xyz"),
                                  file("b.nrrd", gzip + gzipped(bytes_of(false) + "xyz")),
                                  file("c.nrrd", gzip + gzipped(bytes_of(false)) + gzipped("xyz"))}) {
    const auto reader = open_volume(name);
    EXPECT_EQ(read_rest(*reader), samples());
    EXPECT_TRUE(reader->facts().holds_other_bytes);
    ASSERT_EQ(reader->facts().warnings.size(), 1U);
    EXPECT_TRUE(has(reader->facts().warnings[0], "3 bytes follow the samples"));
  }
}

// Else the header would be read as samples.
TEST_F(OpenVolumeTest, SamplesAtTheEndDoNotReachIntoTheHeader) {
  const std::string header = little + "encoding: raw\nbyte skip: -1\n\n";
  const std::string all = header + bytes_of(false);
  EXPECT_EQ(read_all(file("a.nrrd", all)), samples());
  const std::string message = message_of<BrokenInput>(
      [&] { open_volume(file("a.nrrd", header + bytes_of(false).substr(header.size()))); });
  EXPECT_TRUE(has(message, "from byte " + std::to_string(header.size())));
}

TEST_F(OpenVolumeTest, APipeThatEndsTooSoonOrTooLateIsBroken) {
  const std::string early = message_of<BrokenInput>(
      [] { read_all(FilledPipe(bytes_of(false).substr(0, 77)).path(), raw_int16()); });
  EXPECT_TRUE(has(early, "120"));
  EXPECT_TRUE(has(early, "77"));
  message_of<BrokenInput>([] { read_all(FilledPipe(bytes_of(false) + "x").path(), raw_int16()); });
  message_of<BrokenInput>([] { read_all(FilledPipe(little + "encoding: raw\nbyte skip: -1\n\n").path()); });
  message_of<BrokenInput>([] { open_volume(FilledPipe("").path()); });
}

TEST_F(OpenVolumeTest, TruncatedDamagedOrOverlongGzipIsBroken) {
  const std::string header = little + "encoding: gzip\n\n", stream = gzipped(bytes_of(false));
  for (std::size_t size = 0; size < stream.size(); ++size) expect_broken(header + stream.substr(0, size));
  EXPECT_EQ(read_all(file("a.nrrd", header + stream)), samples());
  std::string damaged = stream;
  damaged[stream.size() - 6] ^= 1;  // the check value
  for (const std::string& wrong :
       {damaged, stream + "garbage", stream + std::string("\x1f\x8b", 2), gzipped(bytes_of(false).substr(1))})
    expect_broken(header + wrong);
  message_of<BrokenInput>([&] { read_all(FilledPipe(header + gzipped(bytes_of(false) + "x")).path()); });
}

TEST_F(OpenVolumeTest, SizesThatTheFileCannotHoldAndHeadersWithoutEndAreRefusedAtOnce) {
  const std::string start = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2000000 2000000 1000\n",
                    most = " skip: 9223372036854775807\n\n";
  std::string lines = "NRRD0004\n";
  while (lines.size() < 3 << 20) lines += "#\n";
  for (const std::string& content :
       {start + "encoding: raw\n\nxyz", start + "encoding: gzip\n\n" + gzipped("xyz"),
        little + "encoding: raw\nbyte" + most + bytes_of(false),
        little + "encoding: raw\nline" + most + bytes_of(false),
        little + "encoding: gzip\nbyte" + most + gzipped(bytes_of(false)),
        "NRRD0004\n#" + std::string(3 << 20, 'x'), lines})
    message_of<BrokenInput>([&] { open_volume(file("a.nrrd", content)); });
}

TEST_F(OpenVolumeTest, MissingFilesAndFoldersAreErrorsOfTheWorld) {
  EXPECT_TRUE(has(message_of<WorldError>([&] { open_volume(path("nothing.nrrd")); }), "nothing.nrrd"));
  EXPECT_TRUE(has(message_of<WorldError>(
                      [&] { open_volume(file("a.nhdr", little + "encoding: raw\ndata file: gone.raw\n")); }),
                  "it is the data file that " + path("a.nhdr") + " names"));
}

TEST_F(OpenVolumeTest, FilesOfAFolderAreEqualPartsOfSamplesWithoutAHeader) {
  file("s1.raw", "xx");
  EXPECT_TRUE(
      has(message_of<BrokenInput>([&] { open_volume(folder_.string(), SourceDescription(raw_int16())); }),
          "s1.raw: has 2 bytes"));
}

// Headers may come from anywhere: they must not make a program wait, or read from standard input or devices.
TEST_F(OpenVolumeTest, AHeaderNamesAFileAndNoStreamOrDevice) {
  ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
  for (const char* name : {"-", "/dev/stdin", "/dev/zero", "/dev/fd/0", "fifo", "./fifo"}) {
    const std::string header = file("a.nhdr", little + "encoding: raw\ndata file: " + name + "\n");
    const std::string message = message_of<BrokenInput>([&] { open_volume(header); });
    EXPECT_TRUE(has(message, "a.nhdr"));
    EXPECT_TRUE(has(message, "data file"));
  }
}

// As in teem: a relative path begins at the header.
TEST_F(OpenVolumeTest, AHeaderNamesItsSamplesByAnyPath) {
  std::filesystem::create_directory(path("sub"));
  const std::string data = file("data", bytes_of(false));
  EXPECT_EQ(read_all(file("a.nhdr", little + "encoding: raw\ndata file: " + data + "\n")), samples());
  const std::string outside = file("sub/a.nhdr", little + "encoding: raw\ndata file: ../data\n");
  EXPECT_THROW(read_all(outside), BrokenInput);
  SourceDescription permitted;
  permitted.data_outside = true;
  EXPECT_EQ(read_rest(*open_volume(outside, permitted)), samples());
}

TEST_F(OpenVolumeTest, WithoutHeaderTheErrorSaysThatTheFormatIsNotKnown) {
  try {
    open_volume(file("a.raw", bytes_of(false)));
    ADD_FAILURE();
  } catch (const BrokenInput& error) {
    EXPECT_EQ(error.detail().problem, Problem::no_known_format) << error.what();
  }
  message_of<BrokenInput>([&] { open_volume(file("empty", "")); });
}

TEST_F(OpenVolumeTest, AHeaderAndTheCommandLineMustAgree) {
  const std::string name = file("a.nrrd", little + "encoding: raw\n\n" + bytes_of(false));
  EXPECT_EQ(read_all(name, raw_int16()), samples());
  RawDescription other = raw_int16();
  other.dims = {5, 4, 3};
  message_of<BrokenInput>([&] { open_volume(name, SourceDescription(other)); });
  other = raw_int16();
  other.type = SampleType::uint16;
  message_of<UsageError>([&] { open_volume(name, SourceDescription(other)); });
  other = raw_int16();
  other.big_endian = true;
  message_of<UsageError>([&] { open_volume(name, SourceDescription(other)); });
}

TEST_F(OpenVolumeTest, SpacingOfTheCommandLineBecomesAField) {
  SourceDescription source(raw_int16());
  source.spacing = GivenSpacing{{0.5, 0.5, 1.25}};
  const auto reader = open_volume(file("a.raw", bytes_of(false)), source);
  EXPECT_EQ(text_of(reader->info().metadata), "spacings: 0.5 0.5 1.25\n");
  EXPECT_EQ(reader->info().geometry().spacing, source.spacing->distances);
}

TEST_F(OpenVolumeTest, StandardInputIsReadFromWhereItStands) {
  file("a", "before" + little + "encoding: raw\n\n" + bytes_of(false));
  const int kept = dup(STDIN_FILENO), descriptor = open(path("a").c_str(), O_RDONLY);
  ASSERT_EQ(lseek(descriptor, 6, SEEK_SET), 6);
  dup2(descriptor, STDIN_FILENO);
  close(descriptor);
  {
    const auto reader = open_volume("-");
    EXPECT_TRUE(reader->traits().again);
    EXPECT_EQ(read_rest(*reader), samples());
    reader->rewind();
    EXPECT_EQ(read_rest(*reader), samples());
  }
  dup2(kept, STDIN_FILENO);
  close(kept);
}

TEST_F(OpenVolumeTest, AnyDamageIsReadOrRefused) {
  const std::string header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 6 4 5\nbyte skip: 0\nencoding: ";
  const std::vector<std::string> good = {header + "raw\n\n" + bytes_of(false),
                                         header + "gzip\n\n" + gzipped(bytes_of(false))};
  EXPECT_TRUE(rc::check([&] {
    std::string bytes = *rc::gen::elementOf(good);
    for (int i = *rc::gen::inRange(1, 4); i > 0; --i)
      bytes[*rc::gen::inRange<std::size_t>(0, bytes.size())] = *rc::gen::arbitrary<char>();
    if (*rc::gen::inRange(0, 3) == 0) bytes.resize(*rc::gen::inRange<std::size_t>(0, bytes.size()));
    try {
      const auto reader = open_volume(file("a.nrrd", bytes));
      RC_ASSERT(*sample_bytes(reader->info().dims, reader->info().type) < 10000000);
      std::vector<std::byte> slice(static_cast<std::size_t>(reader->slice_samples()) *
                                   size_of(reader->info().type));
      for (std::int64_t z = 0; z < reader->info().dims.z; ++z) reader->read_slices(slice.data(), 1);
      reader->finish();
    } catch (const BrokenInput&) {
    } catch (const WorldError&) {
      // The damage may name another file.
    }
  }));
}

TEST_F(OpenVolumeTest, RealVolumesOpen) {
  const std::filesystem::path data = std::filesystem::path(TAGRID_SOURCE_DIR) / "../shared/data";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no real volumes at " << data;
  int volumes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(data)) {
    if (entry.path().extension() != ".nhdr") continue;
    EXPECT_TRUE(is_sample_type(open_volume(entry.path().string())->info().type)) << entry.path();
    ++volumes;
  }
  EXPECT_GT(volumes, 0);
}

}  // namespace
}  // namespace tagrid
