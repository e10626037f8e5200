// Shows the progress of long work on standard error.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "pipeline/progress/progress.h"

namespace tagrid {

enum class ProgressStyle {
  automatic,  ///< a bar on a terminal, otherwise nothing
  bar,
  plain,  ///< a line every 30 seconds
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
  Progress progress() {
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

/// The same for the volumes of a list. It also draws while nothing is counted, as when a volume is opened: a thread
/// of its own draws, if the system allows it one.
class ListMeter {
 public:
  using Clock = std::chrono::steady_clock;

  /// `volumes`: of the list; nothing while it is being made. `pause`: between two lines of the plain style.
  ListMeter(ProgressStyle style, bool quiet, std::optional<std::uint64_t> volumes,
            std::chrono::milliseconds pause = std::chrono::seconds(30));
  ~ListMeter();
  ListMeter(const ListMeter&) = delete;
  ListMeter& operator=(const ListMeter&) = delete;

  /// The volume that is processed from now on, as the list names it.
  void begin_volume(const std::string& name);
  /// How much of it is done, in bytes of its samples.
  void update(std::uint64_t done, std::uint64_t total);
  /// A volume is done. `bytes` of it were read: 0 if there was nothing to do, so that the rate and the time left are
  /// those of other volumes.
  void end_volume(std::uint64_t bytes);

  /// "2 of 12 volumes, 1.20 GB, 45.2 MB/s, 3:12 left; 45 % of knee.nrrd", after `seconds`. If the
  /// name does not fit into `columns`, only its end is shown, or nothing. "2 volumes found; scans/2019" if the list is
  /// being made.
  std::string text(double seconds, std::size_t columns = std::string::npos) const;

 private:
  /// `volumes`: of the list.
  std::string counts(std::uint64_t volumes, double seconds) const;
  double part_of_volume() const;
  void draw_until_end();

  ProgressStyle style_;
  std::optional<std::uint64_t> volumes_;
  std::uint64_t ended_ = 0, worked_ = 0, bytes_ = 0;
  std::string name_;  ///< of the volume that is processed; "" between two of them
  std::uint64_t done_ = 0, total_ = 0;
  Clock::time_point start_ = Clock::now();
  std::chrono::milliseconds pause_;
  mutable std::mutex mutex_;
  std::condition_variable end_;
  bool is_over_ = false;
  std::thread thread_;
};

}  // namespace tagrid
