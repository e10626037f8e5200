// Progress of long work, on the standard error.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace tagrid {

enum class ProgressStyle {
  automatic,  ///< a bar on a terminal, else nothing
  bar,
  plain,  ///< a line a minute
  none,
};

/// What that means here: bar, plain or none.
ProgressStyle shown_style(ProgressStyle style, bool quiet);

/// Draws while work goes on, and clears its bar when it ends.
class ProgressMeter {
 public:
  /// `unit_bytes`: bytes of one of the things that are counted.
  ProgressMeter(ProgressStyle style, bool quiet, std::string what, std::uint64_t unit_bytes);
  ~ProgressMeter();
  ProgressMeter(const ProgressMeter&) = delete;
  ProgressMeter& operator=(const ProgressMeter&) = delete;

  using Clock = std::chrono::steady_clock;

  void update(std::uint64_t done, std::uint64_t total, Clock::time_point now = Clock::now());

 private:
  ProgressStyle style_;
  std::string what_;
  std::uint64_t unit_bytes_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
  bool drawn_ = false;
};

}  // namespace tagrid
