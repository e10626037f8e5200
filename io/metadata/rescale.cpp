#include "io/metadata/rescale.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <set>

#include "io/text/foreign_number.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {

void add_rescale(const Rescale& rescale, KeyValues& pairs) {
  if (rescale.slope == 1 && rescale.intercept == 0) return;
  pairs.emplace_back("rescale_slope", fmt::format("{}", rescale.slope));
  pairs.emplace_back("rescale_intercept", fmt::format("{}", rescale.intercept));
  if (!rescale.units.empty()) pairs.emplace_back("rescale_units", rescale.units);
}

std::string doubt_of_rescale(const Metadata& metadata, std::int64_t slices) {
  constexpr std::string_view consequence = "what values samples mean is unknown";
  for (const auto& [key, value] : metadata.pairs()) {
    ForeignNumbers numbers;
    if (key == "rescale_slope" || key == "rescale_intercept")
      numbers = foreign_numbers(value, 1);
    else if (key == "slice_slopes" || key == "slice_intercepts")
      numbers = foreign_numbers(value, static_cast<std::size_t>(slices));
    // The program that wrote the line can read a decimal comma; this reader of the line cannot.
    if (!numbers.is_absent &&
        (!numbers.are_numbers() || std::ranges::any_of(numbers.numbers, &ForeignNumber::decimal_comma)))
      return remark_on(numbers, key, consequence);
  }
  return "";
}

std::optional<RescaleOfSlices> rescale_of_slices(const Metadata& metadata, std::int64_t slices) {
  RescaleOfSlices found;
  for (const auto& [key, value] : metadata.pairs()) {
    if (key != "slice_slopes" && key != "slice_intercepts") continue;
    auto& numbers = key == "slice_slopes" ? found.slopes : found.intercepts;
    for (const std::string_view word : words_of(value)) {
      const auto number = number_of(word);
      if (!number || !std::isfinite(*number)) return std::nullopt;
      numbers.push_back(*number);
    }
  }
  const auto wanted = static_cast<std::size_t>(slices);
  if (found.intercepts.empty()) found.intercepts.assign(wanted, 0);
  if (found.slopes.size() != wanted || found.intercepts.size() != wanted) return std::nullopt;
  return found;
}

namespace {

/// What is known of the samples alone: false for values.
bool is_of_samples(const MetadataEntry& entry) {
  constexpr std::array<std::string_view, 4> fields = {"min", "max", "old min", "old max"};
  constexpr std::array<std::string_view, 6> keys = {
      "rescale_slope:=",     "rescale_intercept:=",    applied_slope_key,
      applied_intercept_key, "metaimage_ElementMin:=", "metaimage_ElementMax:="};
  if (entry.kind == MetadataEntry::Kind::field) return std::ranges::find(fields, entry.field) != fields.end();
  return entry.kind == MetadataEntry::Kind::pair &&
         std::ranges::any_of(keys, [&](std::string_view key) { return entry.line.starts_with(key); });
}

/// Records how samples became values, those of an earlier time included.
void add_applied(const Metadata& before, MetadataEntries& entries) {
  const Rescale& rescale = before.rescale();
  const auto earlier = [&](std::string_view key, double otherwise) {
    return number_of(before.text_of(key)).value_or(otherwise);
  };
  const double slope = rescale.slope * earlier(applied_slope_key, 1),
               intercept = rescale.slope * earlier(applied_intercept_key, 0) + rescale.intercept;
  if (slope != 1) entries.add_pair(applied_slope_key, fmt::format("{}", slope));
  if (slope != 1 || intercept != 0) entries.add_pair(applied_intercept_key, fmt::format("{}", intercept));
}

}  // namespace

Metadata metadata_of_values(const Metadata& metadata) {
  const Rescale& rescale = metadata.rescale();
  MetadataEntries entries;
  constexpr std::string_view background = "vdb_background";
  for (const MetadataEntry& entry : metadata.entries()) {
    if (is_of_samples(entry)) continue;
    const bool is_pair = entry.kind == MetadataEntry::Kind::pair;
    if (is_pair && (entry.key == "slice_slopes" || entry.key == "slice_intercepts"))
      entries.add_written_pair(fmt::format("slice_applied_{}", entry.key.substr(6)), entry.value);
    else if (const auto number = is_pair && entry.key == background ? number_of(entry.value) : std::nullopt)
      entries.add_written_pair(background, fmt::format("{}", rescale.slope * *number + rescale.intercept));
    else
      entries.add(entry);
  }
  add_applied(metadata, entries);
  Metadata of_values(std::move(entries));
  of_values.set_origin(metadata.geometry().origin);
  return of_values;
}

