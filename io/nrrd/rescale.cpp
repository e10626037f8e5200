#include "io/nrrd/rescale.h"

#include <algorithm>
#include <cmath>

#include "io/files/foreign_numbers.h"
#include "io/files/text.h"
#include "io/nrrd/geometry.h"
#include "io/nrrd/line.h"

namespace tagrid {

Rescale rescale_of(std::string_view nrrd_fields) {
  Rescale rescale;
  for (const auto& [key, value] : key_values_of(nrrd_fields)) {
    if (key == "slice_slopes") return {};
    if (key == "rescale_slope") rescale.slope = number_of(value).value_or(0);
    if (key == "rescale_intercept") rescale.intercept = number_of(value).value_or(0);
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
    // Numbers with a decimal comma are read by those who wrote the line, but not from it.
    if (!numbers.is_absent &&
        (!numbers.are_numbers() || std::ranges::any_of(numbers.numbers, &ForeignNumber::decimal_comma)))
      return remark_on(numbers, key, consequence);
  }
  return "";
}

double error_in_samples(double error, const Rescale& rescale) {
  const double slope = std::abs(rescale.slope);
  double in_samples = error / slope;
  while (in_samples * slope > error) in_samples = std::nextafter(in_samples, 0.0);
  return in_samples;
}

}  // namespace tagrid
