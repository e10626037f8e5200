// Meshes with materials as files. Other programs read them in tests/readers/material_mesh_test.py.
#include "io/meshes/material_files.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <set>
#include <sstream>

#include "io/errors/errors.h"
#include "io/meshes/facet_sets.h"
#include "io/meshes/formats.h"
#include "tests/support/boxes_of_materials.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class MaterialFiles : public TemporaryFolder {
 protected:
  void SetUp() override { setenv("TAGRID_READER_PATH", TAGRID_READERS, 1); }
  void TearDown() override { unsetenv("TAGRID_READER_PATH"); }

  std::unique_ptr<MaterialMeshFile> create(const std::string& name, bool overwrite = false) const {
    return material_mesh_format_of(path(name)).create_materials(path(name), overwrite);
  }
  std::string write(const std::string& name, MaterialMesh& mesh, bool overwrite = false) const {
    const auto file = create(name, overwrite);
    file->write(mesh);
    file->commit();
    return content(name);
  }
  std::string write(const std::string& name, const BoxesOfMaterials& boxes, bool overwrite = false) const {
    MaterialMeshOfBoxes made(boxes, path(name));
    return write(name, made.mesh(), overwrite);
  }
  MaterialMesh no_mesh() const {
    return {.order = 1,
            .notes = {},
            .unit = "",
            .materials = {},
            .surfaces = {},
            .points = SpoolFile::beside(path("a")),
            .nodes = SpoolFile::beside(path("a")),
            .face_nodes = SpoolFile::beside(path("a")),
            .faces = SpoolFile::beside(path("a"))};
  }
  static std::vector<std::string> every_name() {
    std::vector<std::string> names;
    for (const MeshFormat& format : material_mesh_formats())
      names.push_back("a" + std::string(format.extensions[0]));
    return names;
  }
};

std::vector<std::string> names_of(const std::vector<FacetSet>& sets) {
  std::vector<std::string> names;
  for (const FacetSet& set : sets) names.push_back(set.name);
  return names;
}

TEST_F(MaterialFiles, TheTableSaysWhatFormatsHold) {
  EXPECT_THAT(every_name(), ElementsAre("a.vtu", "a.vtkhdf", "a.msh", "a.inp", "a.feb", "a.mesh", "a.xdmf"));
  EXPECT_EQ(material_mesh_format_of("-").name, "VTU");
  EXPECT_EQ(material_mesh_format_of("A.INP").name, "Abaqus");
  EXPECT_EQ(message_of<UsageError>([] { mesh_format_of("a.inp"); }),
            "a.inp: Abaqus files hold meshes with materials only; the name of a mesh must end in "
            ".vtu, .vtkhdf, .hdf or .msh");
  EXPECT_EQ(message_of<UsageError>([] { material_mesh_format_of("a.stl"); }),
            "a.stl: STL files hold surfaces only; the name of a mesh with "
            "materials "
            "must end in .vtu, .vtkhdf, .hdf, .msh, .inp, .feb, .mesh or .xdmf");
  EXPECT_THAT(message_of<UsageError>([] { material_mesh_format_of("a.exo"); }), Not(HasSubstr("hold")));
}

TEST_F(MaterialFiles, PointsOfASetAreSortedOrMarked) {
  MaterialMeshOfBoxes made({.cells = {3, 4, 5}, .materials = 2}, path("a"));
  for (const FacetSet& set : facet_sets(made.mesh())) {
    std::set<std::int64_t> wanted;
    for (const FacetSet::Part& part : set.parts) {
      const MaterialSurface& surface = made.mesh().surfaces[part.surface];
      for_each_entry(made.mesh().face_nodes, made.mesh().nodes_of_face(), surface.first, surface.count, 0,
                     [&](std::int64_t, std::span<const std::int64_t> nodes) {
                       wanted.insert(nodes.begin(), nodes.end());
                     });
    }
    for (const std::int64_t most_sorted : {most_sorted_nodes, std::int64_t{0}}) {
      std::vector<std::int64_t> found;
      for_each_point_on(
          made.mesh(), set, [&](std::int64_t point) { found.push_back(point); }, most_sorted);
      EXPECT_EQ(found, std::vector<std::int64_t>(wanted.begin(), wanted.end())) << set.name;
    }
  }
}

