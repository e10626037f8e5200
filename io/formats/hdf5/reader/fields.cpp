#include "io/formats/hdf5/reader/fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "io/text/text.h"

namespace tagrid {

bool are_finite(const std::vector<double>& numbers) {
  return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
}

bool are_steps(const std::vector<double>& numbers) {
  return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number) && number != 0; });
}

AttributeNumbers Fields::numbers(const std::string& attribute, std::size_t count, const char* consequence,
                                 IsGood is_good) {
  AttributeNumbers found = foreign_numbers(object_, attribute, count);
  if (found.is_number() && !is_good(found.values)) found.outcome = ForeignNumber::Outcome::unreadable;
  if (const std::string said = remark(attribute, found, count, consequence); !said.empty())
    warnings.push_back(said);
  return found;
}

std::string Fields::text(const std::string& attribute, const char* consequence) {
  if (!has(attribute)) return "";
  if (const auto text = text_attribute(object_, attribute)) return *text;
  warnings.push_back(fmt::format("{}: {} is {}, which is not a text; {}", name_, attribute,
                                 tagrid::quoted(attribute_in_words(object_, attribute)), consequence));
  return "";
}

std::string Fields::remark(const std::string& attribute, const AttributeNumbers& found, std::size_t count,
                           const char* consequence) const {
  if (found.is_unreadable())
    return fmt::format(
        "{}: {} is {}, which is not {}; {}", name_, attribute,
        found.text.empty() ? "empty" : tagrid::quoted(found.text),
        count == 1 ? "a number that makes sense" : fmt::format("{} numbers that make sense", count),
        consequence);
  if (!found.decimal_comma) return "";
  return fmt::format("{}: {} is {}, with a decimal comma; it is read as {}", name_, attribute,
                     tagrid::quoted(found.text), fmt::join(found.values, " "));
}

}  // namespace tagrid
