#include "tools/formats/dicom/interleaved.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>

#include "io/text/text.h"
#include "tools/formats/stored_samples.h"

namespace tagrid {
namespace {

using Files = std::vector<DicomFile>;
using Slices = std::vector<DicomSlice>;
using Parts = std::vector<DicomPart>;

/// A step of more than this times the usual one leaves room for slices of others.
constexpr double hole = 1.5;

/// Times of phases. MR scanners may also acquire the slices of one volume at alternating ones.
constexpr std::array<std::string_view, 2> phase_times = {"TriggerTime", "NominalCardiacTriggerDelayTime"};
/// Times of acquisition.
constexpr std::array<std::string_view, 3> times = {"AcquisitionDateTime", "AcquisitionTime",
                                                   "FrameAcquisitionDateTime"};

bool is_among(std::string_view name, auto& names) { return std::ranges::find(names, name) != names.end(); }

bool is_mr(const Slices& slices, const Files& files) { return files[slices.front().file].is_mr; }

bool has_two_values(std::size_t moment, const Slices& slices, const Files& files) {
  const DicomValue first = value_of(files, slices.front(), moment);
  return std::ranges::any_of(slices, [&](const DicomSlice& slice) {
    const DicomValue value = value_of(files, slice, moment);
    return value < first || first < value;
  });
}

/// True if slices of a part lie between neighbors of another one. `slices` are those of all parts, sorted.
bool are_interleaved(const Parts& parts, const Slices& slices, const Files& files) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> part_of;
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (const DicomSlice& slice : parts[i].slices) part_of[{slice.file, slice.frame}] = i;
  std::vector<std::vector<std::size_t>> numbers(parts.size());  // of the slices of each part
  std::vector<std::size_t> owners;
  std::vector<double> places;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    owners.push_back(part_of[{slices[i].file, slices[i].frame}]);
    numbers[owners.back()].push_back(i);
    places.push_back(along_normal(frame_of(files, slices[i])));
  }
  for (const std::vector<std::size_t>& own : numbers) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < own.size(); ++i) steps.push_back(places[own[i]] - places[own[i - 1]]);
    if (steps.empty()) continue;
    const double usual = median(steps);
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (steps[i] > hole * usual) continue;
      for (std::size_t between = own[i] + 1; between < own[i + 1]; ++between)
        if (numbers[owners[between]].size() > 1) return true;
    }
  }
  return false;
}

/// The parts by an attribute, if they are interleaved.
std::optional<Parts> interleaved_by(std::size_t moment, const Slices& slices, const Files& files) {
  if (!has_two_values(moment, slices, files)) return std::nullopt;
  Parts parts = parted_by({moment}, slices, files);
  if (parts.size() >= slices.size() || !are_interleaved(parts, slices, files)) return std::nullopt;
  return parts;
}

bool all_have_places(const Slices& slices, const Files& files) {
  return std::ranges::all_of(slices, [&](const auto& slice) { return has_place(frame_of(files, slice)); });
}

/// The slices before and after the longest pause; nothing if times are not numbers.
std::optional<std::array<DicomPart, 2>> parted_by_pause(std::size_t moment, const Slices& slices,
                                                        const Files& files) {
  std::vector<double> values;
  for (const DicomSlice& slice : slices) {
    const DicomValue value = value_of(files, slice, moment);
    if (!value.is_number()) return std::nullopt;
    values.push_back(value.number);
  }
  std::ranges::sort(values);
  double pause = 0, after = 0;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (values[i] - values[i - 1] > pause) pause = values[i] - values[i - 1], after = values[i];
  if (pause == 0) return std::nullopt;
  std::array<DicomPart, 2> parts;
  for (const DicomSlice& slice : slices)
    parts[value_of(files, slice, moment).number >= after ? 1 : 0].slices.push_back(slice);
  for (DicomPart& part : parts) {
    const auto [least, most] = std::ranges::minmax_element(
        part.slices, [](const DicomValue& a, const DicomValue& b) { return a < b; },
        [&](const DicomSlice& slice) { return value_of(files, slice, moment); });
    const std::string_view low = trimmed(value_of(files, *least, moment).text),
                           high = trimmed(value_of(files, *most, moment).text);
    part.told_by = low == high ? std::string(low) : fmt::format("{} to {}", low, high);
  }
  return parts;
}

}  // namespace

std::vector<DicomPart> parted_where_interleaved(const DicomPart& part, const Files& files) {
  const Slices& slices = part.slices;
  if (slices.size() < 4 || !all_have_places(slices, files) || first_of_two(slices, files) < slices.size())
    return {part};
  std::optional<Parts> best;
  for (std::size_t moment = 0; moment < count_of_moments(); ++moment) {
    const bool is_phase = is_among(name_of_moment(moment), phase_times);
    if (is_phase ? is_mr(slices, files) : grows_from_slice_to_slice(moment)) continue;
    auto parts = interleaved_by(moment, slices, files);
    if (parts && (!best || parts->size() < best->size())) best = std::move(parts);
  }
  if (!best) return {part};
  Parts finer;
  for (DicomPart& one : *best) {
    one.told_by = (part.told_by.empty() ? "" : part.told_by + ", ") + one.told_by;
    for (DicomPart& deeper : parted_where_interleaved(one, files)) finer.push_back(std::move(deeper));
  }
  return finer;
}

std::vector<std::string> doubts_of_order(const Slices& slices, const Files& files) {
  std::vector<std::string> doubts;
  const bool may_alternate = is_mr(slices, files);
  for (std::size_t moment = 0; moment < count_of_moments(); ++moment) {
    const std::string_view name = name_of_moment(moment);
    if (name == "FrameOfReferenceUID" && has_two_values(moment, slices, files))
      doubts.push_back(
          "slices have different coordinate systems (FrameOfReferenceUID), so their places may not fit "
          "together");
    if (may_alternate && is_among(name, phase_times))
      if (const auto parts = interleaved_by(moment, slices, files))
        doubts.push_back(fmt::format(
            "slices of {} and of {} lie between each other; if they are phases, this is not one volume",
            parts->front().told_by, parts->back().told_by));
    if (!may_alternate && is_among(name, times) && has_two_values(moment, slices, files))
      if (const auto parts = parted_by_pause(moment, slices, files);
          parts && are_interleaved({parts->begin(), parts->end()}, slices, files))
        doubts.push_back(fmt::format(
            "slices of {} {} and of {} lie between each other; if they are two acquisitions, this is not "
            "one volume",
            name, (*parts)[0].told_by, (*parts)[1].told_by));
  }
  return doubts;
}

}  // namespace tagrid
