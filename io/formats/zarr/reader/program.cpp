// tagrid-read-zarr: reads arrays of Zarr, versions 2 and 3, and of OME-Zarr, from folders and zip files
// (.ozx), and those of N5.

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/zarr/reader/description.h"
#include "io/formats/zarr/reader/image.h"
#include "io/formats/zarr/reader/pieces.h"
#include "io/formats/zarr/reader/store.h"
#include "io/programs/serve.h"
#include "io/programs/serve_reader.h"
#include "io/programs/words.h"
#include "io/text/text.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

class ZarrVolume final : public ServedVolume {
 public:
  ZarrVolume(const std::string& path, const ReaderOptions& options)
      : store_(open_zarr_store(path)),
        image_(chosen_image(*store_, option(options, "dataset"))),
        pieces_(*store_, image_.array) {
    const ZarrArray& array = image_.array;
    if (!array.type)
      throw broken_zarr(path,
                        fmt::format("{} has {} samples, which are not supported; use integers of 8, 16 or 32 "
                                    "bits or floats of 32 or 64 bits",
                                    shown_path(image_), array.type_name),
                        array.format());
    const auto space = image_.space();
    if (!space[axis_of_x] || !space[axis_of_y])
      throw broken_zarr(path, fmt::format("{} has less than two axes", shown_path(image_)), array.format());
    for (std::size_t i = 0; i < 3; ++i) {
      axes_[i] = space[i];
      dims[static_cast<int>(i)] = space[i] ? array.shape[*space[i]] : 1;
    }
    type = *array.type;
    if (!is_volume_size(dims) || !sample_bytes(dims, type))
      throw broken_zarr(path,
                        fmt::format("{} has {} x {} x {} samples, which are no volume", shown_path(image_),
                                    dims.x, dims.y, dims.z),
                        array.format());
    numbers_ = chosen_volume(path, image_, option(options, "series"));
    files = {store_->path_of(image_.metadata_key)};
    slab_ = axes_[axis_of_z] ? std::min(array.piece[*axes_[axis_of_z]], dims.z) : 1;
    memory = pieces_.memory() + static_cast<std::uint64_t>(slab_ + 1) * slice_bytes();
    find_strides();
    describe_image(*store_, image_, axes_, *this);
    count_missing();
  }

  /// Reads as many slices at once as a chunk has.
  void read_slice(std::int64_t z, std::byte* out) override {
    const std::int64_t first = z / slab_ * slab_;
    if (first != first_ || slices_.empty()) {
      slices_.resize(
          memory_size(static_cast<std::uint64_t>(std::min(slab_, dims.z - first)) * slice_bytes()));
      first_ = -1;
      read_slab(first);
      first_ = first;
    }
    std::memcpy(out, &slices_[memory_size(static_cast<std::uint64_t>(z - first) * slice_bytes())],
                slice_bytes());
  }

 private:
  std::uint64_t slice_bytes() const { return static_cast<std::uint64_t>(dims.x * dims.y) * size_of(type); }
  std::int64_t piece_size(std::size_t i) const { return axes_[i] ? image_.array.piece[*axes_[i]] : 1; }

  /// Bytes between neighboring samples along each axis of the array, in a piece.
  void find_strides() {
    strides_.assign(image_.axes.size(), 0);
    std::uint64_t stride = size_of(type);
    for (std::size_t i = image_.axes.size(); i-- > 0;) {
      const std::size_t axis = image_.array.order[i];
      strides_[axis] = stride;
      stride *= static_cast<std::uint64_t>(image_.array.piece[axis]);
    }
  }

  /// How many pieces or chunks of this size the volume has along an axis.
  std::int64_t parts_along(std::size_t i, const std::vector<std::int64_t>& size) const {
    return axes_[i] ? (dims[static_cast<int>(i)] - 1) / size[*axes_[i]] + 1 : 1;
  }
  /// The numbers of a piece or chunk of this volume, which has this size.
  std::vector<std::int64_t> numbers_of(const std::vector<std::int64_t>& size, std::int64_t z, std::int64_t y,
                                       std::int64_t x) const {
    std::vector<std::int64_t> numbers = numbers_;
    for (std::size_t axis = 0; axis < numbers.size(); ++axis) numbers[axis] /= size[axis];
    for (const auto& [i, number] : {std::pair(axis_of_x, x), {axis_of_y, y}, {axis_of_z, z}})
      if (axes_[i]) numbers[*axes_[i]] = number;
    return numbers;
  }

  PieceBox pieces_of_volume() const {
    const std::vector<std::int64_t>& size = image_.array.piece;
    PieceBox box = {numbers_of(size, 0, 0, 0), {}};
    for (const std::int64_t first : box.first) box.end.push_back(first + 1);
    for (std::size_t i = 0; i < 3; ++i)
      if (axes_[i]) box.end[*axes_[i]] = parts_along(i, size);
    return box;
  }

