// The format: "Input syntax rules" and the keywords *NODE, *ELEMENT, *NSET and *SURFACE of the manual of Abaqus. The one
// of CalculiX has the same keywords: "CalculiX CrunchiX USER'S MANUAL", chapter "Input deck format".
#include <array>

#include "io/meshes/facet_sets.h"
#include "io/meshes/material_files.h"
#include "io/meshes/text_output.h"

namespace tagrid {
namespace {

/// Both programs read so many characters of a number.
constexpr std::size_t characters_of_number = 20;
constexpr int numbers_of_line = 16;

/// The face of an element that does not have the corner 0, 1, 2 or 3. S1 has the nodes 1 2 3, S2 1 4 2, S3 2 4 3, and
/// S4 3 4 1.
constexpr std::array<std::string_view, 4> face_names = {"S3", "S4", "S2", "S1"};

class AbaqusFile final : public MaterialMeshFile {
 public:
  using MaterialMeshFile::MaterialMeshFile;

  void write(MaterialMesh& mesh) override {
    check_limits(abaqus_limits, mesh, output_.name());
    const std::vector<FacetSet> sets = facet_sets(mesh);
    for (const FacetSet& set : sets) check_name(abaqus_limits, set.name, output_.name());
    text_.put("** ");
    text_.put(remark_of(mesh));
    text_.put("\n");
    write_nodes(mesh);
    for (const MaterialElements& material : mesh.materials)
      if (material.count > 0) write_elements(mesh, material);
    for (const FacetSet& set : sets) {
      if (!set.is_turned) write_node_set(mesh, set);
      write_surface(mesh, set);
    }
    text_.flush();
  }

 private:
  void card(std::string_view begin, std::string_view name, std::string_view end) {
    for (const std::string_view text : {begin, name, end}) text_.put(text);
  }

  void write_nodes(MaterialMesh& mesh) {
    text_.put("*NODE\n");
    for_each_point_of(mesh.points, [&](std::int64_t point, std::span<const double, 3> xyz) {
      text_.put(point + 1);
      for (const double x : xyz) {
        text_.put(',');
        text_.put(x, characters_of_number);
      }
      text_.put('\n');
    });
  }

  void write_elements(MaterialMesh& mesh, const MaterialElements& material) {
    card(mesh.order == 1 ? "*ELEMENT, TYPE=C3D4, ELSET=" : "*ELEMENT, TYPE=C3D10, ELSET=", material.name,
         "\n");
    for_each_entry(mesh.nodes, mesh.nodes_of_element(), material.first, material.count, 1,
                   [&](std::int64_t element, std::span<const std::int64_t> nodes) {
                     text_.put(element + 1);
                     text_.put(',');
                     text_.put(nodes, ',');
                     text_.put('\n');
                   });
  }

  void write_node_set(MaterialMesh& mesh, const FacetSet& set) {
    card("*NSET, NSET=", set.name, "");
    int in_line = numbers_of_line;
    for_each_point_on(mesh, set, [&](std::int64_t point) {
      const bool is_new = in_line == numbers_of_line;
      text_.put(is_new ? '\n' : ',');
      in_line = is_new ? 1 : in_line + 1;
      text_.put(point + 1);
    });
    text_.put('\n');
  }

  void write_surface(MaterialMesh& mesh, const FacetSet& set) {
    card("*SURFACE, NAME=", set.name, ", TYPE=ELEMENT\n");
    for (const FacetSet::Part& part : set.parts) {
      const MaterialSurface& surface = mesh.surfaces[part.surface];
      for_each_entry(mesh.faces, 2, surface.first, surface.count, 0,
                     [&](std::int64_t, std::span<const std::int64_t> sides) {
                       const std::int64_t face = sides[part.is_back ? 1 : 0];
                       text_.put(face / 4 + 1);
                       text_.put(',');
                       text_.put(face_names[static_cast<std::size_t>(face % 4)]);
                       text_.put('\n');
                     });
    }
  }

  TextOutput text_{output_};
};

}  // namespace

std::unique_ptr<MaterialMeshFile> create_abaqus(const std::string& path, bool overwrite) {
  return std::make_unique<AbaqusFile>(path, overwrite);
}

}  // namespace tagrid
