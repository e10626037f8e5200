#include "io/formats/dicom/reader/character_sets.h"

// The configuration comes first.
#include <dcmtk/config/osconfig.h>

#include <dcmtk/ofstd/ofchrenc.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "io/text/text.h"

namespace tagrid {
namespace {

/// A set of letters that a text can select.
struct Set {
  std::int64_t number;      ///< of the registration at ISO (ISO-IR)
  std::string_view escape;  ///< selects it, after the byte 27
  const char* encoding;     ///< an encoding that has its letters in bytes of 128 and more
  std::size_t bytes;        ///< of a letter
  char prefix;              ///< comes before the bytes of a letter in that encoding; 0: nothing
  bool is_low;              ///< In texts, it replaces ASCII: bytes have no high bit.
};

// JIS X 0201 has ASCII with other pictures of two letters.
constexpr std::array sets = {
    Set{6, "(B", nullptr, 1, 0, true},         Set{14, "(J", nullptr, 1, 0, true},
    Set{100, "-A", "ISO-8859-1", 1, 0, false}, Set{101, "-B", "ISO-8859-2", 1, 0, false},
    Set{109, "-C", "ISO-8859-3", 1, 0, false}, Set{110, "-D", "ISO-8859-4", 1, 0, false},
    Set{144, "-L", "ISO-8859-5", 1, 0, false}, Set{127, "-G", "ISO-8859-6", 1, 0, false},
    Set{126, "-F", "ISO-8859-7", 1, 0, false}, Set{138, "-H", "ISO-8859-8", 1, 0, false},
    Set{148, "-M", "ISO-8859-9", 1, 0, false}, Set{203, "-b", "ISO-8859-15", 1, 0, false},
    Set{166, "-T", "TIS-620", 1, 0, false},    Set{13, ")I", "EUC-JP", 1, '\x8E', false},
    Set{87, "$B", "EUC-JP", 2, 0, true},       Set{159, "$(D", "EUC-JP", 2, '\x8F', true},
    Set{149, "$)C", "EUC-KR", 2, 0, false},    Set{58, "$)A", "EUC-CN", 2, 0, false},
};

constexpr char escape = '\x1B';

bool is_high(char byte) { return (byte & 0x80) != 0; }

/// Bytes below are control characters.
bool is_letter(char byte) { return (byte & 0x7F) >= 0x20 && byte != 0x7F; }

const Set* set_of(std::int64_t number) {
  const auto found = std::ranges::find(sets, number, &Set::number);
  return found == sets.end() ? nullptr : &*found;
}

/// The number in "ISO_IR 100", "ISO 2022 IR 100", and other spellings that are met; 0 if there is none.
std::int64_t number_in_term(std::string_view term) {
  if (!term.starts_with("ISO")) return 0;
  const std::size_t ir = term.find("IR");
  if (ir == term.npos) return 0;
  term.remove_prefix(ir + 2);
  term.remove_prefix(std::min(term.find_first_not_of(" _-"), term.size()));
  return whole_number_of(term).value_or(0);
}

std::optional<std::string> converted(std::string_view bytes, const char* encoding) {
  OFCharacterEncoding converter;
  OFString text;
  if (converter.selectEncoding(encoding, "UTF-8").bad() ||
      converter.convertString(OFString(bytes.data(), bytes.size()), text).bad())
    return std::nullopt;
  return std::string(text.data(), text.size());
}

bool is_ascii(std::string_view text) {
  return std::ranges::none_of(text, [](char byte) { return is_high(byte) || byte == escape; });
}

/// Takes letters of a set from the beginning of `text`, as many as there are. Returns false if there are others.
bool take_letters(const Set& set, std::string_view& text, std::string& result) {
  std::string letters;
  while (!text.empty() && is_high(text.front()) != set.is_low && is_letter(text.front()) &&
         text.front() != ' ') {
    if (text.size() < set.bytes) return false;
    if (set.prefix != 0) letters += set.prefix;
    for (const char byte : text.substr(0, set.bytes)) {
      if (is_high(byte) == set.is_low || !is_letter(byte)) return false;
      letters += static_cast<char>(byte | 0x80);
    }
    text.remove_prefix(set.bytes);
  }
  const auto in_utf8 = converted(letters, set.encoding);
  if (in_utf8) result += *in_utf8;
  return in_utf8 && !letters.empty();
}

}  // namespace

CharacterSets::CharacterSets(std::string_view terms) {
  const std::string_view term = trimmed(terms.substr(0, terms.find('\\')));
  first_ = number_in_term(term);
  if (first_ == 192 || trimmed(terms).empty())
    whole_ = "UTF-8";  // also of files that do not say so
  else if (term == "GB18030" || term == "GBK")
    whole_ = term;
}

std::optional<std::string> CharacterSets::in_utf8(std::string_view text, std::string_view delimiters) const {
  if (is_ascii(text)) return std::string(text);
  if (whole_ == "UTF-8") return is_utf8(text) ? std::optional(std::string(text)) : std::nullopt;
  if (!whole_.empty()) return converted(text, whole_.c_str());
  const Set* const first = set_of(first_);
  const Set* const first_high = first != nullptr && !first->is_low ? first : nullptr;
  const Set *low = nullptr, *high = first_high;
  std::string result;
  while (!text.empty()) {
    const char byte = text.front();
    if (byte == escape) {
      const auto chosen =
          std::ranges::find_if(sets, [&](const Set& set) { return text.substr(1).starts_with(set.escape); });
      if (chosen == sets.end()) return std::nullopt;
      (chosen->is_low ? low : high) = chosen->encoding == nullptr ? nullptr : &*chosen;
      text.remove_prefix(1 + chosen->escape.size());
    } else if (is_high(byte)) {
      if (high == nullptr || !take_letters(*high, text, result)) return std::nullopt;
    } else if (low != nullptr && is_letter(byte) && byte != ' ') {
      if (!take_letters(*low, text, result)) return std::nullopt;
    } else {
      if (!is_letter(byte) || delimiters.find(byte) != delimiters.npos) {
        low = nullptr;
        high = first_high;
      }
      result += byte;
      text.remove_prefix(1);
    }
  }
  return result;
}

}  // namespace tagrid
