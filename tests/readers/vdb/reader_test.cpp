// Grids that OpenVDB's library wrote, read as volumes.

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/text.h"
#include "tests/readers/vdb/openvdb_oracle.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using oracle::Grid;
using oracle::Type;
using testing::HasSubstr;
using testing::Not;

class VdbReaderTest : public TemporaryFolder {
 protected:
  VdbReaderTest() { setenv("TAGRID_READER_PATH", TAGRID_READERS, 1); }
};

std::unique_ptr<VolumeSource> open_grid(const std::string& path, const std::string& grid = "") {
  SourceDescription source;
  source.vdb_grid = grid;
  return open_volume(path, source);
}

/// All samples, as doubles.
std::vector<double> samples_of(VolumeSource& reader) {
  const auto count = static_cast<std::size_t>(reader.slice_samples());
  std::vector<double> samples;
  std::vector<std::byte> slice(count * size_of(reader.info().type));
  for (std::int64_t z = 0; z < reader.info().dims.z; ++z) {
    reader.read_slices(slice.data(), 1);
    with_sample_type(reader.info().type, [&](auto type) {
      const auto* first = reinterpret_cast<const decltype(type)*>(slice.data());
      samples.insert(samples.end(), first, first + count);
    });
  }
  reader.finish();
  return samples;
}

/// Whole numbers, which every type can hold.
double noise(const Index3& p) {
  return static_cast<double>((p.x * 7919 + p.y * 104729 + p.z * 1299709) % 251);
}

/// A grid with all features: leaves, tiles of every size, inactive values in leaves and tiles, a negative
/// origin, a background other than 0.
Grid awkward(Type type) {
  Grid grid;
  grid.type = type;
  grid.background = -3;
  grid.noise = {{-13, -5, -21}, {20, 11, 9}};
  grid.value = noise;
  grid.fills = {{{{24, -16, -16}, {47, 23, 39}}, 5, true},      // tiles of 8^3, and parts of leaves
                {{{-2, -2, -2}, {3, 3, 3}}, 77, false},         // overwritten by the noise
                {{{30, 0, 0}, {33, 3, 3}}, 9, false},           // inactive values in a leaf
                {{{128, 0, -128}, {255, 127, -1}}, 8, true},    // a tile of 128^3
                {{{256, 0, -128}, {383, 127, -1}}, 12, false},  // an inactive one
                {{{260, 100, 10}, {260, 100, 10}}, 1, true}};   // the corner
  return grid;
}

void expect_equal(const std::string& path, const Grid& grid) {
  const auto reader = open_grid(path);
  const oracle::Read whole = oracle::read_file(path, grid.name, {{0, 0, 0}, {0, 0, 0}});
  ASSERT_EQ(reader->info().dims, whole.active.size());
  const oracle::Read expected = oracle::read_file(path, grid.name, whole.active);
  EXPECT_EQ(samples_of(*reader), expected.values);
}

TEST_F(VdbReaderTest, EveryVoxelOfEveryTypeAndCompressionIsThatOfTheLibrary) {
  for (const Type type : {Type::floats, Type::halves, Type::doubles, Type::ints})
    for (const std::uint32_t compression : {0U, 1U, 2U, 3U, 4U, 6U}) {
      if (type != Type::floats && compression > 0 && compression < 6) continue;
      oracle::write_file(path("a.vdb"), {awkward(type)}, compression);
      SCOPED_TRACE(compression);
      expect_equal(path("a.vdb"), awkward(type));
    }
}

TEST_F(VdbReaderTest, TheTypeIsThatOfTheGrid) {
  const std::pair<Type, SampleType> types[] = {{Type::floats, SampleType::float32},
                                               {Type::halves, SampleType::float32},
                                               {Type::doubles, SampleType::float64},
                                               {Type::ints, SampleType::int32}};
  for (const auto& [type, expected] : types) {
    oracle::write_file(path("a.vdb"), {awkward(type)});
    EXPECT_EQ(open_grid(path("a.vdb"))->info().type, expected);
  }
}

