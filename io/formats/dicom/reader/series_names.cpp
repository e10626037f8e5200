#include "io/formats/dicom/reader/series_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "io/bytes/checksum.h"
#include "io/programs/words.h"
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

/// "=2" if all slices have this value. Otherwise, of an attribute that grows, ">10" if that is the least one:
/// times of two volumes may be mixed, but one begins earlier. Of another attribute, "*".
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
std::string key_of(const Slices& slices, const Files& files, bool all) {
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
    if (const std::string text = all || is_in_names(moment) ? summary_of(moment, slices, files) : "=";
        text != "=")
      key += fmt::format("\n{}{}", name_of_moment(moment), text);
  return key;
}

bool is_within(const Slices& some, const Slices& all) {
  return std::ranges::all_of(some, [&](const DicomSlice& slice) {
    return std::ranges::any_of(
        all, [&](const DicomSlice& one) { return one.file == slice.file && one.frame == slice.frame; });
  });
}

/// Splits `slices` by each attribute, and the parts again as often as `more` says. Adds those with the name,
/// but none that lies within another one.
void find_called(const std::string& name, const Slices& slices, const Files& files, int more,
                 std::vector<Slices>& found) {
  for (const bool all : {false, true})
    if (lasting_name_of(slices, files, all) == name) {
      if (std::ranges::any_of(found, [&](const Slices& one) { return is_within(slices, one); })) return;
      std::erase_if(found, [&](const Slices& one) { return is_within(one, slices); });
      found.push_back(slices);
      return;
    }
  if (more == 0 || slices.size() == 1) return;
  for (std::size_t moment = 0; moment < count_of_moments(); ++moment)
    if (const std::vector<DicomPart> parts = parted_by({moment}, slices, files); parts.size() > 1)
      for (const DicomPart& part : parts) find_called(name, part.slices, files, more - 1, found);
}

std::string text_in(const DicomFile& file, const char* name) {
  const auto found = file.texts.find(name);
  return found == file.texts.end() ? "" : found->second;
}

/// "axial", or the plane that is nearest and the vector at right angles to the images.
std::string plane_of(const DicomFrame& frame) {
  if (!frame.orientation) return "without an orientation";
  const Vector3 normal = normal_of(frame);
  constexpr std::array planes = {"sagittal", "coronal", "axial"};
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
  const std::string plane = planes[axis];
  if (std::abs(normal[axis]) > 0.9999) return plane;
  return fmt::format("{}, turned to the normal {:.3g} {:.3g} {:.3g}", plane, normal[0], normal[1], normal[2]);
}

std::string directions_of(const DicomFrame& frame) {
  if (!frame.orientation) return "";
  const auto& [r, c] = *frame.orientation;
  return fmt::format("directions {:.3g} {:.3g} {:.3g} and {:.3g} {:.3g} {:.3g}", r[0], r[1], r[2], c[0], c[1],
                     c[2]);
}

std::string spacing_of(const DicomFrame& frame) {
  if (!frame.spacing) return "without a spacing";
  return fmt::format("{:.6g} x {:.6g} mm", (*frame.spacing)[0], (*frame.spacing)[1]);
}

std::string samples_of(const DicomPixels& pixels) {
  return fmt::format("{}{} bits, {}", pixels.is_signed ? "signed, " : "", pixels.allocated,
                     pixels.photometric);
}

std::string numbers_of(const DicomSeries& series, const Files& files) {
  const auto number = [&](const DicomSlice& slice) { return frame_of(files, slice).number; };
  const auto [least, most] = std::ranges::minmax(series.slices, {}, number);
  if (number(least) == number(most)) return fmt::format("number {}", number(least));
  return fmt::format("numbers {} to {}", number(least), number(most));
}

std::string begin_of(const DicomSeries& series, const Files& files) {
  const DicomSlice& slice = series.slices.front();
  const std::string file = "begins with " + file_name(files[slice.file].path);
  return files[slice.file].frames.size() > 1 ? fmt::format("{}, frame {}", file, slice.frame + 1) : file;
}

