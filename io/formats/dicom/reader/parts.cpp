#include "io/formats/dicom/reader/series.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "io/text/text.h"

namespace tagrid {
namespace {

using Files = std::vector<DicomFile>;
using Slices = std::vector<DicomSlice>;
using Parts = std::vector<DicomPart>;

/// Positions along the normal that differ by less, in mm, are one place.
constexpr double same_place = 1e-4;

std::string_view text_of_moment(const Files& files, const DicomSlice& slice, std::size_t moment) {
  const DicomFile& file = files[slice.file];
  const std::string_view own = value_in(file.frames[slice.frame].moments, moment);
  return own.empty() ? value_in(file.moments, moment) : own;
}

bool are_at_one_place(const Files& files, const DicomSlice& a, const DicomSlice& b) {
  const DicomFrame &f = frame_of(files, a), &g = frame_of(files, b);
  return has_place(f) && has_place(g) ? along_normal(g) - along_normal(f) < same_place
                                      : !has_place(f) && !has_place(g) && f.number == g.number;
}

/// The slices of each place, one place after the other.
std::vector<Slices> by_place(const Slices& slices, const Files& files) {
  std::vector<Slices> places;
  for (const DicomSlice& slice : slices)
    if (!places.empty() && are_at_one_place(files, places.back().back(), slice))
      places.back().push_back(slice);
    else
      places.push_back({slice});
  return places;
}

std::string in_words(std::size_t moment, std::string_view value) {
  const std::string_view name = name_of_moment(moment);
  return value.empty() ? fmt::format("without {}", name) : fmt::format("{} {}", name, trimmed(value));
}

struct Places {
  std::size_t count = 0;
  std::size_t most_images = 0;  ///< at one place
};

/// True if every part is a volume without two slices at one place, and if they are not just the slices of one
/// volume. Of an attribute that grows, a value should be that of a whole volume.
bool are_volumes(const Parts& parts, const Files& files, const Places& places, bool grows) {
  if (parts.size() < 2) return false;
  for (const DicomPart& part : parts)
    if (first_of_two(part.slices, files) < part.slices.size()) return false;
  return parts.size() <= std::max(places.most_images, grows ? 0 : places.count / 2);
}

/// The first image of each place by an attribute that grows, the second one, and so on; nothing if the
/// attribute does not order the images of every place, or if places have different numbers of images.
std::optional<Parts> parted_by_order(std::size_t moment, const Slices& slices, const Files& files) {
  std::vector<Slices> places = by_place(slices, files);
  Parts parts(places.front().size());
  const auto value = [&](const DicomSlice& slice) { return value_of(files, slice, moment); };
  for (Slices& place : places) {
    if (place.size() != parts.size()) return std::nullopt;
    std::ranges::sort(place, [&](const auto& a, const auto& b) { return value(a) < value(b); });
    for (std::size_t i = 0; i < place.size(); ++i) {
      if (i > 0 && !(value(place[i - 1]) < value(place[i]))) return std::nullopt;
      parts[i].slices.push_back(place[i]);
    }
  }
  for (DicomPart& part : parts) {
    const auto [least, most] = std::ranges::minmax_element(
        part.slices, [&](const auto& a, const auto& b) { return value(a) < value(b); });
    part.told_by = in_words(moment, value(*least).text);
    if (value(*least) < value(*most)) part.told_by += fmt::format(" to {}", trimmed(value(*most).text));
  }
  return parts;
}

/// Attributes in which images at one place differ.
std::vector<std::size_t> that_differ(const Slices& slices, const Files& files) {
  std::vector<std::size_t> moments;
  for (std::size_t moment = 0; moment < count_of_moments(); ++moment)
    for (std::size_t i = 1; i < slices.size(); ++i)
      if (are_at_one_place(files, slices[i - 1], slices[i]) &&
          text_of_moment(files, slices[i - 1], moment) != text_of_moment(files, slices[i], moment)) {
        moments.push_back(moment);
        break;
      }
  return moments;
}

std::optional<Parts> parted_by_any_order(const std::vector<std::size_t>& moments, const Slices& slices,
                                         const Files& files) {
  for (const std::size_t moment : moments)
    if (grows_from_slice_to_slice(moment))
      if (auto parts = parted_by_order(moment, slices, files)) return parts;
  return std::nullopt;
}

/// Parts by several attributes at once, such as echo and moment.
std::optional<Parts> parted_by_several(const std::vector<std::size_t>& moments, const Slices& slices,
                                       const Files& files, const Places& places) {
  std::vector<std::size_t> steady;
  for (const std::size_t moment : moments)
    if (!grows_from_slice_to_slice(moment) &&
        parted_by({moment}, slices, files).size() <= std::max(places.most_images, places.count / 2))
      steady.push_back(moment);
  if (steady.empty()) return std::nullopt;
  Parts parts = parted_by(steady, slices, files);
  if (are_volumes(parts, files, places, false)) return parts;
  Parts finer;
  for (const DicomPart& part : parts) {
    if (first_of_two(part.slices, files) == part.slices.size()) {
      finer.push_back(part);
      continue;
    }
    auto ordered = parted_by_any_order(moments, part.slices, files);
    if (!ordered) return std::nullopt;
    for (DicomPart& one : *ordered)
      finer.push_back({std::move(one.slices), fmt::format("{}, {}", part.told_by, one.told_by)});
  }
  return are_volumes(finer, files, places, false) ? std::optional(finer) : std::nullopt;
}

}  // namespace

bool DicomValue::operator<(const DicomValue& other) const {
  if (number != other.number) return number < other.number;
  return !is_number() && text < other.text;
}

DicomValue value_of(const Files& files, const DicomSlice& slice, std::size_t moment) {
  const std::string_view text = text_of_moment(files, slice, moment);
  const auto number = number_of(trimmed(text));
  return number && *number == *number ? DicomValue{*number, text} : DicomValue{.text = text};
}

std::vector<DicomPart> parted_by(const std::vector<std::size_t>& moments, const Slices& slices,
                                 const Files& files) {
  std::map<std::vector<DicomValue>, Slices> groups;
  for (const DicomSlice& slice : slices) {
    std::vector<DicomValue> key;
    for (const std::size_t moment : moments) key.push_back(value_of(files, slice, moment));
    groups[key].push_back(slice);
  }
  Parts parts;
  for (auto& [values, group] : groups) {
    std::string words;
    for (std::size_t i = 0; i < moments.size(); ++i)
      words += (i > 0 ? ", " : "") + in_words(moments[i], values[i].text);
    parts.push_back({std::move(group), std::move(words)});
  }
  return parts;
}

const DicomFrame& frame_of(const Files& files, const DicomSlice& slice) {
  return files[slice.file].frames[slice.frame];
}

bool has_place(const DicomFrame& frame) { return frame.position && frame.orientation; }

double along_normal(const DicomFrame& frame) {
  const Vector3 n = normal_of(frame);
  const Vector3& p = *frame.position;
  return p[0] * n[0] + p[1] * n[1] + p[2] * n[2];
}

std::size_t first_of_two(const Slices& slices, const Files& files) {
  for (std::size_t i = 1; i < slices.size(); ++i)
    if (are_at_one_place(files, slices[i - 1], slices[i])) return i - 1;
  return slices.size();
}

std::vector<DicomPart> parted(const Slices& slices, const Files& files) {
  if (first_of_two(slices, files) == slices.size()) return {{slices, ""}};
  Places places;
  for (const Slices& place : by_place(slices, files)) {
    ++places.count;
    places.most_images = std::max(places.most_images, place.size());
  }
  const std::vector<std::size_t> moments = that_differ(slices, files);
  for (const std::size_t moment : moments)
    if (Parts parts = parted_by({moment}, slices, files);
        are_volumes(parts, files, places, grows_from_slice_to_slice(moment)))
      return parts;
  if (auto parts = parted_by_several(moments, slices, files, places)) return std::move(*parts);
  if (auto parts = parted_by_any_order(moments, slices, files)) return std::move(*parts);
  return {{slices, ""}};
}

std::string differences(const DicomSlice& a, const DicomSlice& b, const Files& files) {
  std::string words;
  for (std::size_t moment = 0; moment < count_of_moments(); ++moment) {
    const std::string_view one = trimmed(text_of_moment(files, a, moment)),
                           other = trimmed(text_of_moment(files, b, moment));
    if (one != other)
      words += fmt::format("{}{} ({} and {})", words.empty() ? "" : ", ", name_of_moment(moment),
                           one.empty() ? "none" : one, other.empty() ? "none" : other);
  }
  return words;
}

}  // namespace tagrid
