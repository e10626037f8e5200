// The envelope of a volume: what is written is read again, whatever the layout, and nothing else is believed.
#include <cstddef>
#include <cstdint>
#include <random>

#include "io/envelope/envelope.h"
#include "io/envelope/plain_bytes.h"
#include "io/errors/errors.h"
#include "io/samples/slices_in_files.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tests/support/gzipped.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using Content = std::vector<std::byte>;

class Envelope : public TemporaryFolder {
 protected:
  std::uint64_t below(std::uint64_t n) { return random_() % n; }

  /// Files of random bytes with the slices of a volume at random places, in any order.
  SourceFacts random_source(const Index3& dims, SampleType type) {
    SourceFacts facts{.info = {.dims = dims, .type = type}, .files = {}};
    bytes_.clear();
    for (std::int64_t z = 0; z < dims.z;) {
      const bool again = !bytes_.empty() && below(3) == 0;
      if (!again) bytes_.emplace_back();
      Content& file = bytes_.back();
      SliceRun run{.file = bytes_.size() - 1, .slices = 1 + static_cast<std::int64_t>(below(3))};
      run.slices = std::min(run.slices, dims.z - z);
      const std::uint64_t row = static_cast<std::uint64_t>(dims.x) * size_of(type);
      if (below(2) == 0) {
        run.row_step = row + below(2) * below(5);
        run.bottom_up = below(2) == 0;
      }
      const std::uint64_t span = *span_of_slice(run, {row, dims.y});
      run.step = span + below(2) * below(9);
      run.big_endian = below(2) == 0;
      if (!is_float_type(type) && size_of(type) <= 4 && below(2) == 0)
        run.stored = {.bits = static_cast<int>(1 + below(8 * size_of(type))),
                      .is_signed = below(2) == 0,
                      .add = static_cast<std::int32_t>(below(100)) - 50};
      run.offset = file.size() + below(20);
      file.resize(run.offset + static_cast<std::uint64_t>(run.slices - 1) * run.step + span + below(9));
      facts.places.push_back(run);
      z += run.slices;
    }
    for (std::size_t i = 0; i < bytes_.size(); ++i) {
      for (std::byte& byte : bytes_[i]) byte = static_cast<std::byte>(random_());
      const std::string name = "f" + std::to_string(i);
      std::ofstream(path(name), std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes_[i].data()),
                 static_cast<std::streamsize>(bytes_[i].size()));
      facts.files.push_back(path(name));
    }
    return facts;
  }

  static Content written(SourceFiles source, bool exact) {
    Content all;
    for (std::size_t i = 0; i < source.files.size(); ++i) look_at_content(source, exact, i);
    write_envelope(
        source, [&](std::span<const std::byte> bytes) { all.insert(all.end(), bytes.begin(), bytes.end()); });
    return all;
  }

  /// Gives `content` in blocks of random sizes.
  NextBlock in_blocks(const Content& content) {
    return [this, &content, position = std::size_t{0}](Content& block) mutable {
      if (position == content.size()) return false;
      const std::size_t n = std::min<std::size_t>(content.size() - position, 1 + below(40));
      const auto begin = content.begin() + static_cast<std::ptrdiff_t>(position);
      block.assign(begin, begin + static_cast<std::ptrdiff_t>(n));
      position += n;
      return true;
    };
  }

  std::mt19937 random_{7};
  std::vector<Content> bytes_;
};

TEST_F(Envelope, OtherBytesAndSamplesAreAllBytesOfTheFiles) {
  for (int round = 0; round < 60; ++round) {
    const SampleType types[] = {SampleType::uint8, SampleType::int16,   SampleType::uint16,
                                SampleType::int32, SampleType::float32, SampleType::float64};
    const SampleType type = types[below(6)];
    const Index3 dims = {1 + static_cast<std::int64_t>(below(5)), 1 + static_cast<std::int64_t>(below(5)),
                         1 + static_cast<std::int64_t>(below(9))};
    SCOPED_TRACE(std::to_string(round) + ": " + described(dims, type));
    const SourceFacts facts = random_source(dims, type);
    const auto source = placed_samples(facts, facts.places);
    const SourceFiles files = source_files(source->facts());
    ASSERT_EQ(files.why_not, std::nullopt);
    Content samples(*sample_bytes(dims, type));
    source->read_slices(samples.data(), dims.z);
    const std::uint64_t slice = source->slice_bytes();

    const Content content = written(files, true);
    EnvelopeReader reader("x.tag", {dims, type}, true, in_blocks(content));
    std::size_t number = 0;
    for (EnvelopeFile file; reader.next_file(file); ++number) {
      EXPECT_EQ(file.name, number < files.names.size() ? files.names[number] : "");
      Content made(file.size);
      reader.read_other_bytes(file, [&](std::uint64_t position, std::span<const std::byte> bytes) {
        std::ranges::copy(bytes, made.begin() + static_cast<std::ptrdiff_t>(position));
      });
      for (const SlicesInFile& slices : file.slices)
        for (std::int64_t i = 0; i < slices.run.slices; ++i) {
          Content one(samples.begin() + static_cast<std::ptrdiff_t>(
                                            static_cast<std::uint64_t>(slices.first_slice + i) * slice),
                      samples.begin() + static_cast<std::ptrdiff_t>(
                                            static_cast<std::uint64_t>(slices.first_slice + i + 1) * slice));
          to_stored(slices, type, one.data(), one.size() / size_of(type));
          const std::uint64_t row = slice / static_cast<std::uint64_t>(dims.y);
          for (std::size_t b = 0; b < one.size(); ++b)
            made[slices.run.offset + static_cast<std::uint64_t>(i) * slices.run.step +
                 place_of_row(slices.run, {row, dims.y}, static_cast<std::int64_t>(b / row)) + b % row] |=
                one[b];
        }
      EXPECT_TRUE(made == bytes_[number]) << number;
    }
    EXPECT_EQ(number, bytes_.size());
  }
}