TEST_F(VdbReaderTest, OtherMetadataOfTheGridAndOfTheFileBecomesPairs) {
  Grid grid = awkward(Type::floats);
  grid.metadata = {{"creator", "a simulation"}, {"frame", "12"}};
  oracle::write_file(path("a.vdb"), {grid}, 6, {{"creator", "a program"}, {"license", "two\nlines"}});
  const std::string fields = text_of(open_grid(path("a.vdb"))->info().metadata);
  EXPECT_THAT(fields, HasSubstr("openvdb_creator:=a simulation\n"));
  EXPECT_THAT(fields, HasSubstr("openvdb_frame:=12\n"));
  EXPECT_THAT(fields, HasSubstr("openvdb_license:=two\\nlines\n"));
  EXPECT_THAT(fields, Not(HasSubstr("openvdb_file")));
  EXPECT_THAT(fields, Not(HasSubstr("openvdb_name")));
}

TEST_F(VdbReaderTest, InactiveValuesOfEveryKindAreRead) {
  // Inactive values as in a level set: the background outside, its negative inside; and leaves with one, two
  // or many other values.
  for (const std::vector<double>& inactive :
       {std::vector<double>{-2}, {2, -2}, {7}, {2, 7}, {6, 7}, {5, 6, 7}, {2}}) {
    Grid grid;
    grid.background = 2;
    std::mt19937 random(3);
    for (std::int64_t i = 0; i < 600; ++i) {
      const auto at = [&] { return static_cast<std::int64_t>(random() % 24); };
      const Index3 p = {at(), at(), at()};
      grid.fills.push_back({{p, p}, inactive[random() % inactive.size()], false});
    }
    grid.fills.push_back({{{0, 0, 0}, {0, 0, 23}}, 1.5, true});
    grid.fills.push_back({{{23, 23, 0}, {23, 23, 0}}, 1.25, true});
    oracle::write_file(path("a.vdb"), {grid});
    expect_equal(path("a.vdb"), grid);
  }
}

TEST_F(VdbReaderTest, ValuesThatAreNoNumbersComeBit) {
  Grid grid;
  grid.noise = {{0, 0, 0}, {9, 9, 9}};
  grid.value = [](const Index3& p) { return p.x == p.y ? NAN : p.x == 3 ? -0.0 : p.x == 4 ? INFINITY : 1.0; };
  oracle::write_file(path("a.vdb"), {grid});
  const auto reader = open_grid(path("a.vdb"));
  const auto samples = samples_of(*reader);
  EXPECT_TRUE(std::isnan(samples[0]));
  EXPECT_TRUE(std::signbit(samples[3]));
  EXPECT_TRUE(std::isinf(samples[4]));
}

TEST_F(VdbReaderTest, SlicesCanBeReadInAnyOrder) {
  const Grid grid = awkward(Type::floats);
  oracle::write_file(path("a.vdb"), {grid});
  const auto reader = open_grid(path("a.vdb"));
  ASSERT_TRUE(reader->traits().again);
  const auto all = samples_of(*reader);
  const auto count = static_cast<std::size_t>(reader->slice_samples());
  std::vector<float> slice(count);
  for (const std::int64_t z : {40, 3, 4, 148, 0}) {
    reader->seek_slice(z);
    reader->read_slices(reinterpret_cast<std::byte*>(slice.data()), 1);
    EXPECT_TRUE(std::equal(slice.begin(), slice.end(), all.begin() + static_cast<std::ptrdiff_t>(count) * z))
        << z;
  }
}

TEST_F(VdbReaderTest, TheTransformBecomesDirectionsAndOrigin) {
  Grid grid = awkward(Type::floats);
  grid.transform = {{{0.5, 0, 0}, {0, 0.25, 0.125}, {0, 0, -2}, {100, 200, 300}}};
  oracle::write_file(path("a.vdb"), {grid});
  const Geometry geometry = open_grid(path("a.vdb"))->info().geometry();
  const std::array<std::array<double, 3>, 3> rows = {grid.transform[0], grid.transform[1], grid.transform[2]};
  EXPECT_EQ(geometry.directions, rows);
  const Index3 low = {-13, -16, -128};
  const oracle::Read read = oracle::read_file(path("a.vdb"), "density", {low, low});
  ASSERT_EQ(read.active.low, low);
  EXPECT_EQ(geometry.origin, (std::array<double, 3>{100 - 6.5, 200 - 4.0, 300 - 2.0 + 256}));
}

