// tagrid-write-hdf5: writes volumes as data sets of HDF5 and VTKHDF files; meshes as unstructured grids of VTKHDF files,
// and as the data sets to which an XDMF file refers. VTKHDF, of version 1.0:
// https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <memory>
#include <span>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/description.h"
#include "io/formats/hdf5/writer/hdf5_file.h"
#include "io/metadata/text.h"
#include "io/programs/serve.h"
#include "io/programs/serve_writer.h"
#include "io/programs/words.h"
#include "io/text/text.h"
#include "io/volume/vtk.h"

namespace tagrid {
namespace {

/// What VTK 9.1 needs beside the samples: https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format
void add_image_data(const Hdf5File& file, const VolumeInfo& info) {
  const Hdf5Handle group = file.make_group("/VTKHDF");
  file.add_whole_numbers(group.get(), "Version", std::array<std::int64_t, 2>{1, 0});
  file.add_fixed_text(group.get(), "Type", "ImageData");
  file.add_whole_numbers(
      group.get(), "WholeExtent",
      std::array<std::int64_t, 6>{0, info.dims.x - 1, 0, info.dims.y - 1, 0, info.dims.z - 1});
  const VtkGeometry geometry = vtk_geometry_of(info.geometry());
  file.add_numbers(group.get(), "Origin", geometry.origin);
  file.add_numbers(group.get(), "Spacing", geometry.spacing);
  file.add_numbers(group.get(), "Direction", geometry.direction);
  file.make_group("/VTKHDF/PointData");
}

class Hdf5Output final : public ServedOutput {
 public:
  Hdf5Output(const WriteRequest& request, bool is_vtkhdf)
      : info_(request.info),
        path_(is_vtkhdf ? vtkhdf_volume_path : hdf5_volume_path),
        file_(request.path, request.name) {
    memory = memory_of_hdf5_library + 4 * text_of(info_.metadata).size();
    if (is_vtkhdf) add_image_data(file_, info_);
    const auto size = [](std::int64_t n) { return static_cast<hsize_t>(n); };
    std::vector<hsize_t> dims = {size(info_.dims.z), size(info_.dims.y), size(info_.dims.x)};
    // VTK expects an array of two axes for an image of one slice.
    is_image_ = is_vtkhdf && info_.dims.z == 1 && info_.dims.y > 1 && info_.dims.x > 1;
    if (is_image_) dims.erase(dims.begin());
    dataset_ = file_.make_dataset(path_, hdf5_type_of(info_.type), dims);
    for (const Hdf5Attribute& attribute : attributes_of(info_.metadata)) add(attribute);
    file_.add_text(dataset_.get(), hdf5_header_attribute, text_of(info_.metadata));
  }

  void write_slice(std::int64_t z, const std::byte* samples) override {
    file_.write(dataset_.get(), hdf5_type_of(info_.type), z, is_image_ ? info_.dims.y : 1, samples);
  }

  std::vector<std::pair<std::string, std::string>> finish() override {
    file_.close(std::move(dataset_));
    file_.close();
    return {{"dataset", fmt::format("\"{}\"", path_)}};
  }

 private:
  void add(const Hdf5Attribute& attribute) const {
    if (const auto* text = std::get_if<std::string>(&attribute.value))
      return file_.add_text(dataset_.get(), attribute.name, *text);
    const std::span<const double> numbers = std::get<std::vector<double>>(attribute.value);
    if (numbers.size() == 9)
      file_.add_vectors(dataset_.get(), attribute.name, numbers.first<9>());
    else
      file_.add_numbers(dataset_.get(), attribute.name, numbers);
  }

  VolumeInfo info_;
  std::string path_;
  Hdf5File file_;
  Hdf5Handle dataset_;  // closed before the file
  bool is_image_ = false;
};

constexpr std::uint8_t vtk_tetra = 10, vtk_quadratic_tetra = 24;

class Hdf5Mesh final : public ServedMesh {
 public:
  Hdf5Mesh(const WriteMeshRequest& request, bool is_vtkhdf)
      : mesh_(request.mesh), is_vtkhdf_(is_vtkhdf), file_(request.path, request.name) {
    memory = memory_of_hdf5_library + numbers_at_once * sizeof(std::int64_t);
    if (is_vtkhdf_)
      make_vtkhdf_arrays();
    else
      make_plain_arrays();
    add_notes(request.options);
  }

  void write_entries(std::size_t array, std::int64_t first, std::int64_t count,
                     const std::byte* entries) override {
    const Array& a = arrays_[array];
    file_.write(a.dataset.get(), a.type, a.numbers * first, a.numbers * count, entries);
  }

  std::vector<std::pair<std::string, std::string>> finish() override {
    for (Array& array : arrays_) file_.close(std::move(array.dataset));
    if (is_vtkhdf_) {
      add_numbers<std::int64_t>("Offsets", H5T_STD_I64LE, mesh_.tetrahedra + 1,
                                [&](std::int64_t i) { return nodes() * i; });
      const std::uint8_t type = mesh_.nodes == 4 ? vtk_tetra : vtk_quadratic_tetra;
      add_numbers<std::uint8_t>("Types", H5T_STD_U8LE, mesh_.tetrahedra, [&](std::int64_t) { return type; });
    }
    file_.close();
    return {};
  }

 private:
  static constexpr std::size_t numbers_at_once = std::size_t{1} << 17;

  struct Array {
    Hdf5Handle dataset;
    hid_t type;
    std::int64_t numbers = 1;  ///< of the slowest axis, for each entry
  };

  std::string path_of(const std::string& name) const { return (is_vtkhdf_ ? "/VTKHDF/" : "/") + name; }
  static hsize_t size(std::int64_t n) { return static_cast<hsize_t>(n); }
  std::int64_t nodes() const { return static_cast<std::int64_t>(mesh_.nodes); }

