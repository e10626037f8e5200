// What Debian 12's emscripten (clang 14, libc++ 13) lacks of C++20, as far as the decoder uses it. It is
// compiled in front of each source, so that the sources need not know. Debian 13's (libc++ 18) lacks only
// from_chars() of floating-point numbers.
#pragma once

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdlib>
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
namespace std {

// A number as std::from_chars reads it: no blanks, no plus sign and no hexadecimal digits, which strtod
// takes.
inline from_chars_result from_chars(const char* first, const char* last, double& value) {
  const std::string text(first, last);
  const size_t begin = text.starts_with('-') ? 1 : 0;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_letter = [&](char letter) { return (text[begin] | 0x20) == letter; };
  const bool is_number = begin < text.size() &&
                         (is_digit(text[begin]) || text[begin] == '.' || is_letter('i') || is_letter('n'));
  const bool is_hexadecimal =
      begin + 1 < text.size() && text[begin] == '0' && (text[begin + 1] | 0x20) == 'x';
  if (!is_number) return {first, errc::invalid_argument};
  if (is_hexadecimal) {
    value = begin == 1 ? -0.0 : 0.0;
    return {first + begin + 1, errc()};
  }
  char* end = nullptr;
  const double read = strtod(text.c_str(), &end);
  if (end == text.c_str()) return {first, errc::invalid_argument};
  const bool is_finite = read - read == 0;
  // Digits that are too large or too small for a double are no number, but "inf" is.
  if (is_digit(text[begin]) || text[begin] == '.')
    if (!is_finite) return {first + (end - text.c_str()), errc::result_out_of_range};
  value = read;
  return {first + (end - text.c_str()), errc()};
}

}  // namespace std
#endif