// What says how a file would look is no reason to remove the file.
TEST_F(Envelope, AFormThatIsNotTheFileComesBackChangedWhateverItSays) {
  const Index3 dims = {3, 2, 1};
  std::ofstream(path("a"), std::ios::binary) << "0123456789";
  SourceFacts facts{.info = {.dims = dims, .type = SampleType::uint8}, .files = {path("a")}};
  const std::vector<std::vector<PlainPiece>> forms = {
      {PlainPiece::given("0123456780")},
      {PlainPiece::stretch(0, 0, 9)},
      {PlainPiece::stretch(0, 0, 9), PlainPiece::given("0")},
      // The file itself, but nobody knows that the samples that were read are those at the place.
      {PlainPiece::stretch(0, 0, 10)}};
  for (const auto& pieces : forms) {
    PlainForm form;
    form.files = {{path("a"), false, pieces}};
    form.places = {{.file = 0, .offset = 2, .step = 6}};
    facts.plain_form = [&] { return form; };
    const SourceFiles source = source_files(facts);
    EXPECT_EQ(source.why_not, std::nullopt);
    EXPECT_NE(source.why_not_restorable(), "");
    EXPECT_TRUE(source.files.front().is_changed);
    for (const bool exact : {true, false}) {
      const Content content = written(source, exact);
      EnvelopeReader reader("x.tag", {dims, SampleType::uint8}, exact, in_blocks(content));
      EnvelopeFile read;
      ASSERT_TRUE(reader.next_file(read));
      EXPECT_TRUE(read.is_changed);
    }
  }
}

// A form of the same files with other beginnings and ends, and samples that are not there.
TEST_F(Envelope, APlainFormIsKeptInsteadOfCompressedFiles) {
  const Index3 dims = {3, 2, 2};
  const auto file = [&](const std::string& name, const std::string& bytes) {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  };
  SourceFacts facts{.info = {.dims = dims, .type = SampleType::uint8},
                    .files = {file("a", "0123456789"), file("b", "abcdef")}};
  PlainForm form;
  form.compression = "packing";
  form.files = {{path("a"),
                 true,
                 {PlainPiece::given("head"), PlainPiece::samples(12), PlainPiece::stretch(1, 2, 5),
                  PlainPiece::stretch(0, 8, 10)}},
                {path("b"), false, {PlainPiece::stretch(1, 0, 6)}}};
  form.places = {{.file = 0, .offset = 10, .step = 6}, {.file = 0, .offset = 4, .step = 6}};
  facts.plain_form = [&] { return form; };
  const SourceFiles source = source_files(facts);
  EXPECT_EQ(source.why_not, std::nullopt);
  EXPECT_TRUE(has(source.why_not_restorable(), "packing"));
  for (const bool exact : {true, false}) {
    const Content content = written(source, exact);
    EXPECT_EQ(compression_in("x.tag", content), "packing");
    EnvelopeReader reader("x.tag", {dims, SampleType::uint8}, exact, in_blocks(content));
    std::string made;
    EnvelopeFile read;
    const auto add = [&](std::uint64_t, std::span<const std::byte> bytes) {
      made.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    };
    ASSERT_TRUE(reader.next_file(read));
    EXPECT_TRUE(read.is_changed && !read.checksum);  // nobody knows its samples
    EXPECT_EQ(read.size, 21U);
    reader.read_other_bytes(read, add);
    EXPECT_EQ(made, "headcde89");
    ASSERT_TRUE(reader.next_file(read));
    EXPECT_FALSE(read.is_changed);
    EXPECT_EQ(read.checksum.has_value(), exact);
    reader.read_other_bytes(read, add);
    EXPECT_EQ(made, "headcde89abcdef");
    EXPECT_FALSE(reader.next_file(read));
    EXPECT_EQ(reader.compression(), "packing");
  }
  // Samples that have no place cannot come from anywhere.
  form.files[0].pieces[1] = PlainPiece::samples(13);
  EXPECT_TRUE(has(source_files(facts).why_not.value_or(""), "samples of other volumes"));
  form.why_not = "for no reason";
  EXPECT_EQ(source_files(facts).why_not, "for no reason");
}

