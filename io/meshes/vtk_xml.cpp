#include "io/meshes/vtk_xml.h"

#include <fmt/format.h>

#include <array>
#include <span>

#include "io/meshes/mesh_files.h"
#include "io/meshes/surface_files.h"
#include "io/volume/vtk.h"

namespace tagrid {
namespace {

/// In text, VTK has the bytes of a string as numbers, with a 0 at the end.
std::string string_array(std::string_view name, std::string_view text) {
  std::string numbers;
  for (const char c : text) numbers += fmt::format("{} ", static_cast<unsigned char>(c));
  return fmt::format(
      "      <DataArray type=\"String\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}0</DataArray>\n",
      name, numbers);
}

std::string number_array(std::string_view name, double number) {
  return fmt::format(
      "      <DataArray type=\"Float64\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>\n",
      name, number);
}

}  // namespace

std::string vtk_field_data(const MeshNotes& notes) {
  std::string arrays;
  if (!notes.space.empty()) arrays += string_array("SPACE", notes.space);
  if (notes.has_rescale())
    arrays += number_array("rescale_slope", notes.rescale.slope) +
              number_array("rescale_intercept", notes.rescale.intercept);
  if (!notes.rescale.units.empty()) arrays += string_array("rescale_units", notes.rescale.units);
  return arrays.empty() ? "" : "    <FieldData>\n" + arrays + "    </FieldData>\n";
}

// The format: VTK File Formats, "XML File Formats", UnstructuredGrid with an AppendedData section. After the
// underscore come the arrays in the order of the offsets; each is preceded by its size in bytes (UInt64).

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

// The format: VTK File Formats, "XML File Formats", PolyData with an AppendedData section.

namespace {

class VtpFile final : public SurfaceFile {
 public:
  VtpFile(const std::string& path, bool overwrite)
      : SurfaceFile(path, overwrite),
        points_(SpoolFile::beside(path)),
        connectivity_(SpoolFile::beside(path)) {}

  void add(const SurfacePiece& piece) override {
    for_each_new_vertex(piece, [&](const std::array<double, 3>& place) {
      write_samples(points_, std::as_bytes(std::span(place)), sizeof(double));
    });
    for (const auto& triangle : piece.triangles) {
      std::array<std::int64_t, 3> ids;
      for (std::size_t i = 0; i < 3; ++i) ids[i] = piece.ids[triangle[i]];
      write_samples(connectivity_, std::as_bytes(std::span(ids)), sizeof(std::int64_t));
      ++triangle_count_;
    }
  }

  void finish() override {
    output_.write(head());
    write_spooled(output_, points_);
    write_spooled(output_, connectivity_);
    write_computed<std::int64_t>(output_, triangle_count_, [](std::int64_t i) { return 3 * (i + 1); });
    output_.write("\n  </AppendedData>\n</VTKFile>\n");
  }

 private:
  std::string head() const {
    const std::uint64_t connectivity = 8 + points_.size(), offsets = connectivity + 8 + connectivity_.size();
    return fmt::format(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        "  <PolyData>\n"
        "{}"
        "    <Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
        "NumberOfPolys=\"{}\">\n"
        "      <Points>\n"
        "        <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\" "
        "offset=\"0\"/>\n"
        "      </Points>\n"
        "      <Polys>\n"
        "        <DataArray type=\"Int64\" Name=\"connectivity\" format=\"appended\" offset=\"{}\"/>\n"
        "        <DataArray type=\"Int64\" Name=\"offsets\" format=\"appended\" offset=\"{}\"/>\n"
        "      </Polys>\n"
        "    </Piece>\n"
        "  </PolyData>\n"
        "  <AppendedData encoding=\"raw\">\n_",
        vtk_field_data({notes_.space}), vertex_count_, triangle_count_, connectivity, offsets);
  }

  SpoolFile points_, connectivity_;
  std::int64_t triangle_count_ = 0;
};

}  // namespace

std::unique_ptr<SurfaceFile> create_vtp(const std::string& path, bool overwrite) {
  return std::make_unique<VtpFile>(path, overwrite);
}

}  // namespace tagrid
