// Meshes as Gmsh and VTU files.
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <cstdlib>
#include <sstream>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/meshes/formats.h"
#include "io/meshes/mesh_files.h"
#include "io/meshes/mesh_writers.h"
#include "tests/support/ply_reader.h"
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
  for (const char* name : {"a.vtk", "a", "", "msh", "a.h5"})
    EXPECT_EQ(message_of<UsageError>([&] { mesh_format_of(name); }),
              std::string(name) + ": the name of a mesh must end in .vtu, .vtkhdf, .hdf or .msh");
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

TEST_F(VtuTest, TypesHaveVtkNames) {
  const char* vtk_names[] = {"UInt8", "Int8", "UInt16", "Int16", "UInt32", "Int32", "Float32", "Float64"};
  for (std::size_t i = 0; i < all_sample_types.size(); ++i) {
    const std::string name = std::string(vtk_names[i]) + ".vtu";
    make_empty(path(name), all_sample_types[i], false);
    EXPECT_NO_THROW(Vtu(path(name)).array<std::byte>(vtk_names[i], "value"));
  }
}

TEST_F(VtuTest, AnEmptyMeshIsAFileAndNothingIsLeftWithoutFinish) {
  { const VtuFile writer(path("mesh.vtu"), SampleType::uint8, false); }
  EXPECT_TRUE(names().empty());
  make_empty(path("mesh.vtu"), SampleType::float64, false);
  EXPECT_EQ(names(), std::vector<std::string>{"mesh.vtu"});
  Vtu vtu(path("mesh.vtu"));
  EXPECT_EQ(vtu.number("NumberOfPoints"), 0u);
  EXPECT_TRUE(vtu.array<double>("Float64", "value").empty());
}

TEST_F(VtuTest, DoesNotOverwriteUnlessTold) {
  make_empty(path("mesh.vtu"), SampleType::uint8, false);
  EXPECT_THROW(VtuFile(path("mesh.vtu"), SampleType::uint8, false), UsageError);
  EXPECT_NO_THROW(make_empty(path("mesh.vtu"), SampleType::int8, true));
  EXPECT_NO_THROW(Vtu(path("mesh.vtu")).array<std::byte>("Int8", "value"));
}

// Each format has the vertices and triangles that it was given.

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
  for (const char* name : {"a", "a.vtu", "ply", "a.ply.gz"})
    EXPECT_TRUE(has(message_of<UsageError>([&] { surface_format_of(name); }), ".ply, .stl, .obj or .vtp"));
}

// Programs that write a mesh as docs/dev/readers.md says, and programs that do not.

using testing::ElementsAre;
using testing::HasSubstr;

