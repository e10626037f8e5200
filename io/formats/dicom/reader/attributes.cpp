#include "io/formats/dicom/reader/attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Outcome = ForeignNumber::Outcome;

/// Wide enough for every count of samples, narrow enough to be exact.
constexpr double largest_integer = 1e15;

bool is_blank(std::string_view text) { return trimmed(text).empty(); }

}  // namespace

std::string name_of(const DcmTagKey& tag) {
  DcmTag named(tag);
  return named.getTagName();
}

std::string text_of(DcmElement& element) {
  OFString text;
  if (element.getOFStringArray(text).bad()) text.clear();
  std::string trimmed(text.c_str(), text.size());
  trimmed.erase(trimmed.find_last_not_of(std::string_view(" \0", 2)) + 1);
  return trimmed;
}

std::optional<std::string> text_of(DcmItem& item, const DcmTagKey& tag) {
  DcmElement* element = nullptr;
  if (item.findAndGetElement(tag, element).bad() || element == nullptr || !element->isLeaf())
    return std::nullopt;
  return text_of(*element);
}

DcmItem* item_in(DcmItem& item, const DcmTagKey& tag) {
  DcmItem* found = nullptr;
  return item.findAndGetSequenceItem(tag, found, 0).good() ? found : nullptr;
}

ForeignNumber number_in(DcmItem& item, const DcmTagKey& tag) {
  const auto text = text_of(item, tag);
  return foreign_number(text ? std::optional<std::string_view>(*text) : std::nullopt);
}

void remark(const ForeignNumber& number, const DcmTagKey& tag, std::string_view consequence,
            DicomNotes& notes) {
  if (std::string text = remark_on(number, name_of(tag), consequence); !text.empty())
    notes.warn(name_of(tag), std::move(text));
}

DicomNumbers numbers_in(DcmItem& item, const DcmTagKey& tag, std::size_t count, std::string_view consequence,
                        DicomNotes& notes) {
  DicomNumbers numbers;
  const auto text = text_of(item, tag);
  if (!text) return numbers;
  numbers.outcome = Outcome::unreadable;
  if (is_blank(*text)) return numbers;
  const auto say = [&](const std::string& what) {
    notes.warn(name_of(tag),
               fmt::format("{} is {}{}", name_of(tag), tagrid::quoted(std::string_view(*text)), what));
  };
  bool has_comma = false;
  for (const std::string_view value : values_of(*text)) {
    const ForeignNumber number = foreign_number(value);
    if (!number.is_number()) break;
    has_comma = has_comma || number.decimal_comma;
    numbers.values.push_back(number.value);
  }
  const std::size_t given = values_of(*text).size();
  if (numbers.values.size() != given) {
    say(fmt::format(", {}; {}", given == 1 ? "which is not a number" : "which are not numbers", consequence));
  } else if (count != 0 && given != count) {
    say(fmt::format(", {} number{} instead of {}; {}", given, given == 1 ? "" : "s", count, consequence));
  } else {
    numbers.outcome = Outcome::number;
    if (has_comma)
      say(fmt::format(", with a decimal comma; it is read as {}", fmt::join(numbers.values, ", ")));
  }
  return numbers;
}

std::optional<std::int64_t> integer_in(DcmItem& item, const DcmTagKey& tag) {
  const ForeignNumber number = number_in(item, tag);
  if (number.is_absent() || (number.is_unreadable() && is_blank(number.text))) return std::nullopt;
  if (!number.is_number() || number.value != std::floor(number.value) ||
      std::abs(number.value) > largest_integer)
    throw BrokenInput("{} is {}, which is not a whole number", name_of(tag),
                      tagrid::quoted(std::string_view(number.text)));
  return static_cast<std::int64_t>(number.value);
}

}  // namespace tagrid
