#include "plugins/hdf5/lattice.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>

namespace tagrid::hdf5 {
namespace {

constexpr std::size_t most_others = 8;
// Beyond any number of a lattice: numbers of floats have 30 bits at most.
constexpr std::int32_t first_other = std::numeric_limits<std::int32_t>::max();

constexpr bool is_float(tagrid_type type) { return type == TAGRID_FLOAT32 || type == TAGRID_FLOAT64; }

// So that number * step is exact in T: the step has 5 bits.
template <class T>
constexpr double largest_number = sizeof(T) == 4 ? 1 << 19 : 1 << 30;

template <class T>
constexpr const char* name_of() {
  constexpr bool is_signed = std::is_signed_v<T>;
  if constexpr (std::floating_point<T>) return sizeof(T) == 4 ? "float32" : "float64";
  if constexpr (sizeof(T) == 1) return is_signed ? "int8" : "uint8";
  if constexpr (sizeof(T) == 2) return is_signed ? "int16" : "uint16";
  return is_signed ? "int32" : "uint32";
}

template <class T>
T place_of(NumberOf<T> number, const Lattice<T>& lattice) {
  // Exact for integers, too: neither factor has more than 33 bits, and a product with more than 53 is beyond
  // the limits.
  const double place = lattice.anchor + static_cast<double>(number) * lattice.step;
  return static_cast<T>(std::clamp(place, static_cast<double>(std::numeric_limits<T>::lowest()),
                                   static_cast<double>(std::numeric_limits<T>::max())));
}

std::int64_t floor_divided(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0); }

// The number of a float, or nothing if it is not rounded.
template <class T>
std::optional<std::int32_t> number_of(T sample, const Lattice<T>& lattice) {
  if (lattice.keeps_fill && sample == lattice.fill) return std::nullopt;
  double number = std::nearbyint(static_cast<double>(sample) / lattice.step);
  // False for NaN, too.
  if (!(std::fabs(number) <= largest_number<T>)) return std::nullopt;
  // The quotient is rounded, so a sample in the middle may have got the further place. The difference is
  // exact.
  const double off = static_cast<double>(sample) - place_of<T>(static_cast<std::int32_t>(number), lattice);
  if (std::fabs(off) > lattice.max_error) number += off > 0 ? 1 : -1;
  if (std::fabs(number) > largest_number<T>) return std::nullopt;
  return static_cast<std::int32_t>(number);
}

// The text after "name:=" of a line.
std::optional<std::string_view> value_of(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find('\n'), header.size());
    const std::string_view line = header.substr(0, end);
    if (line.starts_with(name) && line.substr(name.size()).starts_with(":="))
      return line.substr(name.size() + 2);
    header.remove_prefix(std::min(end + 1, header.size()));
  }
  return std::nullopt;
}

template <class Number, class... Base>
Number parsed(std::string_view& text, Base... base) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base...);
  if (error != std::errc()) throw Error(TAGRID_BROKEN_INPUT, "the chunk's lattice is not understood");
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

}  // namespace

double lattice_step(tagrid_type type, double max_error) {
  if (!is_float(type)) {
    const double whole = std::floor(std::min(max_error, 1073741824.0));
    return whole >= 1 ? 2 * whole + 1 : 0;
  }
  const double twice = 2 * std::min(max_error, std::numeric_limits<double>::max() / 4);
  if (!(twice > 0)) return 0;
  int exponent = 0;
  std::frexp(twice, &exponent);
  // No sample is finer than the smallest number of its type.
  const int unit = std::max(exponent - 5, type == TAGRID_FLOAT32 ? -149 : -1074);
  return std::ldexp(std::floor(std::ldexp(twice, -unit)), unit);
}

template <class T>
Lattice<T> lattice_for(double max_error, T fill) {
  Lattice<T> lattice{max_error, lattice_step(type_of<T>(), max_error), fill};
  if constexpr (std::integral<T>) {
    const auto whole = static_cast<std::int64_t>(lattice.step);
    const std::int64_t number = floor_divided(fill + whole / 2, whole);
    lattice.anchor = static_cast<std::int32_t>(fill - number * whole);
  } else {
    const auto number = number_of(fill, lattice);
    lattice.keeps_fill = number && place_of<T>(*number, lattice) != fill;
  }
  return lattice;
}

