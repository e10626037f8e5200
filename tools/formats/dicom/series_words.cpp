#include "tools/formats/dicom/series_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

namespace tagrid {
namespace {

using Files = std::vector<DicomFile>;

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
  const std::string file = "begins with " + std::filesystem::path(files[slice.file].path).filename().string();
  return files[slice.file].frames.size() > 1 ? fmt::format("{}, frame {}", file, slice.frame + 1) : file;
}

/// What can be said of a series, the most useful first. The first ones are among those by which images of one UID become
/// several volumes. The last ones always differ.
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

}  // namespace

std::string in_words(const DicomPart& part, const Files& files) {
  const DicomFile& file = files[part.slices.front().file];
  std::string words = fmt::format("{} x {} x {}", file.pixels.columns, file.pixels.rows, part.slices.size());
  for (const char* name : {"Modality", "SeriesDescription"})
    if (const std::string text = text_in(file, name); !text.empty()) words += ", " + text;
  if (!file.image_type.empty()) words += ", " + file.image_type;
  if (!part.told_by.empty()) words += ", " + part.told_by;
  return words;
}

namespace {

/// Adds to the texts of each group of series the features in which these differ, until `group_of` has others for them.
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
