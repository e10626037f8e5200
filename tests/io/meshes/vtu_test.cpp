#include "io/meshes/vtu.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {
namespace {

void make_empty(const std::string& path, SampleType type, bool overwrite) {
  VtuFile writer(path, type, overwrite);
  writer.finish();
  writer.commit();
}

using VtuTest = TemporaryFolder;

const std::vector<double> corner_points = {0, 0, 0, 1, 0, 0, 0, 1.5, 0, 0, 0, 0.1};

TEST_F(VtuTest, EverythingComesBackExactly) {
  const std::string target = path("mesh.vtu");
  const std::vector<std::int16_t> values = {-32768, 0, 17, 32767};
  const std::vector<std::int64_t> connectivity = {0, 1, 2, 3, 1, 0, 2, 4};
  const std::vector<std::uint8_t> levels = {0, 14};
  VtuFile writer(target, SampleType::int16, false);
  writer.add_points(corner_points, std::as_bytes(std::span(values)));
  writer.add_tetrahedra(connectivity, levels);
  const std::vector<double> more = {-1e300, 1.0 / 3, 7};
  const std::vector<std::int16_t> one = {5};
  writer.add_points(more, std::as_bytes(std::span(one)));
  EXPECT_EQ(writer.point_count(), 5);
  EXPECT_EQ(writer.tetrahedron_count(), 2);
  writer.finish();
  writer.commit();

  Vtu vtu(path("mesh.vtu"));
  EXPECT_EQ(vtu.number("NumberOfPoints"), 5u);
  EXPECT_EQ(vtu.number("NumberOfCells"), 2u);
  EXPECT_NE(vtu.xml.find("header_type=\"UInt64\""), std::string::npos);
  EXPECT_NE(vtu.xml.find("byte_order=\"LittleEndian\""), std::string::npos);
  EXPECT_NE(vtu.xml.find("NumberOfComponents=\"3\""), std::string::npos);
  std::vector<double> all_points = corner_points;
  all_points.insert(all_points.end(), more.begin(), more.end());
  EXPECT_EQ(vtu.array<double>("Float64", "Points"), all_points);
  EXPECT_EQ(vtu.array<std::int64_t>("Int64", "connectivity"), connectivity);
  EXPECT_EQ(vtu.array<std::int64_t>("Int64", "offsets"), (std::vector<std::int64_t>{4, 8}));
  EXPECT_EQ(vtu.array<std::uint8_t>("UInt8", "types"), (std::vector<std::uint8_t>{10, 10}));
  EXPECT_EQ(vtu.array<std::int16_t>("Int16", "value"), (std::vector<std::int16_t>{-32768, 0, 17, 32767, 5}));
  EXPECT_EQ(vtu.array<std::uint8_t>("UInt8", "level"), levels);
  EXPECT_EQ(vtu.array<std::uint8_t>("UInt8", "type"), (std::vector<std::uint8_t>{0, 2}));
  EXPECT_EQ(vtu.rest(), "\n  </AppendedData>\n</VTKFile>\n");
}

TEST_F(VtuTest, MoreThanAnyBufferComesBackExactly) {
  const std::string target = path("mesh.vtu");
  constexpr std::int64_t count = 300'001;
  std::vector<double> xyz;
  std::vector<std::uint8_t> values, levels, types;
  std::vector<std::int64_t> connectivity;
  for (std::int64_t i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<double>(3 * i + axis));
    for (int corner = 0; corner < 4; ++corner) connectivity.push_back((7 * i + corner) % count);
    values.push_back(static_cast<std::uint8_t>(i * i));
    levels.push_back(static_cast<std::uint8_t>(i % 25));
    types.push_back(static_cast<std::uint8_t>(i % 25 % 3));
  }
  VtuFile writer(target, SampleType::uint8, false);
  const std::span<const double> all_xyz = xyz;
  const std::span<const std::uint8_t> all_values = values;
  for (std::size_t i = 0; i < values.size(); i += 1000) {
    const std::size_t n = std::min<std::size_t>(1000, values.size() - i);
    writer.add_points(all_xyz.subspan(3 * i, 3 * n), std::as_bytes(all_values.subspan(i, n)));
  }
  writer.add_tetrahedra(connectivity, levels);
  writer.finish();
  writer.commit();
  Vtu vtu(path("mesh.vtu"));
  EXPECT_EQ(vtu.array<double>("Float64", "Points"), xyz);
  EXPECT_EQ(vtu.array<std::int64_t>("Int64", "connectivity"), connectivity);
  EXPECT_EQ(vtu.array<std::int64_t>("Int64", "offsets").back(), 4 * count);
  EXPECT_EQ(vtu.array<std::uint8_t>("UInt8", "value"), values);
  EXPECT_EQ(vtu.array<std::uint8_t>("UInt8", "level"), levels);
  EXPECT_EQ(vtu.array<std::uint8_t>("UInt8", "type"), types);
}

TEST_F(VtuTest, AnEmptyMeshIsAFile) {
  VtuFile writer(path("mesh.vtu"), SampleType::float64, false);
  writer.finish();
  writer.commit();
  Vtu vtu(path("mesh.vtu"));
  EXPECT_EQ(vtu.number("NumberOfPoints"), 0u);
  EXPECT_TRUE(vtu.array<double>("Float64", "value").empty());
}

TEST_F(VtuTest, TypesHaveVtkNames) {
  const char* vtk_names[] = {"UInt8", "Int8", "UInt16", "Int16", "UInt32", "Int32", "Float32", "Float64"};
  for (std::size_t i = 0; i < all_sample_types.size(); ++i) {
    const std::string name = std::string(vtk_names[i]) + ".vtu";
    make_empty(path(name), all_sample_types[i], false);
    EXPECT_NO_THROW(Vtu(path(name)).array<std::byte>(vtk_names[i], "value"));
  }
}

TEST_F(VtuTest, NothingIsLeftWithoutFinish) {
  {
    VtuFile writer(path("mesh.vtu"), SampleType::uint8, false);
    const std::vector<std::uint8_t> values(4);
    writer.add_points(corner_points, std::as_bytes(std::span(values)));
    EXPECT_FALSE(std::filesystem::exists(path("mesh.vtu")));
  }
  EXPECT_TRUE(names().empty());
}

TEST_F(VtuTest, OnlyTheMeshIsThereAfterFinish) {
  VtuFile writer(path("mesh.vtu"), SampleType::uint8, false);
  writer.finish();
  writer.commit();
  EXPECT_EQ(names(), std::vector<std::string>{"mesh.vtu"});
}

TEST_F(VtuTest, DoesNotOverwriteUnlessTold) {
  const std::string target = path("mesh.vtu");
  make_empty(target, SampleType::uint8, false);
  EXPECT_THROW(VtuFile(target, SampleType::uint8, false), UsageError);
  EXPECT_NO_THROW(make_empty(target, SampleType::int8, true));
  EXPECT_NO_THROW(Vtu(path("mesh.vtu")).array<std::byte>("Int8", "value"));
}

TEST_F(VtuTest, AMissingFolderIsAWorldError) {
  EXPECT_THROW(VtuFile(path("missing/mesh.vtu"), SampleType::uint8, false), WorldError);
}

}  // namespace
}  // namespace tagrid