TEST_F(MaterialFiles, FacetsAreThoseOfBothSidesOfMaterialsAndOfTheBox) {
  MaterialMeshOfBoxes made({.cells = {2, 1, 1}, .air = true, .empty = true}, path("a"));
  const std::vector<FacetSet> sets = facet_sets(made.mesh());
  EXPECT_THAT(names_of(sets),
              ElementsAre("bone_soft", "bone_x_min", "bone_y_min", "bone_y_max", "bone_z_min", "bone_air",
                          "soft_x_max", "soft_y_min", "soft_y_max", "soft_z_min", "soft_air", "soft_bone",
                          "bone_surface", "soft_surface", "x_min", "x_max", "y_min", "y_max", "z_min"));
  const auto faces = [&](const std::string& name) {
    std::int64_t count = 0;
    for (const FacetSet& set : sets)
      if (set.name == name)
        for (const FacetSet::Part& part : set.parts) count += made.mesh().surfaces[part.surface].count;
    return count;
  };
  EXPECT_EQ(faces("soft_bone"), 2);
  EXPECT_EQ(faces("bone_surface"), 12);
  EXPECT_EQ(faces("soft_surface"), 12);
  EXPECT_EQ(faces("y_max"), 4);
}

TEST_F(MaterialFiles, ANameThatIsTakenGetsANumber) {
  MaterialMeshOfBoxes made({.cells = {2, 1, 1}}, path("a"));
  made.mesh().surfaces[0].name = "BONE_surface";
  made.mesh().surfaces[1].name = "soft_Bone";
  made.mesh().surfaces[2].name = "x_min";
  const std::vector<std::string> names = names_of(facet_sets(made.mesh()));
  for (const char* name : {"BONE_surface", "soft_Bone", "soft_bone_2", "bone_surface_2", "x_min_2"})
    EXPECT_THAT(names, testing::Contains(name));
  std::set<std::string> differ;
  for (std::string name : names) {
    std::ranges::transform(name, name.begin(), [](char c) { return static_cast<char>(std::tolower(c)); });
    EXPECT_TRUE(differ.insert(name).second) << name;
  }
}

TEST_F(MaterialFiles, AbaqusHasWhatItsManualSays) {
  const std::string text =
      write("a.inp", {.cells = {2, 1, 1}, .spacing = {0.1, 2, 1e-9}, .origin = {1, 0, 0}});
  EXPECT_TRUE(text.starts_with(
      "** Tetrahedra with materials; SPACE=LPS; unit=mm\n*NODE\n1,1,0,0\n2,1.1,0,0\n3,1.2,0,0\n"));
  EXPECT_THAT(text, HasSubstr("\n12,1.2,2,1e-09\n*ELEMENT, TYPE=C3D4, ELSET=bone\n1,1,2,5,11\n"));
  EXPECT_THAT(text, HasSubstr("\n*ELEMENT, TYPE=C3D4, ELSET=soft\n7,6,12,2,3\n"));
  EXPECT_THAT(
      text,
      HasSubstr("\n*NSET, NSET=bone_soft\n2,5,8,11\n*SURFACE, NAME=bone_soft, TYPE=ELEMENT\n1,S3\n2,S4\n*"));
  EXPECT_THAT(text, HasSubstr("\n*SURFACE, NAME=soft_bone, TYPE=ELEMENT\n10,S2\n12,S3\n*"));
  EXPECT_THAT(text, Not(HasSubstr("NSET=soft_bone"))) << "its nodes are those of bone_soft";
}

TEST_F(MaterialFiles, LinesOfAbaqusAreShortEnough) {
  const std::string text = write("a.inp", {.cells = {9, 7, 8},
                                           .spacing = {-1.0 / 3, 1e-7 / 3, 1e100 / 7},
                                           .origin = {-0.01 / 3, 0, 0},
                                           .order = 2});
  std::istringstream lines(text);
  std::size_t longest_set = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 256u);
    if (line.starts_with("*")) continue;
    const auto entries = static_cast<std::size_t>(1 + std::ranges::count(line, ','));
    EXPECT_LE(entries, 16u);
    if (entries == 16) ++longest_set;
    std::istringstream parts(line);
    for (std::string part; std::getline(parts, part, ',');) EXPECT_LE(part.size(), 20u) << line;
  }
  EXPECT_GT(longest_set, 10u);
}

