// What the process says to people, and how it ends.
#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace tagrid {

/// From now on, a signal that ends the process first removes the temporary files; see
/// catch_end_signals().
void catch_signals();

/// From now on, say_line() writes `shown` in place of `text`, which has a secret. Not for several threads.
void show_instead_of(const std::string& text, const std::string& shown);

/// Writes a line for people to standard error, in the form of printable(). Failures are ignored.
void say_line(std::string_view text);
/// The same for a text that is formatted.
template <class... Values>
void say(fmt::format_string<Values...> text, Values&&... values) {
  say_line(fmt::format(text, std::forward<Values>(values)...));
}
/// Shows `text`, in the form of printable(), on the last line of the terminal, until another text
/// replaces it; "" removes it. It is cut to the width of the terminal. Lines that are printed
/// meanwhile appear above it.
void show_status(std::string_view text);

/// Flushes standard output. Throws WorldError, or ClosedPipe if the reader has closed the pipe.
void flush_standard_output();

}  // namespace tagrid
