#include <cmath>
#include <string>

#include <fmt/format.h>
#include "tests/fuzz/targets.h"
#include "tools/options/numbers.h"

namespace tagrid::fuzz {

void numbers(Bytes bytes) {
  const std::string text(bytes.begin(), bytes.end());
  if (const auto n = whole_number<std::int64_t>(text)) {
    claim(whole_number<std::int64_t>(std::to_string(*n)) == n, "a whole number comes back");
    claim(std::stoll(text, nullptr, 10) == *n, "a whole number is decimal");
  }
  if (const auto n = whole_number<int>(text))
    claim(whole_number<std::int64_t>(text) == *n, "a whole number does not depend on what holds it");
  if (const auto n = finite_number(text)) {
    claim(std::isfinite(*n) && !(*n == 0 && std::signbit(*n)), "a number is finite, and zero has no sign");
    claim(finite_number(fmt::format("{}", *n)) == n, "a number comes back");
  }
  if (const auto n = byte_count(text)) {
    claim(byte_count(std::to_string(*n)) == n, "a number of bytes comes back");
    const auto unit = text.find_first_not_of("+.0123456789");
    const auto name = unit == text.npos ? "" : text.substr(unit);
    claim(name.empty() || (std::string_view("KMGTkmgt").find(name[0]) != std::string_view::npos &&
                           (name.size() == 1 || name.substr(1) == "B" || name.substr(1) == "iB")),
          "a number of bytes has no other units");
  }
  if (const auto n = three_sizes(text)) {
    claim(three_sizes(fmt::format("{},{},{}", n->x, n->y, n->z)) == n, "sizes come back");
    for (int axis = 0; axis < 3; ++axis)
      claim((*n)[axis] >= 1 && (*n)[axis] <= std::int64_t{1} << 31, "sizes are possible");
  }
  if (const auto d = given_spacing(text)) {
    const auto& [x, y, z] = d->distances;
    claim(given_spacing(fmt::format("{},{},{}{}", x, y, z, d->unit)) == d, "distances come back");
    for (const double distance : d->distances)
      claim(distance > 0 && distance <= 1e300, "distances are possible");
  }
  if (const auto r = value_range(text))
    claim(value_range(fmt::format("{}:{}", r->first, r->second)) == r, "a range comes back");
}

}  // namespace tagrid::fuzz