  void make(const std::string& name, hid_t type, const std::vector<hsize_t>& dims, std::int64_t numbers = 1) {
    arrays_.push_back({file_.make_dataset(path_of(name), type, dims), type, numbers});
  }
  void make_data(const std::string& group, const MeshLayout::Data& data, std::int64_t entries) {
    for (const auto& [name, type] : data) make(group + name, hdf5_type_of(type), {size(entries)});
  }

  void make_vtkhdf_arrays() {
    const Hdf5Handle group = file_.make_group("/VTKHDF");
    file_.add_whole_numbers(group.get(), "Version", std::array<std::int64_t, 2>{1, 0});
    file_.add_fixed_text(group.get(), "Type", "UnstructuredGrid");
    file_.make_group("/VTKHDF/PointData");
    file_.make_group("/VTKHDF/CellData");
    add_count("NumberOfPoints", mesh_.points);
    add_count("NumberOfCells", mesh_.tetrahedra);
    add_count("NumberOfConnectivityIds", nodes() * mesh_.tetrahedra);
    make("Points", H5T_IEEE_F64LE, {size(mesh_.points), 3});
    make("Connectivity", H5T_STD_I64LE, {size(nodes() * mesh_.tetrahedra)}, nodes());
    make_data("PointData/", mesh_.point_data, mesh_.points);
    make_data("CellData/", mesh_.cell_data, mesh_.tetrahedra);
    add_fields();
  }

  /// For XDMF: nothing but the numbers, in as many dimensions as readers expect.
  void make_plain_arrays() {
    make("points", H5T_IEEE_F64LE, {size(mesh_.points), 3});
    make("tetrahedra", H5T_STD_I64LE, {size(mesh_.tetrahedra), size(nodes())});
    make_data("", mesh_.point_data, mesh_.points);
    make_data("", mesh_.cell_data, mesh_.tetrahedra);
  }

  void add_fields() {
    if (mesh_.fields.empty()) return;
    file_.make_group("/VTKHDF/FieldData");
    for (const MeshField& field : mesh_.fields)
      if (field.texts.empty())
        add_numbers<std::int64_t>("FieldData/" + field.name, H5T_STD_I64LE,
                                  static_cast<std::int64_t>(field.numbers.size()),
                                  [&](std::int64_t i) { return field.numbers[static_cast<std::size_t>(i)]; });
      else
        file_.add_texts(path_of("FieldData/" + field.name), field.texts);
  }

  /// What the values and the coordinates mean, where files of volumes have it: at the first data set of
  /// points, or of cells.
  void add_notes(const WriterOptions& options) {
    if (arrays_.size() < 3) return;
    const hid_t values = arrays_[2].dataset.get();
    for (const auto& [name, text] : options) {
      if (name == "space" || name == "rescale_units") file_.add_text(values, name, text);
      if (name != "rescale_slope" && name != "rescale_intercept") continue;
      if (const auto number = number_of(text)) file_.add_numbers(values, name, std::array{*number});
    }
  }

  /// A data set of number_of(0), number_of(1), ...
  template <class Number, class NumberOf>
  void add_numbers(const std::string& name, hid_t type, std::int64_t count, NumberOf number_of) {
    Hdf5Handle dataset = file_.make_dataset(path_of(name), type, {static_cast<hsize_t>(count)});
    std::vector<std::byte> numbers;
    for (std::int64_t first = 0; first < count;) {
      const std::int64_t n = std::min<std::int64_t>(numbers_at_once, count - first);
      numbers.resize(static_cast<std::size_t>(n) * sizeof(Number));
      for (std::int64_t i = 0; i < n; ++i)
        store_little_endian<Number>(numbers.data() + static_cast<std::size_t>(i) * sizeof(Number),
                                    number_of(first + i));
      file_.write(dataset.get(), type, first, n, numbers.data());
      say_working();
      first += n;
    }
    file_.close(std::move(dataset));
  }

  /// One number: a file of several pieces would have one for each.
  void add_count(const std::string& name, std::int64_t count) {
    add_numbers<std::int64_t>(name, H5T_STD_I64LE, 1, [count](std::int64_t) { return count; });
  }

  MeshLayout mesh_;
  bool is_vtkhdf_;
  Hdf5File file_;
  std::vector<Array> arrays_;  // closed before the file
};

/// Begins a file: of VTKHDF if the option "format" is "vtkhdf", otherwise with the data set /volume. The
/// samples (z, y, x) are in one piece of the file, so that they can be read in place. The data set has the
/// attributes of description.h.
std::unique_ptr<ServedOutput> begin_hdf5(const WriteRequest& request) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  return std::make_unique<Hdf5Output>(request, option(request.options, "format") == "vtkhdf");
}

/// Begins the file. Throws UsageError if it should have another format, and WorldError.
std::unique_ptr<ServedMesh> begin_hdf5_mesh(const WriteMeshRequest& request) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const auto format = request.options.find("format");
  const std::string layout = format == request.options.end() ? "vtkhdf" : format->second;
  if (layout != "vtkhdf" && layout != "xdmf")
    throw UsageError("{}: meshes are written as VTKHDF or for XDMF, not as {}", request.name, layout);
  return std::make_unique<Hdf5Mesh>(request, layout == "vtkhdf");
}

}  // namespace
}  // namespace tagrid

int main() {
  // At the end of the program, version 1.10 of the library crashes on a file that it could not close.
  H5dont_atexit();
  return tagrid::serve_writer("hdf5", tagrid::begin_hdf5, tagrid::begin_hdf5_mesh);
}
