#include "io/formats/dicom/reader/series.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "io/errors/errors.h"
#include "io/formats/dicom/reader/interleaved.h"
#include "io/formats/dicom/reader/series_names.h"
#include "io/programs/stored_samples.h"
#include "io/programs/words.h"
#include "io/text/numbered_names.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// Steps that differ by less, relative to the usual one, are equal: positions are rounded texts.
constexpr double same_step = 0.01;

using Files = std::vector<DicomFile>;
using Slices = std::vector<DicomSlice>;

Vector3 minus(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vector3& a) { return std::sqrt(dot(a, a)); }
Vector3 scaled(const Vector3& a, double by) { return {a[0] * by, a[1] * by, a[2] * by}; }

bool is_same_orientation(const DicomFrame& a, const DicomFrame& b) {
  if (a.orientation.has_value() != b.orientation.has_value()) return false;
  if (!a.orientation) return true;
  for (std::size_t i = 0; i < 2; ++i)
    if (length(minus((*a.orientation)[i], (*b.orientation)[i])) > 1e-3) return false;
  return true;
}

bool is_same_spacing(const DicomFrame& a, const DicomFrame& b) {
  if (a.spacing.has_value() != b.spacing.has_value()) return false;
  if (!a.spacing) return true;
  for (std::size_t i = 0; i < 2; ++i)
    if (std::abs((*a.spacing)[i] - (*b.spacing)[i]) > 1e-4 * std::abs((*a.spacing)[i])) return false;
  return true;
}

bool is_of_one_series(const Files& files, const DicomSlice& a, const DicomSlice& b) {
  const DicomFile &f = files[a.file], &g = files[b.file];
  const auto key = [](const DicomFile& file) {
    const DicomPixels& p = file.pixels;
    return std::tie(file.series, file.image_type, p.columns, p.rows, p.allocated, p.is_signed, p.photometric);
  };
  return key(f) == key(g) && is_same_orientation(frame_of(files, a), frame_of(files, b)) &&
         is_same_spacing(frame_of(files, a), frame_of(files, b));
}

void sort(Slices& slices, const Files& files) {
  const bool have_places =
      std::ranges::all_of(slices, [&](const DicomSlice& slice) { return has_place(frame_of(files, slice)); });
  std::ranges::sort(slices, [&](const DicomSlice& a, const DicomSlice& b) {
    const DicomFrame &f = frame_of(files, a), &g = frame_of(files, b);
    if (have_places) {
      const double left = along_normal(f), right = along_normal(g);
      if (left != right) return left < right;
    }
    if (f.number != g.number) return f.number < g.number;
    if (a.file != b.file) return comes_before(files[a.file].path, files[b.file].path);
    return a.frame < b.frame;
  });
}

std::string name_in(const Files& files, const DicomSlice& slice) {
  const DicomFile& file = files[slice.file];
  const std::string name = file_name(file.path);
  return file.frames.size() == 1 ? name : fmt::format("{}, frame {}", name, slice.frame + 1);
}

/// Says which steps are unlike the usual one.
std::string about_steps(const std::vector<double>& steps, double usual, const Slices& slices,
                        const Files& files) {
  std::size_t unlike = 0, first = 0;
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (std::abs(steps[i] - usual) > same_step * usual && unlike++ == 0) first = i;
  if (unlike == 0) return "slices are shifted unevenly against each other";
  const auto [least, most] = std::ranges::minmax(steps);
  std::string text =
      unlike == 1
          ? fmt::format("between slices {} and {} ({} and {}) the distance is {:.6g} mm, elsewhere {:.6g} mm",
                        first, first + 1, name_in(files, slices[first]), name_in(files, slices[first + 1]),
                        steps[first], usual)
          : fmt::format("the distances between slices are not equal: {:.6g} to {:.6g} mm, mostly {:.6g} mm",
                        least, most, usual);
  double missing = 0;
  for (const double step : steps) missing += std::max(std::round(step / usual) - 1, 0.0);
  if (missing > 0)
    text += fmt::format("; {} slice{} to be missing", missing, missing == 1 ? " seems" : "s seem");
  return text;
}

