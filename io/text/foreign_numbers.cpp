#include "io/text/foreign_numbers.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/text/text.h"

namespace tagrid {

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
