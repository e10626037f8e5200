// The format: VTK File Formats, "XML File Formats", PolyData with an AppendedData section.
#include <fmt/format.h>

#include <array>
#include <span>

#include "io/meshes/surface_files.h"
#include "io/meshes/vtk_xml.h"

namespace tagrid {
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
