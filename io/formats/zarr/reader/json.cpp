#include "io/formats/zarr/reader/json.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstring>
#include <string_view>

#include "io/bytes/little_endian.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::uint64_t most_metadata = std::uint64_t{16} << 20;
constexpr int most_nested = 64;

/// Puts quotes around words that Python writes but JSON does not have. Strings stay as they are.
std::string without_words_of_python(std::string_view json) {
  static constexpr std::array<std::string_view, 3> words = {"-Infinity", "Infinity", "NaN"};
  std::string plain;
  for (std::size_t i = 0; i < json.size();) {
    if (json[i] == '"') {
      const std::size_t begin = i++;
      while (i < json.size() && json[i] != '"') i += json[i] == '\\' ? 2 : 1;
      i = std::min(i + 1, json.size());
      plain += json.substr(begin, i - begin);
      continue;
    }
    const auto* const word =
        std::ranges::find_if(words, [&](std::string_view one) { return json.substr(i).starts_with(one); });
    if (word == words.end()) {
      plain += json[i++];
      continue;
    }
    plain += fmt::format("\"{}\"", *word);
    i += word->size();
  }
  return plain;
}

Json parsed(std::string_view text, const std::string& name) {
  return Json::parse(text.begin(), text.end(), [&](int depth, Json::parse_event_t, Json&) {
    if (depth > most_nested) throw BrokenInput(name + ": is nested too deeply");
    return true;
  });
}

Json parsed_as_python_writes(std::string_view text, const std::string& name) try {
  try {
    return parsed(text, name);
  } catch (const Json::exception&) {
    return parsed(without_words_of_python(text), name);
  }
} catch (const Json::exception&) {
  throw BrokenInput(name + ": is not JSON; it may be damaged");
}

int digit_of_base64(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

}  // namespace

std::optional<Json> json_at(const ZarrStore& store, const std::string& key) {
  const auto file = store.find(key);
  if (!file) return std::nullopt;
  const std::vector<std::byte> bytes = file->all(most_metadata);
  Json json = parsed_as_python_writes({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                      file->bytes->name());
  if (!json.is_object()) throw BrokenInput(file->bytes->name() + ": is not a JSON object");
  return json;
}

std::string shown(const Json& json) {
  return tagrid::quoted(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string text_at(const Json& object, const char* name) {
  const Json& value = member(object, name);
  return value.is_string() ? value.get<std::string>() : "";
}

std::optional<double> number_of_base64(const std::string& text) {
  if (text.size() != 12 || text.back() != '=' || text[10] == '=') return std::nullopt;
  std::array<std::byte, 9> bytes = {};
  for (std::size_t i = 0; i < 11; i += 4) {
    std::uint32_t group = 0;
    for (std::size_t j = i; j < i + 4; ++j) {
      const int digit = j == 11 ? 0 : digit_of_base64(text[j]);
      if (digit < 0) return std::nullopt;
      group = group << 6 | static_cast<std::uint32_t>(digit);
    }
    for (std::size_t j = 0; j < 3; ++j)
      bytes[i / 4 * 3 + j] = static_cast<std::byte>(group >> (16 - 8 * j) & 255U);
  }
  return load_little_endian<double>(bytes.data());
}

}  // namespace tagrid
