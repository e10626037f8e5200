#include "tools/readers/hdf5/hdf5_volumes.h"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/files/text.h"
#include "tools/readers/hdf5/attributes.h"
#include "tools/readers/hdf5/handle.h"

namespace tagrid {
namespace {

BrokenInput broken(const std::string& path, std::string_view why) {
  return BrokenInput(fmt::format("{}: HDF5 file: {}", path, why));
}

/// The type of samples, and whether their most significant byte comes first.
struct Stored {
  SampleType type;
  bool big_endian;
};

std::optional<Stored> stored_of(hid_t type) {
  const std::size_t size = H5Tget_size(type);
  const bool big = H5Tget_order(type) == H5T_ORDER_BE;
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_FLOAT) {
    for (const hid_t known : {H5T_IEEE_F32LE, H5T_IEEE_F32BE})
      if (H5Tequal(type, known) > 0) return Stored{SampleType::float32, big};
    for (const hid_t known : {H5T_IEEE_F64LE, H5T_IEEE_F64BE})
      if (H5Tequal(type, known) > 0) return Stored{SampleType::float64, big};
    return std::nullopt;
  }
  if (kind != H5T_INTEGER || H5Tget_precision(type) != 8 * size) return std::nullopt;
  const bool is_signed = H5Tget_sign(type) == H5T_SGN_2;
  switch (size) {
    case 1:
      return Stored{is_signed ? SampleType::int8 : SampleType::uint8, big};
    case 2:
      return Stored{is_signed ? SampleType::int16 : SampleType::uint16, big};
    case 4:
      return Stored{is_signed ? SampleType::int32 : SampleType::uint32, big};
    default:
      return std::nullopt;
  }
}

/// What to read samples as: little endian.
hid_t memory_type(SampleType type) {
  switch (type) {
    case SampleType::uint8:
      return H5T_STD_U8LE;
    case SampleType::int8:
      return H5T_STD_I8LE;
    case SampleType::uint16:
      return H5T_STD_U16LE;
    case SampleType::int16:
      return H5T_STD_I16LE;
    case SampleType::uint32:
      return H5T_STD_U32LE;
    case SampleType::int32:
      return H5T_STD_I32LE;
    case SampleType::float32:
      return H5T_IEEE_F32LE;
    case SampleType::float64:
      return H5T_IEEE_F64LE;
  }
  return -1;
}

std::vector<hsize_t> dims_of(hid_t dataset) {
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = space ? H5Sget_simple_extent_ndims(space.get()) : -1;
  if (rank < 1) return {};
  std::vector<hsize_t> dims(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr);
  return dims;
}

/// Axes in front with one sample are left out. A data set of two axes is one slice.
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
    const auto stored = stored_of(type.get());
    if (size && stored && dims.size() > 2 && size->z > 1)
      static_cast<std::vector<Choice>*>(user)->push_back(
          {std::string("/") + name, fmt::format("{} {}", in_words(dims), name_of(stored->type))});
    return 0;
  };
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, look, &all, H5O_INFO_BASIC);
  return all;
}

std::string dataset_name(hid_t file, const std::string& path, const std::string& wanted) {
  if (!wanted.empty() && opened_dataset(file, wanted)) return wanted;
  if (wanted.empty())
    if (const std::string name = nexus_default(file); !name.empty() && opened_dataset(file, name))
      return name;
  const std::vector<Choice> all = datasets_of(file);
  if (all.empty()) throw broken(path, "has no data set of numbers with three axes");
  return all[chosen(path, "dataset", wanted, all)].name;
}

void require_filters(hid_t properties, const std::string& path) {
  for (int i = 0; i < H5Pget_nfilters(properties); ++i) {
    unsigned flags = 0;
    std::size_t values = 0;
    std::array<char, 256> name = {};
    const H5Z_filter_t filter = H5Pget_filter2(properties, static_cast<unsigned>(i), &flags, &values, nullptr,
                                               name.size() - 1, name.data(), nullptr);
    if (filter < 0 || H5Zfilter_avail(filter) > 0) continue;
    throw broken(
        path,
        fmt::format("its samples need the filter {}{}, which is not installed; HDF5 looks for plugins in "
                    "HDF5_PLUGIN_PATH",
                    filter, name[0] == '\0' ? "" : fmt::format(" ({})", name.data())));
  }
}