// Whatever the bytes say, the reader ends, with an error or with files that could be.
TEST_F(Envelope, DamagedBytesAreRefusedOrHarmless) {
  int refused = 0;
  Content whole;
  for (int round = 0; round < 3000; ++round) {
    const Index3 dims = {3, 2, 5};
    if (round % 100 == 0) whole = written(source_files(random_source(dims, SampleType::uint16)), true);
    Content content = whole;
    switch (below(3)) {
      case 0:
        content[below(content.size())] ^= static_cast<std::byte>(1 << below(8));
        break;
      case 1:
        content.resize(below(content.size()));
        break;
      default:
        content[below(content.size())] = static_cast<std::byte>(0xFF);
    }
    try {
      EnvelopeReader reader("x.tag", {dims, SampleType::uint16}, true, in_blocks(content));
      for (EnvelopeFile file; reader.next_file(file);) {
        EXPECT_TRUE(is_relative_name(file.name));
        std::uint64_t last = 0;
        reader.read_other_bytes(file, [&](std::uint64_t position, std::span<const std::byte> bytes) {
          EXPECT_GE(position, last);
          last = position + bytes.size();
          EXPECT_LE(last, file.size);
        });
      }
    } catch (const BrokenInput& broken) {
      ++refused;
      EXPECT_EQ(std::string(broken.what()).rfind("x.tag: the envelope of its source files: ", 0), 0U);
    }
  }
  EXPECT_GT(refused, 1000);
}

// An encoding with an error gives samples beyond the integers that the bits can hold.
TEST_F(Envelope, SamplesBeyondTheBitsBecomeTheNearest) {
  const auto stored = [](std::int16_t sample, const StoredBits& bits) {
    SlicesInFile slices;
    slices.run.stored = bits;
    slices.spare = SpareBits::sign;
    to_stored(slices, SampleType::int16, reinterpret_cast<std::byte*>(&sample), 1);
    return static_cast<std::int16_t>(sample);
  };
  const auto sign_of_12 = [](int low) { return static_cast<std::int16_t>((low ^ 0x800) - 0x800); };
  for (const int add : {0, -1024, 77}) {
    const auto at = [&](int value) { return static_cast<std::int16_t>(value + add); };
    for (int over = 1; over < 60; ++over) {
      const StoredBits plain = {.bits = 12, .is_signed = false, .add = add}, with_sign = {12, true, add};
      EXPECT_EQ(stored(at(-over), plain), 0);
      EXPECT_EQ(stored(at(4095 + over), plain), sign_of_12(4095));
      EXPECT_EQ(stored(at(-2048 - over), with_sign), -2048);
      EXPECT_EQ(stored(at(2047 + over), with_sign), 2047);
    }
    for (int value = 0; value < 4096; ++value) {
      EXPECT_EQ(stored(at(value), {12, false, add}), sign_of_12(value));
      EXPECT_EQ(stored(at(value - 2048), {12, true, add}), value - 2048);
    }
  }
}

TEST_F(Envelope, WhatCannotComeBackIsNotKept) {
  SourceFacts facts = random_source({9, 9, 4}, SampleType::uint16);
  EXPECT_EQ(source_files(facts).why_not, std::nullopt);
  SourceFacts other = facts;
  other.places.clear();
  EXPECT_TRUE(has(source_files(other).why_not.value_or(""), "compressed"));
  other = facts;
  other.places.back() = other.places.front();
  other.places.back().slices = facts.places.back().slices;
  EXPECT_TRUE(has(source_files(other).why_not.value_or(""), "at the same place"));
  other = facts;
  other.files.back() = "-";
  EXPECT_TRUE(has(source_files(other).why_not.value_or(""), "pipe"));
  std::filesystem::resize_file(facts.files.back(), 300'000);
  EXPECT_TRUE(has(source_files(facts).why_not.value_or(""), "bytes besides these samples"));
}

// The bytes of plain forms: those of a compressed stream count only if its end says that all of them were right.

class PlainBytesOfStreams : public TemporaryFolder {};

TEST_F(PlainBytesOfStreams, AreCheckedToTheEnd) {
  const std::string samples(1000, 'a');
  std::string packed = gzipped(samples);
  const std::vector<PlainPiece> pieces = {PlainPiece::content(0, 0, samples.size()),
                                          PlainPiece::given("end")};
  std::vector<std::byte> bytes(samples.size() + 3);
  OpenFiles whole({file("whole.gz", packed)});
  PlainBytes(pieces, whole).read_at(0, bytes);
  EXPECT_EQ(bytes.front(), std::byte{'a'});
  EXPECT_EQ(bytes.back(), std::byte{'d'});
  packed[packed.size() - 8] ^= 1;  // of the checksum
  OpenFiles damaged({file("damaged.gz", packed)});
  EXPECT_THROW(PlainBytes(pieces, damaged).read_at(0, bytes), BrokenInput);
  const std::vector<PlainPiece> shorter = {PlainPiece::content(0, 0, 999)};
  EXPECT_THROW(PlainBytes(shorter, whole).read_at(0, std::span(bytes).first(999)), BrokenInput);
}

}  // namespace
}  // namespace tagrid
