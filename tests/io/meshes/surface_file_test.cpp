// Each format has the vertices and triangles that it was given.
#include "io/meshes/formats.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <sstream>

#include "io/errors/errors.h"
#include "tests/support/ply_reader.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {
namespace {

using Places = std::vector<std::array<double, 3>>;

const Places places = {{0, 0, 0}, {1e9 + 0.1, 0, 0}, {0, 1.0 / 3, 0}, {-5, 1, 2}, {7, 7, 7}};
const Triangles triangles = {{0, 1, 2}, {2, 1, 3}, {4, 3, 0}};

class SurfaceFiles : public TemporaryFolder {
 protected:
  // Two pieces; the second one has vertices of the first one, between its own.
  std::string write(const std::string& name) {
    const auto file = surface_format_of(path(name)).create_surface(path(name), false);
    const auto add = [&](const std::vector<std::int64_t>& ids,
                         const std::vector<std::array<std::uint32_t, 3>>& of_piece) {
      const auto place_of = [&](std::size_t i) { return places[static_cast<std::size_t>(ids[i])]; };
      file->add({ids, place_of, of_piece});
    };
    add({0, 1, 2}, {{0, 1, 2}});
    add({2, 3, 0, 1, 4}, {{0, 3, 1}, {4, 1, 2}});
    file->finish();
    EXPECT_FALSE(std::filesystem::exists(path(name))) << "it has no name yet";
    const std::uint64_t bytes = file->file_bytes();
    file->commit();
    EXPECT_EQ(content(name).size(), bytes);
    return content(name);
  }
};

TEST_F(SurfaceFiles, PlyHasDoublesAndInts) {
  const PlySurface surface = read_ply(write("a.ply"));
  EXPECT_EQ(surface.vertices, places);
  EXPECT_EQ(surface.triangles, triangles);
}

TEST_F(SurfaceFiles, StlHasTheCornersAsFloatsAndTheirNormals) {
  const std::string bytes = write("a.stl");
  ASSERT_EQ(bytes.size(), 84 + 50 * triangles.size());
  EXPECT_FALSE(bytes.starts_with("solid"));
  std::uint32_t count;
  std::memcpy(&count, bytes.data() + 80, 4);
  EXPECT_EQ(count, triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    float numbers[12];
    std::memcpy(numbers, bytes.data() + 84 + 50 * t, sizeof numbers);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_EQ(numbers[3 + 3 * i + axis],
                  static_cast<float>(places[static_cast<std::size_t>(triangles[t][i])][axis]));
    EXPECT_NEAR(numbers[0] * numbers[0] + numbers[1] * numbers[1] + numbers[2] * numbers[2], 1, 1e-6);
    EXPECT_EQ(bytes.substr(84 + 50 * t + 48, 2), std::string(2, '\0'));
  }
  float normal[3];
  std::memcpy(normal, bytes.data() + 84, sizeof normal);
  EXPECT_EQ(normal[2], 1) << "the first triangle is counterclockwise in the x y plane";
}

TEST_F(SurfaceFiles, ObjHasEveryDigitAndCountsFromOne) {
  std::istringstream lines(write("a.obj"));
  Places vertices;
  Triangles faces;
  for (std::string kind; lines >> kind;) {
    if (kind == "v") {
      std::string x, y, z;
      lines >> x >> y >> z;
      vertices.push_back({std::stod(x), std::stod(y), std::stod(z)});
    } else {
      ASSERT_EQ(kind, "f");
      std::array<std::int64_t, 3> ids;
      for (std::int64_t& id : ids) {
        lines >> id;
        EXPECT_LE(static_cast<std::size_t>(id), vertices.size()) << "a face comes after its vertices";
        --id;
      }
      faces.push_back(ids);
    }
  }
  EXPECT_EQ(vertices, places);
  EXPECT_EQ(faces, triangles);
}

TEST_F(SurfaceFiles, VtpHasAppendedArrays) {
  write("a.vtp");
  Vtu vtp(path("a.vtp"));
  EXPECT_TRUE(has(vtp.xml, "header_type=\"UInt64\""));
  EXPECT_EQ(vtp.number("NumberOfPoints"), places.size());
  EXPECT_EQ(vtp.number("NumberOfPolys"), triangles.size());
  const auto xyz = vtp.array<double>("Float64", "Points");
  const auto connectivity = vtp.array<std::int64_t>("Int64", "connectivity");
  ASSERT_EQ(xyz.size(), 3 * places.size());
  ASSERT_EQ(connectivity.size(), 3 * triangles.size());
  EXPECT_EQ(std::memcmp(xyz.data(), places.data(), 24 * places.size()), 0);
  EXPECT_EQ(std::memcmp(connectivity.data(), triangles.data(), 24 * triangles.size()), 0);
  EXPECT_EQ(vtp.array<std::int64_t>("Int64", "offsets"), (std::vector<std::int64_t>{3, 6, 9}));
  EXPECT_EQ(vtp.rest(), "\n  </AppendedData>\n</VTKFile>\n");
}

TEST_F(SurfaceFiles, AnEmptySurfaceIsAFile) {
  for (const MeshFormat& format : surface_formats()) {
    const std::string name = "empty" + std::string(format.extensions.front());
    const auto file = format.create_surface(path(name), false);
    file->finish();
    file->commit();
    EXPECT_EQ(content(name).size(), file->file_bytes());
  }
  EXPECT_TRUE(read_ply(content("empty.ply")).vertices.empty());
  EXPECT_EQ(content("empty.stl").size(), 84U);
}

TEST_F(SurfaceFiles, TheNameSaysTheFormat) {
  EXPECT_EQ(surface_format_of("-").name, "PLY");
  EXPECT_EQ(surface_format_of("A.STL").name, "STL");
  for (const char* name : {"a", "a.vtu", "ply", "a.ply.gz"}) {
    try {
      surface_format_of(name);
      ADD_FAILURE() << name;
    } catch (const UsageError& error) {
      EXPECT_TRUE(has(error.what(), ".ply, .stl, .obj or .vtp"));
    }
  }
}

}  // namespace
}  // namespace tagrid
