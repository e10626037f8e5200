#include "io/text/text.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <locale>
#include <stdexcept>

#include "io/text/utf8.h"

namespace tagrid {
namespace {

struct Character {
  std::size_t bytes = 1;
  std::uint32_t code = 0;
  bool good = false;
};

std::uint32_t byte_at(std::string_view text, std::size_t i) { return static_cast<unsigned char>(text[i]); }

/// The first character of UTF-8, or one byte if it is not UTF-8.
Character first_character(std::string_view text) {
  const std::uint32_t first = byte_at(text, 0);
  if (first < 0x80) return {1, first, true};
  const std::size_t bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  constexpr std::array<std::uint32_t, 5> least = {0, 0, 0x80, 0x800, 0x10000};
  if (first < 0xC2 || first > 0xF4 || text.size() < bytes) return {};
  std::uint32_t code = first & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    const std::uint32_t next = byte_at(text, i);
    if ((next & 0xC0) != 0x80) return {};
    code = code << 6 | (next & 0x3F);
  }
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < least[bytes] || code > 0x10FFFF || surrogate) return {};
  return {bytes, code, true};
}

bool is_control(std::uint32_t code) {
  const bool turns = (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069) ||
                     code == 0x200E || code == 0x200F || code == 0x061C;
  const bool ends_line = code == 0x2028 || code == 0x2029;
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || turns || ends_line;
}

// `text` with the characters that stay, and each byte of all others as `escaped` writes it.
std::string with_escapes(std::string_view text, bool (*stays)(std::uint32_t code),
                         std::string (*escaped)(unsigned char byte)) {
  std::string result;
  while (!text.empty()) {
    const Character c = first_character(text);
    const std::string_view bytes = text.substr(0, c.bytes);
    if (c.good && stays(c.code))
      result += bytes;
    else
      for (const char byte : bytes) result += escaped(static_cast<unsigned char>(byte));
    text.remove_prefix(c.bytes);
  }
  return result;
}

constexpr std::string_view replacement = "\xEF\xBF\xBD";  // U+FFFD

}  // namespace

std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == text.npos ? text.size() : end + 1);
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  return begin == text.npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  constexpr std::string_view blanks = " \t";
  for (std::size_t begin = text.find_first_not_of(blanks); begin != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(blanks, end);
  }
  return words;
}

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(at);
    parts.push_back(text.substr(0, end));
    if (end == text.npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::optional<double> number_of(std::string_view text) {
  if (text.starts_with("+") && !text.starts_with("+-")) text.remove_prefix(1);
  return entire<double>(text);
}

std::optional<std::int64_t> whole_number_of(std::string_view text) { return entire<std::int64_t>(text); }

bool is_utf8(std::string_view text) {
  for (Character c; !text.empty(); text.remove_prefix(c.bytes))
    if (c = first_character(text); !c.good) return false;
  return true;
}

std::string quoted(std::string_view text) {
  constexpr std::size_t longest = 60;
  std::size_t end = std::min(text.size(), longest);
  const auto is_within_character = [&] { return (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80; };
  for (int i = 0; i < 3 && end < text.size() && is_within_character(); ++i) --end;
  std::string in_quotes = "\"";
  in_quotes += printable(text.substr(0, end));
  in_quotes += end < text.size() ? "...\"" : "\"";
  return in_quotes;
}

std::string counted(std::uint64_t count, std::string_view noun) {
  return std::to_string(count) + " " + std::string(noun) + (count == 1 ? "" : "s");
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

namespace {

/// Nothing if the system has no locale with the letters of Unicode.
const std::optional<std::locale>& letters_of_unicode() {
  static const std::optional<std::locale> letters = [] {
    for (const char* name : {"C.UTF-8", "C.utf8", "en_US.UTF-8"}) {
      try {
        return std::optional(std::locale(name));
      } catch (const std::runtime_error&) {
        // The next name may be known.
      }
    }
    return std::optional<std::locale>();
  }();
  return letters;
}

}  // namespace

void append_utf8(std::uint32_t code, std::string& text) {
  const auto append = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
  if (code < 0x80) return append(code);
  const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
  append((0xF0U << (3 - more) & 0xFFU) | code >> 6 * more);
  for (int i = more - 1; i >= 0; --i) append(0x80U | (code >> 6 * i & 0x3FU));
}

std::string lower_case_of_unicode(std::string_view text) {
  const auto& letters = letters_of_unicode();
  if (!letters || !is_utf8(text)) return lower_case(text);
  const auto& kinds = std::use_facet<std::ctype<wchar_t>>(*letters);
  std::string lower;
  while (!text.empty()) {
    const Character letter = first_character(text);
    append_utf8(static_cast<std::uint32_t>(kinds.tolower(static_cast<wchar_t>(letter.code))), lower);
    text.remove_prefix(letter.bytes);
  }
  return lower;
}

std::string printable(std::string_view text) {
  return with_escapes(
      text, [](std::uint32_t code) { return !is_control(code); },
      [](unsigned char byte) -> std::string {
        if (byte == '\n') return "\\n";
        if (byte == '\t') return "\\t";
        if (byte == '\r') return "\\r";
        return {'\\', 'x', "0123456789abcdef"[byte >> 4], "0123456789abcdef"[byte & 15]};
      });
}

std::string shown_input(const std::string& path) { return path == "-" ? "standard input" : path; }
std::string shown_output(const std::string& path) { return path == "-" ? "standard output" : path; }

std::string text_of_name(std::string_view name) {
  return with_escapes(
      name, [](std::uint32_t code) { return code != 0xFFFD; },
      [](unsigned char byte) {
        return std::string(replacement) + "0123456789ABCDEF"[byte >> 4] + "0123456789ABCDEF"[byte & 15];
      });
}

std::string name_of_text(std::string_view text) {
  std::string name;
  while (!text.empty()) {
    unsigned byte = 0;
    const std::string_view digits = text.substr(std::min(text.size(), replacement.size())).substr(0, 2);
    if (text.starts_with(replacement) && digits.size() == 2 &&
        std::from_chars(digits.data(), digits.data() + 2, byte, 16).ptr == digits.data() + 2) {
      name += static_cast<char>(byte);
      text.remove_prefix(replacement.size() + 2);
    } else {
      name += text.front();
      text.remove_prefix(1);
    }
  }
  return name;
}

}  // namespace tagrid
