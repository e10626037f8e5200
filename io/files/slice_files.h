// The files that hold the slices of a volume: those of a directory, or those that a header names by a
// pattern.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// The regular files of a directory in natural order: without hidden ones and those of deeper folders. Links
/// to files count, and so do those that lead nowhere: a lost slice must not look as if it had never existed.
/// Throws WorldError.
std::vector<std::string> visible_files(const std::string& folder);

/// Names of numbered files as headers write them: "slice%03d.raw".
struct FilePattern {
  std::string before, after;  ///< what stands before and after the number
  int width = 0;              ///< of the number at least
  bool zeros = false;         ///< "007" instead of "  7"

  std::string name(std::int64_t number) const;
  /// The names of the numbers from `first` to `last`. Throws BrokenInput if the step does not lead there, or
  /// if there would be more names than `most`.
  std::vector<std::string> names(std::int64_t first, std::int64_t last, std::int64_t step,
                                 std::int64_t most) const;
};

/// Parses a pattern such as "slice%03d.raw", with the %d, %i or %u of printf(). Returns nothing for other
/// names.
/// Throws BrokenInput if the number is to have more than 999 digits.
std::optional<FilePattern> file_pattern(std::string_view name);

}  // namespace tagrid
