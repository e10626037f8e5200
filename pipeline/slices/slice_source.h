// What gives the slices of a volume to an encoding, and the queue of slices between two threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <mutex>
#include <utility>

#include "pipeline/grid/slices.h"
#include "stages/grid/box.h"

namespace tagrid {

/// Gives complete rows of slices, in the order of z.
class SliceSource {
 public:
  virtual ~SliceSource() = default;
  /// The samples of `rows`, which are rows of one slice. Never called by two threads at once.
  virtual SliceSamples read(const Box& rows) = 0;
  /// No more slices are wanted. Another thread may call this during read(), which then throws instead of
  /// waiting.
  virtual void stop() {}
};

/// Slices that one thread has and another takes.
class SliceQueue {
 public:
  /// At most `most` slices wait in memory.
  explicit SliceQueue(std::size_t most) : most_(most) {}

  /// Waits until there is room for a slice. Returns false if the queue was closed.
  bool wait_for_room() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || waiting_.size() < most_; });
    return !closed_;
  }
  bool is_closed() const {
    const std::lock_guard lock(mutex_);
    return closed_;
  }
  /// REQUIRES: wait_for_room() returned true since the last slice; one thread puts slices.
  void put(SliceSamples slice) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(slice));
    changed_.notify_all();
  }
  /// Waits for the next slice. Throws what the queue was closed with if none is left.
  SliceSamples take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !waiting_.empty(); });
    if (waiting_.empty()) std::rethrow_exception(why_);
    SliceSamples slice = std::move(waiting_.front());
    waiting_.pop_front();
    changed_.notify_all();
    return slice;
  }
  /// Ends all waiting. The first call counts. REQUIRES: `why` is an exception.
  void close(std::exception_ptr why) {
    const std::lock_guard lock(mutex_);
    if (!closed_) why_ = std::move(why);
    closed_ = true;
    changed_.notify_all();
  }

 private:
  std::size_t most_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SliceSamples> waiting_;
  bool closed_ = false;
  std::exception_ptr why_;
};

}  // namespace tagrid
