#include "tools/report/process.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/temporaries.h"
#include "io/system/signals.h"
#include "io/system/this_process.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::string_view clear_line = "\r\033[K";
std::mutex terminal;  ///< of the two that follow, and of what is written
std::string status;   ///< what the last line shows
std::atomic<bool> status_is_shown{false};

void write_to_terminal(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stderr) < text.size()) std::clearerr(stderr);
}

/// `text` without what does not fit on a line: a line that wraps cannot be cleared.
std::string_view on_one_line(std::string_view text) {
  const std::size_t most = columns_of_terminal();
  std::size_t columns = 0;
  for (std::size_t i = 0; i < text.size(); ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80 && ++columns == most) return text.substr(0, i);
  return text;
}

void end_by_signal(int number) {
  if (signal_waits(number)) return;
  unlink_temporaries();
  if (status_is_shown) in_handler::say(clear_line.data(), clear_line.size());
  if (code_after_signal() >= 0) {
    write_message_after_signal();
    in_handler::exit(code_after_signal());
  }
  in_handler::end_by(number);
}

}  // namespace

void catch_signals() { catch_end_signals(end_by_signal); }

namespace {

// Texts with secrets, and what is shown in place of them.
std::vector<std::pair<std::string, std::string>>& secrets() {
  static std::vector<std::pair<std::string, std::string>> all;
  return all;
}

std::string without_secrets(std::string_view text) {
  std::string shown_text(text);
  for (const auto& [secret, shown] : secrets())
    for (std::size_t at = 0; (at = shown_text.find(secret, at)) != shown_text.npos; at += shown.size())
      shown_text.replace(at, secret.size(), shown);
  return shown_text;
}

}  // namespace

void show_instead_of(const std::string& text, const std::string& shown) {
  if (!text.empty() && text != shown) secrets().emplace_back(text, shown);
}

void say_line(std::string_view text) {
  const std::lock_guard lock(terminal);
  std::string line = printable(without_secrets(text)) + "\n";
  if (!status.empty()) line = std::string(clear_line) + line + status;
  write_to_terminal(line);
}

void show_status(std::string_view text) {
  const std::lock_guard lock(terminal);
  const std::string shown = printable(without_secrets(text));
  status = on_one_line(shown);
  status_is_shown = !status.empty();
  write_to_terminal(std::string(clear_line) + status);
  std::fflush(stderr);
}

void flush_standard_output() {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return;
  if (errno == EPIPE) throw ClosedPipe("standard output: the reader closed the pipe");
  throw world_error("cannot write", "standard output", errno);
}

}  // namespace tagrid
