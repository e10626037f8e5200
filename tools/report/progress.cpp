#include "tools/report/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "io/text/text.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

std::string duration(double seconds) {
  const auto s = static_cast<long long>(seconds + 0.5);
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                  : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

}  // namespace

ProgressStyle shown_style(ProgressStyle style, bool quiet) {
  if (quiet) return ProgressStyle::none;
  if (style != ProgressStyle::automatic) return style;
  return isatty(STDERR_FILENO) ? ProgressStyle::bar : ProgressStyle::none;
}

ProgressMeter::ProgressMeter(ProgressStyle style, bool quiet, std::string what, std::uint64_t unit_bytes)
    : style_(shown_style(style, quiet)), what_(printable(what)), unit_bytes_(unit_bytes) {}

ProgressMeter::~ProgressMeter() {
  if (drawn_) say_to_terminal("\r\033[K");
}

void ProgressMeter::update(std::uint64_t done, std::uint64_t total, Clock::time_point now) {
  if (style_ == ProgressStyle::none || total == 0) return;
  if (done < done_) start_ = now;
  done_ = done;
  const auto pause = style_ == ProgressStyle::bar ? std::chrono::milliseconds(200) : std::chrono::minutes(1);
  if (now - last_ < pause && (drawn_ || style_ != ProgressStyle::bar)) return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double part = static_cast<double>(done) / static_cast<double>(total);
  const double rate = seconds > 0 ? static_cast<double>(done * unit_bytes_) / seconds / 1e6 : 0;
  const std::string left = part > 0 && seconds > 0 ? duration(seconds / part - seconds) : "?";
  const std::string line = fmt::format("{} {:3.0f} %  {:.1f} MB/s  {} left", what_, 100 * part, rate, left);
  if (style_ == ProgressStyle::plain) {
    say_line(line);
    return;
  }
  constexpr int width = 30;
  const int filled = static_cast<int>(part * width);
  say_to_terminal(fmt::format("\r\033[K[{:#<{}}{: <{}}] {}", "", filled, "", width - filled, line));
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace tagrid
