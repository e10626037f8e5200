#include "io/metadata/rescale.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/metadata/fields.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

namespace tagrid {

Rescale rescale_of(std::string_view nrrd_fields) {
  Rescale rescale;
  for (const auto& [key, value] : key_values_of(nrrd_fields)) {
    if (key == "slice_slopes") return {};
    if (key == "rescale_slope") rescale.slope = number_of(value).value_or(0);
    if (key == "rescale_intercept") rescale.intercept = number_of(value).value_or(NAN);
    if (key == "rescale_units") rescale.units = value;
  }
  const bool valid = std::isfinite(rescale.slope) && rescale.slope != 0 && std::isfinite(rescale.intercept);
  return valid ? rescale : Rescale{};
}

bool has_slopes_of_slices(std::string_view nrrd_fields) {
  return std::ranges::any_of(key_values_of(nrrd_fields),
                             [](const auto& pair) { return pair.first == "slice_slopes"; });
}

double largest_slope(std::string_view nrrd_fields) {
  double largest = 0;
  for (const auto& [key, value] : key_values_of(nrrd_fields))
    if (key == "slice_slopes")
      for (const std::string_view word : words_of(value))
        if (const auto slope = number_of(word); slope && std::isfinite(*slope))
          largest = std::max(largest, std::abs(*slope));
  return largest > 0 ? largest : std::abs(rescale_of(nrrd_fields).slope);
}

Rescale rescale_of_bounds(std::string_view nrrd_fields) {
  return has_slopes_of_slices(nrrd_fields) ? Rescale{.slope = largest_slope(nrrd_fields), .intercept = 0}
                                           : rescale_of(nrrd_fields);
}

std::string doubt_of_rescale(std::string_view nrrd_fields, std::int64_t slices) {
  constexpr std::string_view consequence = "what values samples mean is unknown";
  for (const auto& [key, value] : key_values_of(nrrd_fields)) {
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

std::optional<RescaleOfSlices> rescale_of_slices(std::string_view nrrd_fields, std::int64_t slices) {
  RescaleOfSlices found;
  for (const auto& [key, value] : key_values_of(nrrd_fields)) {
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
bool is_of_samples(const NrrdLine& line) {
  constexpr std::array<std::string_view, 4> fields = {"min", "max", "old min", "old max"};
  constexpr std::array<std::string_view, 6> keys = {
      "rescale_slope:=",     "rescale_intercept:=",    applied_slope_key,
      applied_intercept_key, "metaimage_ElementMin:=", "metaimage_ElementMax:="};
  if (line.kind == NrrdLine::Kind::field) return std::ranges::find(fields, line.field) != fields.end();
  return line.kind == NrrdLine::Kind::key_value &&
         std::ranges::any_of(keys, [&](std::string_view key) { return line.text.starts_with(key); });
}

/// The lines that tell how samples became values, those of an earlier time included.
std::string lines_of_applied(std::string_view nrrd_fields, const Rescale& rescale) {
  const auto before = [&](std::string_view key, double otherwise) {
    return number_of(text_of_key(nrrd_fields, key)).value_or(otherwise);
  };
  const double slope = rescale.slope * before(applied_slope_key, 1),
               intercept = rescale.slope * before(applied_intercept_key, 0) + rescale.intercept;
  std::string lines;
  if (slope != 1) lines += fmt::format("{}:={}\n", applied_slope_key, slope);
  if (slope != 1 || intercept != 0) lines += fmt::format("{}:={}\n", applied_intercept_key, intercept);
  return lines;
}

}  // namespace

std::string fields_of_values(std::string_view nrrd_fields) {
  const Rescale rescale = rescale_of(nrrd_fields);
  std::string lines;
  constexpr std::string_view background = "vdb_background:=";
  for (const NrrdLine& parsed : nrrd_lines(nrrd_fields)) {
    if (is_of_samples(parsed)) continue;
    const std::string_view line = parsed.text;
    if (line.starts_with("slice_slopes:=") || line.starts_with("slice_intercepts:="))
      lines.append("slice_applied_").append(line.substr(6));
    else if (const auto number = number_of(line.substr(std::min(background.size(), line.size())));
             number && line.starts_with(background))
      lines += fmt::format("{}{}", background, rescale.slope * *number + rescale.intercept);
    else
      lines.append(line);
    lines += '\n';
  }
  return lines + lines_of_applied(nrrd_fields, rescale);
}

double error_in_samples(double error, const Rescale& rescale) {
  const double slope = std::abs(rescale.slope);
  double in_samples = error / slope;
  while (in_samples * slope > error) in_samples = std::nextafter(in_samples, 0.0);
  return in_samples;
}

namespace {

std::string without_names(std::string sentence, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const std::string prefix = name + ": ";
    if (name.empty()) continue;
    for (std::size_t at = 0; (at = sentence.find(prefix, at)) != sentence.npos;)
      if (at == 0 || sentence.compare(at - 2, 2, "; ") == 0)
        sentence.erase(at, prefix.size());
      else
        at += prefix.size();
  }
  return sentence;
}

}  // namespace

std::string lines_of_doubts(const SourceFacts& facts, const std::vector<std::string>& names) {
  const std::string& fields = facts.info.nrrd_fields;
  KeyValues pairs;
  if (!facts.scale_doubt.empty() && text_of_key(fields, scale_doubt_key).empty())
    pairs.emplace_back(scale_doubt_key, without_names(facts.scale_doubt, names));
  std::string all;
  for (const std::string& sentence : facts.not_understood)
    all += (all.empty() ? "" : "; ") + without_names(sentence, names);
  if (!all.empty() && text_of_key(fields, not_understood_key).empty())
    pairs.emplace_back(not_understood_key, all);
  return nrrd_fields_of({}, pairs);
}

std::string scale_doubt_in(std::string_view nrrd_fields) {
  std::string doubt = text_of_key(nrrd_fields, scale_doubt_key);
  if (!doubt.empty() || has_slopes_of_slices(nrrd_fields)) return doubt;
  return doubt_of_rescale(nrrd_fields, 1);
}

std::vector<std::string> doubts_in(std::string_view nrrd_fields) {
  std::vector<std::string> doubts;
  for (std::string sentence : {scale_doubt_in(nrrd_fields), text_of_key(nrrd_fields, not_understood_key)})
    if (!sentence.empty()) doubts.push_back(std::move(sentence));
  return doubts;
}

}  // namespace tagrid
