#include "io/formats/hdf5/reader/datasets.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>

namespace tagrid {

BrokenInput broken_hdf5(const std::string& path, std::string_view why) {
  return BrokenInput(fmt::format("{}: HDF5 file: {}", path, why));
}

std::string file_of(hid_t dataset) {
  const ssize_t size = H5Fget_name(dataset, nullptr, 0);
  if (size <= 0) return "";
  std::string name(static_cast<std::size_t>(size), '\0');
  H5Fget_name(dataset, name.data(), name.size() + 1);
  return name;
}

bool is_in_folder_of(const std::string& path, hid_t dataset) {
  namespace fs = std::filesystem;
  const std::string other = file_of(dataset);
  if (other.empty() || other == path) return true;
  std::error_code unknown;
  const auto folder = [&](const std::string& file) {
    return fs::weakly_canonical(fs::absolute(file).parent_path(), unknown);
  };
  return folder(other) == folder(path);
}

bool has_own_samples(const std::string& path, hid_t dataset) {
  const Hdf5Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  return properties && H5Pget_external_count(properties.get()) == 0 &&
         H5Pget_layout(properties.get()) != H5D_VIRTUAL && is_in_folder_of(path, dataset);
}

std::vector<hsize_t> dims_of(hid_t dataset) {
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = space ? H5Sget_simple_extent_ndims(space.get()) : -1;
  if (rank < 1) return {};
  std::vector<hsize_t> dims(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr);
  return dims;
}

std::optional<Index3> volume_size(const std::vector<hsize_t>& dims) {
  std::array<std::int64_t, 3> sizes = {1, 1, 1};  // z, y, x
  for (std::size_t i = 0; i < dims.size(); ++i) {
    const std::size_t from_end = dims.size() - 1 - i;
    if (from_end > 2 ? dims[i] != 1 : dims[i] < 1 || dims[i] > std::uint64_t{1} << 40) return std::nullopt;
    if (from_end <= 2) sizes[2 - from_end] = static_cast<std::int64_t>(dims[i]);
  }
  if (dims.size() < 2) return std::nullopt;
  return Index3{sizes[2], sizes[1], sizes[0]};
}

std::string in_words(const std::vector<hsize_t>& dims) {
  if (dims.empty()) return "no axes of";
  std::string words;
  for (std::size_t i = dims.size(); i > 0; --i)
    words += fmt::format("{}{}", words.empty() ? "" : " x ", dims[i - 1]);
  return words;
}

Hdf5Handle opened_dataset(hid_t file, const std::string& name) {
  if (H5Oexists_by_name(file, name.c_str(), H5P_DEFAULT) <= 0) return {};
  Hdf5Handle object(H5Oopen(file, name.c_str(), H5P_DEFAULT), H5Oclose);
  if (object && H5Iget_type(object.get()) == H5I_DATASET) return object;
  return {};
}

}  // namespace tagrid
