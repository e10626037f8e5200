#include "tools/formats/dicom/series_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "io/bytes/checksum.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Files = std::vector<DicomFile>;
using Slices = std::vector<DicomSlice>;

constexpr std::size_t digits = 8;

/// Numbers that are equal have equal texts, whatever their texts in the files are: 1 and 1.0, 0 and -0.
std::string text_of_number(double number) { return fmt::format("{:.6g}", number + 0.0); }

std::string text_of_value(const DicomValue& value) {
  return value.is_number() ? fmt::format("{}", value.number + 0.0) : std::string(trimmed(value.text));
}

/// "=2" if all slices have this value. Otherwise, of an attribute that grows, ">10" if that is the least one: times of
/// two volumes may be mixed, but one begins earlier. Of another attribute, "*".
std::string summary_of(std::size_t moment, const Slices& slices, const Files& files) {
  DicomValue least = value_of(files, slices.front(), moment), most = least;
  for (const DicomSlice& slice : slices) {
    const DicomValue value = value_of(files, slice, moment);
    if (value < least) least = value;
    if (most < value) most = value;
  }
  if (!(least < most)) return "=" + text_of_value(least);
  return grows_from_slice_to_slice(moment) ? ">" + text_of_value(least) : "*";
}

/// What tells volumes of one series apart, as lines.
std::string key_of(const Slices& slices, const Files& files) {
  const DicomFile& file = files[slices.front().file];
  const DicomFrame& frame = frame_of(files, slices.front());
  const DicomPixels& pixels = file.pixels;
  std::string key = fmt::format("{}\n{} {} {} {} {}\n", file.image_type, pixels.columns, pixels.rows,
                                pixels.allocated, pixels.is_signed, pixels.photometric);
  if (frame.orientation)
    for (const Vector3& direction : *frame.orientation)
      // Files that were written by other programs differ in the last digits.
      for (const double part : direction) key += text_of_number(std::round(part * 1e4) / 1e4) + " ";
  key += "\n";
  if (frame.spacing)
    for (const double spacing : *frame.spacing) key += text_of_number(spacing) + " ";
  for (std::size_t moment = 0; moment < count_of_moments(); ++moment)
    if (const std::string text = summary_of(moment, slices, files); text != "=")
      key += fmt::format("\n{}{}", name_of_moment(moment), text);
  return key;
}

/// Splits `slices` by each attribute, and the parts again as often as `more` says.
std::optional<Slices> part_called(const std::string& name, const Slices& slices, const Files& files,
                                  int more) {
  if (lasting_name_of(slices, files) == name) return slices;
  if (more == 0 || slices.size() == 1) return std::nullopt;
  for (std::size_t moment = 0; moment < count_of_moments(); ++moment)
    if (const std::vector<DicomPart> parts = parted_by({moment}, slices, files); parts.size() > 1)
      for (const DicomPart& part : parts)
        if (auto found = part_called(name, part.slices, files, more - 1)) return found;
  return std::nullopt;
}

}  // namespace

std::string lasting_name_of(const Slices& slices, const Files& files) {
  const std::string key = key_of(slices, files), &uid = files[slices.front().file].series;
  const std::string checksum = fmt::format("{:016x}", checksum_of({std::as_bytes(std::span(key))}));
  return fmt::format("{}-{}", uid.empty() ? "series" : uid, checksum.substr(0, digits));
}

std::string_view uid_in(std::string_view name) {
  const std::size_t end = name.rfind('-');
  return end == name.npos || name.size() != end + 1 + digits ? std::string_view() : name.substr(0, end);
}

std::optional<Slices> slices_called(const std::string& name, const Slices& slices, const Files& files) {
  constexpr int most_splits = 2;
  return part_called(name, slices, files, most_splits);
}

}  // namespace tagrid
