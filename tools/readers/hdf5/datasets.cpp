#include "tools/readers/hdf5/datasets.h"

#include <fmt/format.h>

#include <array>

#include "io/programs/serve_reader.h"
#include "tools/hdf5/attributes.h"
#include "tools/hdf5/sample_types.h"

namespace tagrid {

BrokenInput broken_hdf5(const std::string& path, std::string_view why) {
  return BrokenInput(fmt::format("{}: HDF5 file: {}", path, why));
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

/// The data set that NeXus files name as the default one: https://manual.nexusformat.org/datarules.html
std::string nexus_default(hid_t file) {
  std::string path = "/";
  for (int depth = 0; depth < 8; ++depth) {
    const Hdf5Handle group(H5Oopen(file, path.c_str(), H5P_DEFAULT), H5Oclose);
    if (!group) return "";
    if (const auto signal = text_attribute(group.get(), "signal")) return path + *signal;
    const auto next = text_attribute(group.get(), "default");
    if (!next || next->empty()) return "";
    path += *next + "/";
  }
  return "";
}

/// All data sets that can be volumes: of numbers, with more than one slice.
std::vector<Choice> datasets_of(hid_t file) {
  std::vector<Choice> all;
  const auto look = [](hid_t root, const char* name, const H5O_info_t* info, void* user) -> herr_t {
    if (info->type != H5O_TYPE_DATASET) return 0;
    const Hdf5Handle dataset = opened_dataset(root, name);
    if (!dataset) return 0;
    const std::vector<hsize_t> dims = dims_of(dataset.get());
    const auto size = volume_size(dims);
    const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
    const auto stored = stored_samples_of(type.get());
    if (size && stored && dims.size() > 2 && size->z > 1)
      static_cast<std::vector<Choice>*>(user)->push_back(
          {std::string("/") + name, fmt::format("{} {}", in_words(dims), name_of(stored->type))});
    return 0;
  };
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, look, &all, H5O_INFO_BASIC);
  return all;
}

}  // namespace

std::string dataset_name(hid_t file, const std::string& path, const std::string& wanted) {
  if (!wanted.empty() && opened_dataset(file, wanted)) return wanted;
  if (wanted.empty())
    if (const std::string name = nexus_default(file); !name.empty() && opened_dataset(file, name))
      return name;
  const std::vector<Choice> all = datasets_of(file);
  if (all.empty()) throw broken_hdf5(path, "has no data set of numbers with three axes");
  return all[chosen(path, "dataset", wanted, all)].name;
}

}  // namespace tagrid
