// tagrid-read-hdf5: reads data sets of HDF5 files (https://docs.hdfgroup.org/hdf5).

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/conventions.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/geometry.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/formats/hdf5/reader/plain_copy.h"
#include "io/formats/hdf5/reader/storage.h"
#include "io/metadata/loss.h"
#include "io/programs/serve_reader.h"
#include "io/programs/words.h"
#include "io/text/text.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

class Hdf5Volume final : public ServedVolume {
 public:
  Hdf5Volume(const std::string& path, const std::string& wanted)
      : path_(path), file_(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose) {
    if (!file_) throw broken_hdf5(path, "cannot be opened; it is damaged, or another program is writing it");
    const auto [name, remarks] = chosen_dataset(file_.get(), path, wanted);
    dataset_ = opened_dataset(file_.get(), name);
    const std::vector<hsize_t> sizes = dims_of(dataset_.get());
    const Hdf5Handle stored_type(H5Dget_type(dataset_.get()), H5Tclose);
    const auto stored = stored_samples_of(stored_type.get());
    const auto size = volume_size(sizes);
    if (!stored)
      throw broken_hdf5(path, fmt::format("{} has {}, which are not supported; use integers of 8, 16 or 32 "
                                          "bits or floats of 32 or 64 bits",
                                          name, samples_in_words(stored_type.get())));
    if (!size || !is_volume_size(*size) || !sample_bytes(*size, stored->type))
      throw broken_hdf5(path, fmt::format("{} has {} samples, which are no volume", name, in_words(sizes)));
    dims = *size;
    type = stored->type;
    if (const auto image = imaris_size(file_.get(), name, dims)) {
      dims = *image;
      is_padded_ = true;
    }
    rank_ = sizes.size();
    files = {path};
    if (const std::string other = file_of(dataset_.get()); !other.empty() && other != path) {
      if (!is_in_folder_of(path, dataset_.get()))
        throw broken_hdf5(
            path,
            fmt::format(
                "the data set is in another directory, where nothing is read; give that file itself: {}",
                other));
      files.push_back(other);
    }
    warnings = remarks;
    describe_dataset(file_.get(), path, name, *this);
    big_endian_ = stored->big_endian;
    look_at_layout(name);
    has_plain_form = places.empty() && !is_padded_;
  }

  ReaderPlainFile plain_file(std::size_t number) override {
    ReaderPlainFile plain;
    const std::uint64_t size = FileSource(files[number]).size();
    if (number + 1 < files.size()) {  // it only leads to the data set
      plain.pieces = {PlainPiece::stretch(number, 0, size)};
      return plain;
    }
    const std::uint64_t slice = static_cast<std::uint64_t>(dims.x * dims.y) * size_of(type),
                        samples = slice * static_cast<std::uint64_t>(dims.z);
    PlainHdf5 copy = plain_copy(files[number], dataset_.get(), samples);
    plain.why_not = std::move(copy.why_not);
    if (plain.why_not) return plain;
    plain.compression = storage_;
    const std::uint64_t begin = copy.before.size();
    plain.pieces = {PlainPiece::given(std::move(copy.before)), PlainPiece::samples(samples),
                    PlainPiece::given(std::move(copy.behind))};
    plain.places = {{0, {number, begin, dims.z, slice, big_endian_}}};
    return plain;
  }

  /// Reads as many slices at once as a chunk has.
  void read_slice(std::int64_t z, std::byte* out) override {
    const std::uint64_t bytes = static_cast<std::uint64_t>(dims.x * dims.y) * size_of(type);
    const std::int64_t first = z / slab_ * slab_;
    if (first != first_ || slices_.empty()) {
      const std::int64_t count = std::min(slab_, dims.z - first);
      slices_.resize(memory_size(static_cast<std::uint64_t>(count) * bytes));
      first_ = -1;
      if (is_zeroed_) std::ranges::fill(slices_, std::byte{0});
      read_slab(first, count);
      first_ = first;
    }
    std::copy_n(slices_.begin() + static_cast<std::ptrdiff_t>(static_cast<std::uint64_t>(z - first) * bytes),
                bytes, out);
  }

