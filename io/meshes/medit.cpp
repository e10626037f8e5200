// The format: libMeshb, "The Gamma Mesh Format", in ASCII, https://github.com/LoicMarechal/libMeshb
#include <fmt/format.h>

#include <utility>

#include "io/errors/errors.h"
#include "io/meshes/facet_sets.h"
#include "io/meshes/material_files.h"
#include "io/meshes/text_output.h"

namespace tagrid {
namespace {

class MeditFile final : public MaterialMeshFile {
 public:
  using MaterialMeshFile::MaterialMeshFile;

  void write(MaterialMesh& mesh) override {
    check_limits(medit_limits, mesh, output_.name());
    for (const MaterialElements& material : mesh.materials)
      if (!std::in_range<std::int32_t>(material.label))
        throw UsageError(
            fmt::format("{}: references of Medit files have 32 bits, too few for the label {} of {}",
                        output_.name(), material.label, material.name));
    for (const MaterialSurface& surface : mesh.surfaces)
      check_name(medit_limits, surface.name, output_.name());
    write_head(mesh);
    text_.put("\nVertices\n");
    text_.put(mesh.point_count());
    text_.put('\n');
    for_each_point_of(mesh.points, [&](std::int64_t, std::span<const double, 3> xyz) {
      for (const double x : xyz) {
        text_.put(x);
        text_.put(' ');
      }
      text_.put("0\n");
    });
    begin(mesh.order == 1 ? "Tetrahedra" : "TetrahedraP2", mesh.element_count());
    for (const MaterialElements& material : mesh.materials)
      put_entries(mesh.nodes, mesh.nodes_of_element(), material.first, material.count, material.label);
    std::int64_t faces = 0, reference = 0;
    for (const MaterialSurface& surface : mesh.surfaces) faces += surface.count;
    begin(mesh.order == 1 ? "Triangles" : "TrianglesP2", faces);
    for (const MaterialSurface& surface : mesh.surfaces)
      put_entries(mesh.face_nodes, mesh.nodes_of_face(), surface.first, surface.count, ++reference);
    text_.put("\nEnd\n");
    text_.flush();
  }

 private:
  void write_head(const MaterialMesh& mesh) {
    text_.put("MeshVersionFormatted 2\nDimension 3\n# ");
    text_.put(remark_of(mesh));
    text_.put('\n');
    for (const MaterialElements& material : mesh.materials)
      text_.put(fmt::format("# tetrahedra {}: {}\n", material.label, material.name));
    int reference = 0;
    for (const MaterialSurface& surface : mesh.surfaces)
      text_.put(fmt::format("# triangles {}: {}\n", ++reference, surface.name));
  }

  void begin(std::string_view keyword, std::int64_t count) {
    text_.put('\n');
    text_.put(keyword);
    text_.put('\n');
    text_.put(count);
    text_.put('\n');
  }

  void put_entries(SpoolFile& nodes, std::size_t size, std::int64_t first, std::int64_t count,
                   std::int64_t reference) {
    for_each_entry(nodes, size, first, count, 1, [&](std::int64_t, std::span<const std::int64_t> numbers) {
      text_.put(numbers, ' ');
      text_.put(' ');
      text_.put(reference);
      text_.put('\n');
    });
  }

  TextOutput text_{output_};
};

}  // namespace

std::unique_ptr<MaterialMeshFile> create_medit(const std::string& path, bool overwrite) {
  return std::make_unique<MeditFile>(path, overwrite);
}

}  // namespace tagrid
