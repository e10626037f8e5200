#include "io/formats/hdf5/reader/storage.h"
#include "io/formats/hdf5/reader/links.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/metadata/loss.h"
#include "io/programs/words.h"
#include "io/samples/data_files.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// Filters of https://github.com/HDFGroup/hdf5_plugins, and what brings them.
struct KnownFilter {
  H5Z_filter_t number;
  const char *name, *packages;
};
constexpr KnownFilter known_filters[] = {
    {307, "bzip2", "Debian's package hdf5-filter-plugin and Python's package hdf5plugin have it"},
    {32000, "lzf", "Debian's package hdf5-plugin-lzf has it"},
    {32001, "Blosc",
     "Debian's package hdf5-filter-plugin-blosc-serial and Python's package hdf5plugin have it"},
    {32004, "LZ4", "Debian's package hdf5-filter-plugin and Python's package hdf5plugin have it"},
    {32008, "Bitshuffle", "Debian's package bitshuffle and Python's package hdf5plugin have it"},
    {32013, "ZFP", "Debian's package hdf5-filter-plugin-zfp-serial and Python's package hdf5plugin have it"},
    {32015, "Zstandard", "Python's package hdf5plugin has it"},
    {32017, "SZ", "Python's package hdf5plugin has it"},
    {32018, "FCIDECOMP", "Python's package hdf5plugin has it"},
    {32024, "SZ3", "Python's package hdf5plugin has it"},
    {32026, "Blosc2", "Python's package hdf5plugin has it"},
};

/// Filters that lose precision. ZFP and SZ also have modes without loss, but files do not state the
/// mode clearly.
constexpr KnownFilter lossy_filters[] = {{32013, "ZFP (unless reversible)", ""},
                                         {32017, "SZ", ""},
                                         {32022, "BitGroom", ""},
                                         {32023, "Granular BitRound", ""},
                                         {32024, "SZ3", ""}};
constexpr H5Z_filter_t filter_of_tagrid = 33184;
struct Filter {
  H5Z_filter_t number;
  std::string name;
  std::array<unsigned, 20> values = {};
};

Filter filter_of(hid_t properties, int position) {
  unsigned flags = 0;
  Filter filter;
  std::size_t values = filter.values.size();
  std::array<char, 256> name = {};
  filter.number = H5Pget_filter2(properties, static_cast<unsigned>(position), &flags, &values,
                                 filter.values.data(), name.size() - 1, name.data(), nullptr);
  // Plugins give long names: "HDF5 lz4 filter; see ...".
  const std::string_view text = name.data();
  filter.name = text.substr(0, text.find_first_of(";(,"));
  return filter;
}

}  // namespace

void require_filters(hid_t properties, const std::string& path) {
  for (int i = 0; i < H5Pget_nfilters(properties); ++i) {
    const Filter filter = filter_of(properties, i);
    if (filter.number < 0 || H5Zfilter_avail(filter.number) > 0) continue;
    std::string name = filter.name, packages;
    for (const KnownFilter& known : known_filters)
      if (known.number == filter.number) {
        name = known.name;
        packages = fmt::format("; {}", known.packages);
      }
    throw broken_hdf5(
        path, fmt::format("its samples need the filter {}{}, which is not installed{}; HDF5 looks for "
                          "plugins in the directories of HDF5_PLUGIN_PATH",
                          filter.number, name.empty() ? "" : fmt::format(" ({})", name), packages));
  }
}

std::string name_of_storage(hid_t properties) {
  std::string names;
  for (int i = 0; i < H5Pget_nfilters(properties); ++i) {
    const Filter filter = filter_of(properties, i);
    if (!names.empty()) names += ", ";
    names += filter.name.empty() ? fmt::format("filter {}", filter.number) : filter.name;
  }
  if (!names.empty()) return names;
  return H5Pget_layout(properties) == H5D_CHUNKED ? "chunks" : "not contiguous";
}

