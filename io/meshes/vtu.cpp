// The format: VTK File Formats, "XML File Formats", UnstructuredGrid with an AppendedData section. After the
// underscore come the arrays in the order of the offsets; each is preceded by its size in bytes (UInt64).
#include "io/meshes/mesh_files.h"

#include <fmt/format.h>

#include "io/meshes/vtk_xml.h"
#include "io/volume/vtk.h"

namespace tagrid {
namespace {

constexpr std::uint8_t vtk_tetra = 10;

// The primitive of each tetrahedron, computed from its level.
void write_types(OutputFile& output, SpoolFile& levels) {
  write_size(output, levels.size());
  levels.read_back([&](std::span<std::byte> part) {
    for (std::byte& level : part) level = primitive_of(level);
    output.write(std::span<const std::byte>(part));
  });
}

}  // namespace

std::string VtuFile::head() const {
  std::uint64_t offset = 0;
  const auto array = [&](std::string_view type, std::string_view name, int components, std::uint64_t bytes) {
    std::string line = fmt::format("        <DataArray type=\"{}\" Name=\"{}\"", type, name);
    if (components > 1) line += fmt::format(" NumberOfComponents=\"{}\"", components);
    line += fmt::format(" format=\"appended\" offset=\"{}\"/>\n", offset);
    offset += 8 + bytes;
    return line;
  };
  const auto cells = static_cast<std::uint64_t>(mesh_.tetrahedra);
  const auto points = static_cast<std::uint64_t>(mesh_.points);
  std::string xml = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n"
      "  <UnstructuredGrid>\n"
      "{}"
      "    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
      vtk_field_data(notes_), mesh_.points, mesh_.tetrahedra);
  xml += "      <Points>\n" + array("Float64", "Points", 3, mesh_.coordinates.size()) + "      </Points>\n";
  xml += "      <Cells>\n" + array("Int64", "connectivity", 1, mesh_.connectivity.size());
  xml += array("Int64", "offsets", 1, cells * sizeof(std::int64_t));
  xml += array("UInt8", "types", 1, cells) + "      </Cells>\n";
  xml += "      <PointData Scalars=\"value\">\n" +
         array(vtk_name_of(mesh_.value_type), "value", 1, mesh_.values.size());
  if (notes_.has_rescale()) xml += array("Float64", "rescaled", 1, points * sizeof(double));
  xml += "      </PointData>\n";
  xml += "      <CellData Scalars=\"level\">\n" + array("UInt8", "level", 1, cells);
  xml += array("UInt8", "type", 1, cells) + "      </CellData>\n";
  xml += "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_";
  return xml;
}

void VtuFile::write_mesh() {
  output_.write(head());
  write_spooled(output_, mesh_.coordinates);
  write_spooled(output_, mesh_.connectivity);
  write_computed<std::int64_t>(output_, mesh_.tetrahedra, [](std::int64_t i) { return 4 * (i + 1); });
  write_computed<std::uint8_t>(output_, mesh_.tetrahedra, [](std::int64_t) { return vtk_tetra; });
  write_spooled(output_, mesh_.values);
  if (notes_.has_rescale()) {
    write_size(output_, static_cast<std::uint64_t>(mesh_.points) * sizeof(double));
    for_each_rescaled([&](std::int64_t, std::span<const std::byte> numbers) { output_.write(numbers); });
  }
  write_spooled(output_, mesh_.levels);
  write_types(output_, mesh_.levels);
  output_.write("\n  </AppendedData>\n</VTKFile>\n");
}

}  // namespace tagrid
