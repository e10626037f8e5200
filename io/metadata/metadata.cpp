#include "io/metadata/metadata.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "io/errors/errors.h"
#include "io/metadata/fields.h"
#include "io/metadata/rescale.h"
#include "io/metadata/text.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

std::string unescaped(std::string_view written) {
  std::string text;
  for (std::string_view rest = written; !rest.empty(); rest.remove_prefix(1)) {
    const bool is_escape = rest[0] == '\\' && rest.size() > 1 && (rest[1] == 'n' || rest[1] == '\\');
    if (is_escape) rest.remove_prefix(1);
    text += is_escape && rest[0] == 'n' ? '\n' : rest[0];
  }
  return text;
}

MetadataEntries entries_of(const Geometry& geometry, const KeyValues& pairs) {
  MetadataEntries entries;
  add_fields(geometry, entries);
  for (const auto& [key, text] : pairs) entries.add_pair(key, text);
  return entries;
}

}  // namespace

Metadata::Metadata(MetadataEntries entries)
    : entries_(std::move(entries)), geometry_(geometry_of_fields(entries_)) {
  find_rescale();
}

Metadata::Metadata(const Geometry& geometry, const KeyValues& pairs)
    : Metadata(entries_of(geometry, pairs)) {}

std::optional<std::string> Metadata::value(std::string_view key) const {
  std::optional<std::string_view> written;
  for (const MetadataEntry& entry : entries_)
    if (entry.kind == MetadataEntry::Kind::pair && entry.key == key) written = entry.value;
  if (!written) return std::nullopt;
  return unescaped(*written);
}

KeyValues Metadata::pairs() const {
  KeyValues pairs;
  std::map<std::string_view, std::size_t> places;
  for (const MetadataEntry& entry : entries_) {
    if (entry.kind != MetadataEntry::Kind::pair) continue;
    if (const auto [place, is_new] = places.try_emplace(entry.key, pairs.size()); is_new)
      pairs.emplace_back(entry.key, unescaped(entry.value));
    else
      pairs[place->second].second = unescaped(entry.value);
  }
  return pairs;
}

void Metadata::add_pairs(const KeyValues& pairs) {
  for (const auto& [key, text] : pairs) entries_.add_pair(key, text);
  find_rescale();
}

void Metadata::add_written_pair(std::string_view key, std::string_view value) {
  entries_.add_written_pair(key, value);
  find_rescale();
}

void Metadata::erase(std::string_view key) {
  MetadataEntries others;
  for (const MetadataEntry& entry : entries_)
    if (entry.kind != MetadataEntry::Kind::pair || entry.key != key) others.add(entry);
  entries_ = std::move(others);
  find_rescale();
}

void Metadata::find_rescale() {
  rescale_ = {};
  const auto slope = value("rescale_slope"), intercept = value("rescale_intercept"),
             slopes = value("slice_slopes");
  has_slopes_of_slices_ = slopes.has_value();
  if (!slopes) {
    Rescale given;
    if (slope) given.slope = number_of(*slope).value_or(0);
    if (intercept) given.intercept = number_of(*intercept).value_or(NAN);
    given.units = text_of("rescale_units");
    const bool is_valid = std::isfinite(given.slope) && given.slope != 0 && std::isfinite(given.intercept);
    if (is_valid) rescale_ = std::move(given);
  }
  largest_slope_ = 0;
  const std::string list = slopes.value_or("");
  for (const std::string_view word : words_of(list))
    if (const auto number = number_of(word); number && std::isfinite(*number))
      largest_slope_ = std::max(largest_slope_, std::abs(*number));
  if (largest_slope_ == 0) largest_slope_ = std::abs(rescale_.slope);
}

Rescale Metadata::rescale_of_bounds() const {
  return has_slopes_of_slices_ ? Rescale{.slope = largest_slope_, .intercept = 0} : rescale_;
}

KeyValues pairs_without_places(const Metadata& metadata) {
  KeyValues pairs = metadata.pairs();
  std::erase_if(pairs, [](const auto& pair) { return pair.first == "slice_positions"; });
  return pairs;
}

void add_text(std::string_view text, MetadataEntries& entries) {
  // Otherwise a header that contains these lines would not give them back.
  if (!text.empty() && (!text.ends_with('\n') || text.find("\r\n") != text.npos))
    throw BrokenInput("NRRD header: lines here must end with a single line feed");
  while (!text.empty()) entries.add_line(take_line(text));
}

Metadata parse_metadata(std::string_view text) {
  MetadataEntries entries;
  add_text(text, entries);
  return Metadata(std::move(entries));
}

const std::string& text_of(const Metadata& metadata) { return metadata.entries().text(); }

}  // namespace tagrid