double error_in_samples(double error, const Rescale& rescale) {
  const double slope = std::abs(rescale.slope);
  double in_samples = error / slope;
  while (in_samples * slope > error) in_samples = std::nextafter(in_samples, 0.0);
  return in_samples;
}

namespace {

bool is_of_word(char c) {
  return static_cast<unsigned char>(c) >= 0x80 || std::isalnum(static_cast<unsigned char>(c)) != 0;
}

/// Replaces `name` where it is not a part of a longer word.
void replace_name(std::string& sentence, const std::string& name, std::string_view by) {
  for (std::size_t at = 0; (at = sentence.find(name, at)) != sentence.npos;) {
    const std::size_t end = at + name.size();
    const bool begins = at == 0 || !is_of_word(name.front()) || !is_of_word(sentence[at - 1]),
               ends = end == sentence.size() || !is_of_word(name.back()) || !is_of_word(sentence[end]);
    if (begins && ends) sentence.replace(at, name.size(), by);
    at += begins && ends ? by.size() : 1;
  }
}

/// Leaves out a name that begins a sentence.
void cut_beginning(std::string& sentence, const std::string& name) {
  const std::string prefix = name + ": ";
  for (std::size_t at = 0; (at = sentence.find(prefix, at)) != sentence.npos;)
    if (at == 0 || (at > 1 && sentence.compare(at - 2, 2, "; ") == 0))
      sentence.erase(at, prefix.size());
    else
      at += prefix.size();
}

std::string without_names(std::string sentence, const NamesOfSource& names) {
  constexpr std::size_t least = 3;  // bytes; shorter ones are words of any sentence
  for (const std::string& name : names.names) cut_beginning(sentence, name);
  for (const std::string& folder : names.folders) {
    replace_name(sentence, folder + "/", "");
    if (folder.size() >= least) replace_name(sentence, folder, "its directory");
  }
  for (const std::string& file : names.files) {
    cut_beginning(sentence, file);
    if (file.size() >= least) replace_name(sentence, file, "a file");
  }
  return sentence;
}

struct Longer {
  bool operator()(const std::string& a, const std::string& b) const {
    return a.size() != b.size() ? a.size() > b.size() : a < b;
  }
};

}  // namespace

NamesOfSource names_of_source(const std::vector<std::string>& names, const std::vector<std::string>& files) {
  namespace fs = std::filesystem;
  std::set<std::string, Longer> folders, own;
  std::set<fs::path> parents;
  for (const std::string& file : files) {
    own.insert(name_of_path(file));
    parents.insert(path_of(file).parent_path());
  }
  for (const fs::path& parent : parents)
    for (fs::path folder : {parent, normal_path(absolute_path(parent))})
      for (; folder.has_relative_path(); folder = folder.parent_path())
        if (folder != "." && folder.filename() != "..") folders.insert(text_of(folder));
  NamesOfSource found{names, {folders.begin(), folders.end()}, {own.begin(), own.end()}};
  std::erase(found.names, "");
  std::erase(found.files, "");
  return found;
}

void add_doubts(const std::string& scale_doubt, const std::vector<std::string>& not_understood,
                const NamesOfSource& names, Metadata& metadata) {
  KeyValues pairs;
  if (!scale_doubt.empty() && metadata.text_of(scale_doubt_key).empty())
    pairs.emplace_back(scale_doubt_key, without_names(scale_doubt, names));
  std::string all;
  for (const std::string& sentence : not_understood)
    all += (all.empty() ? "" : "; ") + without_names(sentence, names);
  if (!all.empty() && metadata.text_of(not_understood_key).empty())
    pairs.emplace_back(not_understood_key, all);
  metadata.add_pairs(pairs);
}

std::string scale_doubt_in(const Metadata& metadata) {
  std::string doubt = metadata.text_of(scale_doubt_key);
  if (!doubt.empty() || metadata.has_slopes_of_slices()) return doubt;
  return doubt_of_rescale(metadata, 1);
}

std::vector<std::string> doubts_in(const Metadata& metadata) {
  std::vector<std::string> doubts;
  for (std::string sentence : {scale_doubt_in(metadata), metadata.text_of(not_understood_key)})
    if (!sentence.empty()) doubts.push_back(std::move(sentence));
  return doubts;
}

}  // namespace tagrid
