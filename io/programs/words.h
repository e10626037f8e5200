// Options of a request, and lists in answers.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "io/text/text.h"

namespace tagrid {

/// The value of an option; "" if it is not given.
inline std::string option(const std::map<std::string, std::string>& options, const std::string& name) {
  const auto found = options.find(name);
  return found == options.end() ? "" : found->second;
}

/// What follows the last slash.
inline std::string file_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

/// "a, b, c and 4 more": at most `most` of them.
template <class T>
std::string listed(const std::vector<T>& all, std::size_t most) {
  const std::size_t some = std::min(all.size(), most);
  std::string text =
      fmt::format("{}", fmt::join(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(some), ", "));
  return some == all.size() ? text : fmt::format("{} and {} more", text, all.size() - some);
}

/// Attributes by which netCDF says that it rounded samples, and the words for this loss.
inline constexpr std::pair<const char*, const char*> lossy_attributes[] = {
    {"_QuantizeBitGroomNumberOfSignificantDigits", "netCDF, BitGroom"},
    {"_QuantizeGranularBitRoundNumberOfSignificantDigits", "netCDF, Granular BitRound"},
    {"_QuantizeBitRoundNumberOfSignificantBits", "netCDF, BitRound"}};

/// About the attribute of netCDF that says which number stands for missing samples
/// (https://cfconventions.org).
inline std::string about_missing_samples(const std::string& object, const std::string& number,
                                         const std::string& attribute) {
  return fmt::format(
      "{}: samples that are {}, if there are any, stand for missing ones ({}); they are encoded like all "
      "others, so that an error makes other numbers of them, which nobody can tell from measurements",
      object, number, attribute);
}

/// About the attribute `_Unsigned` of netCDF, by which integers have another sign than their type; "" if they
/// have the sign of their type.
inline std::string about_other_sign(const std::string& object, const std::string& text, bool is_signed) {
  const std::string word = lower_case(text);
  if ((word != "true" || !is_signed) && (word != "false" || is_signed)) return "";
  return fmt::format(
      "{}: _Unsigned is {}, but samples are {}signed integers, and are kept as they are; how values follow "
      "from samples is not known",
      object, quoted(std::string_view(text)), is_signed ? "" : "un");
}

}  // namespace tagrid
