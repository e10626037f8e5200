#include "io/meshes/vtk_xml.h"

#include <fmt/format.h>

#include <array>
#include <span>

#include "io/meshes/mesh_files.h"
#include "io/meshes/mesh_writers.h"
#include "io/meshes/surface_files.h"
#include "io/volume/vtk.h"

namespace tagrid {
namespace {

/// In text, VTK has the bytes of strings as numbers, with a 0 at the end of each.
std::string string_array(std::string_view name, std::span<const std::string> texts) {
  std::string numbers;
  for (const std::string& text : texts) {
    for (const char c : text) numbers += fmt::format("{} ", static_cast<unsigned char>(c));
    numbers += &text == &texts.back() ? "0" : "0 ";
  }
  return fmt::format(
      "      <DataArray type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">{}</DataArray>\n",
      name, texts.size(), numbers);
}

std::string string_array(std::string_view name, const std::string& text) {
  return string_array(name, std::span(&text, 1));
}

std::string number_array(std::string_view name, double number) {
  return fmt::format(
      "      <DataArray type=\"Float64\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>\n",
      name, number);
}

std::string field_array(const MeshField& field) {
  if (!field.texts.empty()) return string_array(field.name, field.texts);
  return fmt::format(
      "      <DataArray type=\"Int64\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">{}</DataArray>\n",
      field.name, field.numbers.size(), fmt::join(field.numbers, " "));
}

}  // namespace

std::string vtk_field_data(const MeshNotes& notes, const std::vector<MeshField>& fields) {
  std::string arrays;
  if (!notes.space.empty()) arrays += string_array("SPACE", notes.space);
  if (notes.has_rescale())
    arrays += number_array("rescale_slope", notes.rescale.slope) +
              number_array("rescale_intercept", notes.rescale.intercept);
  if (!notes.rescale.units.empty()) arrays += string_array("rescale_units", notes.rescale.units);
  for (const MeshField& field : fields) arrays += field_array(field);
  return arrays.empty() ? "" : "    <FieldData>\n" + arrays + "    </FieldData>\n";
}

// The format: VTK File Formats, "XML File Formats", UnstructuredGrid with an AppendedData section. After the
// underscore come the arrays in the order of the offsets; each is preceded by its size in bytes (UInt64).

namespace {

constexpr std::uint8_t vtk_tetra = 10, vtk_quadratic_tetra = 24;

/// The offsets of arrays in the AppendedData section.
class Offsets {
 public:
  std::string array(std::string_view type, std::string_view name, int components, std::uint64_t bytes) {
    std::string line = fmt::format("        <DataArray type=\"{}\" Name=\"{}\"", type, name);
    if (components > 1) line += fmt::format(" NumberOfComponents=\"{}\"", components);
    line += fmt::format(" format=\"appended\" offset=\"{}\"/>\n", offset_);
    offset_ += 8 + bytes;
    return line;
  }
  std::string data(std::string_view element, const std::vector<MeshData>& data, std::uint64_t entries) {
    std::string lines = fmt::format("      <{}", element);
    if (!data.empty()) lines += fmt::format(" Scalars=\"{}\"", data.front().name);
    lines += ">\n";
    for (const MeshData& each : data)
      lines += array(vtk_name_of(each.type), each.name, 1, entries * size_of(each.type));
    return lines + fmt::format("      </{}>\n", element);
  }

 private:
  std::uint64_t offset_ = 0;
};

std::string head_of(const MeshContents& mesh) {
  Offsets offsets;
  const auto cells = static_cast<std::uint64_t>(mesh.cells);
  const auto points = static_cast<std::uint64_t>(mesh.points);
  std::string xml = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n"
      "  <UnstructuredGrid>\n"
      "{}"
      "    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
      vtk_field_data(mesh.notes, mesh.fields), mesh.points, mesh.cells);
  xml += "      <Points>\n" + offsets.array("Float64", "Points", 3, mesh.coordinates->size()) +
         "      </Points>\n";
  xml += "      <Cells>\n" + offsets.array("Int64", "connectivity", 1, mesh.connectivity->size());
  xml += offsets.array("Int64", "offsets", 1, cells * sizeof(std::int64_t));
  xml += offsets.array("UInt8", "types", 1, cells) + "      </Cells>\n";
  xml += offsets.data("PointData", mesh.point_data, points);
  xml += offsets.data("CellData", mesh.cell_data, cells);
  xml += "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_";
  return xml;
}

void write_data(OutputFile& output, const std::vector<MeshData>& all, std::int64_t entries) {
  for (const MeshData& data : all) {
    write_size(output, static_cast<std::uint64_t>(entries) * size_of(data.type));
    for_each_piece(data, [&](std::int64_t, std::span<const std::byte> numbers) { output.write(numbers); });
  }
}

}  // namespace

void write_vtu(OutputFile& output, const MeshContents& mesh) {
  output.write(head_of(mesh));
  write_spooled(output, *mesh.coordinates);
  write_spooled(output, *mesh.connectivity);
  const auto nodes = static_cast<std::int64_t>(mesh.nodes);
  const std::uint8_t type = nodes == 4 ? vtk_tetra : vtk_quadratic_tetra;
  write_computed<std::int64_t>(output, mesh.cells, [&](std::int64_t i) { return nodes * (i + 1); });
  write_computed<std::uint8_t>(output, mesh.cells, [&](std::int64_t) { return type; });
  write_data(output, mesh.point_data, mesh.points);
  write_data(output, mesh.cell_data, mesh.cells);
  output.write("\n  </AppendedData>\n</VTKFile>\n");
}

void VtuFile::write_mesh() { write_vtu(output_, contents()); }

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
        vtk_field_data({notes_.space}, {}), vertex_count_, triangle_count_, connectivity, offsets);
  }

  SpoolFile points_, connectivity_;
  std::int64_t triangle_count_ = 0;
};

}  // namespace

std::unique_ptr<SurfaceFile> create_vtp(const std::string& path, bool overwrite) {
  return std::make_unique<VtpFile>(path, overwrite);
}

}  // namespace tagrid
