// Meshes as Gmsh and VTU files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/meshes/formats.h"
#include "io/meshes/mesh_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {
namespace {

/// Reads a file front to back.
class Parts {
 public:
  explicit Parts(std::string bytes) : bytes_(std::move(bytes)) {}
  void expect(const std::string& text) {
    EXPECT_EQ(bytes_.substr(at_, text.size()), text);
    at_ += text.size();
  }
  template <class T>
  std::vector<T> numbers(std::size_t count) {
    std::vector<T> all;
    for (; all.size() < count && at_ + sizeof(T) <= bytes_.size(); at_ += sizeof(T))
      all.push_back(load_little_endian<T>(reinterpret_cast<const std::byte*>(bytes_.data() + at_)));
    return all;
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

using testing::ElementsAre;
using Sizes = std::uint64_t;
using GmshTest = TemporaryFolder;

TEST_F(GmshTest, EverythingIsWhereVersion41HasIt) {
  GmshFile mesh(path("a.msh"), SampleType::int16, false);
  const std::vector<double> xyz = {0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, -3, 5, 5, 5};
  const std::vector<std::int16_t> values = {-32768, 2, 3, 4, 32767};
  mesh.add_points(xyz, std::as_bytes(std::span(values)));
  mesh.add_tetrahedra(std::vector<std::int64_t>{0, 1, 2, 3, 4, 2, 3, 1}, std::vector<std::uint8_t>{5, 15});
  mesh.finish();
  EXPECT_FALSE(std::filesystem::exists(path("a.msh")));
  mesh.commit();
  EXPECT_EQ(mesh.file_bytes(), content("a.msh").size());

  Parts parts(content("a.msh"));
  parts.expect("$MeshFormat\n4.1 1 8\n");
  EXPECT_THAT(parts.numbers<int>(1), ElementsAre(1));
  parts.expect("\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"volume\"\n$EndPhysicalNames\n$Entities\n");
  EXPECT_THAT(parts.numbers<Sizes>(4), ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(parts.numbers<int>(1), ElementsAre(1));
  EXPECT_THAT(parts.numbers<double>(6), ElementsAre(0, 0, -3, 5, 5, 5));
  EXPECT_THAT(parts.numbers<Sizes>(1), ElementsAre(1));
  EXPECT_THAT(parts.numbers<int>(1), ElementsAre(1));
  EXPECT_THAT(parts.numbers<Sizes>(1), ElementsAre(0));
  parts.expect("\n$EndEntities\n$Nodes\n");
  EXPECT_THAT(parts.numbers<Sizes>(4), ElementsAre(1, 5, 1, 5));
  EXPECT_THAT(parts.numbers<int>(3), ElementsAre(3, 1, 0));
  EXPECT_THAT(parts.numbers<Sizes>(6), ElementsAre(5, 1, 2, 3, 4, 5));
  EXPECT_EQ(parts.numbers<double>(15), xyz);
  parts.expect("\n$EndNodes\n$Elements\n");
  EXPECT_THAT(parts.numbers<Sizes>(4), ElementsAre(1, 2, 1, 2));
  EXPECT_THAT(parts.numbers<int>(3), ElementsAre(3, 1, 4));
  EXPECT_THAT(parts.numbers<Sizes>(11), ElementsAre(2, 1, 1, 2, 3, 4, 2, 5, 3, 4, 2));
  parts.expect("\n$EndElements\n$NodeData\n1\n\"value\"\n1\n0\n3\n0\n1\n5\n");
  for (int i = 0; i < 5; ++i) {
    EXPECT_THAT(parts.numbers<int>(1), ElementsAre(i + 1));
    EXPECT_THAT(parts.numbers<double>(1), ElementsAre(values[static_cast<std::size_t>(i)]));
  }
  parts.expect("\n$EndNodeData\n");
  for (const char* name : {"level", "type"}) {
    parts.expect(std::string("$ElementData\n1\n\"") + name + "\"\n1\n0\n3\n0\n1\n2\n");
    EXPECT_THAT(parts.numbers<int>(1), ElementsAre(1));
    EXPECT_THAT(parts.numbers<double>(1), ElementsAre(name[0] == 'l' ? 5 : 2));
    EXPECT_THAT(parts.numbers<int>(1), ElementsAre(2));
    EXPECT_THAT(parts.numbers<double>(1), ElementsAre(name[0] == 'l' ? 15 : 0));
    parts.expect("\n$EndElementData\n");
  }
  EXPECT_TRUE(parts.at_end());
}

TEST_F(GmshTest, MoreThan32BitsCanNumberIsRefused) {
  const std::int64_t most = 2147483647;
  EXPECT_NO_THROW(check_gmsh_count(most, "points", "a.msh"));
  EXPECT_THROW(check_gmsh_count(most + 1, "points", "a.msh"), UsageError);
}

TEST(MeshFormats, AreChosenByTheEndOfTheName) {
  for (const auto& [name, format] : std::vector<std::pair<std::string, std::string>>{{"-", "VTU"},
                                                                                     {"a.vtu", "VTU"},
                                                                                     {"A.VTU", "VTU"},
                                                                                     {"a.vtkhdf", "VTKHDF"},
                                                                                     {"a.hdf", "VTKHDF"},
                                                                                     {"a.msh", "Gmsh"}})
    EXPECT_EQ(mesh_format_of(name).name, format) << name;
  for (const char* name : {"a.vtk", "a", "", "msh", "a.h5"}) try {
      mesh_format_of(name);
      ADD_FAILURE() << name;
    } catch (const UsageError& error) {
      EXPECT_EQ(error.what(),
                std::string(name) + ": the name of a mesh must end in .vtu, .vtkhdf, .hdf or .msh");
    }
}
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
  EXPECT_TRUE(has(vtu.xml, "header_type=\"UInt64\""));
  EXPECT_TRUE(has(vtu.xml, "byte_order=\"LittleEndian\""));
  EXPECT_TRUE(has(vtu.xml, "NumberOfComponents=\"3\""));
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