 private:
  void look_at_layout(const std::string& name) {
    const Hdf5Handle properties(H5Dget_create_plist(dataset_.get()), H5Pclose);
    storage_ = name_of_storage(properties.get());
    const H5D_layout_t layout = H5Pget_layout(properties.get());
    require_own_samples(properties.get(), path_, name);
    add_loss(loss_of(dataset_.get(), properties.get()), *metadata);
    const std::uint64_t slice = static_cast<std::uint64_t>(dims.x * dims.y) * size_of(type);
    if (layout == H5D_CONTIGUOUS) {
      const haddr_t offset = H5Dget_offset(dataset_.get());
      if (offset != HADDR_UNDEF && !is_padded_) {
        places = {{files.size() - 1, offset, dims.z, slice, big_endian_}};
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
          throw broken_hdf5(path_, "its chunks are too large");
      memory += 4 * chunk_bytes;  // as it is stored, and as it becomes
      // A chunk is read once, if whole slices are; the cache of the library need not hold any.
    }
    look_for_unwritten(properties.get(), name);
    memory += static_cast<std::uint64_t>(slab_) * slice + slice;
    // The plain form: as the library has it, as bytes, and as the answer.
    const std::uint64_t stored = H5Dget_storage_size(dataset_.get()), all = FileSource(files.back()).size();
    memory += 8 * std::min(all - std::min(stored, all), most_around_samples);
  }

  void look_for_unwritten(hid_t properties, const std::string& name) {
    const Unwritten unwritten = unwritten_samples(dataset_.get(), properties);
    if (unwritten.what.empty()) return;
    const std::string sentence =
        fmt::format("{}: HDF5 file: {}: {} never written", path_, name, unwritten.what);
    if (unwritten.has_values) {
      warnings.push_back(sentence + "; their samples are the fill value");
      return;
    }
    not_understood.push_back(sentence + ", and the file does not say their values; they are encoded as 0");
    is_zeroed_ = true;
  }

  void read_slab(std::int64_t first, std::int64_t count) {
    const Hdf5Handle space = space_of(dataset_.get());
    std::vector<hsize_t> start(rank_, 0), size(rank_, 1);
    if (rank_ > 2) {
      start[rank_ - 3] = static_cast<hsize_t>(first);
      size[rank_ - 3] = static_cast<hsize_t>(count);
    }
    size[rank_ - 2] = static_cast<hsize_t>(dims.y);
    size[rank_ - 1] = static_cast<hsize_t>(dims.x);
    H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr);
    const Hdf5Handle memory_space(H5Screate_simple(static_cast<int>(rank_), size.data(), nullptr), H5Sclose);
    if (H5Dread(dataset_.get(), hdf5_type_of(type), memory_space.get(), space.get(), H5P_DEFAULT,
                slices_.data()) < 0)
      throw broken_hdf5(path_, fmt::format("slices {} to {} cannot be read", first, first + count - 1));
  }

  std::string path_;
  Hdf5Handle file_, dataset_;
  std::string storage_;
  bool big_endian_ = false;
  bool is_padded_ = false;  ///< samples behind the volume along each axis are no part of it
  bool is_zeroed_ = false;  ///< the library does not fill what was never written
  std::size_t rank_ = 0;
  std::int64_t slab_ = 1, first_ = -1;
  std::vector<std::byte> slices_;
};

/// Opens a data set of three axes (z, y, x): the one that the option "dataset" names, otherwise the default
/// one of NeXus, otherwise the only one.
std::unique_ptr<ServedVolume> open_hdf5(const std::string& path, const ReaderOptions& options) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  return std::make_unique<Hdf5Volume>(path, option(options, "dataset"));
}

}  // namespace
}  // namespace tagrid

int main() {
  return tagrid::serve_volumes("hdf5", tagrid::open_hdf5, {.may_need = tagrid::may_be_linked_to});
}
