// Volumes written as grids, read by OpenVDB's library and its tools.

#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/errors/errors.h"
#include "io/formats/table/formats.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/text.h"
#include "tests/readers/vdb/openvdb_oracle.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using Wishes = std::map<std::string, std::string>;

/// What the program said of the file.
struct Written {
  double background = 0;
  std::optional<double> max_error;
  std::uint64_t active_voxels = 0, leaves = 0;
};

class VdbWriterTest : public TemporaryFolder {
 protected:
  VdbWriterTest() { setenv("TAGRID_READER_PATH", TAGRID_READERS, 1); }

  /// Writes a volume with the samples that `value` returns, in pieces of an odd size.
  template <class T, class Value>
  Written write(const std::string& name, const Index3& dims, Value value,
                const Wishes& wishes = {{"max-error", "0"}}, const std::string& fields = "") {
    VolumeInfo info;
    info.dims = dims;
    info.type = sample_type_of<T>();
    info.metadata = parse_metadata(fields);
    std::vector<T> samples;
    for (const auto [x, y, z] : points_of(dims)) samples.push_back(static_cast<T>(value(Index3{x, y, z})));
    const auto writer = create_volume(format_from_name(name), path(name), info,
                                      {.files = {.overwrite = true}, .wishes = wishes});
    std::span<const T> rest = samples;
    while (!rest.empty()) {
      const auto part = rest.first(std::min<std::size_t>(rest.size(), 997));
      writer->write_slices(std::as_bytes(part));
      rest = rest.subspan(part.size());
    }
    writer->commit();
    const nlohmann::json facts = nlohmann::json::parse(writer->facts());
    Written written = {.background = facts.at("background"),
                       .max_error = std::nullopt,
                       .active_voxels = facts.at("active_voxels"),
                       .leaves = facts.at("leaves")};
    if (facts.at("max_error").is_number()) written.max_error = facts.at("max_error").get<double>();
    return written;
  }

  std::string vdb_print(const std::string& options, const std::string& name) const {
    const std::string command =
        "vdb_print " + options + " '" + path(name) + "' > '" + path("printed") + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << content("printed");
    return content("printed");
  }
};

template <class T>
double noise(const Index3& p) {
  const auto number = static_cast<double>((p.x * 7919 + p.y * 104729 + p.z * 1299709) % 101);
  return std::is_floating_point_v<T> ? number / 8 - 3 : number;
}

template <class T>
class EveryType : public VdbWriterTest {};
TYPED_TEST_SUITE(EveryType, AllTypes);

TYPED_TEST(EveryType, TheLibraryReadsEveryVoxelAndTagridTheTypeToo) {
  using T = TypeParam;
  const Index3 dims = {21, 10, 19};
  const auto summary = this->template write<T>("a.vdb", dims, noise<T>);
  const oracle::Read read = oracle::read_file(this->path("a.vdb"), "density", Box::of_size(dims));
  std::uint64_t active = 0;
  for (std::size_t i = 0; i < read.values.size(); ++i) {
    const auto n = static_cast<std::int64_t>(i);
    const double expected = noise<T>({n % 21, n / 21 % 10, n / 210});
    ASSERT_EQ(read.values[i], expected) << i;
    ASSERT_EQ(read.is_active[i], expected != noise<T>({0, 0, 0})) << i;
    active += read.is_active[i];
  }
  EXPECT_EQ(read.active_voxels, active);
  EXPECT_EQ(summary.active_voxels, active);
  EXPECT_EQ(summary.leaves, read.leaves);
  EXPECT_EQ(read.background, noise<T>({0, 0, 0}));
  EXPECT_EQ(read.type, (sizeof(T) <= 2 || std::is_same_v<T, float> ? "float"
                        : std::is_same_v<T, std::int32_t>          ? "int32"
                                                                   : "double"));
  const auto again = open_volume(this->path("a.vdb"));
  EXPECT_EQ(again->info().type, sample_type_of<T>());
  EXPECT_EQ(again->info().dims, dims);
}

TYPED_TEST(EveryType, TheLargestAndTheSmallestValueComeBack) {
  using T = TypeParam;
  const auto value = [](const Index3& p) {
    return p.x == 0 ? T(0) : p.x == 1 ? std::numeric_limits<T>::max() : std::numeric_limits<T>::lowest();
  };
  this->template write<T>("a.vdb", {3, 1, 1}, value);
  const auto reader = open_volume(this->path("a.vdb"));
  T samples[3];
  ASSERT_EQ(reader->info().dims, (Index3{3, 1, 1}));
  reader->read_slices(reinterpret_cast<std::byte*>(samples), 1);
  for (const std::int64_t x : {0, 1, 2}) EXPECT_EQ(samples[x], value({x, 0, 0}));
}

