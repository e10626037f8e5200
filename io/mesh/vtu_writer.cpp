// The format: VTK File Formats, "XML File Formats", UnstructuredGrid with an AppendedData section. After the
// underscore come the arrays in the order of the offsets; each is preceded by its size in bytes (UInt64).
#include "io/mesh/vtu_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "io/mesh/vtk_appended.h"
#include "io/volume/vtk_names.h"

namespace tagrid {
namespace {

constexpr std::uint8_t vtk_tetra = 10;

// The primitive of each tetrahedron, computed from its level.
void write_types(OutputFile& output, SpoolFile& levels) {
  write_size(output, levels.size());
  levels.read_back([&](std::span<std::byte> part) {
    for (std::byte& level : part) level = static_cast<std::byte>(std::to_integer<unsigned>(level) % 3);
    output.write(std::span<const std::byte>(part));
  });
}

}  // namespace

VtuWriter::VtuWriter(const std::string& path, SampleType value_type, bool overwrite)
    : value_type_(value_type),
      output_(path, overwrite),
      coordinates_(SpoolFile::beside(path)),
      values_(SpoolFile::beside(path)),
      connectivity_(SpoolFile::beside(path)),
      levels_(SpoolFile::beside(path)) {}

void VtuWriter::add_points(std::span<const double> xyz, std::span<const std::byte> values) {
  assert(xyz.size() % 3 == 0 && values.size() == xyz.size() / 3 * size_of(value_type_));
  write_samples(coordinates_, std::as_bytes(xyz), sizeof(double));
  write_samples(values_, values, size_of(value_type_));
  points_ += static_cast<std::int64_t>(xyz.size() / 3);
}

void VtuWriter::add_tetrahedra(std::span<const std::int64_t> connectivity,
                               std::span<const std::uint8_t> levels) {
  assert(connectivity.size() == 4 * levels.size());
  for (std::int64_t index : connectivity) {
    assert(index >= 0);
    largest_index_ = std::max(largest_index_, index);
  }
  write_samples(connectivity_, std::as_bytes(connectivity), sizeof(std::int64_t));
  levels_.write(std::as_bytes(levels));
  tetrahedra_ += static_cast<std::int64_t>(levels.size());
}

std::string VtuWriter::head() const {
  std::uint64_t offset = 0;
  const auto array = [&](std::string_view type, std::string_view name, int components, std::uint64_t bytes) {
    std::string line = fmt::format("        <DataArray type=\"{}\" Name=\"{}\"", type, name);
    if (components > 1) line += fmt::format(" NumberOfComponents=\"{}\"", components);
    line += fmt::format(" format=\"appended\" offset=\"{}\"/>\n", offset);
    offset += 8 + bytes;
    return line;
  };
  const auto cells = static_cast<std::uint64_t>(tetrahedra_);
  std::string xml = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n"
      "  <UnstructuredGrid>\n"
      "    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
      points_, tetrahedra_);
  xml += "      <Points>\n" + array("Float64", "Points", 3, coordinates_.size()) + "      </Points>\n";
  xml += "      <Cells>\n" + array("Int64", "connectivity", 1, connectivity_.size());
  xml += array("Int64", "offsets", 1, cells * sizeof(std::int64_t));
  xml += array("UInt8", "types", 1, cells) + "      </Cells>\n";
  xml += "      <PointData Scalars=\"value\">\n" +
         array(vtk_name_of(value_type_), "value", 1, values_.size()) + "      </PointData>\n";
  xml += "      <CellData Scalars=\"level\">\n" + array("UInt8", "level", 1, cells);
  xml += array("UInt8", "type", 1, cells) + "      </CellData>\n";
  xml += "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_";
  return xml;
}

void VtuWriter::finish() {
  assert(largest_index_ < points_);
  output_.write(head());
  write_spooled(output_, coordinates_);
  write_spooled(output_, connectivity_);
  write_computed<std::int64_t>(output_, tetrahedra_, [](std::int64_t i) { return 4 * (i + 1); });
  write_computed<std::uint8_t>(output_, tetrahedra_, [](std::int64_t) { return vtk_tetra; });
  write_spooled(output_, values_);
  write_spooled(output_, levels_);
  write_types(output_, levels_);
  output_.write("\n  </AppendedData>\n</VTKFile>\n");
}

}  // namespace tagrid
