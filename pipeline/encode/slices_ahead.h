// Reads slices ahead of those that are encoded, if another process decodes them: it then works while bricks
// are encoded, however many threads do that.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "io/volume/volume_source.h"
#include "pipeline/grid/slices.h"

namespace tagrid {

/// Gives the slices of a source, one after the other. A thread of its own, which waits for the other process
/// most of the time, reads them.
class SlicesAhead {
 public:
  /// At most `count` slices wait in memory. With 0 there is no thread: rows are read when they are asked for.
  /// `source` must outlive this. REQUIRES: count = 0, or the source is at its beginning.
  SlicesAhead(VolumeSource& source, std::int64_t count) : source_(source), count_(count) {}
  ~SlicesAhead() { end(); }
  SlicesAhead(const SlicesAhead&) = delete;
  SlicesAhead& operator=(const SlicesAhead&) = delete;

  /// As read_input_slice(). REQUIRES: count = 0, or `rows` are the next slice.
  SliceSamples read(const Box& rows);
  /// From now on, a read that waits throws WorldError as soon as `stop` is true. `stop` must outlive the
  /// reads, and those of the source after end().
  void stop_when(const std::atomic<bool>& stop);
  /// Ends the thread; from now on, the source belongs to the caller again.
  void end();

 private:
  void start();
  void read_all();

  VolumeSource& source_;
  std::int64_t count_;
  const std::atomic<bool>* stopped_ = nullptr;  ///< what the caller stops reads with
  std::atomic<bool> ending_{false};             ///< what stops the thread
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SliceSamples> waiting_;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace tagrid
