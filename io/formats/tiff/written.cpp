#include "io/formats/tiff/written.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "io/bytes/little_endian.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"

namespace tagrid {
namespace {

bool has_sign(SampleType type) {
  return type == SampleType::int8 || type == SampleType::int16 || type == SampleType::int32;
}

enum class FieldType : std::uint16_t { text = 2, half = 3, word = 4, ratio = 5, big = 16 };

/// Bytes of a file, from front to back, in the classic form or as BigTIFF.
class Headers {
 public:
  explicit Headers(bool is_big) : is_big_(is_big) {}

  template <class T>
  void put(T number) {
    std::array<std::byte, sizeof(T)> bytes;
    store_little_endian(bytes.data(), number);
    text_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  /// A number as wide as offsets are.
  void put_offset(std::uint64_t number) {
    if (is_big_)
      put(number);
    else
      put(static_cast<std::uint32_t>(number));
  }
  void put_count(std::uint64_t number) {
    if (is_big_)
      put(number);
    else
      put(static_cast<std::uint16_t>(number));
  }
  /// A field whose value fits into its entry.
  void put_field(std::uint16_t tag, FieldType type, std::uint64_t count, std::uint64_t value) {
    put(tag);
    put(static_cast<std::uint16_t>(type));
    put_offset(count);
    put_offset(value);  // little endian: a half is in front
  }
  void put_text(std::string_view text) { text_ += text; }
  const std::string& text() const { return text_; }
  std::uint64_t size() const { return text_.size(); }

 private:
  bool is_big_;
  std::string text_;
};

constexpr std::uint64_t fields_of_page = 13;

std::uint64_t page_bytes(bool is_big) {
  return is_big ? 8 + fields_of_page * 20 + 8 : 2 + fields_of_page * 12 + 4;
}

/// True if the text can be the rest of a line of ImageJ's description.
bool fits_line(const std::string& text) {
  return text.find_first_of("\r\n") == text.npos && text.find('\0') == text.npos;
}

/// A clause that explains why TIFF cannot store this spacing; "" if it can. ImageJ treats
/// resolutions without a unit as print resolutions. A unit is the rest of its line.
std::string why_no_spacing(const Geometry& geometry) {
  const std::string& unit = geometry.units[0];
  for (const std::size_t axis : {0U, 1U}) {
    const double size = std::abs(geometry.spacing[axis]);
    if (std::isnan(size)) return fmt::format("it is unknown along {}", axis == 0 ? "x" : "y");
    if (!(size > 1e-6 && size < 1e6)) return fmt::format("TIFF cannot hold a distance of {}", size);
  }
  if (unit.empty()) return "its unit is unknown";
  return fits_line(unit) ? "" : "its unit has several lines";
}

bool has_known_spacing(const Geometry& geometry) {
  return geometry.has_spacing && why_no_spacing(geometry).empty();
}

/// In memory, ImageJ has signed numbers as unsigned ones, larger by this; its calibration belongs to these.
constexpr double half = 32768;

double c0_of(const Rescale& rescale, SampleType type) {
  return type == SampleType::int16 ? rescale.intercept - rescale.slope * half : rescale.intercept;
}

/// What the samples mean, as ImageJ has it; "" if they are the values. REQUIRES: keeps_values_in_tiff().
std::string calibration_of(const VolumeInfo& info) {
  const Rescale rescale = info.metadata.rescale();
  if (rescale == Rescale{}) return "";
  const double c0 = c0_of(rescale, info.type);
  constexpr int straight_line = 0;
  return fmt::format("cf={}\nc0={}\nc1={}\n", straight_line, c0, rescale.slope) +
         (rescale.units.empty() ? "" : fmt::format("vunit={}\n", rescale.units));
}

/// What ImageJ reads of a stack.
std::string description_of(const VolumeInfo& info, const Geometry& geometry) {
  std::string text = fmt::format("ImageJ=1.53t\nimages={0}\nslices={0}\n", info.dims.z);
  if (has_known_spacing(geometry)) {
    if (!std::isnan(geometry.spacing[2])) text += fmt::format("spacing={}\n", std::abs(geometry.spacing[2]));
    text += fmt::format("unit={}\n", geometry.units[0]);
  }
  if (keeps_values_in_tiff(info)) text += calibration_of(info);
  if (const std::string loss = info.metadata.text_of(lossy_source_key); !loss.empty() && fits_line(loss))
    text += fmt::format("{}={}\n", lossy_source_key, loss);
  return text + '\0';
}

/// Samples per unit of length as a ratio of whole numbers.
std::pair<std::uint32_t, std::uint32_t> resolution_of(double spacing) {
  if (!(std::abs(spacing) > 1e-6) || !(std::abs(spacing) < 1e6)) return {1, 1};
  const double size = std::abs(spacing);
  // The larger number uses its 32 bits.
  const double largest = 4294967040.0;
  return size < 1 ? std::pair{static_cast<std::uint32_t>(largest),
                              static_cast<std::uint32_t>(std::round(largest * size))}
                  : std::pair{static_cast<std::uint32_t>(std::round(largest / size)),
                              static_cast<std::uint32_t>(largest)};
}

}  // namespace

std::string tiff_headers(const VolumeInfo& info) {
  const Geometry geometry = in_one_unit(info.geometry());
  const std::string description = description_of(info, geometry);
  const auto pages = static_cast<std::uint64_t>(info.dims.z);
  const std::uint64_t slice = *sample_bytes({info.dims.x, info.dims.y, 1}, info.type),
                      shared = description.size() + description.size() % 2 + 16;
  const std::uint64_t classic = 8 + shared + pages * page_bytes(false) + pages * slice;
  const bool is_big = classic > std::numeric_limits<std::uint32_t>::max();
  const std::uint64_t first = is_big ? 16 : 8, text_at = first, ratios_at = text_at + shared - 16,
                      pages_at = ratios_at + 16;
  // Samples begin at a whole number of 16 bytes.
  const std::uint64_t samples_at = (pages_at + pages * page_bytes(is_big) + 15) / 16 * 16;
  Headers headers(is_big);
  headers.put_text("II");
  headers.put(std::uint16_t{static_cast<std::uint16_t>(is_big ? 43 : 42)});
  if (is_big) headers.put(std::uint32_t{8});
  headers.put_offset(pages_at);
  headers.put_text(description);
  if (description.size() % 2 != 0) headers.put_text(std::string_view("\0", 1));
  for (const std::size_t axis : {0U, 1U}) {
    const auto [samples, length] = resolution_of(geometry.spacing[axis]);
    headers.put(samples);
    headers.put(length);
  }
  const std::uint64_t bits = 8 * size_of(info.type);
  const std::uint64_t format = is_float_type(info.type) ? 3 : has_sign(info.type) ? 2 : 1;
  for (std::uint64_t page = 0; page < pages; ++page) {
    headers.put_count(fields_of_page);
    headers.put_field(256, FieldType::word, 1, static_cast<std::uint64_t>(info.dims.x));
    headers.put_field(257, FieldType::word, 1, static_cast<std::uint64_t>(info.dims.y));
    headers.put_field(258, FieldType::half, 1, bits);
    headers.put_field(259, FieldType::half, 1, 1);  // not compressed
    headers.put_field(262, FieldType::half, 1, 1);  // small numbers mean black
    headers.put_field(270, FieldType::text, description.size(), text_at);
    headers.put_field(273, is_big ? FieldType::big : FieldType::word, 1, samples_at + page * slice);
    headers.put_field(278, FieldType::word, 1, static_cast<std::uint64_t>(info.dims.y));
    headers.put_field(279, is_big ? FieldType::big : FieldType::word, 1, slice);
    // BigTIFF has room for a ratio in the entry.
    if (is_big) {
      const auto [x, one] = resolution_of(geometry.spacing[0]);
      const auto [y, two] = resolution_of(geometry.spacing[1]);
      headers.put_field(282, FieldType::ratio, 1, x | static_cast<std::uint64_t>(one) << 32);
      headers.put_field(283, FieldType::ratio, 1, y | static_cast<std::uint64_t>(two) << 32);
    } else {
      headers.put_field(282, FieldType::ratio, 1, ratios_at);
      headers.put_field(283, FieldType::ratio, 1, ratios_at + 8);
    }
    // Resolutions of paper would be in inches.
    constexpr std::uint64_t no_unit = 1;
    headers.put_field(296, FieldType::half, 1, no_unit);
    headers.put_field(339, FieldType::half, 1, format);
    headers.put_offset(page + 1 < pages ? pages_at + (page + 1) * page_bytes(is_big) : 0);
  }
  headers.put_text(std::string(samples_at - headers.size(), '\0'));
  return headers.text();
}

bool keeps_values_in_tiff(const VolumeInfo& info) {
  // ImageJ calibrates no other numbers.
  return (info.type == SampleType::uint8 || info.type == SampleType::uint16 ||
          info.type == SampleType::int16) &&
         fits_line(info.metadata.rescale().units);
}

std::string lost_rescale_in_tiff(const VolumeInfo& info) {
  if (info.metadata.rescale() == Rescale{} || keeps_values_in_tiff(info)) return "";
  return fmt::format(
      "TIFF has no place for slope and intercept of {} samples (ImageJ has one for uint8, uint16 and int16)",
      name_of(info.type));
}

std::vector<std::string> lost_in_tiff(const VolumeInfo& info) {
  std::vector<std::string> lost;
  const Rescale rescale = info.metadata.rescale();
  // Readers take these for signed samples, and some intercepts come back from the sum of two numbers.
  if (info.type == SampleType::uint16 && rescale.intercept == -half && rescale.slope == 1)
    lost.emplace_back(
        "TIFF with this intercept is read as int16 without one, because ImageJ stores signed samples this "
        "way");
  if (info.type == SampleType::int16 && c0_of(rescale, info.type) + rescale.slope * half != rescale.intercept)
    lost.push_back(
        fmt::format("TIFF rounds the intercept of its values: ImageJ's is {} smaller", rescale.slope * half));
  const Geometry geometry = in_one_unit(info.geometry());
  if (std::string mixed = lost_by_mixed_units(geometry); !mixed.empty()) lost.push_back(std::move(mixed));
  if (geometry.has_spacing && !has_known_spacing(geometry))
    lost.push_back("the spacing is not written: " + why_no_spacing(geometry));
  const bool is_mirrored =
      !geometry.has_directions && std::ranges::any_of(geometry.spacing, [](double s) { return s < 0; });
  if (geometry.has_directions || geometry.has_origin || is_mirrored)
    lost.push_back(fmt::format("TIFF has no place for positions and directions{}",
                               has_known_spacing(geometry) ? "; only the spacing is written" : ""));
  return lost;
}

std::uint64_t memory_of_tiff(const VolumeInfo& info) {
  return 2 * static_cast<std::uint64_t>(info.dims.z) * page_bytes(true);
}

}  // namespace tagrid