std::string loss_of(hid_t dataset, hid_t properties) {
  std::string loss;
  for (const auto& [attribute, words] : lossy_attributes)
    if (H5Aexists(dataset, attribute) > 0) loss = loss_after(loss, words);
  for (int i = 0; i < H5Pget_nfilters(properties); ++i) {
    const Filter filter = filter_of(properties, i);
    for (const KnownFilter& known : lossy_filters)
      if (known.number == filter.number) loss = loss_after(loss, fmt::format("HDF5, {}", known.name));
    // Integers with a number of bits that a user chose may lose their high bits; 0 lets the filter choose.
    if (filter.number == H5Z_FILTER_SCALEOFFSET && (filter.values[0] != H5Z_SO_INT || filter.values[1] != 0))
      loss = loss_after(
          loss, filter.values[0] == H5Z_SO_INT
                    ? fmt::format("HDF5, scaleoffset, {} bits", filter.values[1])
                    : fmt::format("HDF5, scaleoffset, {} decimals", static_cast<int>(filter.values[1])));
    const std::uint64_t bits = filter.values[0] | static_cast<std::uint64_t>(filter.values[1]) << 32;
    if (filter.number == filter_of_tagrid && bits != 0)
      loss = loss_after(loss, fmt::format("tagrid, maximum error {:.6g}", std::bit_cast<double>(bits)));
  }
  return loss;
}

void require_own_samples(hid_t properties, const std::string& path, const std::string& name) {
  // Without the first slash, as h5repack has it.
  const std::string relative = name.starts_with('/') ? name.substr(1) : name;
  // These could be any files of this machine.
  if (H5Pget_external_count(properties) > 0)
    throw broken_hdf5(
        path, fmt::format("its samples are in other files (external storage), which is not supported; "
                          "h5repack -l {}:CONTI copies them into the file",
                          relative));
  if (H5Pget_layout(properties) != H5D_VIRTUAL) return;
  std::string missing;
  for (const std::string& file : files_of_virtual(properties)) {
    std::error_code unknown;
    // "%b" stands for numbers.
    if (file == "." || is_on_server(file) || file.find('%') != file.npos ||
        std::filesystem::exists(path_of(path).parent_path() / path_of(file), unknown))
      continue;
    missing = file;
    break;
  }
  throw broken_hdf5(
      path,
      fmt::format(
          "{} has its samples in other data sets (it is a virtual data set), which is not supported; "
          "h5repack -l {}:CONTI copies them into one file{}",
          name, relative,
          missing.empty()
              ? ", if all those files are there: it silently fills what is missing"
              : fmt::format(" when all those files are there, but {} is not, and would be filled silently",
                            missing)));
}

Unwritten unwritten_samples(hid_t dataset, hid_t properties) {
  Unwritten unwritten;
  const H5D_layout_t layout = H5Pget_layout(properties);
  if (layout == H5D_CONTIGUOUS && H5Dget_offset(dataset) == HADDR_UNDEF) unwritten.what = "all samples were";
  if (layout == H5D_CHUNKED) {
    const std::vector<hsize_t> sizes = dims_of(dataset);
    std::vector<hsize_t> chunk(sizes.size(), 1);
    H5Pget_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
    hsize_t all = 1, stored = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i)
      all *= (sizes[i] + std::max<hsize_t>(chunk[i], 1) - 1) / std::max<hsize_t>(chunk[i], 1);
    const Hdf5Handle space = space_of(dataset);
    if (H5Dget_num_chunks(dataset, space.get(), &stored) >= 0 && stored < all)
      unwritten.what = fmt::format("{} of {} chunks were", all - stored, all);
  }
  H5D_fill_value_t fill = H5D_FILL_VALUE_UNDEFINED;
  H5D_fill_time_t time = H5D_FILL_TIME_IFSET;
  H5Pfill_value_defined(properties, &fill);
  H5Pget_fill_time(properties, &time);
  // The library leaves the memory of such samples as it was.
  unwritten.has_values = fill != H5D_FILL_VALUE_UNDEFINED && time != H5D_FILL_TIME_NEVER;
  return unwritten;
}

}  // namespace tagrid
