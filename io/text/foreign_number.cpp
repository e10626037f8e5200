#include "io/text/foreign_number.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/text/text.h"

namespace tagrid {
namespace {

using Outcome = ForeignNumber::Outcome;

/// `text` with a point in place of its decimal comma; nothing if it has none.
std::optional<std::string> with_decimal_point(std::string_view text) {
  const std::size_t comma = text.find(',');
  if (comma == text.npos || text.find_first_of(".,", comma + 1) != text.npos || text.find('.') < comma)
    return std::nullopt;
  const auto length_of_digits = [&](std::size_t from, int step) {
    std::size_t count = 0;
    for (std::size_t at = from; at < text.size() && is_digit(text[at]); at += static_cast<std::size_t>(step))
      ++count;
    return count;
  };
  const std::size_t before = length_of_digits(comma - 1, -1), after = length_of_digits(comma + 1, 1);
  if (before == 0 || after == 0) return std::nullopt;
  // "1,024" may be a thousand and 24; no group of thousands begins with 0.
  if (after == 3 && before <= 3 && text[comma - before] != '0') return std::nullopt;
  std::string result(text);
  result[comma] = '.';
  return result;
}

}  // namespace

ForeignNumber foreign_number(std::optional<std::string_view> text) {
  if (!text) return {};
  ForeignNumber result{.outcome = Outcome::unreadable, .text = std::string(*text)};
  // Formats with fields of fixed width fill them with zeros.
  const std::string_view word = trimmed(text->substr(0, text->find('\0')));
  std::optional<double> number = number_of(word);
  if (!number)
    if (const auto plain = with_decimal_point(word)) {
      number = number_of(*plain);
      result.decimal_comma = number.has_value();
    }
  if (!number || !std::isfinite(*number)) return result;
  result.outcome = Outcome::number;
  result.value = *number;
  return result;
}

ForeignNumber foreign_number(double stored) {
  if (!std::isfinite(stored)) return {.outcome = Outcome::unreadable, .text = fmt::format("{}", stored)};
  return {.outcome = Outcome::number, .value = stored, .text = fmt::format("{}", stored)};
}

std::string remark_on(const ForeignNumber& number, std::string_view name, std::string_view consequence) {
  if (number.decimal_comma)
    return fmt::format("{} is {}, with a decimal comma; it is read as {}", name, tagrid::quoted(number.text),
                       number.value);
  if (!number.is_unreadable()) return "";
  if (trimmed(number.text).empty()) return fmt::format("{} is empty; {}", name, consequence);
  return fmt::format("{} is {}, which is not a number; {}", name, tagrid::quoted(number.text), consequence);
}

bool ForeignNumbers::are_numbers() const {
  return !numbers.empty() && std::ranges::all_of(numbers, &ForeignNumber::is_number);
}

std::vector<double> ForeignNumbers::values() const {
  std::vector<double> values;
  for (const ForeignNumber& number : numbers) values.push_back(number.value);
  return values;
}

ForeignNumbers foreign_numbers(std::optional<std::string_view> text, std::size_t count) {
  if (!text) return {};
  ForeignNumbers result{.is_absent = false, .text = std::string(*text), .count = count, .numbers = {}};
  const auto words = words_of(*text);
  if (words.size() == count)
    for (const std::string_view word : words) result.numbers.push_back(foreign_number(word));
  return result;
}

std::string remark_on(const ForeignNumbers& numbers, std::string_view name, std::string_view consequence) {
  if (numbers.is_absent) return "";
  const std::string text = quoted(std::string_view(numbers.text));
  if (trimmed(numbers.text).empty()) return fmt::format("{} is empty; {}", name, consequence);
  if (numbers.numbers.empty())
    return fmt::format("{} {} must be {} numbers; {}", name, text, numbers.count, consequence);
  for (const ForeignNumber& number : numbers.numbers)
    if (number.is_unreadable())
      return fmt::format("{} {}: {} is not a number; {}", name, text, quoted(std::string_view(number.text)),
                         consequence);
  if (std::ranges::any_of(numbers.numbers, &ForeignNumber::decimal_comma))
    return fmt::format("{} {} has decimal commas, which are read as points", name, text);
  return "";
}

}  // namespace tagrid
