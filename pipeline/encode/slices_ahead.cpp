#include "pipeline/encode/slices_ahead.h"

#include <chrono>
#include <system_error>
#include <utility>

#include "io/errors/errors.h"
#include "pipeline/job/source_survey.h"
#include "pipeline/threads/node_times.h"
#include "pipeline/threads/threads.h"

namespace tagrid {

SliceSamples read_slice_on_threads(VolumeSource& source, const Box& rows) {
  if (!source.at_once()) return read_input_slice(source, rows);
  const VolumeInfo& info = source.info();
  const std::size_t row_bytes = static_cast<std::size_t>(info.dims.x) * size_of(info.type);
  return read_input_slice(source, rows, [&](std::byte* samples) {
    share_rows(rows.size().y, row_bytes, 1, [&](std::int64_t first, std::int64_t count) {
      const TimeOfNode time(Node::read_samples);
      source.read_at(samples + static_cast<std::size_t>(first) * row_bytes,
                     Box::of_size(info.dims).offset({0, rows.low.y + first, rows.low.z}),
                     count * info.dims.x);
    });
    if (rows.high.y == info.dims.y - 1) source.seek_slice(rows.low.z + 1);
  });
}

SliceSamples SlicesAhead::read(const Box& rows) {
  using namespace std::chrono_literals;
  if (count_ > 0 && !thread_.joinable()) start();
  if (count_ == 0) return read_slice_on_threads(source_, rows);
  std::unique_lock lock(mutex_);
  while (waiting_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    if (stopped_ != nullptr && *stopped_)
      throw WorldError(source_.name() + ": its samples are no longer needed");
    changed_.wait_for(lock, 100ms);
  }
  SliceSamples slice = std::move(waiting_.front());
  waiting_.pop_front();
  changed_.notify_all();
  return slice;
}

void SlicesAhead::start() {
  try {
    thread_ = std::thread([this] { read_all(); });
  } catch (const std::system_error&) {
    // The system gives no more threads: slices are read when they are asked for.
    count_ = 0;
    if (stopped_ != nullptr) source_.stop_when(*stopped_);
  }
}

void SlicesAhead::read_all() {
  const Index3 dims = source_.info().dims;
  try {
    for (std::int64_t z = 0; z < dims.z; ++z) {
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return std::ssize(waiting_) < count_ || ending_; });
      }
      if (ending_) return;
      SliceSamples slice = read_input_slice(source_, {{0, 0, z}, {dims.x - 1, dims.y - 1, z}});
      const std::lock_guard lock(mutex_);
      waiting_.push_back(std::move(slice));
      changed_.notify_all();
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    changed_.notify_all();
  }
}

void SlicesAhead::stop_when(const std::atomic<bool>& stop) {
  stopped_ = &stop;
  source_.stop_when(count_ == 0 ? stop : ending_);
}

void SlicesAhead::end() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    changed_.notify_all();
  }
  thread_.join();
  if (stopped_ != nullptr) source_.stop_when(*stopped_);
}

}  // namespace tagrid
