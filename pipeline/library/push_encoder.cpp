#include "pipeline/library/push_encoder.h"

#include <cstring>

#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "pipeline/encode/graph.h"
#include "pipeline/memory/plan.h"
#include "pipeline/settle/settle.h"

namespace tagrid {
namespace {

// Ends the work. The caller has given up and does not see this exception.
struct GivenUp {};

std::uint64_t bytes_of_slice(const VolumeInfo& info) {
  return *sample_bytes({info.dims.x, info.dims.y, 1}, info.type);
}

// Bounds are those of samples, whatever these stand for.
SourceFacts facts_of(const VolumeInfo& info) {
  SourceFacts facts;
  facts.info = info;
  return facts;
}

EncodeJob job_for(const VolumeInfo& info, const EncodeOptions& options, const Resources& resources,
                  std::uint64_t waiting, VolumeSource* samples) {
  Settling settling{
      .resources = resources, .any_rows = false, .needs = {.besides = waiting * bytes_of_slice(info)}};
  // Slices come once, so they cannot be spooled.
  settling.resources.spool.reset();
  return samples == nullptr ? settle(options, facts_of(info), settling) : settle(options, *samples, settling);
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
  const ResolvedOptions resolved = in_samples(options, facts_of(info));
  return smallest_memory_of_encoding(resolved.parameters, false, most_waiting * bytes_of_slice(info),
                                     !resolved.overviews.empty());
}

PushEncoder::~PushEncoder() {
  given_up_ = true;
  queue_.close(std::make_exception_ptr(GivenUp()));
  if (worker_.joinable()) worker_.join();
}

class PushEncoder::Slices : public SliceSource {
 public:
  explicit Slices(SliceQueue& queue) : queue_(queue) {}
  SliceSamples read(const Box&) override { return queue_.take(); }
  void stop() override { queue_.close(std::make_exception_ptr(GivenUp())); }

 private:
  SliceQueue& queue_;
};

// All slices may be there although the caller no longer wants the file.
class PushEncoder::CallersWatch : public ProgressWatch {
 public:
  CallersWatch(const PushEncoder& of, std::uint64_t total) : ProgressWatch(of.progress_, total), of_(of) {}
  void before_reading() override {
    if (of_.given_up_) throw GivenUp();
  }
  void done(std::uint64_t bytes) override {
    before_reading();
    ProgressWatch::done(bytes);
  }

 private:
  const PushEncoder& of_;
};

// Runs in the thread of the encoder.
void PushEncoder::run() {
  const CodingParameters& parameters = job_.parameters();
  Slices slices(queue_);
  CallersWatch watch(*this, sample_bytes(parameters.dims, parameters.type).value());
  try {
    encode(job_, BrickRows::all(parameters.bricks()), slices, *writer_, watch, overviews_.sums());
    overviews_.write(*writer_, watch);
    writer_->finish();
  } catch (...) {
    failure_ = std::current_exception();
  }
  queue_.close(std::make_exception_ptr(GivenUp()));
}

void PushEncoder::wait_for_end() {
  if (worker_.joinable()) worker_.join();
  if (failure_) std::rethrow_exception(failure_);
}

void PushEncoder::write(const std::byte* samples, std::int64_t slices, const Strides& strides) {
  const CodingParameters& parameters = job_.parameters();
  const std::size_t bytes =
      memory_size(*sample_bytes({parameters.dims.x, parameters.dims.y, 1}, parameters.type));
  if (slices < 0 || slices > parameters.dims.z - fed_)
    throw UsageError("{} more slices were given, but only {} of {} are missing", slices,
                     parameters.dims.z - fed_, parameters.dims.z);
  for (; slices > 0; --slices, ++fed_, samples += strides[2]) {
    // A slice copied before the wait would be one more than the plan counts.
    if (!queue_.wait_for_room()) wait_for_end();
    auto slice = std::make_shared_for_overwrite<std::byte[]>(bytes);
    copy_slice(samples, strides, parameters.dims, size_of(parameters.type), slice.get());
    queue_.put(std::move(slice));
  }
}

void PushEncoder::finish() {
  if (fed_ < job_.parameters().dims.z) {
    if (queue_.is_closed()) wait_for_end();
    throw UsageError("only {} of {} slices were given", fed_, job_.parameters().dims.z);
  }
  wait_for_end();
}

}  // namespace tagrid
