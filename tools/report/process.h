// Signals, standard streams and memory of the process.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string_view>
#include <utility>

namespace tagrid {

/// Makes sure that descriptors 0, 1 and 2 are taken, so that no file of the program becomes a standard stream
/// that the caller closed. Reading or writing such a stream fails.
void occupy_standard_streams();

/// From now on, a signal that ends the process first removes the temporary files. Signals that the caller
/// ignores stay ignored. If a file grows over its limit, that is a write error instead of a signal.
void catch_signals();

/// Sets up the heap for speed: memory that a brick has freed is kept for the next one.
void keep_freed_memory();
/// Sets up the heap for a limit on memory, in bytes: large blocks go back to the system when freed.
void give_back_freed_memory(std::uint64_t limit);

/// The peak resident memory of this process so far, in bytes.
std::uint64_t peak_memory();
/// The processor time of all threads of this process so far, in seconds.
double processor_seconds();

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
/// Of the terminal that standard error is; npos of std::string if it is none.
std::size_t columns_of_terminal();

/// Flushes standard output. Throws WorldError, or ClosedPipe if the reader has closed the pipe.
void flush_standard_output();

}  // namespace tagrid