/// What can be said of a series, the most useful first. The first ones are among those by which images of one
/// UID become several volumes. The last ones always differ.
constexpr std::size_t features = 9, features_of_images = 4;
std::string feature(std::size_t which, const DicomSeries& series, const Files& files) {
  const DicomSlice& slice = series.slices.front();
  const DicomFile& file = files[slice.file];
  switch (which) {
    case 0:
      return plane_of(frame_of(files, slice));
    case 1:
      return directions_of(frame_of(files, slice));
    case 2:
      return spacing_of(frame_of(files, slice));
    case 3:
      return samples_of(file.pixels);
    case 4: {
      const std::string number = text_in(file, "SeriesNumber");
      return number.empty() ? "" : "SeriesNumber " + number;
    }
    case 5:
      return text_in(file, "ProtocolName");
    case 6:
      return numbers_of(series, files);
    case 7:
      return begin_of(series, files);
    default:
      return file.path;
  }
}

/// Adds to the texts of each group of series the features in which these differ, until `group_of` has others
/// for them.
template <class GroupOf>
void tell_apart(std::vector<DicomSeries>& series, const Files& files, std::size_t most_features,
                GroupOf group_of) {
  for (std::size_t which = 0; which < most_features; ++which) {
    std::map<std::string, std::vector<DicomSeries*>> equal;
    for (DicomSeries& one : series) equal[group_of(one)].push_back(&one);
    for (const auto& [group, those] : equal) {
      std::set<std::string> words;
      for (const DicomSeries* one : those) words.insert(feature(which, *one, files));
      if (words.size() < 2) continue;
      for (DicomSeries* one : those)
        if (const std::string more = feature(which, *one, files); !more.empty())
          one->choice.text += ", " + more;
    }
  }
}

}  // namespace

std::string lasting_name_of(const Slices& slices, const Files& files, bool all) {
  const std::string key = key_of(slices, files, all), &uid = files[slices.front().file].series;
  const std::string checksum = fmt::format("{:016x}", checksum_of({std::as_bytes(std::span(key))}));
  return fmt::format("{}-{}", uid.empty() ? "series" : uid, checksum.substr(0, digits));
}

std::string_view uid_in(std::string_view name) {
  const std::size_t end = name.rfind('-');
  return end == name.npos || name.size() != end + 1 + digits ? std::string_view() : name.substr(0, end);
}

std::vector<Slices> slices_called(const std::string& name, const Slices& slices, const Files& files) {
  constexpr int most_splits = 2;
  std::vector<Slices> found;
  find_called(name, slices, files, most_splits, found);
  return found;
}

std::string in_words(const DicomPart& part, const Files& files) {
  const DicomFile& file = files[part.slices.front().file];
  std::string words = fmt::format("{} x {} x {}", file.pixels.columns, file.pixels.rows, part.slices.size());
  for (const char* name : {"Modality", "SeriesDescription"})
    if (const std::string text = text_in(file, name); !text.empty()) words += ", " + text;
  if (!file.image_type.empty()) words += ", " + file.image_type;
  if (!part.told_by.empty()) words += ", " + part.told_by;
  return words;
}

void make_distinct(std::vector<DicomSeries>& series, const Files& files) {
  // Another number of slices does not say why images of one UID are not one volume.
  tell_apart(series, files, features_of_images, [&](const DicomSeries& one) {
    const DicomFile& file = files[one.slices.front().file];
    const std::string slices =
        fmt::format("{} x {} x {}", file.pixels.columns, file.pixels.rows, one.slices.size());
    return fmt::format("{}\n{} x {}{}", file.series, file.pixels.columns, file.pixels.rows,
                       one.choice.text.substr(slices.size()));
  });
  tell_apart(series, files, features, [](const DicomSeries& one) { return one.choice.text; });
}

}  // namespace tagrid
