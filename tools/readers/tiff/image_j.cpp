#include "tools/readers/tiff/image_j.h"

#include <charconv>

#include "io/files/errors.h"
#include "io/files/text.h"

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

}  // namespace

std::string plain_unit(std::string_view unit) {
  // The micro sign and the Greek letter, in UTF-8, in Latin-1, and as ImageJ escapes them.
  for (const std::string_view micro :
       {"micron", "microns", "um", "\xc2\xb5m", "\xce\xbcm", "\xb5m", "\\u00B5m", "\\u03BCm"})
    if (unit == micro) return "um";
  return std::string(unit);
}

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
    if (key == "spacing") found.spacing = number_of(value).value_or(0);
    if (key == "unit") found.unit = plain_unit(value);
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

}  // namespace tagrid