TEST_F(VdbWriterTest, EqualVoxelsBecomeTilesOfEverySize) {
  // A slab that holds a cube of 128^3 and more, at an origin that cuts leaves.
  const Index3 dims = {140, 136, 150};
  const auto value = [](const Index3& p) { return p.z < 3 ? 0 : p.x == 139 && p.y == 135 ? 8 : 7; };
  write<std::uint8_t>("a.vdb", dims, value, {}, "vdb_origin:=-5 -8 -11\n");
  const Box box = {{-5, -8, -11}, {134, 127, 138}};
  const oracle::Read read = oracle::read_file(path("a.vdb"), "density", box);
  for (std::size_t i = 0; i < read.values.size(); ++i) {
    const auto n = static_cast<std::int64_t>(i);
    ASSERT_EQ(read.values[i], value({n % 140, n / 140 % 136, n / (140 * 136)})) << i;
  }
  EXPECT_EQ(read.active, (Box{{-5, -8, -8}, {134, 127, 138}}));
  EXPECT_EQ(read.active_voxels, 140U * 136 * 147);
  // 16 x 17 x 18 whole leaves have one value; 16^3 of them are one tile of 128^3.
  EXPECT_EQ(read.active_tiles, 16U * 17 * 18 - 16 * 16 * 16 + 1) << read.leaves;
}

TEST_F(VdbWriterTest, AVolumeOfOneValueHasNoActiveVoxelAndComesBack) {
  write<float>("a.vdb", {17, 3, 5}, [](const Index3&) { return 2.5; });
  EXPECT_EQ(oracle::read_file(path("a.vdb"), "density", {{0, 0, 0}, {0, 0, 0}}).active_voxels, 0U);
  const auto reader = open_volume(path("a.vdb"));
  EXPECT_EQ(reader->info().dims, (Index3{17, 3, 5}));
  std::vector<float> slice(17 * 3);
  reader->seek_slice(4);
  reader->read_slices(reinterpret_cast<std::byte*>(slice.data()), 1);
  EXPECT_EQ(slice, std::vector<float>(17 * 3, 2.5F));
}

TEST_F(VdbWriterTest, AnEmptyMarginComesBack) {
  const Index3 dims = {30, 30, 30};
  const auto value = [](const Index3& p) { return p == Index3{15, 16, 17} ? 1 : 0; };
  write<std::int16_t>("a.vdb", dims, value);
  EXPECT_EQ(open_volume(path("a.vdb"))->info().dims, dims);
}

TEST_F(VdbWriterTest, BackgroundAndToleranceDecideWhatIsActive) {
  Wishes options = {{"background", "10"}, {"tolerance", "2"}, {"max-error", "3"}};
  const auto summary = write<std::int16_t>(
      "a.vdb", {21, 1, 1}, [](const Index3& p) { return p.x; }, options);
  const oracle::Read read = oracle::read_file(path("a.vdb"), "density", {{0, 0, 0}, {20, 0, 0}});
  for (std::size_t x = 0; x <= 20; ++x) {
    const bool near = x >= 8 && x <= 12;
    EXPECT_EQ(read.is_active[x], !near) << x;
    EXPECT_EQ(read.values[x], near ? 10.0 : static_cast<double>(x)) << x;
  }
  EXPECT_EQ(summary.background, 10);
  EXPECT_EQ(summary.max_error, 5.0);
  EXPECT_TRUE(has(vdb_print("-l", "a.vdb"), "tagrid_max_error: 5\n"));
  options["background"] = "0.5";
  EXPECT_THROW(write<std::int16_t>(
                   "b.vdb", {2, 1, 1}, [](const Index3&) { return 0; }, options),
               UsageError);
  options["background"] = "40000";
  EXPECT_THROW(write<std::int16_t>(
                   "b.vdb", {2, 1, 1}, [](const Index3&) { return 0; }, options),
               UsageError);
  EXPECT_EQ(names(), (std::vector<std::string>{"a.vdb", "printed"}));
}

TEST_F(VdbWriterTest, NumbersThatAreNoneAreKept) {
  const auto value = [](const Index3& p) {
    return p.x == 0 ? NAN : p.x == 1 ? -0.0 : p.x == 2 ? INFINITY : 0.0;
  };
  const auto summary = write<double>("a.vdb", {4, 1, 1}, value);
  EXPECT_EQ(summary.background, 0);
  EXPECT_EQ(summary.active_voxels, 3U);
  const auto reader = open_volume(path("a.vdb"));
  double samples[4];
  reader->read_slices(reinterpret_cast<std::byte*>(samples), 1);
  EXPECT_TRUE(std::isnan(samples[0]) && std::signbit(samples[1]) && std::isinf(samples[2]) &&
              samples[3] == 0);
}

