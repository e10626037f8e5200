// What the caller of a run is told while it goes on.
#pragma once

#include <cstdint>
#include <functional>

namespace tagrid {

/// Told how many bytes of samples of how many are done; called by one thread at a time.
using Progress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Looks on while rows of bricks are worked on. What it throws ends the work.
struct Watch {
  /// Told how many bytes of samples were done since it was told last; called by one thread at a time.
  std::function<void(std::uint64_t bytes)> done;
  /// Called before something is read, perhaps while done() runs. May be empty.
  std::function<void()> before_reading = {};
};

/// Tells `progress`, which may be empty, how much of `total` is done.
inline Watch watch_for(const Progress& progress, std::uint64_t total) {
  if (!progress) return {[](std::uint64_t) {}};
  return {[progress, total, done = std::uint64_t{0}](std::uint64_t bytes) mutable {
    progress(done += bytes, total);
  }};
}

}  // namespace tagrid
