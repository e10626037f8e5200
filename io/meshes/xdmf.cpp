// The format: "XDMF Model and Format", version 3, https://www.xdmf.org/index.php/XDMF_Model_and_Format
#include <fmt/format.h>

#include <filesystem>

#include "io/errors/errors.h"
#include "io/meshes/material_files.h"
#include "io/meshes/mesh_writers.h"
#include "io/text/paths.h"

namespace tagrid {

std::string path_of_xdmf_numbers(const std::string& path) {
  if (!path.ends_with('f') && !path.ends_with('F'))
    throw UsageError(path + ": XDMF is two files, one .xdmf and one .h5, and cannot be a stream");
  return text_of(path_of(path).replace_extension(".h5"));
}

namespace {

/// As XML has it, in text.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      default:
        result += c;
    }
  return result;
}

std::string number_type(SampleType type) {
  const char* kind = is_float_type(type) ? "Float" : type == SampleType::uint32 ? "UInt" : "Int";
  return fmt::format("NumberType=\"{}\" Precision=\"{}\"", kind, size_of(type));
}

class XdmfFile final : public MaterialMeshFile {
 public:
  XdmfFile(const std::string& path, bool overwrite)
      : MaterialMeshFile(path, overwrite),
        path_of_numbers_(path_of_xdmf_numbers(path)),
        numbers_(path_of_numbers_, overwrite),
        hdf5_(numbers_, path_of_numbers_, "XDMF") {
    if (!output_.can_seek() || !numbers_.can_seek())
      throw UsageError(path + ": XDMF is two files, one .xdmf and one .h5, and cannot be a stream");
    if (name_of_numbers().find(':') != std::string::npos)
      throw UsageError(path + ": XDMF names its .h5 file before a colon, so the name cannot have one");
  }

  void write(MaterialMesh& mesh) override {
    const MeshContents contents = contents_of(mesh);
    hdf5_.write(contents, "xdmf");
    output_.write(text_of(contents, mesh.materials));
  }
  void commit() override {
    numbers_.publish();
    output_.publish();
    output_.keep();
    numbers_.keep();
  }
  std::uint64_t file_bytes() const override { return output_.position() + hdf5_.bytes(); }
  std::vector<std::string> warnings() const override { return hdf5_.warnings(); }

 private:
  std::string name_of_numbers() const { return name_of_path(path_of_numbers_); }

  /// A reference to a data set.
  std::string item(const std::string& dimensions, SampleType type, const std::string& dataset,
                   const std::string& of_type = "") const {
    return fmt::format("        <DataItem Dimensions=\"{}\" {} Format=\"HDF\">{}:/{}</DataItem>\n",
                       dimensions, of_type.empty() ? number_type(type) : of_type, escaped(name_of_numbers()),
                       dataset);
  }

  std::string text_of(const MeshContents& mesh, const std::vector<MaterialElements>& materials) const {
    std::string xml =
        "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n"
        "    <Grid Name=\"mesh\" GridType=\"Uniform\">\n";
    // meshio has names so. VTK's reader passes them over, but ends the program if there is no Value.
    if (!materials.empty()) {
      xml += "      <Information Name=\"names\" Value=\"\"><![CDATA[<main>";
      for (const MaterialElements& material : materials)
        xml += fmt::format("<map key=\"{}\" dim=\"3\">{}</map>", material.name, material.label);
      xml += "</main>]]></Information>\n";
    }
    xml += fmt::format("      <Topology TopologyType=\"{}\" NumberOfElements=\"{}\">\n",
                       mesh.nodes == 4 ? "Tetrahedron" : "Tetrahedron_10", mesh.cells);
    xml += item(fmt::format("{} {}", mesh.cells, mesh.nodes), {}, "tetrahedra",
                "NumberType=\"Int\" Precision=\"8\"");
    xml += "      </Topology>\n      <Geometry GeometryType=\"XYZ\">\n";
    xml += item(fmt::format("{} 3", mesh.points), SampleType::float64, "points");
    xml += "      </Geometry>\n";
    for (const MeshData& data : mesh.cell_data) {
      xml +=
          fmt::format("      <Attribute Name=\"{}\" AttributeType=\"Scalar\" Center=\"Cell\">\n", data.name);
      xml += item(fmt::format("{}", mesh.cells), data.type, data.name) + "      </Attribute>\n";
    }
    return xml + "    </Grid>\n  </Domain>\n</Xdmf>\n";
  }

  std::string path_of_numbers_;
  OutputFile numbers_;
  Hdf5MeshWriter hdf5_;
};

}  // namespace

std::unique_ptr<MaterialMeshFile> create_xdmf(const std::string& path, bool overwrite) {
  return std::make_unique<XdmfFile>(path, overwrite);
}

}  // namespace tagrid