TEST_F(MaterialFiles, CoordinatesOfTextComeBack) {
  const std::array<double, 3> spacing = {-1.0 / 3, 1e-7 / 3, 1e100 / 7};
  for (const char* name : {"a.inp", "a.feb", "a.mesh"}) {
    const bool is_rounded = std::string(name) == "a.inp";
    std::istringstream lines(write(name, {.cells = {2, 1, 1}, .spacing = spacing}));
    std::size_t found = 0;
    for (std::string line; found < 12 && std::getline(lines, line);) {
      // The last points have all three numbers.
      for (char& c : line)
        if (c == ',' || c == '<' || c == '>' || c == '"') c = ' ';
      std::istringstream words(line);
      std::vector<std::string> numbers;
      for (std::string word; words >> word;)
        if (word.find_first_not_of("0123456789.e+-") == std::string::npos) numbers.push_back(word);
      if (numbers.size() != 4) continue;
      const std::size_t first = std::string(name) == "a.mesh" ? 0 : 1;
      if (++found == 12)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double expected = spacing[axis] * (axis == 0 ? 2 : 1);
          const double read = std::stod(numbers[first + axis]);
          if (is_rounded)
            EXPECT_NEAR(read / expected, 1, 1e-13);
          else
            EXPECT_EQ(read, expected) << name;
        }
    }
    EXPECT_EQ(found, 12u) << name;
  }
}

TEST_F(MaterialFiles, VtuHasLabelsAndNames) {
  write("a.vtu", {.cells = {2, 1, 1}, .order = 2, .empty = true});
  Vtu vtu(path("a.vtu"));
  EXPECT_EQ(vtu.number("NumberOfPoints"), 45u);
  EXPECT_EQ(vtu.number("NumberOfCells"), 12u);
  EXPECT_EQ(vtu.array<std::uint8_t>("UInt8", "types"), std::vector<std::uint8_t>(12, 24));
  EXPECT_EQ(vtu.array<std::int64_t>("Int64", "offsets").back(), 120);
  EXPECT_EQ(vtu.array<std::int64_t>("Int64", "connectivity").size(), 120u);
  std::vector<std::int32_t> labels(12, 10);
  std::fill(labels.begin() + 6, labels.end(), 20);
  EXPECT_EQ(vtu.array<std::int32_t>("Int32", "material"), labels);
  EXPECT_TRUE(has(vtu.xml, "\"material_labels\" NumberOfTuples=\"3\" format=\"ascii\">10 20 30<"));
  EXPECT_TRUE(has(vtu.xml, "\"material_names\" NumberOfTuples=\"3\""));
  EXPECT_TRUE(has(vtu.xml, "<CellData Scalars=\"material\">"));
  EXPECT_EQ(vtu.rest(), "\n  </AppendedData>\n</VTKFile>\n");
}