/// Says where numbers of images are missing, by the steps between the others; "" if none are.
std::string about_missing_numbers(const Slices& slices, const Files& files) {
  const auto number = [&](std::size_t i) { return frame_of(files, slices[i]).number; };
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 1; i < slices.size(); ++i) least = std::min(least, number(i) - number(i - 1));
  for (std::size_t i = 1; i < slices.size(); ++i)
    if (number(i) - number(i - 1) > least)
      return fmt::format("; between numbers {} and {} ({} and {}) slices seem to be missing", number(i - 1),
                         number(i), name_in(files, slices[i - 1]), name_in(files, slices[i]));
  return "";
}

/// Why an image has no place: "; ImagePositionPatient is ...".
std::string about_place(const DicomFile& file) {
  for (const DicomNote& note : file.notes.warnings)
    if (note.about.starts_with("Image")) return "; " + note.text;
  return "";
}

/// Two images at one place, which belong to no two volumes.
std::string about_one_place(const DicomSlice& a, const DicomSlice& b, const Files& files,
                            const std::string& name) {
  const std::string both =
      fmt::format("{}: {} and {} are at the same position", name, name_in(files, a), name_in(files, b));
  const DicomFile &f = files[a.file], &g = files[b.file];
  if (a.file == b.file) return both + ", and nothing shows which frames belong together";
  if (!f.instance.empty() && f.instance == g.instance && a.frame == b.frame)
    return both + ": they are one image twice (SOPInstanceUID); remove one of them";
  const std::string differ = differences(a, b, files);
  return fmt::format(
      "{}, and nothing shows which images belong together{}; move one of them to another directory", both,
      differ.empty() ? "" : " (they differ in " + differ + ")");
}

std::string about_distance_without_places(const DicomFrame& first) {
  if (first.step != 0) return fmt::format("is what they say, {:.6g} mm", first.thickness);
  if (first.thickness > 0) return fmt::format("is a guess: their thickness, {:.6g} mm", first.thickness);
  return "is not known";
}

}  // namespace

std::vector<DicomSeries> series_of(const Files& files) {
  std::vector<Slices> groups;
  for (std::size_t file = 0; file < files.size(); ++file)
    for (std::size_t frame = 0; frame < files[file].frames.size(); ++frame) {
      const DicomSlice slice{file, frame};
      // Images of one series mostly follow each other.
      const auto group = std::ranges::find_if(groups.rbegin(), groups.rend(), [&](const Slices& g) {
        return is_of_one_series(files, g.front(), slice);
      });
      if (group != groups.rend())
        group->push_back(slice);
      else
        groups.push_back({slice});
    }
  std::vector<DicomSeries> series;
  for (Slices& group : groups) {
    sort(group, files);
    std::vector<DicomPart> parts;
    for (const DicomPart& part : parted(group, files))
      for (DicomPart& one : parted_where_interleaved(part, files)) parts.push_back(std::move(one));
    const std::string name_of_all = parts.size() > 1 ? lasting_name_of(group, files) : "";
    std::vector<std::string> names;
    for (const DicomPart& part : parts) names.push_back(lasting_name_of(part.slices, files));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const bool is_only_one = std::ranges::count(names, names[i]) == 1 && names[i] != name_of_all;
      std::string name = is_only_one ? names[i] : lasting_name_of(parts[i].slices, files, true);
      std::string words = in_words(parts[i], files);
      series.push_back({{std::move(name), std::move(words)}, std::move(parts[i].slices), name_of_all});
    }
  }
  make_distinct(series, files);
  return series;
}

namespace {

/// Throws BrokenInput if only some slices have a place, or if two have the same.
void require_places_of_their_own(const Slices& slices, const Files& files, std::size_t placed,
                                 const std::string& name) {
  if (placed != 0 && placed != slices.size()) {
    const auto without =
        std::ranges::find_if(slices, [&](const DicomSlice& s) { return !has_place(frame_of(files, s)); });
    throw BrokenInput("{}: {} of {} slices have no position, as {}{}", name, slices.size() - placed,
                      slices.size(), name_in(files, *without), about_place(files[without->file]));
  }
  if (const std::size_t i = first_of_two(slices, files); i < slices.size())
    throw BrokenInput(about_one_place(slices[i], slices[i + 1], files, name));
}

/// The distances that a file of one slice gives, in mm.
Geometry geometry_given_by(const DicomFrame& frame) {
  Geometry geometry;
  geometry.units.fill("mm");
  if (frame.spacing) {
    geometry.spacing = {(*frame.spacing)[0], (*frame.spacing)[1],
                        frame.thickness > 0 ? frame.thickness : Geometry::unknown};
    geometry.has_spacing = (*frame.spacing)[0] > 0 && (*frame.spacing)[1] > 0;
  }
  return geometry;
}

/// The distances of neighbors along the normal.
std::vector<double> steps_between(const Slices& slices, const Files& files) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < slices.size(); ++i)
    steps.push_back(along_normal(frame_of(files, slices[i])) - along_normal(frame_of(files, slices[i - 1])));
  return steps;
}