TEST_F(VdbReaderTest, AUniformScaleIsASpacingAndAPerspectiveNone) {
  Grid grid = awkward(Type::floats);
  grid.uniform = true;
  grid.transform[0][0] = 0.75;
  oracle::write_file(path("a.vdb"), {grid});
  EXPECT_EQ(open_grid(path("a.vdb"))->info().geometry().spacing, (std::array<double, 3>{0.75, 0.75, 0.75}));
  grid.uniform = false;
  grid.perspective = true;
  oracle::write_file(path("b.vdb"), {grid});
  EXPECT_FALSE(open_grid(path("b.vdb"))->info().geometry().has_spacing);
}

TEST_F(VdbReaderTest, OfSeveralGridsOneIsChosenByItsName) {
  Grid first = awkward(Type::floats), second = awkward(Type::ints), third = awkward(Type::bools);
  first.name = "density";
  second.name = "labels";
  third.name = "mask";
  oracle::write_file(path("a.vdb"), {first, second, third});
  EXPECT_EQ(open_grid(path("a.vdb"), "density")->info().type, SampleType::float32);
  EXPECT_EQ(open_grid(path("a.vdb"), "labels")->info().type, SampleType::int32);
  EXPECT_EQ(open_grid(path("a.vdb"), "mask")->info().type, SampleType::uint8);
  const std::vector<Choice> list = {
      {"density", "Tree_float_5_4_3"}, {"labels", "Tree_int32_5_4_3"}, {"mask", "Tree_bool_5_4_3"}};
  try {
    open_grid(path("a.vdb"));
    ADD_FAILURE() << "one was chosen";
  } catch (const UsageError& error) {
    EXPECT_EQ(error.detail().choices, list) << error.what();
    // --grid is another option.
    EXPECT_EQ(error.detail().option, "vdb-grid");
  }
  const std::string message = message_of<UsageError>([&] { open_grid(path("a.vdb"), "nothing"); });
  EXPECT_TRUE(has(message, "density, labels, mask"));
}

TEST_F(VdbReaderTest, GridsOfOneNameHaveNumbers) {
  Grid first = awkward(Type::floats), second = awkward(Type::ints);
  oracle::write_file(path("a.vdb"), {first, second});
  message_of<UsageError>([&] { open_grid(path("a.vdb"), "density"); });
  EXPECT_EQ(open_grid(path("a.vdb"), "density[0]")->info().type, SampleType::float32);
  EXPECT_EQ(open_grid(path("a.vdb"), "density[1]")->info().type, SampleType::int32);
}

TEST_F(VdbReaderTest, GridsWithoutANameAreChosenByTheirLines) {
  Grid first = awkward(Type::floats), second = awkward(Type::ints);
  first.name = second.name = "";
  oracle::write_file(path("a.vdb"), {first, second});
  try {
    open_grid(path("a.vdb"));
    ADD_FAILURE() << "one was chosen";
  } catch (const UsageError& error) {
    const std::vector<Choice>& list = error.detail().choices;
    ASSERT_EQ(list.size(), 2u);
    EXPECT_NE(list[0].name, list[1].name);
    EXPECT_EQ(open_grid(path("a.vdb"), list[0].name)->info().type, SampleType::float32);
    EXPECT_EQ(open_grid(path("a.vdb"), list[1].name)->info().type, SampleType::int32);
  }
}

TEST_F(VdbReaderTest, AGridThatSharesATreeHasItsVoxels) {
  oracle::write_instances(path("a.vdb"), awkward(Type::floats), "second");
  const auto first = open_grid(path("a.vdb"), "density"), second = open_grid(path("a.vdb"), "second");
  EXPECT_EQ(samples_of(*first), samples_of(*second));
}

TEST_F(VdbReaderTest, AStreamOfOneGridIsReadAndOneOfSeveralRefused) {
  oracle::write_stream(path("a.vdb"), {awkward(Type::doubles)});
  oracle::write_file(path("b.vdb"), {awkward(Type::doubles)});
  const auto a = open_grid(path("a.vdb")), b = open_grid(path("b.vdb"));
  EXPECT_EQ(samples_of(*a), samples_of(*b));
  oracle::write_stream(path("c.vdb"), {awkward(Type::doubles), awkward(Type::floats)});
  message_of<BrokenInput>([&] { open_grid(path("c.vdb")); });
}