  /// Reports how many chunks are missing: they may never have been written, or may be lost.
  void count_missing() {
    const ZarrArray& array = image_.array;
    const PieceBox box = pieces_of_volume();
    std::uint64_t all = 1;  // at most as many as there are samples
    for (std::size_t axis = 0; axis < box.end.size(); ++axis)
      all *= static_cast<std::uint64_t>(box.end[axis] - box.first[axis]);
    const ZarrPresence presence = presence_of(*store_, array, pieces_, box);
    if (presence.written >= all) return;
    const std::string missing = fmt::format("{} of {} chunks are missing", all - presence.written, all);
    if (!presence.other_key.empty())
      throw broken_zarr(
          store_->path(),
          fmt::format("{}: {}, but there is a file {}, where the metadata leads to {}; {} may state the "
                      "wrong separator or beginning of chunk keys",
                      shown_path(image_), missing, tagrid::quoted(presence.other_key),
                      tagrid::quoted(presence.expected_key), tagrid::quoted(image_.metadata_key)),
          array.format());
    const std::string sentence =
        fmt::format("{}: {}: {}: {}", store_->path(), array.format(), shown_path(image_), missing);
    if (array.has_fill)
      warnings.push_back(sentence + "; their samples are the fill value");
    else
      not_understood.push_back(sentence + ", and the array does not say their values; they are encoded as 0");
  }

  void read_slab(std::int64_t first) {
    const std::int64_t z = axes_[axis_of_z] ? first / piece_size(axis_of_z) : 0;
    const std::vector<std::int64_t>& size = image_.array.piece;
    for (std::int64_t y = 0; y < parts_along(axis_of_y, size); ++y)
      for (std::int64_t x = 0; x < parts_along(axis_of_x, size); ++x) {
        const auto piece = pieces_.read(numbers_of(size, z, y, x));
        place(piece ? &*piece : nullptr, first, y * piece_size(axis_of_y), x * piece_size(axis_of_x));
        say_working();
      }
  }

  /// Copies the samples of a piece, or of none, to where they are in the slab.
  void place(const std::vector<std::byte>* piece, std::int64_t z0, std::int64_t y0, std::int64_t x0) {
    const std::size_t size = size_of(type);
    const std::int64_t depth = std::min(slab_, dims.z - z0),
                       height = std::min(piece_size(axis_of_y), dims.y - y0),
                       width = std::min(piece_size(axis_of_x), dims.x - x0);
    std::uint64_t start = 0;  // of the channel and the moment
    for (std::size_t axis = 0; axis < numbers_.size(); ++axis)
      start += static_cast<std::uint64_t>(numbers_[axis] % image_.array.piece[axis]) * strides_[axis];
    for (std::int64_t z = 0; z < depth; ++z)
      for (std::int64_t y = 0; y < height; ++y) {
        std::byte* row = &slices_[static_cast<std::size_t>((z * dims.y + y0 + y) * dims.x + x0) * size];
        if (piece == nullptr)
          for (std::int64_t x = 0; x < width; ++x)
            std::copy_n(image_.array.fill.data(), size, row + static_cast<std::size_t>(x) * size);
        else
          copy_row(&(*piece)[start + offset(axis_of_z, z) + offset(axis_of_y, y)], offset(axis_of_x, 1),
                   width, row);
      }
  }
  std::uint64_t offset(std::size_t i, std::int64_t samples) const {
    return axes_[i] ? static_cast<std::uint64_t>(samples) * strides_[*axes_[i]] : 0;
  }

  void copy_row(const std::byte* from, std::uint64_t stride, std::int64_t width, std::byte* row) const {
    const std::size_t size = size_of(type);
    if (stride == size) {
      std::memcpy(row, from, static_cast<std::size_t>(width) * size);
    } else {
      for (std::int64_t x = 0; x < width; ++x)
        std::memcpy(row + static_cast<std::size_t>(x) * size, from + static_cast<std::uint64_t>(x) * stride,
                    size);
    }
    if (image_.array.big_endian && size > 1)
      for (std::byte* sample = row; sample < row + static_cast<std::size_t>(width) * size; sample += size)
        std::reverse(sample, sample + size);
  }

  std::unique_ptr<ZarrStore> store_;
  ZarrImage image_;
  ZarrPieces pieces_;
  SpaceAxes axes_;                     ///< of the array, that are x, y, z
  std::vector<std::int64_t> numbers_;  ///< of this volume along the other axes
  std::vector<std::uint64_t> strides_;
  std::int64_t slab_ = 1, first_ = -1;
  std::vector<std::byte> slices_;  ///< from first_ on, little endian
};

/// Opens the array that the option "dataset" names, or the only one; of several moments or channels, those of
/// the option "series".
std::unique_ptr<ServedVolume> open_zarr(const std::string& path, const ReaderOptions& options) {
  return std::make_unique<ZarrVolume>(path, options);
}

}  // namespace
}  // namespace tagrid

int main() { return tagrid::serve_volumes("zarr", tagrid::open_zarr); }
