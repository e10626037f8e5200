#include "pipeline/encode/push_encoder.h"

#include <fmt/format.h>

#include <cstring>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "pipeline/encode/graph.h"

namespace tagrid {
namespace {

// Ends the work. The caller has given up and does not see this exception.
struct GivenUp {};

std::uint64_t slice_bytes(const CodingParameters& parameters) {
  return *sample_bytes({parameters.dims.x, parameters.dims.y, 1}, parameters.type);
}

// Bounds are those of samples, whatever these stand for.
ResolvedOptions resolved_for(const VolumeInfo& info, const EncodeOptions& options) {
  SourceFacts facts;
  facts.info = info;
  return in_samples(options, facts);
}

EncodeJob job_for(const VolumeInfo& info, const EncodeOptions& options, Resources resources,
                  std::uint64_t waiting, VolumeSource* samples) {
  const ResolvedOptions resolved = resolved_for(info, options);
  // Slices come once, so they cannot be spooled.
  resources.spool.clear();
  const EncodePlan plan = plan_encoding(
      resolved.parameters, resources, false,
      {.besides = waiting * slice_bytes(resolved.parameters), .sums = !resolved.overviews.empty()});
  return samples == nullptr ? settle(resolved, plan) : settle(resolved, plan, *samples);
}

// Copies the rows of a slice without gaps.
void copy_slice(const std::byte* from, const Strides& strides, const Index3& dims, std::size_t size,
                std::byte* to) {
  for (std::int64_t y = 0; y < dims.y; ++y)
    for (std::int64_t x = 0; x < dims.x; ++x, to += size)
      std::memcpy(to, from + y * strides[1] + x * strides[0], size);
}

}  // namespace

PushEncoder::PushEncoder(const VolumeInfo& info, const EncodeOptions& options, const Resources& resources,
                         ByteSink& out, Progress progress, VolumeSource* samples)
    : job_(job_for(info, options, resources, most_waiting, samples)),
      progress_(std::move(progress)),
      overviews_(job_.header, job_.overviews, resources, "the output") {
  writer_.emplace(out, job_.header);
  worker_ = std::thread([this] { run(); });
}

std::uint64_t PushEncoder::smallest_memory(const VolumeInfo& info, const EncodeOptions& options) {
  const ResolvedOptions resolved = resolved_for(info, options);
  return smallest_memory_of_encoding(resolved.parameters, false,
                                     most_waiting * slice_bytes(resolved.parameters),
                                     !resolved.overviews.empty());
}

PushEncoder::~PushEncoder() {
  {
    const std::lock_guard lock(mutex_);
    given_up_ = true;
  }
  changed_.notify_all();
  if (worker_.joinable()) worker_.join();
}

// Runs in the thread of the encoder.
void PushEncoder::run() {
  const CodingParameters& parameters = job_.parameters();
  Watch watch = watch_for(progress_, sample_bytes(parameters.dims, parameters.type).value());
  watch.done = [&, done = watch.done](std::uint64_t bytes) {
    // All slices may be available, but the caller no longer wants the file.
    require_caller();
    done(bytes);
  };
  std::exception_ptr failure;
  try {
    RowEncoder encoder(parameters, job_.plan, [&](const Box&) { return take(); });
    overviews_.sum_blocks_of(encoder);
    encoder.encode(BrickRows::all(parameters.bricks()), *writer_, watch);
    overviews_.write(*writer_, [&] { require_caller(); });
    writer_->finish();
  } catch (...) {
    failure = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  failure_ = failure;
  ended_ = true;
  changed_.notify_all();
}

void PushEncoder::require_caller() const {
  if (given_up_) throw GivenUp();
}

SliceSamples PushEncoder::take() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return given_up_ || !waiting_.empty(); });
  require_caller();
  SliceSamples slice = std::move(waiting_.front());
  waiting_.pop_front();
  changed_.notify_all();
  return slice;
}

// Only this thread adds slices. A slice copied before the wait would be one more than the plan counts.
void PushEncoder::wait_for_room() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return ended_ || waiting_.size() < most_waiting; });
  if (failure_) std::rethrow_exception(failure_);
}

void PushEncoder::write(const std::byte* samples, std::int64_t slices, const Strides& strides) {
  const CodingParameters& parameters = job_.parameters();
  if (slices < 0 || slices > parameters.dims.z - fed_)
    throw UsageError(fmt::format("{} more slices were given, but only {} of {} are missing", slices,
                                 parameters.dims.z - fed_, parameters.dims.z));
  for (; slices > 0; --slices, ++fed_, samples += strides[2]) {
    wait_for_room();
    auto slice = std::make_shared_for_overwrite<std::byte[]>(memory_size(slice_bytes(parameters)));
    copy_slice(samples, strides, parameters.dims, size_of(parameters.type), slice.get());
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(slice));
    changed_.notify_all();
  }
}

void PushEncoder::finish() {
  std::unique_lock lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  if (fed_ < job_.parameters().dims.z)
    throw UsageError(fmt::format("only {} of {} slices were given", fed_, job_.parameters().dims.z));
  changed_.wait(lock, [&] { return ended_; });
  if (failure_) std::rethrow_exception(failure_);
}

}  // namespace tagrid
