#include "io/volume/series_of_files.h"

#include <fmt/format.h>

#include <utility>

#include "io/errors/errors.h"

namespace tagrid {

NumberedFiles chosen_series(const std::string& folder, std::vector<std::string> files,
                            const SourceDescription& source) {
  std::vector<NumberedFiles> series = numbered_files(std::move(files));
  if (series.empty()) throw BrokenInput(folder + ": has no files");
  if (source.series) {
    std::vector<NumberedFiles> meant;
    for (const NumberedFiles& one : series)
      if (one.pattern == source.series) meant.push_back(one);
    if (meant.size() > 1)
      throw UsageError(
          "{}: has {} series that are called {}; move the files of one of them to another directory", folder,
          meant.size(), *source.series);
    for (std::size_t i = 0; i < series.size() && meant.empty(); ++i)
      if (std::to_string(i + 1) == source.series) meant = {series[i]};
    if (meant.empty())
      throw UsageError("{}: has no series {}; without {}, the existing ones are listed", folder,
                       *source.series, Setting{"series", "this setting"});
    series = std::move(meant);
  }
  if (series.size() != 1) {
    std::vector<Choice> choices;
    for (const NumberedFiles& one : series)
      choices.push_back({one.pattern, fmt::format("{} files", one.paths.size())});
    const Sentence sentence("{}: holds {} series of files; choose one with {}, by its number or its name:",
                            folder, choices.size(), Setting{"series", "the series"});
    throw UsageError(sentence, {.subject = folder, .option = "series", .choices = std::move(choices)});
  }
  if (series.front().same) throw BrokenInput("{}: {}", folder, same_in_words(series.front()));
  return std::move(series.front());
}

void require_no_gap(const std::string& folder, const NumberedFiles& files, const SourceDescription& source) {
  if (files.gap && !source.gaps_ok)
    throw BrokenInput(fmt::format("{}: {}", folder, gap_in_words(files)), Problem::slices_missing);
}

NumberedFiles series_of_files(const std::string& folder, std::vector<std::string> files,
                              const SourceDescription& source) {
  NumberedFiles series = chosen_series(folder, std::move(files), source);
  require_no_gap(folder, series, source);
  return series;
}

}  // namespace tagrid
