// Progress reports of a run to its caller.
#pragma once

#include <cstdint>
#include <functional>

namespace tagrid {

/// Takes the bytes of samples that are done, and their total. Called by one thread at a time.
using Progress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Watches the work on rows of bricks. An exception from it ends the work.
struct Watch {
  /// Takes the number of bytes of samples that were done since the previous call. Called by one thread at a
  /// time.
  std::function<void(std::uint64_t bytes)> done;
  /// Called before each read, perhaps while done() runs. May be empty.
  std::function<void()> before_reading = {};
};

/// A watch that passes the progress towards `total` to `progress`, which may be empty.
inline Watch watch_for(const Progress& progress, std::uint64_t total) {
  if (!progress) return {[](std::uint64_t) {}};
  return {[progress, total, done = std::uint64_t{0}](std::uint64_t bytes) mutable {
    progress(done += bytes, total);
  }};
}

}  // namespace tagrid
