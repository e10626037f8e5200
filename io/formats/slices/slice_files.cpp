#include "io/formats/slices/slice_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/formats/vendors/sections.h"
#include "io/programs/words.h"
#include "io/text/foreign_number.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t longest_log = 1 << 20;

std::vector<std::string> files_in(const std::string& folder, const std::vector<std::string>& extensions) {
  std::vector<std::string> files = visible_files(folder);
  std::erase_if(files, [&](const std::string& path) {
    return std::ranges::find(extensions, extension_of(path)) == extensions.end();
  });
  if (std::ranges::any_of(files, [](const std::string& path) { return !is_preview(path); }))
    std::erase_if(files, is_preview);
  if (files.empty())
    throw BrokenInput("{}: is a directory without files whose names end in {}", folder,
                      fmt::join(extensions, ", "));
  return files;
}

}  // namespace

std::vector<NumberedFiles> series_of_slices(const std::string& folder,
                                            const std::vector<std::string>& extensions) {
  return numbered_files(files_in(folder, extensions));
}

Choice choice_of(const NumberedFiles& files) { return {files.pattern, counted(files.paths.size(), "file")}; }

void require_no_gap(const std::string& folder, const NumberedFiles& files, const ReaderOptions& options) {
  if (files.same) throw BrokenInput("{}: {}", folder, same_in_words(files));
  if (files.gap && option(options, "gaps-ok").empty())
    throw BrokenInput(fmt::format("{}: {}", folder, gap_in_words(files)), Problem::slices_missing);
}

NumberedFiles slice_files(const std::string& folder, const std::vector<std::string>& extensions,
                          const ReaderOptions& options) {
  std::vector<NumberedFiles> series = series_of_slices(folder, extensions);
  std::vector<Choice> choices;
  for (const NumberedFiles& files : series) choices.push_back(choice_of(files));
  NumberedFiles& files = series[chosen(folder, "series", option(options, "series"), choices)];
  require_no_gap(folder, files, options);
  return std::move(files);
}

void add_warning_of_gaps(const std::string& folder, const NumberedFiles& files,
                         std::vector<std::string>& warnings) {
  if (files.gap) warnings.push_back(fmt::format("{}: {}", folder, gap_in_words(files)));
}

void add_bytes_after(const std::vector<BytesAfter>& files, std::vector<std::string>& warnings) {
  if (files.empty()) return;
  const std::string others = files.size() == 2 ? "; likewise in another file"
                             : files.size() > 2
                                 ? fmt::format("; likewise in {} other files", files.size() - 1)
                                 : "";
  warnings.push_back(fmt::format("{}: {} bytes follow the samples; they are not part of the volume{}",
                                 files.front().path, files.front().bytes, others));
}

namespace {

bool is_resolution_of_paper(double dots_per_inch) {
  constexpr std::array usual = {72,  75,  90,  96,  100, 120, 144, 150, 180, 192,  200, 220,
                                240, 250, 288, 300, 350, 360, 400, 600, 720, 1200, 2400};
  // In dots per centimeter or meter they are rounded: 118 for 300 dpi.
  constexpr double rounding = 2e-3;
  return std::ranges::any_of(usual,
                             [&](int dots) { return std::abs(dots_per_inch - dots) <= rounding * dots; });
}

}  // namespace

SpacingOfSlice spacing_of_resolution(double x, double y, double millimeters) {
  constexpr double inch = 25.4;
  SpacingOfSlice found;
  if (x == 1 && y == 1) return found;
  if (is_resolution_of_paper(x * inch / millimeters) && is_resolution_of_paper(y * inch / millimeters)) {
    found.remark =
        fmt::format("its resolution of {:.4g} dpi is treated as a print resolution, not as a voxel size",
                    x * inch / millimeters);
    return found;
  }
  for (const double resolution : {x, y})
    if (!(resolution > 0) || !std::isfinite(millimeters / resolution) || millimeters / resolution == 0) {
      found.remark = fmt::format("its resolution of {} x {} is not usable, so its spacing is unknown", x, y);
      return found;
    }
  found.geometry.spacing = {millimeters / x, millimeters / y, Geometry::unknown};
  found.geometry.has_spacing = true;
  found.geometry.units.fill("mm");
  return found;
}

void ResolutionOfSlices::add(double x, double y) {
  const std::pair resolution(x, y);
  if (!first_) first_ = resolution;
  are_same_ = are_same_ && resolution == *first_;
}