Geometry geometry_of_dataset(hid_t dataset) {
  Geometry geometry;
  const auto is_good = [](double number) { return std::isfinite(number) && number != 0; };
  if (const auto spacing = number_attribute(dataset, "spacing");
      spacing.size() == 3 && std::ranges::all_of(spacing, is_good)) {
    std::ranges::copy(spacing, geometry.spacing.begin());
    geometry.has_spacing = true;
  } else if (const auto size = number_attribute(dataset, "element_size_um");
             size.size() == 3 && std::ranges::all_of(size, is_good)) {
    geometry.spacing = {size[2], size[1], size[0]};
    geometry.has_spacing = true;
    geometry.units.fill("um");
  }
  if (const auto d = number_attribute(dataset, "directions"); d.size() == 9) {
    for (std::size_t i = 0; i < 9; ++i) geometry.directions[i / 3][i % 3] = d[i];
    const double volume = determinant(geometry.directions);
    geometry.has_directions = std::isfinite(volume) && volume != 0;
  }
  if (const auto origin = number_attribute(dataset, "origin");
      origin.size() == 3 && std::ranges::all_of(origin, [](double n) { return std::isfinite(n); })) {
    std::ranges::copy(origin, geometry.origin.begin());
    geometry.has_origin = true;
  }
  geometry.space = text_attribute(dataset, "space").value_or("");
  return geometry;
}

/// The file that a data set lies in, which links may have led to.
std::string file_of(hid_t dataset) {
  const ssize_t size = H5Fget_name(dataset, nullptr, 0);
  if (size <= 0) return "";
  std::string name(static_cast<std::size_t>(size), '\0');
  H5Fget_name(dataset, name.data(), name.size() + 1);
  return name;
}

class Hdf5Volume final : public ServedVolume {
 public:
  Hdf5Volume(const std::string& path, const std::string& wanted)
      : path_(path), file_(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose) {
    if (!file_) throw broken(path, "cannot be opened; it is damaged, or another program is writing it");
    const std::string name = dataset_name(file_.get(), path, wanted);
    dataset_ = opened_dataset(file_.get(), name);
    const std::vector<hsize_t> sizes = dims_of(dataset_.get());
    const Hdf5Handle stored_type(H5Dget_type(dataset_.get()), H5Tclose);
    const auto stored = stored_of(stored_type.get());
    const auto size = volume_size(sizes);
    if (!stored)
      throw broken(
          path,
          fmt::format("{} has samples of a type that is not supported; supported are integers of 8, 16 and "
                      "32 bits and floats of 32 and 64 bits",
                      name));
    if (!size)
      throw broken(path, fmt::format("{} has {} samples, which are no volume", name, in_words(sizes)));
    dims = *size;
    type = stored->type;
    rank_ = sizes.size();
    geometry = geometry_of_dataset(dataset_.get());
    pairs.emplace_back("hdf5_dataset", name);
    for (auto& [key, value] : all_attributes(dataset_.get()))
      pairs.emplace_back("hdf5_" + key, std::move(value));
    files = {path};
    if (const std::string other = file_of(dataset_.get()); !other.empty() && other != path) {
      require_same_folder(other);
      files.push_back(other);
    }
    look_at_layout(stored->big_endian);
  }

  /// Reads as many slices at once as a chunk has.
  void read_slice(std::int64_t z, std::byte* out) override {
    const std::uint64_t bytes = static_cast<std::uint64_t>(dims.x * dims.y) * size_of(type);
    const std::int64_t first = z / slab_ * slab_;
    if (first != first_ || slices_.empty()) {
      const std::int64_t count = std::min(slab_, dims.z - first);
      slices_.resize(static_cast<std::size_t>(count) * bytes);
      first_ = -1;
      read_slab(first, count);
      first_ = first;
    }
    std::copy_n(slices_.begin() + static_cast<std::ptrdiff_t>(static_cast<std::uint64_t>(z - first) * bytes),
                bytes, out);
  }