class VtkhdfTest : public TemporaryFolder {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(path("bin"));
    setenv("TAGRID_READER_PATH", path("bin").c_str(), 1);
  }
  void TearDown() override { unsetenv("TAGRID_READER_PATH"); }

  static inline const std::string hello = R"(echo '{"tagrid-writer": 1, "name": "test", "version": "1"}')";
  static inline const std::string ready = R"(echo '{"answer": "ready", "memory": 90000000}')";
  static inline const std::string done = R"(echo '{"answer": "done"}')";
  static inline const std::string take = R"(head -c "$size" >> "$path")";

  /// A script of a shell: `begin`; then, when it was asked to write, `at_write`; `at_array` for each piece, which it must
  /// take from its input; `at_finish` in the end.
  void make_writer(const std::string& at_write = ready, const std::string& at_array = take,
                   const std::string& at_finish = done, const std::string& begin = hello) const {
    const std::string script =
        "#!/bin/sh\n" + begin + "\nread -r line\n" +
        R"sh(path=$(printf %s "$line" | sed 's/.*"path":"\([^"]*\)".*/\1/'))sh" + "\n" + at_write +
        "\nwhile read -r line; do\n  case $line in\n    *positions*) size=120 ;;\n    *connectivity*) "
        "size=64 "
        ";;\n    *value*) size=10 ;;\n    *) size=2 ;;\n  esac\n  case $line in\n    *finish*) " +
        at_finish + " ;;\n    *) " + at_array + " ;;\n  esac\ndone\n";
    chmod(file("bin/tagrid-write-hdf5", script).c_str(), 0700);
  }

  /// Five points and two tetrahedra.
  void write(VtkhdfFile& mesh) const {
    std::vector<double> xyz(15);
    for (std::size_t i = 0; i < xyz.size(); ++i) xyz[i] = static_cast<double>(i);
    const std::vector<std::int16_t> values = {-1, 2, 3, 4, 5};
    mesh.add_points(xyz, std::as_bytes(std::span(values)));
    mesh.add_tetrahedra(std::vector<std::int64_t>{0, 1, 2, 3, 1, 2, 3, 4},
                        std::vector<std::uint8_t>{'d', 'h'});
    mesh.finish();
  }
  void write_all() const {
    VtkhdfFile mesh(path("a.vtkhdf"), SampleType::int16, false);
    write(mesh);
    mesh.commit();
  }

  /// The message of the error with which writing fails. Nothing may be left.
  template <class Error = WorldError>
  std::string failure() const {
    const std::string message = message_of<Error>([&] { write_all(); });
    EXPECT_THAT(names(), ElementsAre("bin"));
    return message;
  }
};

TEST_F(VtkhdfTest, TheWriterGetsEveryArrayAndTheFileAppearsAtTheEnd) {
  make_writer(R"(printf '%s\n' "$line" > "${0%/*}/../request"; )" + ready,
              R"(printf '%s\n' "$line" >> "${0%/*}/../requests"; )" + take);
  VtkhdfFile mesh(path("a.vtkhdf"), SampleType::int16, false);
  write(mesh);
  EXPECT_FALSE(std::filesystem::exists(path("a.vtkhdf")));
  EXPECT_EQ(mesh.file_bytes(), 120u + 64 + 10 + 2 + 2);
  mesh.commit();

  const std::string request = content("request");
  for (const char* part : {R"("request":"write-mesh")", R"("points":5)", R"("tetrahedra":2)",
                           R"("point_data":[{"name":"value","type":"int16"}])",
                           R"("cell_data":[{"name":"level","type":"uint8"},{"name":"type","type":"uint8"}])",
                           R"("options":{"format":"vtkhdf"})"})
    EXPECT_THAT(request, HasSubstr(part));
  EXPECT_THAT(request, HasSubstr("\"name\":\"" + path("a.vtkhdf") + "\""));
  EXPECT_EQ(content("requests"),
            "{\"from\":0,\"name\":\"positions\",\"request\":\"array\",\"to\":5}\n"
            "{\"from\":0,\"name\":\"connectivity\",\"request\":\"array\",\"to\":2}\n"
            "{\"from\":0,\"name\":\"value\",\"request\":\"array\",\"to\":5}\n"
            "{\"from\":0,\"name\":\"level\",\"request\":\"array\",\"to\":2}\n"
            "{\"from\":0,\"name\":\"type\",\"request\":\"array\",\"to\":2}\n");
  const std::string bytes = content("a.vtkhdf");
  EXPECT_EQ(bytes.substr(0, 16), std::string(14, '\0') + "\xf0\x3f") << "0.0, and 1.0";
  EXPECT_EQ(bytes.substr(120 + 8, 8), std::string("\1\0\0\0\0\0\0\0", 8));
  EXPECT_EQ(bytes.substr(184, 4), std::string("\xff\xff\2\0", 4));
  EXPECT_EQ(bytes.substr(194), std::string("dh\1\2", 4))
      << "levels, and what is left of them if divided by 3";
}

// As for volumes; see program_source_test.cpp.
TEST_F(VtkhdfTest, WhatAWriterDoesWrongNamesItAndLeavesNothing) {
  const auto fails_with = [&](const char* message) { EXPECT_THAT(failure(), HasSubstr(message)); };
  make_writer(ready, take, R"(echo '{"answer": "error", "kind": "usage", "message": "it cannot be"}'; exit)");
  EXPECT_EQ(failure<UsageError>(), "it cannot be");
  make_writer(R"(echo '{"answer": "ready", "memory": 1000000000}')");
  fails_with("wants 1000000000 bytes of memory");
  // In the middle of an array, between arrays, and before the end.
  make_writer(ready, "head -c 50 > /dev/null; kill -KILL $$");
  fails_with("by signal 9");
  make_writer(ready, take + "; case $line in *connectivity*) echo 'no room' >&2; exit 3 ;; esac");
  fails_with("stderr: no room");
  make_writer(ready, take, "exit 0");
  fails_with("exited with code 0 before it answered");
  make_writer(ready, take, R"(mv "$path" "$path.x"; cp "$path.x" "$path"; rm "$path.x"; )" + done);
  fails_with("removed or replaced the file");
}

TEST_F(VtkhdfTest, AnExistingFileStays) {
  make_writer();
  file("a.vtkhdf", "mine");
  EXPECT_THROW(write_all(), UsageError);
  EXPECT_EQ(content("a.vtkhdf"), "mine");
}

}  // namespace
}  // namespace tagrid
