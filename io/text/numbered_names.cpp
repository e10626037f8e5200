#include "io/text/numbered_names.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>

#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// A number without leading zeros.
std::string_view without_zeros(std::string_view number) {
  return number.substr(std::min(number.find_first_not_of('0'), number.size()));
}

/// Takes the digits in front of `text`, and returns them without leading zeros.
std::string_view take_number(std::string_view& text) {
  const auto end = static_cast<std::size_t>(std::ranges::find_if_not(text, is_digit) - text.begin());
  std::string_view number = text.substr(0, end);
  text.remove_prefix(end);
  return without_zeros(number);
}

/// A name as texts and numbers: "a12b.tif" is "a", "12", "b.tif". Texts have even places, numbers odd ones.
std::vector<std::string> pieces_of(std::string_view name) {
  std::vector<std::string> pieces = {""};
  for (const char c : name) {
    if (is_digit(c) != (pieces.size() % 2 == 0)) pieces.emplace_back();
    pieces.back() += c;
  }
  return pieces;
}

/// What all names of a series have in common, if piece `at` is the number of the slice.
std::string joined(std::vector<std::string> pieces, std::size_t at, const std::string& instead) {
  if (at < pieces.size()) pieces[at] = instead;
  std::string name;
  for (const std::string& piece : pieces) name += piece;
  return name;
}

/// A name with `instead` for each of its numbers.
std::string with_numbers_as(const std::string& instead, const std::vector<std::string>& pieces) {
  std::string pattern;
  for (std::size_t at = 0; at < pieces.size(); ++at) pattern += at % 2 == 0 ? pieces[at] : instead;
  return pattern;
}

bool is_number(char c) { return is_digit(c) || c == '#'; }

/// Replaces each number with a decimal point, and its sign, by /: "z-1.#mm.tif" becomes "z/mm.tif". Returns "" if
/// no number has a decimal point, or if # stands for a number without one. Numbers with several points, such as
/// UIDs, do not count.
std::string without_decimals(std::string_view pattern) {
  std::string result;
  bool is_found = false;
  while (!pattern.empty()) {
    const auto end = std::ranges::find_if_not(pattern, [](char c) { return is_number(c) || c == '.'; });
    std::string_view number = pattern.substr(0, static_cast<std::size_t>(end - pattern.begin()));
    while (number.ends_with('.')) number.remove_suffix(1);
    if (number.empty() || number.front() == '.') {
      result += pattern.front();
      pattern.remove_prefix(1);
      continue;
    }
    if (std::ranges::count(number, '.') == 1) {
      if (result.ends_with('-') || result.ends_with('+')) result.pop_back();
      result += '/';
      is_found = true;
    } else {
      if (number.find('#') != number.npos) return "";
      result += number;
    }
    pattern.remove_prefix(number.size());
  }
  return is_found ? result : "";
}

/// The last number that differs among names of the same texts. 0, which is a text, if none does.
std::size_t last_that_differs(const std::vector<std::vector<std::string>>& names) {
  std::size_t last = 0;
  for (const auto& name : names)
    for (std::size_t at = 1; at < name.size(); at += 2)
      if (name[at] != names.front()[at]) last = std::max(last, at);
  return last;
}

/// The difference of two numbers of any length; 0 if it is not small.
std::int64_t step_between(std::string_view a, std::string_view b) {
  constexpr std::size_t most_digits = 18;
  if (a.size() > most_digits || b.size() > most_digits) return 0;
  return std::stoll(std::string(b)) - std::stoll(std::string(a));
}

void find_gap(NumberedFiles& files, std::size_t at) {
  std::vector<std::int64_t> steps;
  const auto number = [&](std::size_t i) { return pieces_of(name_of_path(files.paths[i]))[at]; };
  for (std::size_t i = 1; i < files.paths.size(); ++i)
    steps.push_back(step_between(number(i - 1), number(i)));
  if (steps.empty()) return;
  for (std::size_t i = 0; i < steps.size() && !files.same; ++i)
    if (without_zeros(number(i)) == without_zeros(number(i + 1)))
      files.same = {files.paths[i], files.paths[i + 1]};
  if (files.same) return;
  const std::int64_t least = std::ranges::min(steps);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] == least) continue;
    if (!files.gap) files.gap = {files.paths[i], files.paths[i + 1]};
    // Numbers that are too long, or that are the same, have no steps.
    if (least < 1 || steps[i] < 1) continue;
    const std::int64_t from = std::stoll(number(i)) + least, to = std::stoll(number(i + 1)) - least;
    if (from <= to)
      files.missing += (files.missing.empty() ? "" : ", ") + std::to_string(from) +
                       (from == to ? "" : " to " + std::to_string(to));
  }
}

}  // namespace

