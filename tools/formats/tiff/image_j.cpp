#include "tools/formats/tiff/image_j.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "io/errors/errors.h"
#include "io/text/text.h"
#include "tools/formats/tiff/lengths.h"

namespace tagrid {
namespace {

std::int64_t count_from(std::string_view text) {
  std::int64_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  constexpr std::int64_t most = std::int64_t{1} << 31;
  if (error != std::errc() || end != text.data() + text.size() || count < 1 || count > most)
    throw BrokenInput("TIFF file: ImageJ's description has the number " + quoted(text));
  return count;
}

/// Pixels in a unit, as a length.
ForeignNumber length_of(const std::optional<double>& resolution) {
  if (!resolution) return {};
  ForeignNumber length = foreign_number(1 / *resolution);
  if (!(*resolution > 0)) length.outcome = ForeignNumber::Outcome::unreadable;
  length.text = fmt::format("{}", *resolution);
  return length;
}

}  // namespace

std::optional<ImageJ> image_j_of(std::string_view description) {
  if (!description.starts_with("ImageJ=")) return std::nullopt;
  ImageJ found;
  bool has_slices = false;
  while (!description.empty()) {
    const std::string_view line = take_line(description);
    const std::size_t equal = line.find('=');
    if (equal == line.npos) continue;
    const std::string_view key = line.substr(0, equal), value = line.substr(equal + 1);
    if (key == "images") found.images = count_from(value);
    if (key == "channels") found.channels = count_from(value);
    if (key == "frames") found.frames = count_from(value);
    if (key == "slices") {
      found.slices = count_from(value);
      has_slices = true;
    }
    if (key == "spacing") found.spacing = foreign_number(value);
    if (key == "unit") found.unit.fill(plain_unit(value));
    // They come after the unit, and only if they differ from it.
    if (key == "yunit") found.unit[1] = plain_unit(value);
    if (key == "zunit") found.unit[2] = plain_unit(value);
  }
  if (!has_slices) found.slices = found.images / (found.channels * found.frames);
  if (found.channels > found.images || found.frames > found.images || found.slices > found.images ||
      found.channels * found.frames > found.images ||
      found.channels * found.frames * found.slices != found.images)
    throw BrokenInput("TIFF file: ImageJ's description says " + std::to_string(found.images) +
                      " images, but " + std::to_string(found.channels) + " channels, " +
                      std::to_string(found.slices) + " slices and " + std::to_string(found.frames) +
                      " frames");
  return found;
}

Geometry spacing_of(const ImageJ& image_j, const TiffPage& first, TiffRemarks& remarks) {
  const std::string& unit = image_j.unit[0];
  if (unit.empty() || unit == "pixel" || unit == "pixels") return {};
  ForeignNumber between = image_j.spacing;
  // ImageJ also ignores the sign.
  if (between.is_number() && between.value < 0) {
    between.value = -between.value;
    remarks.warn(fmt::format("ImageJ's spacing is {}; it is read as {}", between.text, between.value));
  }
  return spacing_of({{{"XResolution", length_of(first.x_resolution), unit},
                      {"YResolution", length_of(first.y_resolution), image_j.unit[1]},
                      {"ImageJ's spacing", between, image_j.unit[2]}}},
                    remarks);
}

}  // namespace tagrid
