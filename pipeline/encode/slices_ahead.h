// Reads slices ahead of the encoder if another process decodes them, so that both work at once.
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

/// As read_input_slice(), with the threads of this arena if the source can be read by several.
SliceSamples read_slice_on_threads(VolumeSource& source, const Box& rows);

/// Gives the slices of a source in order. Its own thread, which mostly waits, reads them.
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
  /// Makes reads throw WorldError once `stop` is true. It must outlive them, and the source's after end().
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