template <class T>
std::optional<OnLattice<T>> to_lattice(std::span<const T> samples, const Lattice<T>& lattice) {
  OnLattice<T> found;
  found.numbers.resize(samples.size());
  if constexpr (std::integral<T>) {
    const auto whole = static_cast<std::int64_t>(lattice.step), half = whole / 2 - lattice.anchor;
    std::ranges::transform(samples, found.numbers.begin(),
                           [&](T sample) { return static_cast<T>(floor_divided(sample + half, whole)); });
  } else {
    std::int32_t low = first_other;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (const auto number = number_of(samples[i], lattice)) {
        found.numbers[i] = *number;
        low = std::min(low, *number);
        continue;
      }
      const auto bits = std::bit_cast<BitsOf<T>>(samples[i]);
      const auto known =
          std::ranges::find(found.others, bits, [](const auto& other) { return other.second; });
      const auto index = static_cast<std::int32_t>(known - found.others.begin());
      if (known == found.others.end()) {
        if (found.others.size() == most_others) return std::nullopt;
        found.others.emplace_back(0, bits);
      }
      found.numbers[i] = first_other - index;
    }
    // Numbers that lie next to those in use keep the range of numbers small.
    if (low == first_other) low = 0;
    if (!found.others.empty())
      for (std::int32_t& number : found.numbers)
        if (number > first_other - static_cast<std::int32_t>(most_others))
          number = low - 1 - (first_other - number);
    for (auto& other : found.others) other.first = --low;
  }
  return found;
}

template <class T>
void from_lattice(const OnLattice<T>& places, const Lattice<T>& lattice, std::span<T> samples) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const NumberOf<T> number = places.numbers[i];
    samples[i] = place_of<T>(number, lattice);
    if constexpr (std::floating_point<T>)
      for (const auto& other : places.others)
        if (number == other.first) samples[i] = std::bit_cast<T>(other.second);
  }
}

template <class T>
std::string lattice_lines(const OnLattice<T>& places, const Lattice<T>& lattice) {
  std::string lines;
  const auto add = [&lines](const char* before, auto... value) {
    char text[64];
    lines.append(before).append(text, std::to_chars(text, text + sizeof text, value...).ptr);
  };
  add("rescale_slope:=", lattice.step);
  add("\nrescale_intercept:=", lattice.anchor);
  lines.append("\nlattice:=").append(name_of<T>());
  for (const auto& other : places.others) {
    add(" ", other.first);
    add(":", other.second, 16);
  }
  return lines.append("\n");
}

bool has_lattice(const std::string& header) { return value_of(header, "lattice").has_value(); }

template <class T>
void read_lattice_lines(const std::string& header, const Lattice<T>& lattice, OnLattice<T>& places) {
  std::string_view slope = value_of(header, "rescale_slope").value_or("");
  std::string_view intercept = value_of(header, "rescale_intercept").value_or("0");
  std::string_view others = *value_of(header, "lattice");
  if (!others.starts_with(name_of<T>()))
    throw Error(TAGRID_BROKEN_INPUT, "the chunk has samples of another type than the data set");
  if (parsed<double>(slope) != lattice.step || parsed<double>(intercept) != lattice.anchor)
    throw Error(TAGRID_BROKEN_INPUT,
                "the chunk was coded with another bound or fill value than those of the data set");
  others.remove_prefix(std::string_view(name_of<T>()).size());
  while (!others.empty()) {
    others.remove_prefix(1);
    const auto number = parsed<NumberOf<T>>(others);
    others.remove_prefix(std::min<std::size_t>(1, others.size()));
    places.others.emplace_back(number, parsed<BitsOf<T>>(others, 16));
  }
}

#define TAGRID_INSTANTIATE(T)                                                                \
  template Lattice<T> lattice_for<T>(double, T);                                             \
  template std::optional<OnLattice<T>> to_lattice<T>(std::span<const T>, const Lattice<T>&); \
  template void from_lattice<T>(const OnLattice<T>&, const Lattice<T>&, std::span<T>);       \
  template std::string lattice_lines<T>(const OnLattice<T>&, const Lattice<T>&);             \
  template void read_lattice_lines<T>(const std::string&, const Lattice<T>&, OnLattice<T>&);
TAGRID_INSTANTIATE(std::uint8_t)
TAGRID_INSTANTIATE(std::int8_t)
TAGRID_INSTANTIATE(std::uint16_t)
TAGRID_INSTANTIATE(std::int16_t)
TAGRID_INSTANTIATE(std::uint32_t)
TAGRID_INSTANTIATE(std::int32_t)
TAGRID_INSTANTIATE(float)
TAGRID_INSTANTIATE(double)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid::hdf5