bool is_preview(const std::string& path) {
  return lower_case(text_of(path_of(path).stem())).ends_with("_spr");
}

std::string gap_in_words(const NumberedFiles& files) {
  return "between " + name_of_path(files.gap->first) + " and " + name_of_path(files.gap->second) +
         ", slices are missing according to their numbers" +
         (files.missing.empty() ? "" : ": " + files.missing);
}

std::string same_in_words(const NumberedFiles& files) {
  return name_of_path(files.same->first) + " and " + name_of_path(files.same->second) +
         " have the same number, so it is unclear which one is the slice; move one of them to another "
         "directory";
}

std::string number_pattern(std::string_view name) { return with_numbers_as("#", pieces_of(name)); }

std::vector<NumberedFiles> numbered_files(std::vector<std::string> paths) {
  std::ranges::sort(paths, comes_before);
  // Names with the same texts between their numbers.
  std::map<std::string, std::vector<std::string>> alike;
  for (std::string& path : paths) {
    // A name may have a # of its own, but no slash.
    std::string texts = with_numbers_as("/", pieces_of(name_of_path(path)));
    alike[std::move(texts)].push_back(std::move(path));
  }
  std::vector<NumberedFiles> series;
  for (const auto& [texts, members] : alike) {
    std::vector<std::vector<std::string>> names;
    for (const std::string& path : members) names.push_back(pieces_of(name_of_path(path)));
    const std::size_t at = last_that_differs(names);
    std::map<std::string, NumberedFiles> by_rest;
    for (std::size_t i = 0; i < members.size(); ++i) {
      NumberedFiles& files = by_rest[joined(names[i], at > 0 ? at : names[i].size(), "#")];
      files.paths.push_back(members[i]);
    }
    for (auto& [pattern, files] : by_rest) {
      files.pattern = pattern;
      if (at > 0) find_gap(files, at);
      series.push_back(std::move(files));
    }
  }
  std::ranges::stable_sort(series, comes_before, &NumberedFiles::pattern);
  return series;
}

std::string doubt_of_patterns(const std::vector<std::string>& patterns) {
  constexpr std::size_t most_in_directory_by_chance = 2;
  std::map<std::string, std::string> by_letters;
  std::map<std::string, std::vector<std::string>> by_texts, by_decimals;
  for (const std::string& pattern : patterns) {
    if (const std::string rest = without_decimals(pattern); !rest.empty())
      by_decimals[rest].push_back(pattern);
    if (pattern.find('#') == pattern.npos) {
      // Names of series that are no names of files, such as UIDs of DICOM, have numbers of other kinds.
      const std::string extension = text_of(path_of(pattern).extension());
      if (extension.size() > 1 && std::ranges::none_of(extension, is_digit))
        by_texts[number_pattern(pattern)].push_back(pattern);
    } else if (const auto& [other, is_new] = by_letters.emplace(lower_case(pattern), pattern); !is_new) {
      return other->second + " and " + pattern +
             " differ in upper and lower case only; if they are one volume, give its slices the same "
             "extension";
    }
  }
  for (const auto& [rest, names] : by_decimals)
    if (names.size() > most_in_directory_by_chance &&
        std::ranges::any_of(names, [](const std::string& name) { return name.find('#') != name.npos; }))
      return names.front() + " and " + std::to_string(names.size() - 1) +
             " others differ in numbers with a decimal point; if they are slices of one volume, give them "
             "names, or links, that differ in one whole number only";
  for (const auto& [texts, names] : by_texts)
    if (names.size() > most_in_directory_by_chance && numbered_files(names).size() == names.size())
      return names.front() + " and " + std::to_string(names.size() - 1) +
             " other files differ in several numbers; if they are slices of one volume, give them names, or "
             "links, that differ in one number only";
  return "";
}

bool comes_before(std::string_view a, std::string_view b) {
  std::string_view x = a, y = b;
  while (!x.empty() && !y.empty()) {
    if (is_digit(x.front()) && is_digit(y.front())) {
      const std::string_view m = take_number(x), n = take_number(y);
      if (m.size() != n.size()) return m.size() < n.size();
      if (m != n) return m < n;
    } else {
      if (x.front() != y.front())
        return static_cast<unsigned char>(x.front()) < static_cast<unsigned char>(y.front());
      x.remove_prefix(1);
      y.remove_prefix(1);
    }
  }
  if (x.empty() != y.empty()) return x.empty();
  return a < b;
}

}  // namespace tagrid
