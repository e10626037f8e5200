#include "tools/archive/name_template.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "io/errors/errors.h"
#include "io/text/text.h"
#include "tools/archive/manifest.h"

namespace tagrid {
namespace {

constexpr std::size_t digits_of_hash = 20;                     // of a million volumes, no two have the same
constexpr std::size_t most_of_value = 64, most_of_step = 240;  // bytes

/// A date, or nothing: some headers have other texts there, which may name a patient.
std::string date_of(const std::string& text) {
  const auto number = [&](std::size_t at, std::size_t digits) { return std::stoi(text.substr(at, digits)); };
  constexpr std::string_view form = "0000-00-00";
  const bool is_like = std::ranges::equal(
      text, form, [](char c, char of_form) { return of_form == '0' ? is_digit(c) : c == of_form; });
  const bool is_date =
      is_like && number(5, 2) >= 1 && number(5, 2) <= 12 && number(8, 2) >= 1 && number(8, 2) <= 31;
  return is_date ? text : "";
}

/// A code string of DICOM, or nothing.
std::string code_of(const std::string& text) {
  constexpr std::size_t most = 16;
  const auto is_of_code = [](char c) {
    return (c >= 'A' && c <= 'Z') || is_digit(c) || c == '_' || c == ' ';
  };
  return text.size() <= most && std::ranges::all_of(text, is_of_code) ? text : "";
}

struct Field {
  std::string_view name;
  bool is_identifying;
  std::string (*value)(const NamedVolume& volume);
};

constexpr std::string_view hash_field = "hash";

/// The keys of `archive find` that are known before a volume is encoded, and two more.
constexpr std::array<Field, 9> fields = {{
    {"patient", true, [](const NamedVolume& volume) { return volume.subject.patient; }},
    {"patient_id", true, [](const NamedVolume& volume) { return volume.subject.patient_id; }},
    {"study", true, [](const NamedVolume& volume) { return volume.subject.study; }},
    {"series", true, [](const NamedVolume& volume) { return volume.subject.series; }},
    {"stem", true, [](const NamedVolume& volume) { return volume.stem; }},
    {"study_date", false, [](const NamedVolume& volume) { return date_of(volume.subject.study_date); }},
    {"modality", false, [](const NamedVolume& volume) { return code_of(volume.subject.modality); }},
    {"type", false, [](const NamedVolume& volume) { return volume.type; }},
    {hash_field, false, [](const NamedVolume&) { return std::string(); }},  // the last one of the list
}};

const Field* field_called(std::string_view name) {
  const auto* found = std::ranges::find(fields, name, &Field::name);
  return found == fields.end() ? nullptr : found;
}

/// "{patient}, {study_date}": those that a name may have with or without a key file.
std::string list_of_fields(const KeyFile* keys) {
  std::vector<std::string> names;
  for (const Field& one : fields)
    if (keys == nullptr || !one.is_identifying) names.push_back(fmt::format("{{{}}}", one.name));
  if (keys == nullptr) names.back() += " (with --keys)";
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Characters that paths have no place for, or Windows and the servers of its shares have not.
constexpr std::string_view not_in_names = "/\\:*?\"<>|";

/// The beginning of a text, without half a character of UTF-8.
std::string_view cut(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xc0) == 0x80) --most;
  return text.substr(0, most);
}

/// A value as a part of a step, not empty.
std::string value_in_name(std::string_view text) {
  const std::string step = step_of(trimmed(text));
  std::string_view value = cut(step, most_of_value);
  if (const std::size_t percent = value.rfind('%'); percent != value.npos && percent + 3 > value.size())
    value = value.substr(0, percent);
  while (value.ends_with('.') || value.ends_with(' ')) value.remove_suffix(1);  // Windows drops them
  return value.empty() ? "unknown" : std::string(value);
}

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw usage_error("--name {}: {}", text, why);
}

}  // namespace

std::string step_of(std::string_view text) {
  std::string step;
  for (const char c : text) {
    const bool is_plain = static_cast<unsigned char>(c) >= ' ' && c != '\x7f' && c != '%' &&
                          not_in_names.find(c) == not_in_names.npos;
    // Not a hidden file, and not the directory above.
    if (is_plain && !(c == '.' && step.empty()))
      step += c;
    else
      step += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return step;
}

NameTemplate::NameTemplate(const std::string& text, const KeyFile* keys) : keys_(keys) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = std::min(text.find_first_of("{}", at), text.size());
    if (begin > at) parts_.push_back({false, text.substr(at, begin - at)});
    if (begin == text.size()) break;
    const std::size_t end = text.find('}', begin);
    if (text[begin] == '}' || end == text.npos) refuse(text, "a brace has no other one; write {field}");
    const std::string name = text.substr(begin + 1, end - begin - 1);
    const Field* field = field_called(name);
    if (field == nullptr)
      refuse(text, fmt::format("there is no field {{{}}}; fields are {}", name, list_of_fields(keys_)));
    if (name == hash_field && keys_ == nullptr) refuse(text, "{hash} needs a key; give --keys FILE");
    if (field->is_identifying && keys_ != nullptr)
      refuse(text, fmt::format("{{{}}} identifies a patient, which no name may with --keys; fields are {}",
                               name, list_of_fields(keys_)));
    parts_.push_back({true, name});
    at = end + 1;
  }
  if (std::ranges::none_of(parts_, &Part::is_field))
    refuse(text, fmt::format("has no field; fields are {}", list_of_fields(keys_)));
  std::size_t size = 0;
  std::string example;  // a name of the list must be possible
  for (const Part& part : parts_) {
    const std::string longest = part.is_field ? std::string(most_of_value, 'x') : part.text;
    for (const char c : longest) {
      size = c == '/' ? 0 : size + 1;
      if (size > most_of_step) refuse(text, "its names may be too long; give it fewer fields");
    }
    example += part.is_field ? "x" : part.text;
  }
  if (example.find_first_of("\t\n\r\\") != example.npos || example.find('\0') != example.npos)
    refuse(text, "has a character that a name in a list cannot have");
  if (output_called(example) != example + ".tag")
    refuse(text, "must be the path of a file, without .tag, . and empty steps");
}

std::string NameTemplate::name_of(const NamedVolume& volume) const {
  std::string name;
  for (const Part& part : parts_) {
    if (!part.is_field)
      name += part.text;
    else if (part.text == hash_field)
      name += keys_->hash({"volume", volume.identity}, digits_of_hash);
    else
      name += value_in_name(field_called(part.text)->value(volume));
  }
  return name;
}

}  // namespace tagrid