TEST_F(MaterialFiles, LabelsOfAnySizeAreExact) {
  MaterialMeshOfBoxes made({.cells = {2, 1, 1}}, path("a"));
  made.mesh().materials[1].label = 4'000'000'000;
  write("a.vtu", made.mesh());
  EXPECT_EQ(Vtu(path("a.vtu")).array<std::uint32_t>("UInt32", "material").back(), 4'000'000'000u);
  made.mesh().materials[0].label = -1;
  write("a.vtu", made.mesh(), true);
  EXPECT_EQ(Vtu(path("a.vtu")).array<double>("Float64", "material").front(), -1);
  EXPECT_THAT(message_of<UsageError>([&] { write("a.mesh", made.mesh()); }),
              HasSubstr("references of Medit files have 32 bits, too few for the label 4000000000 of soft"));
  const auto gmsh = create("a.msh");
  gmsh->write(made.mesh());
  ASSERT_EQ(gmsh->warnings().size(), 1u);
  EXPECT_THAT(gmsh->warnings()[0], HasSubstr("have the tags 1, 2, 3 and so on"));
  gmsh->commit();
  EXPECT_THAT(content("a.msh"), HasSubstr("3 1 \"bone\"\n3 2 \"soft\"\n"));
}

TEST_F(MaterialFiles, WhatAFormatCannotHoldIsRefused) {
  MaterialMesh mesh = no_mesh();
  const std::byte end{1};
  mesh.points.write_at(24 * std::uint64_t{999'999'999} + 23,
                       std::span(&end, 1));  // a gap, which takes no space
  for (const char* name : {"a.inp", "a.feb", "a.mesh"}) {
    const bool is_abaqus = std::string(name) == "a.inp";
    if (!is_abaqus) mesh.points.write_at(24 * std::uint64_t{2147483647} + 23, std::span(&end, 1));
    EXPECT_THAT(
        message_of<UsageError>([&] { create(name)->write(mesh); }),
        HasSubstr(is_abaqus
                      ? "Abaqus files have at most 999999999 points, and the mesh has 1000000000; choose "
                        "another format, or a coarser mesh"
                      : "files have at most 2147483647 points, and the mesh has 2147483648"));
  }
  MaterialMesh many = no_mesh();
  many.nodes.write_at(32 * std::uint64_t{999'999'999} + 31, std::span(&end, 1));
  EXPECT_THAT(message_of<UsageError>([&] { create("a.inp")->write(many); }),
              HasSubstr("at most 999999999 tetrahedra, and the mesh has 1000000000"));
  EXPECT_TRUE(names().empty());
}

TEST_F(MaterialFiles, NamesHaveALimit) {
  MaterialMeshOfBoxes made({.cells = {2, 1, 1}}, path("a"));
  made.mesh().materials[1].name = std::string(72, 'a');
  EXPECT_NE(write("a.inp", made.mesh()), "") << "with _surface, it has 80";
  made.mesh().materials[1].name += 'a';
  EXPECT_THAT(message_of<UsageError>([&] { write("a.inp", made.mesh(), true); }),
              HasSubstr("Abaqus files have names of up to 80 characters, and \"" + std::string(73, 'a') +
                        "_surface\" has 81; give materials shorter names"));
  made.mesh().materials[1].name = std::string(128, 'a');
  EXPECT_THAT(message_of<UsageError>([&] { write("a.msh", made.mesh()); }),
              HasSubstr("up to 127 characters"));
}

TEST_F(MaterialFiles, EveryFormatWritesEveryMesh) {
  for (const std::string& name : every_name())
    for (const int order : {1, 2})
      for (const auto& boxes :
           std::vector<BoxesOfMaterials>{{.cells = {1, 1, 1}, .materials = 1},
                                         {.cells = {2, 2, 2}, .mirrored = true, .empty = true},
                                         {.cells = {300, 1, 1}, .materials = 300}}) {
        BoxesOfMaterials of_order = boxes;
        of_order.order = order;
        const auto file = create(name, true);
        MaterialMeshOfBoxes made(of_order, path(name));
        file->write(made.mesh());
        file->commit();
        EXPECT_TRUE(file->warnings().empty());
        const std::uint64_t beside = std::filesystem::exists(path("a.h5")) ? content("a.h5").size() : 0;
        EXPECT_EQ(file->file_bytes(), content(name).size() + (name == "a.xdmf" ? beside : 0)) << name;
        const std::string first = content(name);
        EXPECT_EQ(write(name, of_order, true), first) << "equal meshes give equal bytes";
      }
}

TEST_F(MaterialFiles, AMeshWithoutElementsIsAFileButForFebio) {
  for (const std::string& name : every_name()) {
    MaterialMesh mesh = no_mesh();
    mesh.materials.push_back({"bone", 1, 0, 0});
    if (name == "a.feb")
      EXPECT_THAT(message_of<UsageError>([&] { write(name, mesh); }),
                  HasSubstr("the mesh has no tetrahedra"));
    else
      EXPECT_NE(write(name, mesh), "") << name;
  }
}

TEST_F(MaterialFiles, NothingIsThereBeforeCommitAndNothingIsLeftWithout) {
  for (const std::string& name : every_name()) {
    {
      const auto file = create(name);
      MaterialMeshOfBoxes made({}, path(name));
      file->write(made.mesh());
      EXPECT_FALSE(std::filesystem::exists(path(name)));
    }
    EXPECT_TRUE(names().empty()) << name;
  }
}

TEST_F(MaterialFiles, AFileThatExistsStays) {
  for (const std::string& name : every_name()) {
    file(name, "mine");
    EXPECT_THROW(create(name), UsageError) << name;
    EXPECT_EQ(content(name), "mine");
    write(name, BoxesOfMaterials{}, true);
    EXPECT_NE(content(name), "mine");
  }
}

TEST_F(MaterialFiles, BothFilesOfXdmfAppearOrNone) {
  file("a.h5", "mine");
  EXPECT_THROW(create("a.xdmf"), UsageError);
  EXPECT_EQ(content("a.h5"), "mine");
  write("a.xdmf", BoxesOfMaterials{}, true);
  EXPECT_THAT(names(), ElementsAre("a.h5", "a.xdmf"));
  EXPECT_THAT(content("a.xdmf"), HasSubstr(">a.h5:/points<"));
  EXPECT_TRUE(content("a.h5").starts_with("\x89HDF"));

  // Someone else takes one of the names.
  for (const char* taken : {"b.xdmf", "b.h5"}) {
    {
      const auto written = create("b.xdmf");
      MaterialMeshOfBoxes made({}, path("b.xdmf"));
      written->write(made.mesh());
      file(taken, "mine");
      EXPECT_THROW(written->commit(), UsageError);
    }
    EXPECT_THAT(names(), ElementsAre("a.h5", "a.xdmf", taken));
    EXPECT_EQ(content(taken), "mine");
    std::filesystem::remove(path(taken));
  }
}

TEST_F(MaterialFiles, XdmfNeedsANameForItsOtherFile) {
  EXPECT_THAT(message_of<UsageError>([&] { create("a:b.xdmf"); }), HasSubstr("the name cannot have one"));
  write("A.XDMF", BoxesOfMaterials{});
  EXPECT_THAT(names(), ElementsAre("A.XDMF", "A.h5"));
  write("a & b.xdmf", BoxesOfMaterials{});
  EXPECT_THAT(content("a & b.xdmf"), HasSubstr(">a &amp; b.h5:/points<"));
}

TEST_F(MaterialFiles, PointsOfFacesComeOnceAndInOrder) {
  MaterialMeshOfBoxes made({.cells = {4, 5, 6}, .order = 2}, path("a"));
  for (const FacetSet& set : facet_sets(made.mesh())) {
    std::set<std::int64_t> expected;
    for (const FacetSet::Part& part : set.parts)
      for_each_entry(made.mesh().face_nodes, 6, made.mesh().surfaces[part.surface].first,
                     made.mesh().surfaces[part.surface].count, 0,
                     [&](std::int64_t, std::span<const std::int64_t> nodes) {
                       expected.insert(nodes.begin(), nodes.end());
                     });
    std::vector<std::int64_t> found;
    for_each_point_on(made.mesh(), set, [&](std::int64_t point) { found.push_back(point); });
    EXPECT_EQ(found, std::vector<std::int64_t>(expected.begin(), expected.end())) << set.name;
  }
}

TEST_F(MaterialFiles, PointsOfFacesAreFoundInMeshesOfAnySize) {
  // More points than are marked at a time; all but the last one are a gap.
  MaterialMesh mesh = no_mesh();
  const std::int64_t last = (std::int64_t{1} << 27) + 5;
  const std::byte end{1};
  mesh.points.write_at(24 * static_cast<std::uint64_t>(last) + 23, std::span(&end, 1));
  const std::array<std::int64_t, 6> nodes = {
      last, 3, std::int64_t{1} << 26, last, (std::int64_t{1} << 26) - 1, 3};
  mesh.face_nodes.write(std::as_bytes(std::span(nodes)));
  mesh.surfaces.push_back({"all", 0, {}, {}, 0, 2});
  std::vector<std::int64_t> found;
  for_each_point_on(mesh, {"all", {{0, false}}}, [&](std::int64_t point) { found.push_back(point); });
  EXPECT_THAT(found, ElementsAre(3, (std::int64_t{1} << 26) - 1, std::int64_t{1} << 26, last));
}

}  // namespace
}  // namespace tagrid
