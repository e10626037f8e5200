// Shows the progress of long work on standard error.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace tagrid {

enum class ProgressStyle {
  automatic,  ///< a bar on a terminal, otherwise nothing
  bar,
  plain,  ///< a line per minute
  none,
};

/// The style for this terminal: bar, plain or none.
ProgressStyle shown_style(ProgressStyle style, bool quiet);

/// Draws while work goes on, and clears its bar at the end.
class ProgressMeter {
 public:
  /// `unit_bytes`: bytes of one counted item.
  ProgressMeter(ProgressStyle style, bool quiet, std::string what, std::uint64_t unit_bytes);
  ~ProgressMeter();
  ProgressMeter(const ProgressMeter&) = delete;
  ProgressMeter& operator=(const ProgressMeter&) = delete;

  using Clock = std::chrono::steady_clock;

  /// Counts time from here on. Without it, time counts from the beginning of the meter.
  void begin(Clock::time_point now = Clock::now()) { start_ = now; }

  /// Updates the meter, and must not outlive it. Work that is repeated restarts below what was done.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress() {
    return [this](std::uint64_t done, std::uint64_t total) { update(done, total); };
  }
  void update(std::uint64_t done, std::uint64_t total, Clock::time_point now = Clock::now());

 private:
  ProgressStyle style_;
  std::string what_;
  std::uint64_t unit_bytes_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
  std::uint64_t done_ = 0;
  bool drawn_ = false;
};

}  // namespace tagrid
