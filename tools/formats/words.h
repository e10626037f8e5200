// Options of a request, and lists in answers.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

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

}  // namespace tagrid
