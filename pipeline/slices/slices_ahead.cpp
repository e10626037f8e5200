#include "pipeline/slices/slices_ahead.h"

#include <memory>
#include <system_error>
#include <utility>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "pipeline/threads/node_times.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

// What a source looks at after the one that could stop it has ended.
constexpr std::atomic<bool> never{false};

std::shared_ptr<std::byte[]> memory_for(const VolumeSource& source, const Box& rows) {
  return std::make_shared_for_overwrite<std::byte[]>(
      memory_size(static_cast<std::uint64_t>(rows.count()) * size_of(source.info().type)));
}

void finish_after(VolumeSource& source, const Box& rows) {
  const Index3 dims = source.info().dims;
  if (rows.high.y == dims.y - 1 && rows.high.z == dims.z - 1) source.finish();
}

}  // namespace

SliceSamples read_input_slice(VolumeSource& source, const Box& rows) {
  const auto samples = memory_for(source, rows);
  source.read_rows(samples.get(), rows);
  finish_after(source, rows);
  return samples;
}

SliceSamples read_slice_on_threads(VolumeSource& source, const Box& rows) {
  if (!source.at_once()) return read_input_slice(source, rows);
  const Index3 dims = source.info().dims;
  const std::size_t row_bytes = static_cast<std::size_t>(dims.x) * size_of(source.info().type);
  const auto samples = memory_for(source, rows);
  share_rows(rows.size().y, row_bytes, 1, [&](std::int64_t first, std::int64_t count) {
    const TimeOfNode time(Node::read_samples);
    source.read_at(samples.get() + static_cast<std::size_t>(first) * row_bytes,
                   Box::of_size(dims).offset({0, rows.low.y + first, rows.low.z}), count * dims.x);
  });
  if (rows.high.y == dims.y - 1) source.seek_slice(rows.low.z + 1);
  finish_after(source, rows);
  return samples;
}

SlicesAhead::SlicesAhead(VolumeSource& source, std::int64_t count)
    : source_(source),
      count_(count),
      queue_(static_cast<std::size_t>(count)),
      no_longer_needed_(
          std::make_exception_ptr(WorldError(source.name() + ": its samples are no longer needed"))) {
  source_.stop_when(stopped_);
}

SliceSamples SlicesAhead::read(const Box& rows) {
  if (count_ > 0 && !thread_.joinable()) start();
  return count_ == 0 ? read_slice_on_threads(source_, rows) : queue_.take();
}

void SlicesAhead::start() {
  try {
    thread_ = std::thread([this] { read_all(); });
  } catch (const std::system_error&) {
    // The system gives no more threads: slices are read when they are asked for.
    count_ = 0;
  }
}

void SlicesAhead::read_all() {
  const Index3 dims = source_.info().dims;
  try {
    for (std::int64_t z = 0; z < dims.z && queue_.wait_for_room(); ++z)
      queue_.put(read_input_slice(source_, {{0, 0, z}, {dims.x - 1, dims.y - 1, z}}));
  } catch (...) {
    queue_.close(std::current_exception());
  }
}

void SlicesAhead::stop() {
  stopped_ = true;
  queue_.close(no_longer_needed_);
}

void SlicesAhead::end() {
  if (thread_.joinable()) {
    stop();
    thread_.join();
  }
  source_.stop_when(never);
}

}  // namespace tagrid
