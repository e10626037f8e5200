#include "tools/formats/hdf5/writer/hdf5_output.h"

#include <fmt/format.h>

#include <array>
#include <span>

#include "io/volume/vtk_geometry.h"
#include "tools/formats/hdf5/description.h"
#include "tools/formats/hdf5/sample_types.h"
#include "tools/formats/hdf5/writer/hdf5_file.h"

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
  const VtkGeometry geometry = vtk_geometry_of(info.geometry);
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
    memory = memory_of_hdf5_library + 4 * info_.nrrd_fields.size();
    if (is_vtkhdf) add_image_data(file_, info_);
    const auto size = [](std::int64_t n) { return static_cast<hsize_t>(n); };
    std::vector<hsize_t> dims = {size(info_.dims.z), size(info_.dims.y), size(info_.dims.x)};
    // VTK expects an array of two axes for an image of one slice.
    is_image_ = is_vtkhdf && info_.dims.z == 1 && info_.dims.y > 1 && info_.dims.x > 1;
    if (is_image_) dims.erase(dims.begin());
    dataset_ = file_.make_dataset(path_, hdf5_type_of(info_.type), dims);
    for (const Hdf5Attribute& attribute : attributes_of(info_)) add(attribute);
    file_.add_text(dataset_.get(), hdf5_header_attribute, info_.nrrd_fields);
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

}  // namespace

std::unique_ptr<ServedOutput> begin_hdf5(const WriteRequest& request) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const auto format = request.options.find("format");
  return std::make_unique<Hdf5Output>(request, format != request.options.end() && format->second == "vtkhdf");
}

}  // namespace tagrid
