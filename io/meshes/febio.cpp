// The format: "FEBio User Manual", chapter "Free Format Input", version 4.0 of the format. Tetrahedra of 10 nodes and
// triangles of 6 have them in the order of MaterialMesh.
#include <fmt/format.h>

#include <array>

#include "io/errors/errors.h"
#include "io/meshes/facet_sets.h"
#include "io/meshes/material_files.h"
#include "io/meshes/text_output.h"

namespace tagrid {
namespace {

/// The nodes of a face in the order in which they are seen from its back.
constexpr std::array<std::size_t, 6> turned = {0, 2, 1, 5, 4, 3};

class FebioFile final : public MaterialMeshFile {
 public:
  using MaterialMeshFile::MaterialMeshFile;

  void write(MaterialMesh& mesh) override {
    check_limits(febio_limits, mesh, output_.name());
    if (mesh.element_count() == 0)
      throw UsageError(output_.name() + ": the mesh has no tetrahedra, and FEBio reads no such file");
    const std::vector<FacetSet> sets = facet_sets(mesh);
    text_.put("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- ");
    text_.put(remark_of(mesh));
    text_.put(" -->\n<febio_spec version=\"4.0\">\n  <Module type=\"solid\"/>\n");
    write_materials(mesh);
    text_.put("  <Mesh>\n");
    write_nodes(mesh);
    for (const MaterialElements& material : mesh.materials)
      if (material.count > 0) write_elements(mesh, material);
    for (const FacetSet& set : sets) write_surface(mesh, set);
    for (const FacetSet& set : sets)
      if (!set.is_turned) write_node_set(mesh, set);
    text_.put("  </Mesh>\n  <MeshDomains>\n");
    for (const MaterialElements& material : mesh.materials)
      if (material.count > 0)
        text_.put(fmt::format("    <SolidDomain name=\"{0}\" mat=\"{0}\"/>\n", material.name));
    text_.put("  </MeshDomains>\n</febio_spec>\n");
    text_.flush();
  }

 private:
  void write_materials(const MaterialMesh& mesh) {
    text_.put("  <Material>\n    <!-- The properties of all materials are placeholders: replace them. -->\n");
    int id = 0;
    for (const MaterialElements& material : mesh.materials)
      if (material.count > 0)
        text_.put(
            fmt::format("    <material id=\"{}\" name=\"{}\" type=\"neo-Hookean\">\n"
                        "      <density>1</density>\n      <E>1</E>\n      <v>0.3</v>\n    </material>\n",
                        ++id, material.name));
    text_.put("  </Material>\n");
  }

  void write_nodes(MaterialMesh& mesh) {
    text_.put("    <Nodes name=\"nodes\">\n");
    for_each_point_of(mesh.points, [&](std::int64_t point, std::span<const double, 3> xyz) {
      begin("node", point + 1);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (axis > 0) text_.put(',');
        text_.put(xyz[axis]);
      }
      text_.put("</node>\n");
    });
    text_.put("    </Nodes>\n");
  }

  void write_elements(MaterialMesh& mesh, const MaterialElements& material) {
    text_.put(
        fmt::format("    <Elements type=\"tet{}\" name=\"{}\">\n", mesh.nodes_of_element(), material.name));
    for_each_entry(mesh.nodes, mesh.nodes_of_element(), material.first, material.count, 1,
                   [&](std::int64_t element, std::span<const std::int64_t> nodes) {
                     begin("elem", element + 1);
                     text_.put(nodes, ',');
                     text_.put("</elem>\n");
                   });
    text_.put("    </Elements>\n");
  }

  void write_surface(MaterialMesh& mesh, const FacetSet& set) {
    const std::string_view kind = mesh.order == 1 ? "tri3" : "tri6";
    text_.put(fmt::format("    <Surface name=\"{}\">\n", set.name));
    std::int64_t id = 0;
    for (const FacetSet::Part& part : set.parts) {
      const MaterialSurface& surface = mesh.surfaces[part.surface];
      for_each_entry(mesh.face_nodes, mesh.nodes_of_face(), surface.first, surface.count, 1,
                     [&](std::int64_t, std::span<const std::int64_t> nodes) {
                       std::array<std::int64_t, 6> seen;
                       for (std::size_t i = 0; i < nodes.size(); ++i)
                         seen[i] = nodes[part.is_back ? turned[i] : i];
                       begin(kind, ++id);
                       text_.put(std::span(seen).first(nodes.size()), ',');
                       text_.put("</");
                       text_.put(kind);
                       text_.put(">\n");
                     });
    }
    text_.put("    </Surface>\n");
  }

  void write_node_set(MaterialMesh& mesh, const FacetSet& set) {
    constexpr std::int64_t in_line = 16;
    text_.put(fmt::format("    <NodeSet name=\"{}\">", set.name));
    std::int64_t count = 0;
    for_each_point_on(mesh, set, [&](std::int64_t point) {
      if (count > 0) text_.put(',');
      if (count++ % in_line == 0) text_.put('\n');
      text_.put(point + 1);
    });
    text_.put("\n    </NodeSet>\n");
  }

  void begin(std::string_view element, std::int64_t id) {
    text_.put("      <");
    text_.put(element);
    text_.put(" id=\"");
    text_.put(id);
    text_.put("\">");
  }

  TextOutput text_{output_};
};

}  // namespace

std::unique_ptr<MaterialMeshFile> create_febio(const std::string& path, bool overwrite) {
  return std::make_unique<FebioFile>(path, overwrite);
}

}  // namespace tagrid
