// The format: "VTKHDF File Format", UnstructuredGrid of version 1.0,
// https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format
#include "tools/formats/hdf5/writer/hdf5_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/programs/serve.h"
#include "io/text/text.h"
#include "tools/formats/hdf5/sample_types.h"
#include "tools/formats/hdf5/writer/hdf5_file.h"

namespace tagrid {
namespace {

constexpr std::uint8_t vtk_tetra = 10;

class Hdf5Mesh final : public ServedMesh {
 public:
  explicit Hdf5Mesh(const WriteMeshRequest& request)
      : mesh_(request.mesh), file_(request.path, request.name) {
    memory = memory_of_hdf5_library + numbers_at_once * sizeof(std::int64_t);
    const Hdf5Handle group = file_.make_group("/VTKHDF");
    file_.add_whole_numbers(group.get(), "Version", std::array<std::int64_t, 2>{1, 0});
    file_.add_fixed_text(group.get(), "Type", "UnstructuredGrid");
    file_.make_group("/VTKHDF/PointData");
    file_.make_group("/VTKHDF/CellData");
    add_count("NumberOfPoints", mesh_.points);
    add_count("NumberOfCells", mesh_.tetrahedra);
    add_count("NumberOfConnectivityIds", 4 * mesh_.tetrahedra);
    make_arrays();
    add_notes(request.options);
  }

  void write_entries(std::size_t array, std::int64_t first, std::int64_t count,
                     const std::byte* entries) override {
    const Array& a = arrays_[array];
    file_.write(a.dataset.get(), a.type, a.numbers * first, a.numbers * count, entries);
  }

  std::vector<std::pair<std::string, std::string>> finish() override {
    for (Array& array : arrays_) file_.close(std::move(array.dataset));
    add_numbers<std::int64_t>("Offsets", H5T_STD_I64LE, mesh_.tetrahedra + 1,
                              [](std::int64_t i) { return 4 * i; });
    add_numbers<std::uint8_t>("Types", H5T_STD_U8LE, mesh_.tetrahedra,
                              [](std::int64_t) { return vtk_tetra; });
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

  static std::string path_of(const std::string& name) { return "/VTKHDF/" + name; }

  void make_arrays() {
    const auto size = [](std::int64_t n) { return static_cast<hsize_t>(n); };
    const auto make = [&](const std::string& name, hid_t type, const std::vector<hsize_t>& dims,
                          std::int64_t numbers = 1) {
      arrays_.push_back({file_.make_dataset(path_of(name), type, dims), type, numbers});
    };
    make("Points", H5T_IEEE_F64LE, {size(mesh_.points), 3});
    make("Connectivity", H5T_STD_I64LE, {size(4 * mesh_.tetrahedra)}, 4);
    for (const auto& [name, type] : mesh_.point_data)
      make("PointData/" + name, hdf5_type_of(type), {size(mesh_.points)});
    for (const auto& [name, type] : mesh_.cell_data)
      make("CellData/" + name, hdf5_type_of(type), {size(mesh_.tetrahedra)});
  }

  /// What the values and the coordinates mean, where files of volumes have it: at the first data set of points.
  void add_notes(const WriterOptions& options) {
    if (mesh_.point_data.empty()) return;
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
  Hdf5File file_;
  std::vector<Array> arrays_;  // closed before the file
};

}  // namespace

std::unique_ptr<ServedMesh> begin_hdf5_mesh(const WriteMeshRequest& request) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const auto format = request.options.find("format");
  if (format != request.options.end() && format->second != "vtkhdf")
    throw UsageError(
        fmt::format("{}: meshes are written as VTKHDF, not as {}", request.name, format->second));
  return std::make_unique<Hdf5Mesh>(request);
}

}  // namespace tagrid
