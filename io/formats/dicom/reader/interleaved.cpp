#include "io/formats/dicom/reader/interleaved.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "io/programs/stored_samples.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Files = std::vector<DicomFile>;
using Slices = std::vector<DicomSlice>;
using Parts = std::vector<DicomPart>;

/// A step that is larger than the usual one by this factor leaves room for slices of another
/// acquisition.
constexpr double hole = 1.5;
/// Steps that differ by less, relative to the usual one, are equal.
constexpr double even_enough = 0.05;
/// Numbers with a smaller relative difference are equal; for tilts, the difference is in degrees.
constexpr double same_value = 1e-3, same_tilt = 0.05;

/// Times of phases. MR scanners may also acquire the slices of one volume at alternating ones.
constexpr std::array<std::string_view, 2> phase_times = {"TriggerTime", "NominalCardiacTriggerDelayTime"};
/// Times of acquisition.
constexpr std::array<std::string_view, 3> times = {"AcquisitionDateTime", "AcquisitionTime",
                                                   "FrameAcquisitionDateTime"};

/// Attributes that differ between the passes in which MR scanners acquire one volume, such as every
/// second slice.
constexpr std::array<std::string_view, 3> passes = {"AcquisitionNumber", "FrameAcquisitionNumber",
                                                    "InversionTime"};

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

/// True if two values differ only by rounding. Whole numbers are often counts, so numbers that
/// differ by 1 are different.
bool are_close(std::size_t moment, const DicomValue& a, const DicomValue& b) {
  if (!a.is_number() || !b.is_number()) return !(a < b || b < a);
  const double apart = std::abs(a.number - b.number);
  if (name_of_moment(moment) == "GantryDetectorTilt") return apart <= same_tilt;
  const bool are_whole = a.number == std::round(a.number) && b.number == std::round(b.number);
  return apart <= (are_whole ? 0 : same_value * std::abs(b.number));
}

/// "of EchoTime 2.46", "without EchoTime".
std::string which_are(const DicomPart& part) {
  return (part.told_by.starts_with("without ") ? "" : "of ") + part.told_by;
}

/// The parts by an attribute; values that were rounded are one.
Parts parted_by_value(std::size_t moment, const Slices& slices, const Files& files) {
  Parts parts = parted_by({moment}, slices, files);
  std::map<DicomValue, std::size_t> part_of;
  Parts merged;
  const DicomValue* last = nullptr;
  for (const DicomPart& part : parts) {
    const DicomValue value = value_of(files, part.slices.front(), moment);
    if (last == nullptr || !are_close(moment, *last, value)) merged.push_back({{}, part.told_by});
    last = &part_of.emplace(value, merged.size() - 1).first->first;
  }
  for (const DicomSlice& slice : slices)
    merged[part_of[value_of(files, slice, moment)]].slices.push_back(slice);
  return merged;
}

/// The parts by an attribute, if they are interleaved.
std::optional<Parts> interleaved_by(std::size_t moment, const Slices& slices, const Files& files) {
  if (!has_two_values(moment, slices, files)) return std::nullopt;
  Parts parts = parted_by_value(moment, slices, files);
  if (parts.size() < 2 || parts.size() >= slices.size() || !are_interleaved(parts, slices, files))
    return std::nullopt;
  return parts;
}

/// The step of slices at equal distances; nothing if these differ. REQUIRES: two slices or more.
std::optional<double> even_step(const Slices& slices, const Files& files) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < slices.size(); ++i)
    steps.push_back(along_normal(frame_of(files, slices[i])) - along_normal(frame_of(files, slices[i - 1])));
  const double usual = median(steps);
  for (const double step : steps)
    if (std::abs(step - usual) > even_enough * usual) return std::nullopt;
  return usual;
}

/// True if interleaved parts are probably one volume: all slices together have equal steps, and the
/// attribute does not identify an acquisition. If they were several acquisitions, each would have
/// equal steps of the same size.
bool are_rather_one(std::size_t moment, const Parts& parts, const Slices& slices, const Files& files) {
  if (!even_step(slices, files)) return false;
  const std::string_view name = name_of_moment(moment);
  if (is_mr(slices, files) && is_among(name, passes)) return true;
  // Scanners leave attributes out; but images before the contrast agent have none.
  if (parts.size() == 2 && name != "ContrastBolusAgent")
    for (const DicomPart& part : parts)
      if (value_of(files, part.slices.front(), moment).text.empty()) return true;
  std::optional<double> first;
  for (const DicomPart& part : parts) {
    if (part.slices.size() < 2) continue;
    const auto step = even_step(part.slices, files);
    if (!step || (first && std::abs(*step - *first) > even_enough * *first)) return true;
    first = step;
  }
  return false;
}

bool all_have_places(const Slices& slices, const Files& files) {
  return std::ranges::all_of(slices, [&](const auto& slice) { return has_place(frame_of(files, slice)); });
}

/// The slices in the order of their times, split where the scan returns to positions that it has
/// passed: one part for each sweep. Nothing if times are not numbers.
std::optional<Parts> parted_by_sweep(std::size_t moment, const Slices& slices, const Files& files) {
  std::map<DicomValue, std::vector<std::size_t>> by_time;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    const DicomValue value = value_of(files, slices[i], moment);
    if (!value.is_number()) return std::nullopt;
    by_time[value].push_back(i);
  }
  Parts parts;
  std::vector<std::size_t> sweep_of(slices.size());
  std::size_t low = 0, high = 0;
  std::string_view begin;
  for (const auto& [time, those] : by_time) {
    const std::string_view text = trimmed(time.text);
    if (parts.empty() || (those.front() < high && low < those.back()))
      parts.emplace_back(), begin = text, low = those.front(), high = those.back();
    low = std::min(low, those.front()), high = std::max(high, those.back());
    parts.back().told_by = begin == text ? std::string(text) : fmt::format("{} to {}", begin, text);
    for (const std::size_t i : those) sweep_of[i] = parts.size() - 1;
  }
  for (std::size_t i = 0; i < slices.size(); ++i) parts[sweep_of[i]].slices.push_back(slices[i]);
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
    if (parts && are_rather_one(moment, *parts, slices, files)) continue;
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
          "slices have different coordinate systems (FrameOfReferenceUID), so their positions may not fit "
          "together");
    if (is_among(name, phase_times) ? may_alternate : !grows_from_slice_to_slice(moment))
      if (const auto parts = interleaved_by(moment, slices, files))
        doubts.push_back(
            fmt::format("slices {} and {} are interleaved; if they are {}, this is not one volume",
                        which_are(parts->front()), which_are(parts->back()),
                        is_among(name, phase_times) ? "phases" : "several acquisitions"));
    if (!may_alternate && is_among(name, times) && has_two_values(moment, slices, files))
      if (const auto parts = parted_by_sweep(moment, slices, files);
          parts && parts->size() > 1 && are_interleaved(*parts, slices, files))
        doubts.push_back(fmt::format(
            "slices of {} {} and of {} are interleaved; if they are two acquisitions, this is not one volume",
            name, (*parts)[0].told_by, (*parts)[1].told_by));
  }
  return doubts;
}

}  // namespace tagrid
