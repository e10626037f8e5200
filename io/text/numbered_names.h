// Names with numbers: their natural order, and files that are slices of one volume: slice001.tif,
// slice002.tif ...
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tagrid {

/// Files whose names differ in one number only, in the order of that number.
struct NumberedFiles {
  std::string pattern;  ///< their name, with # for the number: "slice#.tif"
  std::vector<std::string> paths;
  /// Two neighbors between which numbers are missing, by the steps between the others.
  std::optional<std::pair<std::string, std::string>> gap;
  /// Two files with the same number, such as a1.tif and a01.tif.
  std::optional<std::pair<std::string, std::string>> same;
  std::string missing;  ///< all numbers that are missing by the same rule: "4, 7 to 9"
};

/// Sorts files of one directory into such series, which come in natural order of their patterns. A file
/// without a number, or with a name of its own kind, is a series of one. If names differ in several numbers,
/// the last one is that of the slice. Two series have the same pattern if a file has a # in its name: a#.tif
/// beside a1.tif and a2.tif.
std::vector<NumberedFiles> numbered_files(std::vector<std::string> paths);

/// "between a2.tif and a4.tif, slices are missing by their numbers: 3". REQUIRES: a gap.
std::string gap_in_words(const NumberedFiles& files);

/// "a1.tif and a01.tif have the same number". REQUIRES: `same`.
std::string same_in_words(const NumberedFiles& files);

/// Says which of the patterns of a directory may belong to one volume, although its slices are not named like
/// that: they differ in upper and lower case, or in numbers with a decimal point, or each is a single file and
/// they differ in several numbers. "" if there are none.
std::string doubt_of_patterns(const std::vector<std::string>& patterns);

/// A name with # for each of its numbers: "a#b#.tif".
std::string number_pattern(std::string_view name);

/// True for NAME_spr.bmp and the like: a shadow projection, which SkyScan's programs put beside slices.
bool is_preview(const std::string& path);

/// True if `a` comes before `b` in natural order: digits in a row count as one number, so that slice9 comes
/// before slice10. It is an order of all texts: leading zeros count last.
bool comes_before(std::string_view a, std::string_view b);

}  // namespace tagrid
