// Lines, words and numbers in texts that come from files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// Removes and returns the first line of `text`, without its '\n' and any '\r' before it.
std::string_view take_line(std::string_view& text);

/// '0' to '9', whatever the locale.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// `text` without blanks and '\r' around it.
std::string_view trimmed(std::string_view text);

/// The parts of `text` between blanks.
std::vector<std::string_view> words_of(std::string_view text);

/// All of `text` as a number, independent of the locale; "nan" is one.
std::optional<double> number_of(std::string_view text);

/// All of `text` as a whole number, without a plus sign.
std::optional<std::int64_t> whole_number_of(std::string_view text);

/// `text` for a message, as UTF-8: shortened, and without anything on which a terminal would act.
std::string quoted(std::string_view text);

std::string lower_case(std::string_view text);

}  // namespace tagrid
