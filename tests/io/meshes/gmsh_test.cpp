#include "io/meshes/gmsh.h"

#include <gmock/gmock.h>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/meshes/mesh_formats.h"
#include "tests/support/temporary_folder.h"

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

}  // namespace
}  // namespace tagrid
