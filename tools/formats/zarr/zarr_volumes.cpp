// tagrid-read-zarr: reads arrays of Zarr, versions 2 and 3, and of OME-Zarr, from folders and zip files
// (.ozx).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/nrrd/rescale.h"
#include "io/programs/serve.h"
#include "io/programs/serve_reader.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"
#include "io/volume/lengths.h"
#include "stages/sample/coding_parameters.h"
#include "tools/formats/words.h"
#include "tools/formats/zarr/image.h"
#include "tools/formats/zarr/pieces.h"
#include "tools/formats/zarr/store.h"

namespace tagrid {
namespace {

/// Attributes that are kept as pairs; more would be a file of its own.
constexpr std::size_t most_attributes = std::size_t{1} << 18;
/// Chunks whose presence is looked at, as a folder may have millions.
constexpr std::int64_t most_looked_at = 100'000;
constexpr std::size_t axis_of_x = 0, axis_of_y = 1, axis_of_z = 2;

/// An axis besides x, y and z: of moments, of channels, or of anything else.
struct OtherAxis {
  std::size_t axis = 0;
  std::string letter, word;
  std::int64_t size = 1;
};

std::vector<OtherAxis> other_axes(const ZarrImage& image) {
  const auto space = image.space();
  std::vector<OtherAxis> others;
  for (std::size_t axis = image.axes.size(); axis-- > 0;) {
    if (std::ranges::find(space, std::optional(axis)) != space.end()) continue;
    std::string name = lower_case(image.axes[axis].name);
    // Up to version 0.2, all arrays have these axes.
    if (name.empty() && image.axes.size() == 5) name = axis == 0 ? "t" : "c";
    const std::string word = name == "t" || name == "time"      ? "moment"
                             : name == "c" || name == "channel" ? "channel"
                                                                : name;
    const std::string letter = word == "moment"    ? "t"
                               : word == "channel" ? "c"
                               : name.empty()      ? fmt::format("a{}_", axis)
                                                   : printable(name);
    others.push_back({axis, letter, word.empty() ? fmt::format("axis {}", axis) : printable(word),
                      image.array.shape[axis]});
  }
  return others;
}

/// The number along each axis of the volume that `wanted` names; along x, y and z, 0.
std::vector<std::int64_t> chosen_volume(const std::string& path, const ZarrImage& image,
                                        const std::string& wanted) {
  const std::vector<OtherAxis> others = other_axes(image);
  std::int64_t count = 1;
  for (const OtherAxis& other : others)
    if (other.size < 1 || other.size > most_volumes / count)
      throw broken_zarr(path, fmt::format("has {} of {} along the axis {}, which is too many volumes",
                                          other.size, other.word, other.letter));
    else
      count *= other.size;
  const auto numbers_of = [&](std::int64_t volume) {
    std::vector<std::int64_t> numbers(image.axes.size(), 0);
    for (const OtherAxis& other : others) {
      numbers[other.axis] = volume % other.size;
      volume /= other.size;
    }
    return numbers;
  };
  if (count == 1 && wanted.empty()) return numbers_of(0);
  std::vector<Choice> choices;
  for (std::int64_t volume = 0; volume < count; ++volume) {
    const std::vector<std::int64_t> numbers = numbers_of(volume);
    Choice choice;
    for (const OtherAxis& other : others) {
      if (other.size == 1) continue;
      choice.name += fmt::format("{}{}", other.letter, numbers[other.axis] + 1);
      choice.text += fmt::format("{}{} {} of {}", choice.text.empty() ? "" : ", ", other.word,
                                 numbers[other.axis] + 1, other.size);
    }
    choices.push_back(std::move(choice));
  }
  return numbers_of(static_cast<std::int64_t>(chosen(path, "series", wanted, choices)));
}

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
                                    shown_path(), array.type_name));
    const auto space = image_.space();
    if (!space[axis_of_x] || !space[axis_of_y])
      throw broken_zarr(path, fmt::format("{} has less than two axes", shown_path()));
    for (std::size_t i = 0; i < 3; ++i) {
      axes_[i] = space[i];
      dims[static_cast<int>(i)] = space[i] ? array.shape[*space[i]] : 1;
    }
    type = *array.type;
    if (!is_volume_size(dims) || !sample_bytes(dims, type))
      throw broken_zarr(path, fmt::format("{} has {} x {} x {} samples, which are no volume", shown_path(),
                                          dims.x, dims.y, dims.z));
    numbers_ = chosen_volume(path, image_, option(options, "series"));
    files = {store_->path_of(image_.metadata_key)};
    slab_ = axes_[axis_of_z] ? std::min(array.piece[*axes_[axis_of_z]], dims.z) : 1;
    memory = pieces_.memory() + static_cast<std::uint64_t>(slab_ + 1) * slice_bytes();
    find_strides();
    describe();
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
  std::string shown_path() const {
    return image_.array.path.empty() ? "the array" : tagrid::quoted(image_.array.path);
  }
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

  void describe() {
    pairs = {{"zarr_dataset", "/" + image_.array.path}};
    if (!image_.name.empty()) pairs.emplace_back("zarr_name", image_.name);
    add_attributes("zarr_attributes", image_.attributes);
    if (image_.array.attributes != image_.attributes)
      add_attributes("zarr_array_attributes", image_.array.attributes);
    for (std::size_t i = 0; i < 3; ++i)
      if (axes_[i]) geometry.units[i] = image_.axes[*axes_[i]].unit;
    if (image_.has_scale) set_spacing();
    if (image_.has_translation) {
      for (std::size_t i = 0; i < 3; ++i)
        if (axes_[i]) geometry.origin[i] = image_.axes[*axes_[i]].translation;
      geometry.has_origin = true;
    }
    set_scale();
    if (std::string lost = lost_by_mixed_units(geometry); !lost.empty())
      warnings.push_back(fmt::format("{}: OME-Zarr: {}", store_->path(), lost));
    geometry = in_one_unit(geometry);
    const Json& header = member(member(image_.attributes, "tagrid"), "nrrd_header");
    if (header.is_string() && has_places_of(header.get<std::string>())) {
      nrrd = header.get<std::string>();
      // Without any line, these would count.
      geometry = {};
      pairs.clear();
      return;
    }
    add_rescale(rescale, pairs);  // which a reader's "rescale" would not do beside lines of NRRD
    if (header.is_string()) keep_pairs_of(header.get<std::string>());
    nrrd = nrrd_fields_of(geometry, pairs);
  }

  /// The number of an attribute, which may be a text or a list of one.
  ForeignNumber number_at(const char* name) const {
    const Json* value = &member(image_.array.attributes, name);
    if (value->is_array() && value->size() == 1) value = &value->front();
    if (value->is_null()) return {};
    if (value->is_number()) return foreign_number(value->get<double>());
    const std::string text = value->is_string() ? value->get<std::string>() : value->dump();
    return foreign_number(std::optional<std::string_view>(text));
  }

  /// The attributes of netCDF, as xarray writes them (https://cfconventions.org).
  void set_scale() {
    const std::string object = fmt::format("{}: Zarr: {}", store_->path(), shown_path());
    ForeignNumber slope = number_at("scale_factor"), intercept = number_at("add_offset");
    if (slope.is_number() && slope.value == 0) slope.outcome = ForeignNumber::Outcome::unreadable;
    constexpr const char* unknown = "how values follow from samples is not known";
    for (const auto& [name, number] :
         {std::pair("scale_factor", &slope), std::pair("add_offset", &intercept)}) {
      const std::string remark = remark_on(*number, name, unknown);
      if (number->is_unreadable() && scale_doubt.empty())
        scale_doubt = fmt::format("{}: {}", object, remark);
      else if (!remark.empty() && number->is_number())
        warnings.push_back(fmt::format("{}: {}", object, remark));
    }
    if (const std::string text = text_of_flag("_Unsigned"); !is_float_type(type) && scale_doubt.empty())
      scale_doubt = about_other_sign(object, text, name_of(type).starts_with('i'));
    if (scale_doubt.empty() && (slope.is_number() || intercept.is_number()))
      rescale = {slope.value_or(1), intercept.value_or(0), text_at(image_.array.attributes, "units")};
    for (const char* name : {"_FillValue", "missing_value"})
      if (const ForeignNumber missing = number_at(name); missing.is_number())
        not_understood.push_back(about_missing_samples(object, fmt::format("{}", missing.value), name));
  }
  std::string text_of_flag(const char* name) const {
    const Json& value = member(image_.array.attributes, name);
    return value.is_boolean() ? (value.get<bool>() ? "true" : "false")
                              : text_at(image_.array.attributes, name);
  }

  /// True if samples are where the header lines that tagrid keeps in its files put them. False for levels that
  /// are not the finest one, and if somebody changed the places.
  bool has_places_of(const std::string& header) const try {
    if (!image_.is_finest) return false;
    const Geometry said = in_one_unit(volume_info(dims, type, header).geometry);
    for (std::size_t i = 0; i < 3; ++i)
      if (spacing_or_1(said, i) != spacing_or_1(geometry, i) || said.origin[i] != geometry.origin[i] ||
          length_unit(said.units[i]) != length_unit(geometry.units[i]))
        return false;
    return true;
  } catch (const BrokenInput&) {
    return false;  // another program's
  }

  void keep_pairs_of(const std::string& header) try {
    const Geometry said = geometry_of(header);
    const KeyValues kept = pairs_without_places(header);
    pairs.insert(pairs.begin(), kept.begin(), kept.end());  // of equal keys, the last one counts
    if (said.has_directions || !said.space.empty())
      warnings.push_back(fmt::format(
          "{}: OME-Zarr: the header that tagrid wrote is of another level or of other places; scale "
          "and translation count, and its directions and coordinate system are left out",
          store_->path()));
  } catch (const BrokenInput&) {
    // Another program's.
  }

  /// A negative scale mirrors the volume, which directions can say. A scale of 0 says nothing.
  void set_spacing() {
    for (std::size_t i = 0; i < 3; ++i) {
      const double scale = axes_[i] ? image_.axes[*axes_[i]].scale : Geometry::unknown;
      geometry.has_spacing = true;
      if (scale == 0)
        warnings.push_back(
            fmt::format("{}: OME-Zarr: the scale along {} is 0; the distance between samples is not known",
                        store_->path(), "xyz"[i]));
      else
        geometry.spacing[i] = std::abs(scale);
      if (scale < 0) geometry.has_directions = true;
      if (axes_[i]) geometry.directions[i][i] = scale == 0 ? 1 : scale;
    }
    if (!axes_[axis_of_z]) geometry.directions[axis_of_z][axis_of_z] = 1;
  }

  void add_attributes(const std::string& key, const Json& attributes) {
    if (attributes.empty()) return;
    std::string text = attributes.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() <= most_attributes)
      pairs.emplace_back(key, std::move(text));
    else
      warnings.push_back(fmt::format("{}: Zarr: its attributes are too long to be kept", store_->path()));
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

  /// Says how many chunks are missing: they may be so on purpose, or be lost. Where a volume has too many chunks in
  /// shards, how many shards.
  void count_missing() {
    const ZarrArray& array = image_.array;
    auto missing =
        missing_of(array.piece, "chunks", [&](const auto& numbers) { return pieces_.has(numbers); });
    if (!missing && array.shards)
      missing = missing_of(array.chunk, "shards",
                           [&](const auto& numbers) { return store_->has(array.key(numbers)); });
    if (missing && missing->empty()) return;
    if (!array.has_fill)
      not_understood.push_back(unknown_fill(missing.value_or("chunks that are missing")));
    else if (missing)
      warnings.push_back(fmt::format("{}: Zarr: {}: {}; their samples are the fill value", store_->path(),
                                     shown_path(), *missing));
  }
  /// How many parts of this size of the volume are not there, in words; empty if all are. Nothing if they are too many
  /// to look at.
  std::optional<std::string> missing_of(const std::vector<std::int64_t>& size, const char* word,
                                        const auto& has) const {
    std::int64_t all = 1, missing = 0;
    for (std::size_t i = 0; i < 3; ++i)
      if (__builtin_mul_overflow(all, parts_along(i, size), &all) || all > most_looked_at)
        return std::nullopt;
    for (std::int64_t z = 0; z < parts_along(axis_of_z, size); ++z)
      for (std::int64_t y = 0; y < parts_along(axis_of_y, size); ++y)
        for (std::int64_t x = 0; x < parts_along(axis_of_x, size); ++x) {
          if (!has(numbers_of(size, z, y, x))) ++missing;
          say_working();
        }
    return missing == 0 ? "" : fmt::format("{} of {} {} are missing", missing, all, word);
  }
  std::string unknown_fill(const std::string& what) const {
    return fmt::format("{}: Zarr: {}: {}, and the array does not say their values; they are encoded as 0",
                       store_->path(), shown_path(), what);
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
  std::array<std::optional<std::size_t>, 3> axes_;  ///< of the array, that are x, y, z
  std::vector<std::int64_t> numbers_;               ///< of this volume along the other axes
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