 private:
  /// A file is untrusted input: its links lead to files in its folder, and to no others.
  void require_same_folder(const std::string& other) const {
    namespace fs = std::filesystem;
    std::error_code unknown;
    const auto folder = [&](const std::string& file) {
      return fs::weakly_canonical(fs::absolute(file).parent_path(), unknown);
    };
    if (folder(other) != folder(path_))
      throw broken(path_, fmt::format("the data set is in another folder, {}", other));
  }

  void look_at_layout(bool big_endian) {
    const Hdf5Handle properties(H5Dget_create_plist(dataset_.get()), H5Pclose);
    const H5D_layout_t layout = H5Pget_layout(properties.get());
    // Such files could be any of this machine.
    if (H5Pget_external_count(properties.get()) > 0)
      throw broken(path_, "its samples are in other files (external storage), which is not supported");
    // The library fills what it does not find.
    if (layout == H5D_VIRTUAL)
      throw broken(path_,
                   "its samples are in other files (a virtual data set), which is not supported; h5repack "
                   "copies them into one");
    const std::uint64_t slice = static_cast<std::uint64_t>(dims.x * dims.y) * size_of(type);
    if (layout == H5D_CONTIGUOUS) {
      const haddr_t offset = H5Dget_offset(dataset_.get());
      if (offset != HADDR_UNDEF) {
        places = {{files.size() - 1, offset, dims.z, slice, big_endian}};
        return;
      }
    }
    if (layout == H5D_CHUNKED) {
      require_filters(properties.get(), path_);
      std::vector<hsize_t> chunk(rank_);
      H5Pget_chunk(properties.get(), static_cast<int>(rank_), chunk.data());
      slab_ =
          rank_ > 2 ? std::clamp<std::int64_t>(static_cast<std::int64_t>(chunk[rank_ - 3]), 1, dims.z) : 1;
      std::uint64_t chunk_bytes = size_of(type);
      for (const hsize_t size : chunk)
        if (__builtin_mul_overflow(chunk_bytes, size, &chunk_bytes))
          throw broken(path_, "its chunks are beyond all memory");
      memory += 4 * chunk_bytes;  // as it is stored, and as it becomes
      // A chunk is read once, if whole slices are; the cache of the library need not hold any.
    }
    memory += static_cast<std::uint64_t>(slab_) * slice + slice;
  }

  void read_slab(std::int64_t first, std::int64_t count) {
    const Hdf5Handle space(H5Dget_space(dataset_.get()), H5Sclose);
    std::vector<hsize_t> start(rank_, 0), size(rank_, 1);
    if (rank_ > 2) {
      start[rank_ - 3] = static_cast<hsize_t>(first);
      size[rank_ - 3] = static_cast<hsize_t>(count);
    }
    size[rank_ - 2] = static_cast<hsize_t>(dims.y);
    size[rank_ - 1] = static_cast<hsize_t>(dims.x);
    H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr);
    const Hdf5Handle memory_space(H5Screate_simple(static_cast<int>(rank_), size.data(), nullptr), H5Sclose);
    if (H5Dread(dataset_.get(), memory_type(type), memory_space.get(), space.get(), H5P_DEFAULT,
                slices_.data()) < 0)
      throw broken(path_, fmt::format("slices {} to {} cannot be read", first, first + count - 1));
  }

  std::string path_;
  Hdf5Handle file_, dataset_;
  std::size_t rank_ = 0;
  std::int64_t slab_ = 1, first_ = -1;
  std::vector<std::byte> slices_;
};

}  // namespace

std::unique_ptr<ServedVolume> open_hdf5(const std::string& path, const ReaderOptions& options) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const auto wanted = options.find("dataset");
  return std::make_unique<Hdf5Volume>(path, wanted == options.end() ? "" : wanted->second);
}

}  // namespace tagrid
