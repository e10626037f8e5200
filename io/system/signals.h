// Signals that end this process, and what their handler may do.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace tagrid {

/// From now on, a signal that would end this process calls `handler` once with its number. Signals that are
/// ignored stay ignored. If a file grows over its limit, that is a write error instead of a signal.
void catch_end_signals(void (*handler)(int));

/// Calls for a handler of signals: they can come at any time, even within another call.
namespace in_handler {
void rename(const char* from, const char* to) noexcept;
void unlink(const char* path) noexcept;
/// Removes an empty directory.
void remove_folder(const char* path) noexcept;
/// Removes a directory with all that is in it.
void remove_with_files(const char* folder) noexcept;
/// Writes to standard error.
void say(const char* text, std::size_t size) noexcept;
[[noreturn]] void exit(int code) noexcept;
/// Ends this process by a signal; a handler must return after it.
void end_by(int signal) noexcept;
}  // namespace in_handler

/// The end signals, which are kept from the process while this exists, and can be read instead.
class EndSignals {
 public:
  /// Throws WorldError.
  EndSignals();
  ~EndSignals();
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  /// Something that wait_for() knows: it can be read once a signal has come.
  int descriptor() const;
  /// From now on, a second one ends the process at once. REQUIRES: one can be read.
  void let_through();
  /// Shows an address in the user's browser, to which the signals come as to this process before. Returns why that
  /// cannot be done, or "".
  std::string open_in_browser(const std::string& address) const;

 private:
  struct Kept;
  std::unique_ptr<Kept> kept_;
};

}  // namespace tagrid
