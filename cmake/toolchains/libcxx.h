// What the C++ library of Debian 12's emscripten (clang 14, libc++ 13) lacks of C++20, as far as the half of libtagrid that
// reads uses it. It is compiled in front of each source, so that the sources need not know. Debian 13's (libc++ 18) and that
// of zig for macOS (libc++ 16) lack only from_chars() of floating-point numbers.
#pragma once

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstddef>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <system_error>
#include <type_traits>

#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 15000
namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  return __builtin_bit_cast(To, from);
}

template <class T>
requires std::is_array_v<T> unique_ptr<T> make_unique_for_overwrite(size_t count) {
  return unique_ptr<T>(new std::remove_extent_t<T>[count]);
}

namespace ranges {

template <class Range, class Holds>
constexpr bool any_of(Range&& range, Holds holds) {
  return std::any_of(std::begin(range), std::end(range), std::ref(holds));
}
template <class Range, class Holds>
constexpr bool all_of(Range&& range, Holds holds) {
  return std::all_of(std::begin(range), std::end(range), std::ref(holds));
}
template <class A, class B>
constexpr bool equal(A&& a, B&& b) {
  return std::equal(std::begin(a), std::end(a), std::begin(b), std::end(b));
}
template <class Range, class T, class Projection>
constexpr auto find(Range&& range, const T& value, Projection projection) {
  return std::find_if(std::begin(range), std::end(range),
                      [&](const auto& element) { return std::invoke(projection, element) == value; });
}
template <class Range, class T>
constexpr auto find(Range&& range, const T& value) {
  return std::find(std::begin(range), std::end(range), value);
}
template <class Range, class Less = std::less<>, class Projection>
void stable_sort(Range&& range, Less less, Projection projection) {
  std::stable_sort(std::begin(range), std::end(range), [&](const auto& a, const auto& b) {
    return less(std::invoke(projection, a), std::invoke(projection, b));
  });
}

}  // namespace ranges
}  // namespace std
#endif

#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 200000
#ifdef __wasm__
// Number() of some characters. JavaScript rounds as well as strtod, which would be 13 kB of the module.
extern "C" __attribute__((import_module("tagrid"), import_name("number"))) double tagrid_number_of_javascript(
    const char* text, std::size_t bytes);
inline double tagrid_number(const char* text, std::size_t bytes) {
  return tagrid_number_of_javascript(text, bytes);
}
#else
#include <locale.h>
#include <stdlib.h>
#ifdef __APPLE__
#include <xlocale.h>
#endif
inline double tagrid_number(const char* text, std::size_t bytes) {
  static const locale_t point = newlocale(LC_ALL_MASK, "C", nullptr);
  return strtod_l(std::string(text, bytes).c_str(), nullptr, point);
}
#endif

namespace std {

// A number as std::from_chars reads it: no blanks, no plus sign and no hexadecimal digits.
inline from_chars_result from_chars(const char* first, const char* last, double& value) {
  const char* at = first;
  const auto take = [&](auto is_wanted) {
    const char* const begin = at;
    while (at != last && is_wanted(*at)) ++at;
    return at != begin;
  };
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_word = [&](const char* word) {
    const char* c = at;
    for (; *word != 0; ++word, ++c)
      if (c == last || (*c | 0x20) != *word) return false;
    at = c;
    return true;
  };
  const bool is_negative = at != last && *at == '-';
  if (is_negative) ++at;
  if (is_word("nan") || is_word("infinity") || is_word("inf")) {
    const double magnitude = (at[-1] | 0x20) == 'n' ? __builtin_nan("") : __builtin_inf();
    value = is_negative ? -magnitude : magnitude;
    return {at, errc()};
  }
  bool has_digits = take(is_digit);
  if (at != last && *at == '.' && (has_digits || (at + 1 != last && is_digit(at[1])))) {
    ++at;
    has_digits = take(is_digit) || has_digits;
  }
  if (!has_digits) return {first, errc::invalid_argument};
  const char* const mantissa = at;
  if (at != last && (*at | 0x20) == 'e') {
    ++at;
    if (at != last && (*at == '-' || *at == '+')) ++at;
    if (!take(is_digit)) at = mantissa;
  }
  const double read = tagrid_number(first, static_cast<size_t>(at - first));
  // Digits that are too large for a double are no number, but "inf" is.
  if (read - read != 0) return {at, errc::result_out_of_range};
  value = read;
  return {at, errc()};
}

}  // namespace std
#endif
