#include "tools/readers/hdf5/datasets.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "io/files/text.h"
#include "io/programs/serve_reader.h"
#include "tools/hdf5/description.h"
#include "tools/hdf5/sample_types.h"
#include "tools/readers/hdf5/image_data.h"
#include "tools/readers/hdf5/nexus.h"

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

namespace {

/// The data sets of numbers that can be volumes.
struct Candidates {
  std::vector<Choice> volumes, slices;  ///< with several slices, and with one
  std::string other;  ///< what the first other one of several axes is: "/a has integers of 64 bits"
};

/// A picture of two axes is no volume, unless the file says that it is one.
bool is_slice(hid_t dataset, const std::string& name, std::size_t rank) {
  return rank > 2 || is_vtkhdf_array(name) || H5Aexists(dataset, hdf5_header_attribute) > 0;
}

Candidates candidates_of(hid_t file) {
  Candidates all;
  const auto look = [](hid_t root, const char* relative, const H5O_info_t* info, void* user) -> herr_t {
    if (info->type != H5O_TYPE_DATASET) return 0;
    const Hdf5Handle dataset = opened_dataset(root, relative);
    if (!dataset) return 0;
    const std::string name = std::string("/") + relative;
    const std::vector<hsize_t> dims = dims_of(dataset.get());
    const auto size = volume_size(dims);
    const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
    const auto stored = stored_samples_of(type.get());
    // An array of VTKHDF with a fourth axis has several numbers for each sample.
    Candidates& found = *static_cast<Candidates*>(user);
    if (!size || !stored || (is_vtkhdf_array(name) && dims.size() > 3)) {
      if (dims.size() < 3 || !found.other.empty()) return 0;
      found.other = stored ? fmt::format("{} has {} axes ({})", name, dims.size(), in_words(dims))
                           : fmt::format("{} has {}", name, samples_in_words(type.get()));
      return 0;
    }
    const Choice choice = {name, fmt::format("{} {}", in_words(dims), name_of(stored->type))};
    if (dims.size() > 2 && size->z > 1)
      found.volumes.push_back(choice);
    else if (is_slice(dataset.get(), name, dims.size()))
      found.slices.push_back(choice);
    return 0;
  };
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, look, &all, H5O_INFO_BASIC);
  return all;
}

BrokenInput has_no_volume(hid_t file, const std::string& path, const std::string& other) {
  const std::string type = vtkhdf_type(file);
  if (!type.empty() && type != "ImageData")
    return BrokenInput(
        fmt::format("{}: VTKHDF file: holds {}, which is no volume", path, tagrid::quoted(type)));
  constexpr const char* wanted =
      "has no data set with three axes of integers of 8, 16 or 32 bits, or floats of 32 or 64 bits";
  return broken_hdf5(path, other.empty() ? wanted : fmt::format("{}; {}", wanted, other));
}

}  // namespace

std::string dataset_name(hid_t file, const std::string& path, const std::string& wanted) {
  if (!wanted.empty() && opened_dataset(file, wanted)) return wanted;
  if (wanted.empty())
    if (const std::string name = nexus_default(file); !name.empty() && opened_dataset(file, name))
      return name;
  Candidates all = candidates_of(file);
  std::vector<Choice>& list = all.volumes.empty() ? all.slices : all.volumes;
  if (list.empty()) throw has_no_volume(file, path, all.other);
  if (wanted.empty() && list.size() > 1) {
    std::vector<Choice> signals;
    for (const Choice& choice : list)
      if (is_nexus_signal(file, choice.name)) signals.push_back(choice);
    if (signals.size() == 1) return signals[0].name;
  }
  return list[chosen(path, "dataset", wanted, list)].name;
}

}  // namespace tagrid