/// Sets the third direction by the positions of at least two slices. If they are not even, their positions
/// are kept.
void set_direction_of_slices(const Slices& slices, const Files& files, const std::string& name,
                             ServedVolume& volume) {
  Geometry& geometry = volume.geometry;
  const DicomFrame& first = frame_of(files, slices.front());
  const std::vector<double> steps = steps_between(slices, files);
  const double usual = median(steps);
  // From the first slice to the last one, scaled to the usual step: tilted gantries shift slices against
  // each other.
  const Vector3 whole = minus(*frame_of(files, slices.back()).position, *first.position);
  geometry.directions[2] = scaled(whole, usual / dot(whole, normal_of(first)));
  bool is_even = true;
  std::string positions;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    const Vector3& position = *frame_of(files, slices[i]).position;
    const Vector3 expected = scaled(geometry.directions[2], static_cast<double>(i));
    const double off = length(minus(minus(position, geometry.origin), expected));
    // Rounding adds up from slice to slice; a gap is larger.
    is_even = is_even && off <= same_step * usual * std::max<double>(1, static_cast<double>(i));
    positions += fmt::format("{}{} {} {}", i > 0 ? "; " : "", position[0], position[1], position[2]);
  }
  for (const double step : steps) is_even = is_even && std::abs(step - usual) <= same_step * usual;
  if (is_even) {
    geometry.directions[2] = scaled(whole, 1 / static_cast<double>(slices.size() - 1));
    return;
  }
  volume.pairs.emplace_back("slice_positions", positions);
  volume.warnings.push_back(
      fmt::format("{}: {}; the position of each slice is kept, but a mesh has equal steps", name,
                  about_steps(steps, usual, slices, files)));
}

}  // namespace

void set_places(const Slices& slices, const Files& files, const std::string& name, ServedVolume& volume) {
  const DicomFrame& first = frame_of(files, slices.front());
  const auto placed = static_cast<std::size_t>(
      std::ranges::count_if(slices, [&](const DicomSlice& s) { return has_place(frame_of(files, s)); }));
  require_places_of_their_own(slices, files, placed, name);
  Geometry& geometry = volume.geometry;
  geometry = geometry_given_by(first);
  if (placed == 0) {
    if (slices.size() > 1)
      volume.warnings.push_back(fmt::format("{}: slices have no positions; they are in the order of their "
                                            "numbers, and the distance between them {}",
                                            name, about_distance_without_places(first)) +
                                about_missing_numbers(slices, files));
    return;
  }
  if (!geometry.has_spacing) {
    volume.warnings.push_back(
        name + ": the distances between samples are not given (PixelSpacing), so their places are not known");
    geometry = {};
    return;
  }
  if (slices.size() == 1 && !(first.thickness > 0))
    volume.warnings.push_back(name + ": the thickness of the slice is not given; it is taken as 1 mm");
  geometry.space = "left-posterior-superior";
  geometry.origin = *first.position;
  geometry.has_origin = true;
  for (std::size_t axis = 0; axis < 2; ++axis)
    geometry.directions[axis] = scaled(unit_of((*first.orientation)[axis]), geometry.spacing[axis]);
  geometry.directions[2] = scaled(normal_of(first), first.thickness > 0 ? first.thickness : 1);
  if (slices.size() > 1) set_direction_of_slices(slices, files, name, volume);
  for (const std::string& doubt : doubts_of_order(slices, files))
    volume.warnings.push_back(fmt::format("{}: {}", name, doubt));
  geometry.has_directions = true;
}

namespace {

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