TEST_F(VdbReaderTest, WhatIsNoVolumeIsRefused) {
  Grid empty;
  oracle::write_file(path("a.vdb"), {empty});
  EXPECT_TRUE(has(message_of<BrokenInput>([&] { open_grid(path("a.vdb")); }), "no active voxel"));
  oracle::write_file(path("b.vdb"), {});
  message_of<BrokenInput>([&] { open_grid(path("b.vdb")); });
  oracle::write_file(path("c.vdb"), {awkward(Type::floats)});
  RawDescription raw;
  raw.dims = {1, 1, 1};
  message_of<UsageError>([&] { open_volume(path("c.vdb"), SourceDescription(raw)); });
  message_of<UsageError>([&] { open_volume(FilledPipe(content("a.vdb")).path()); });
  message_of<UsageError>([&] { open_grid(file("d.nrrd", "NRRD0004\n"), "density"); });
}

TEST_F(VdbReaderTest, ABoxThatIsTooLargeIsRefusedBeforeMemoryIsTaken) {
  Grid grid;
  const std::int64_t far = (std::int64_t{1} << 30) - 1;
  grid.fills = {{{{-far, -far, -far}, {-far, -far, -far}}, 1, true},
                {{{far, far, far}, {far, far, far}}, 1, true}};
  oracle::write_file(path("a.vdb"), {grid});
  const std::string message = message_of<BrokenInput>([&] { open_grid(path("a.vdb")); });
  EXPECT_TRUE(has(message, "2147483647 x 2147483647 x 2147483647"));
}

/// A small file in which most bytes mean something.
Grid small_grid() {
  Grid grid;
  grid.background = 0.5;
  grid.noise = {{-3, -3, -3}, {9, 6, 12}};
  grid.value = noise;
  grid.fills = {{{{16, 0, 0}, {31, 15, 15}}, 5, true}};
  return grid;
}

TEST_F(VdbReaderTest, EveryTruncationIsBroken) {
  // Every cut starts a process, so there are more of them only if time does not matter.
  const bool few = std::getenv("TAGRID_LONG") == nullptr;
  const std::size_t finer = few ? 1 : 10;
  for (const std::uint32_t compression : {0U, 1U, 6U}) {
    if (few && compression == 1) continue;
    oracle::write_file(path("a.vdb"), {small_grid()}, compression);
    const std::string whole = content("a.vdb");
    for (std::size_t size = 8; size < whole.size();
         size += 1 + (size < 600 ? 5 + size / 20 : whole.size() / 20) / finer) {
      file("b.vdb", whole.substr(0, size));
      message_of<BrokenInput>([&] { open_grid(path("b.vdb")); });
    }
  }
}

TEST_F(VdbReaderTest, AnyDamageIsReadOrRefused) {
  constexpr std::uint64_t most = 1 << 20;
  std::mt19937_64 random(17);
  int read = 0, refused = 0;
  const int files = std::getenv("TAGRID_LONG") != nullptr ? 1000 : 15;
  for (const std::uint32_t compression : {0U, 1U, 3U, 6U}) {
    oracle::write_file(path("a.vdb"), {small_grid()}, compression);
    const std::string whole = content("a.vdb");
    for (int i = 0; i < files; ++i) {
      std::string bytes = whole;
      // Most fields that can be forged are in the first part of a file.
      for (int damages = 1 + static_cast<int>(random() % 3); damages > 0; --damages) {
        char& byte =
            bytes[8 +
                  random() %
                      ((random() % 2 != 0 ? bytes.size() : std::min<std::size_t>(bytes.size(), 900)) - 8)];
        byte = random() % 3 == 0 ? '\xff' : static_cast<char>(byte ^ (1 << random() % 8));
      }
      file("b.vdb", bytes);
      try {
        const auto reader = open_grid(path("b.vdb"));
        if (*sample_bytes(reader->info().dims, reader->info().type) > most) continue;
        samples_of(*reader);
        ++read;
      } catch (const BrokenInput&) {
        ++refused;
      } catch (const WorldError& error) {
        // The library trusts sizes in a file: it may take all memory that it is given, or write where it must
        // not.
        const std::string_view message = error.what();
        EXPECT_TRUE(message.find("damaged") != message.npos) << message;
        ++refused;
      }
    }
  }
  EXPECT_GT(read, files / 3);
  EXPECT_GT(refused, files / 2);
}

}  // namespace
}  // namespace tagrid