void ResolutionOfSlices::describe(const std::string& file, double millimeters, Geometry& geometry,
                                  std::vector<std::string>& warnings) const {
  if (!are_same_) {
    warnings.push_back(file + ": its slices have different resolutions, so its spacing is unknown");
    return;
  }
  if (!first_ || first_->first == 0 || first_->second == 0) return;
  SpacingOfSlice found = spacing_of_resolution(first_->first, first_->second, millimeters);
  geometry = std::move(found.geometry);
  if (!found.remark.empty()) warnings.push_back(fmt::format("{}: {}", file, found.remark));
}

namespace {

/// What the file says; nothing if it has no reconstruction. Other sections speak of the camera.
std::optional<SliceLog> read_log(const std::string& path) {
  FileBytes file(path);
  if (file.size().value_or(0) > longest_log) return std::nullopt;
  const Sections sections = read_sections(file);
  const auto field = [&](const char* key) {
    const auto found = sections.find(key);
    return found == sections.end() ? ForeignNumber{} : foreign_number(std::string_view(found->second));
  };
  ForeignNumber size = field("reconstruction/pixel size (um)");
  SliceLog log;
  const bool is_of_reconstruction = std::ranges::any_of(
      sections, [](const auto& entry) { return entry.first.starts_with("reconstruction/"); });
  if (size.is_absent() && is_of_reconstruction) {
    // Programs may leave out the size of voxels. Unless they are binned, it is that of the pixels.
    size = field("acquisition/image pixel size (um)");
    log.warnings.push_back(fmt::format(
        "the section Reconstruction has no Pixel Size (um); Image Pixel Size (um) = {} is used instead",
        size.text));
  }
  if (size.is_absent()) return std::nullopt;
  log.path = path;
  const auto is_good = [&](const ForeignNumber& number, const char* name, double least, const char* unknown) {
    if (number.is_unreadable() || number.decimal_comma)
      log.warnings.push_back(remark_on(number, name, unknown));
    if (number.is_number() && number.value < least)
      log.warnings.push_back(fmt::format("{} is {}; {}", name, number.text, unknown));
    return number.is_number() && number.value >= least;
  };
  constexpr double tiny = std::numeric_limits<double>::min();
  const bool has_size = is_good(size, "Pixel Size (um)", tiny, "the spacing is unknown");
  // Not all sections may have been saved.
  const ForeignNumber step = field("reconstruction/section to section step");
  const bool has_step = step.is_absent() ||
                        is_good(step, "Section to Section Step", 1, "the distance between slices is unknown");
  if (has_size) {
    log.geometry.spacing.fill(size.value);
    log.geometry.spacing[2] = has_step ? size.value * step.value_or(1) : Geometry::unknown;
  }
  log.geometry.has_spacing = has_size;
  if (has_size) log.geometry.units.fill("um");
  for (const auto& [key, value] : sections)
    if (!value.empty()) log.pairs.emplace_back("skyscan_" + key, value);
  return log;
}

}  // namespace

SliceLog log_of_slices(const std::string& folder, const NumberedFiles& slices) {
  std::vector<SliceLog> logs;
  for (const std::string& path : visible_files(folder))
    if (extension_of(path) == ".log")
      if (auto log = read_log(path)) logs.push_back(std::move(*log));
  // The longest name that fits: scan2.log rather than scan.log.
  std::size_t longest = 0;
  const SliceLog* own = logs.size() == 1 ? &logs.front() : nullptr;
  for (const SliceLog& log : logs) {
    const std::string stem = text_of(path_of(log.path).stem());
    if (!slices.pattern.starts_with(stem) || stem.size() <= longest) continue;
    longest = stem.size();
    own = &log;
  }
  return own == nullptr ? SliceLog{} : *own;
}

void include_log(SliceLog log, Geometry& geometry, KeyValues& pairs, std::vector<std::string>& files,
                 std::vector<std::string>& warnings) {
  if (log.path.empty()) return;
  for (const std::string& sentence : log.warnings)
    warnings.push_back(fmt::format("{}: {}", log.path, sentence));
  geometry = std::move(log.geometry);
  pairs.insert(pairs.end(), log.pairs.begin(), log.pairs.end());
  files.push_back(std::move(log.path));
}

std::pair<std::string, std::string> pair_of(const NumberedFiles& files) {
  return {"slice files", fmt::format("{} to {} ({})", file_name(files.paths.front()),
                                     file_name(files.paths.back()), files.paths.size())};
}

}  // namespace tagrid
