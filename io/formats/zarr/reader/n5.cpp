#include "io/formats/zarr/reader/n5.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/zarr/reader/codecs.h"
#include "io/formats/zarr/reader/json.h"
#include "io/programs/stored_samples.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Sizes = std::vector<std::int64_t>;

/// How many samples are in a box; nothing if there are too many to count.
std::optional<std::uint64_t> samples_in(const Sizes& size) {
  std::uint64_t count = 1;
  for (const std::int64_t one : size)
    if (__builtin_mul_overflow(count, static_cast<std::uint64_t>(one), &count)) return std::nullopt;
  return count;
}

/// What the header of a block says: https://github.com/saalfeldlab/n5#file-system-specification
struct BlockHeader {
  Sizes size;             ///< the slowest axis first
  std::size_t bytes = 0;  ///< of the header
};

BlockHeader header_of(std::span<const std::byte> stored, std::size_t axes, const std::string& name) {
  const auto number = [&](std::size_t at, std::size_t size) {
    if (stored.size() < at + size) throw BrokenInput(name + ": is truncated, within the header of its block");
    return number_in(stored.subspan(at, size), true);
  };
  constexpr std::uint64_t plain = 0, with_count = 1;
  const std::uint64_t mode = number(0, 2), stated_axes = number(2, 2);
  if (mode != plain && mode != with_count)
    throw BrokenInput("{}: its block is of the mode {}, which is not supported", name, mode);
  if (stated_axes != axes)
    throw BrokenInput("{}: its block has {} axes, but its array has {}", name, stated_axes, axes);
  BlockHeader header{Sizes(axes), 4 + 4 * axes};
  for (std::size_t axis = 0; axis < axes; ++axis)
    header.size[axes - 1 - axis] = static_cast<std::int64_t>(number(4 + 4 * axis, 4));
  if (mode == with_count) {
    if (number(header.bytes, 4) != samples_in(header.size))
      throw BrokenInput(name + ": its block has another number of samples than its size says");
    header.bytes += 4;
  }
  return header;
}

/// Copies the rows of a box of samples into a larger one.
void copy_rows(const std::vector<std::byte>& from, const Sizes& size, std::vector<std::byte>& to,
               const Sizes& full, std::size_t sample) {
  const auto row = static_cast<std::size_t>(size.back()) * sample;
  Sizes at(size.size(), 0);
  for (std::size_t done = 0; done < from.size(); done += row) {
    std::size_t place = 0;
    for (std::size_t axis = 0; axis < size.size(); ++axis)
      place = place * static_cast<std::size_t>(full[axis]) + static_cast<std::size_t>(at[axis]);
    std::memcpy(&to[place * sample], &from[done], row);
    for (std::size_t axis = size.size() - 1; axis-- > 0;) {
      if (++at[axis] < size[axis]) break;
      at[axis] = 0;
    }
  }
}

/// As many finite numbers above zero as there are axes, the slowest one first; nothing for anything else.
std::optional<std::vector<double>> numbers_of(const Json& list, std::size_t axes) {
  if (!list.is_array() || list.size() != axes) return std::nullopt;
  std::vector<double> numbers;
  for (const Json& one : list) {
    if (!one.is_number() || !std::isfinite(one.get<double>()) || !(one.get<double>() > 0))
      return std::nullopt;
    numbers.insert(numbers.begin(), one.get<double>());
  }
  return numbers;
}

/// True for a unit that says nothing about lengths.
bool is_pixel(const std::string& unit) {
  const std::string name = lower_case(unit);
  return name == "pixel" || name == "pixels" || name == "px";
}

/// True for factors that are not 1 for each axis.
bool are_coarser(const Json& factors) {
  const auto is_one = [](const Json& one) { return one.is_number() && one.get<double>() == 1; };
  return !factors.is_null() && !(factors.is_array() && std::ranges::all_of(factors, is_one));
}

/// Reads the attributes of one object; false if it has none.
class Scales {
 public:
  Scales(const ZarrStore& store, ZarrImage& image) : store_(store), image_(image) {}

