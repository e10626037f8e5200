#include "io/formats/table/raw_directory.h"

#include <fmt/format.h>

#include <cstdint>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/samples/slices_in_files.h"
#include "io/system/files.h"
#include "io/text/numbered_names.h"

namespace tagrid {

namespace {

/// The files of the series that is asked for, or of the only one. Throws UsageError, and BrokenInput if there
/// are none.
NumberedFiles raw_series(const std::string& folder, const SourceDescription& source) {
  std::vector<NumberedFiles> series = numbered_files(visible_files(folder));
  if (series.empty()) throw BrokenInput(folder + ": has no files");
  if (!source.series.empty()) {
    std::vector<NumberedFiles> meant;
    for (const NumberedFiles& files : series)
      if (files.pattern == source.series) meant.push_back(files);
    if (meant.size() > 1)
      throw UsageError(fmt::format(
          "{}: has {} series that are called {}; move the files of one of them to another directory", folder,
          meant.size(), source.series));
    for (std::size_t i = 0; i < series.size() && meant.empty(); ++i)
      if (std::to_string(i + 1) == source.series) meant = {series[i]};
    if (meant.empty())
      throw UsageError(Sentence{"{}: has no series {}; without {}, the existing ones are listed",
                                {folder, source.series, Setting{"series", "this setting"}}});
    series = std::move(meant);
  }
  if (series.size() != 1) {
    std::vector<Choice> choices;
    for (const NumberedFiles& files : series)
      choices.push_back({files.pattern, fmt::format("{} files", files.paths.size())});
    const Sentence sentence{"{}: holds {} series of files; choose one with {}, by its number or its name:",
                            {folder, choices.size(), Setting{"series", "the series"}}};
    throw UsageError(sentence, std::move(choices));
  }
  return std::move(series.front());
}

}  // namespace

std::unique_ptr<VolumeSource> open_raw_directory(const std::string& folder, const SourceDescription& source) {
  const RawDescription& raw = *source.raw;
  NumberedFiles files = raw_series(folder, source);
  if (files.same) throw BrokenInput(fmt::format("{}: {}", folder, same_in_words(files)));
  const auto count = static_cast<std::int64_t>(files.paths.size());
  if (!sample_bytes(raw.dims, raw.type) || raw.dims.z % count != 0)
    throw BrokenInput(fmt::format("{}: {} files cannot have equal parts of {}{}", folder, count,
                                  described(raw.dims, raw.type),
                                  files.gap ? "; " + gap_in_words(files) : ""));
  // Checked last: if the parts are unequal, accepting gaps does not help.
  if (files.gap && !source.gaps_ok)
    throw BrokenInput(fmt::format("{}: {}", folder, gap_in_words(files)), Problem::slices_missing);
  const std::int64_t slices = raw.dims.z / count;
  const std::uint64_t slice = *sample_bytes({raw.dims.x, raw.dims.y, 1}, raw.type);
  std::vector<SliceRun> runs;
  for (std::size_t i = 0; i < files.paths.size(); ++i) {
    const auto status = status_of(files.paths[i]);
    const std::uint64_t wanted = raw.offset + slice * static_cast<std::uint64_t>(slices);
    if (status && status->size != wanted)
      throw BrokenInput(fmt::format("{}: has {} bytes, but {} are expected ({} of {} slices)", files.paths[i],
                                    status->size, wanted, slices, described(raw.dims, raw.type)));
    runs.push_back({i, raw.offset, slices, slice, raw.big_endian.value_or(false)});
  }
  std::vector<std::string> warnings;
  if (files.gap) warnings.push_back(fmt::format("{}: {}", folder, gap_in_words(files)));
  SourceFacts facts;
  facts.info = {raw.dims, raw.type};
  facts.files = std::move(files.paths);
  facts.warnings = std::move(warnings);
  facts.holds_other_bytes = raw.offset > 0;
  facts.headerless = true;
  return placed_samples(std::move(facts), std::move(runs));
}

}  // namespace tagrid