TEST_F(VdbWriterTest, SpacingsDirectionsAndOriginBecomeTheTransform) {
  const auto zero = [](const Index3&) { return 0; };
  const Box point = {{0, 0, 0}, {0, 0, 0}};
  using Rows = std::array<std::array<double, 3>, 4>;
  write<std::uint8_t>("a.vdb", {2, 2, 2}, zero, {}, "spacings: 0.5 0.5 0.5\n");
  EXPECT_EQ(oracle::read_file(path("a.vdb"), "density", point).transform,
            (Rows{{{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {0, 0, 0}}}));
  EXPECT_TRUE(oracle::read_file(path("a.vdb"), "density", point).uniform);
  write<std::uint8_t>("a.vdb", {2, 2, 2}, zero, {}, "spacings: 0.5 0.25 -2\nspace origin: (1,2,3)\n");
  EXPECT_EQ(oracle::read_file(path("a.vdb"), "density", point).transform,
            (Rows{{{0.5, 0, 0}, {0, 0.25, 0}, {0, 0, -2}, {1, 2, 3}}}));
  write<std::uint8_t>(
      "a.vdb", {2, 2, 2}, zero, {},
      "space dimension: 3\nspace directions: (0,1,0) (0.5,0,0.25) (0,0,3)\nspace origin: (1,2,3)\n");
  EXPECT_EQ(oracle::read_file(path("a.vdb"), "density", point).transform,
            (Rows{{{0, 1, 0}, {0.5, 0, 0.25}, {0, 0, 3}, {1, 2, 3}}}));
}

TEST_F(VdbWriterTest, AllThatAHeaderSaidComesBack) {
  const std::string fields =
      "content: a scan\nspace: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.5,0) (0,0.1,-2.25)\n"
      "space units: \"mm\" \"mm\" \"mm\"\nspace origin: (-12.5,3,1e3)\n# a remark\nModality:=CT\n";
  write<std::int16_t>("a.vdb", {5, 4, 3}, noise<std::int16_t>, {}, fields);
  EXPECT_EQ(text_of(open_volume(path("a.vdb"))->info().metadata), fields);
}

// The library rounds the numbers of a transform: 0.7 becomes 0.7000000000000028 beside such an origin.
TEST_F(VdbWriterTest, AHeaderComesBackWhateverTheLibraryRounds) {
  for (const char* const directions : {"(0.7,0,0) (0,0.8,0) (0,0,2.5)", "(0.7,0,0) (0,-0.8,0) (0,0,1.1)",
                                       "(0.3,0,0) (0,0.3,0) (0,0,0.3)", "(0.1,0.7,0) (0.3,-0.1,0) (0,0,1.7)"})
    for (const char* const origin : {"(-123.4,57.3,-812.7)", "(0,0,0)", "(1e4,0.1,-1e-3)"}) {
      const std::string fields = std::string("space: left-posterior-superior\nspace directions: ") +
                                 directions + "\nspace origin: " + origin +
                                 "\nrescale_slope:=2\nrescale_units:=HU\n";
      write<std::int16_t>("a.vdb", {5, 4, 3}, noise<std::int16_t>, {}, fields);
      EXPECT_EQ(text_of(open_volume(path("a.vdb"))->info().metadata), fields);
    }
}

TEST_F(VdbWriterTest, WhatSamplesMeanStaysIfSomebodyMovesTheGrid) {
  write<std::int16_t>("a.vdb", {5, 4, 3}, noise<std::int16_t>, {},
                      "space dimension: 3\nspace directions: (0.5,0,0) (0,0.25,0) (0,0,2)\n"
                      "space origin: (1234.5,0,0)\nslice_positions:=1 2 3\nrescale_slope:=2\n"
                      "lossy source:=JPEG\nvdb_grid:=smoke\n");
  std::string bytes = content("a.vdb");
  const auto bytes_of = [](double number) { return std::string(reinterpret_cast<char*>(&number), 8); };
  const std::size_t at = bytes.find(bytes_of(1234.5));
  ASSERT_NE(at, bytes.npos);
  const VolumeInfo info = open_volume(file("b.vdb", bytes.replace(at, 8, bytes_of(1000))))->info();
  EXPECT_EQ(info.geometry().origin, (std::array<double, 3>{1000, 0, 0}));
  EXPECT_EQ(info.metadata.text_of("rescale_slope"), "2");
  EXPECT_EQ(info.metadata.text_of("lossy source"), "JPEG");
  EXPECT_EQ(info.metadata.text_of("vdb_grid"), "smoke");
  EXPECT_EQ(info.metadata.text_of("slice_positions"), "");
}

TEST_F(VdbWriterTest, AGridComesBackVoxelByVoxelWhereItWas) {
  for (const oracle::Type type : {oracle::Type::floats, oracle::Type::doubles, oracle::Type::ints}) {
    oracle::Grid grid;
    grid.name = "smoke";
    grid.grid_class = type == oracle::Type::floats ? "fog volume" : "unknown";
    grid.type = type;
    grid.background = -2;
    grid.noise = {{-9, 3, -30}, {8, 12, 1}};
    grid.value = noise<int>;
    grid.fills = {{{{16, 0, -8}, {31, 15, 7}}, 5, true}, {{{0, 0, 0}, {3, 3, 3}}, 9, false}};
    grid.transform = {{{0.5, 0, 0}, {0, 0.25, 0}, {0, 0, 2}, {4, 5, 6}}};
    oracle::write_file(path("a.vdb"), {grid});
    const auto reader = open_volume(path("a.vdb"));
    const auto writer =
        create_volume(format_named("vdb"), path("b.vdb"), reader->info(), {.files = {.overwrite = true}});
    std::vector<std::byte> all(*sample_bytes(reader->info().dims, reader->info().type));
    reader->read_slices(all.data(), reader->info().dims.z);
    writer->write_slices(all);
    writer->commit();
    const Box box = {{-9, 0, -30}, {31, 15, 7}};
    const oracle::Read before = oracle::read_file(path("a.vdb"), "smoke", box);
    const oracle::Read after = oracle::read_file(path("b.vdb"), "smoke", box);
    ASSERT_EQ(before.active, box);
    EXPECT_EQ(before.values, after.values);
    EXPECT_EQ(before.background, after.background);
    EXPECT_EQ(before.type, after.type);
    EXPECT_EQ(after.grid_class, grid.grid_class);
    EXPECT_EQ(before.transform, after.transform);
    EXPECT_EQ(before.active, after.active);
  }
}

TEST_F(VdbWriterTest, VdbPrintAgrees) {
  const Index3 dims = {40, 33, 21};
  const auto value = [](const Index3& p) { return p.x < 10 ? -1000 : noise<int>(p); };
  const auto summary = write<std::int16_t>("a.vdb", dims, value, {{"grid", "scan"}, {"type", "int32"}});
  ASSERT_LE(summary.active_voxels, 30U * 33 * 21);
  ASSERT_EQ(summary.active_voxels, 20790U);
  const std::string text = vdb_print("-l", "a.vdb");
  for (const std::string line :
       {"Name: scan\n", "Type: Tree_int32_5_4_3\n", "Background value: -1000\n", "Max value: 100\n",
        "Number of active voxels:       20,790\n",
        "Bounding box of active voxels: [10, 0, 0] -> [39, 32, 20]\n",
        "Dimensions of active voxels:   30 x 33 x 21\n", "tagrid_type: int16\n", "file_voxel_count: 20790\n",
        "file_bbox_min: [10, 0, 0]\n", "file_bbox_max: [39, 32, 20]\n"})
    EXPECT_TRUE(has(text, line)) << line << text;
  EXPECT_TRUE(has(vdb_print("", "a.vdb"), "30x33x21"));
}

TEST_F(VdbWriterTest, EqualVolumesGiveEqualBytes) {
  for (const char* name : {"a.vdb", "b.vdb"}) write<std::int16_t>(name, {20, 20, 20}, noise<int>);
  EXPECT_EQ(content("a.vdb"), content("b.vdb"));
  write<std::int16_t>("b.vdb", {20, 20, 20}, [](const Index3& p) { return p.x == 5 ? 1 : noise<int>(p); });
  EXPECT_NE(content("a.vdb").substr(21, 36), content("b.vdb").substr(21, 36)) << "two files with one UUID";
}

TEST_F(VdbWriterTest, AValueThatIsNoneOfTheTypeItOnceHadIsBroken) {
  write<std::int16_t>("a.vdb", {9, 9, 9}, [](const Index3& p) { return p.x == 8 ? 300 : 3; });
  std::string bytes = content("a.vdb");
  const std::size_t type = bytes.find("int16", bytes.find("tagrid_type"));
  ASSERT_NE(type, bytes.npos);
  bytes.replace(type, 5, "uint8");
  const auto reader = open_volume(file("b.vdb", bytes));
  ASSERT_EQ(reader->info().type, SampleType::uint8);
  std::vector<std::byte> slice(81);
  const std::string message = message_of<BrokenInput>([&] { reader->read_slices(slice.data(), 1); });
  EXPECT_TRUE(has(message, "300"));
  bytes.replace(type, 5, "uint9");
  message_of<BrokenInput>([&] { open_volume(file("c.vdb", bytes)); });
}

}  // namespace
}  // namespace tagrid