  bool read(const Json& attributes) {
    const std::size_t axes = image_.axes.size();
    if (const Json& resolution = member(attributes, "resolution"); !resolution.is_null()) {
      const bool is_own = &attributes == &image_.array.attributes;
      if (is_own && are_coarser(factors())) {
        image_.doubts.push_back(sentence(
            "it has both resolution and downsamplingFactors, and resolution may be that of the finest "
            "level or its own; its scale is unknown"));
        return true;
      }
      set(numbers_of(resolution, axes), "resolution");
      set_units(member(attributes, "units"));
      return true;
    }
    const Json& pixel = member(attributes, "pixelResolution");
    if (pixel.is_null()) return false;
    const bool is_list = pixel.is_array();
    set(numbers_of(is_list ? pixel : member(pixel, "dimensions"), axes), "pixelResolution");
    set_units(is_list ? member(attributes, "units") : member(pixel, "unit"));
    return true;
  }

 private:
  /// Those of the level; null for the finest one.
  const Json& factors() const { return member(image_.array.attributes, "downsamplingFactors"); }

  void set(const std::optional<std::vector<double>>& numbers, const char* name) {
    if (!numbers)
      return say(fmt::format("its {} is not a positive number for each axis; it is not used", name));
    auto times = std::optional(std::vector<double>(numbers->size(), 1.0));
    if (!factors().is_null()) times = numbers_of(factors(), numbers->size());
    if (!times)
      return say("its downsamplingFactors are not a positive number for each axis; its scale is unknown");
    for (std::size_t i = 0; i < numbers->size(); ++i) image_.axes[i].scale = (*numbers)[i] * (*times)[i];
    image_.has_scale = true;
  }

  /// One for all axes, or a list of them.
  void set_units(const Json& units) {
    const std::size_t axes = image_.axes.size();
    for (std::size_t i = 0; i < axes; ++i) {
      const Json& own = units.is_array() && units.size() == axes ? units[axes - 1 - i] : units;
      if (own.is_string()) image_.axes[i].unit = own.get<std::string>();
    }
    if (std::ranges::any_of(image_.axes, [](const ZarrAxis& axis) { return is_pixel(axis.unit); })) {
      image_.has_scale = false;
      for (ZarrAxis& axis : image_.axes) axis.unit.clear();
    }
  }

  void say(const std::string& what) { image_.remarks.push_back(sentence(what)); }
  std::string sentence(const std::string& what) const {
    return fmt::format("{}: N5: {}: {}", store_.path(),
                       image_.array.path.empty() ? "the array" : image_.array.path, what);
  }

  const ZarrStore& store_;
  ZarrImage& image_;
};

}  // namespace

std::vector<std::byte> n5_block(const std::vector<std::byte>& stored, const ZarrArray& array,
                                const Sizes& numbers, const std::string& name) {
  const BlockHeader header = header_of(stored, array.piece.size(), name);
  for (std::size_t axis = 0; axis < numbers.size(); ++axis) {
    const std::int64_t most = array.piece[axis],
                       least = std::min(most, array.shape[axis] - numbers[axis] * array.piece[axis]);
    if (header.size[axis] < least || header.size[axis] > most)
      throw BrokenInput("{}: its block has {} samples, but a block of its array has {}", name,
                        fmt::join(header.size, " x "), fmt::join(array.piece, " x "));
  }
  const std::size_t sample = size_of(*array.type);
  const std::uint64_t bytes = *samples_in(header.size) * sample;  // not more than a whole block has
  std::vector<std::byte> samples = decompressed(
      {stored.begin() + static_cast<std::ptrdiff_t>(header.bytes), stored.end()}, array.codecs, bytes, name);
  if (header.size == array.piece) return samples;
  std::vector<std::byte> whole(memory_size(array.piece_bytes()));
  copy_rows(samples, header.size, whole, array.piece, sample);
  return whole;
}

void set_n5_scale(const ZarrStore& store, ZarrImage& image) {
  Scales scales(store, image);
  if (scales.read(image.array.attributes) || image.array.path.empty()) return;
  // Levels have that of the finest one in the group around them.
  if (const auto group = zarr_node(store, image.group); group && !group->is_array)
    scales.read(group->attributes);
}

bool is_n5_scale(const std::string& name) {
  constexpr std::array<std::string_view, 4> known = {"resolution", "units", "pixelResolution",
                                                     "downsamplingFactors"};
  return std::ranges::find(known, name) != known.end();
}

}  // namespace tagrid
