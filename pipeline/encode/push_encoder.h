// An encoding that is fed slices: for callers that make samples instead of having a file of them.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "io/files/byte_sink.h"
#include "io/tag/file.h"
#include "io/volume/volume_info.h"
#include "pipeline/encode/options.h"
#include "pipeline/encode/slices.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"
#include "stages/volume/samples.h"

namespace tagrid {

/// Encodes on threads of its own what one thread feeds. Bytes of the file go to a sink, which is called by
/// one thread at a time.
class PushEncoder {
 public:
  /// Begins the file. `out` and what `progress` needs outlive the encoder. Throws UsageError for options that
  /// the volume does not allow, and for a limit on memory that cannot be kept.
  PushEncoder(const VolumeInfo& info, const EncodeOptions& options, const Resources& resources, ByteSink& out,
              Progress progress);
  /// Ends the work, whether it is complete or not.
  ~PushEncoder();
  PushEncoder(const PushEncoder&) = delete;
  PushEncoder& operator=(const PushEncoder&) = delete;

  /// The smallest limit on memory that can be kept.
  static std::uint64_t smallest_memory(const VolumeInfo& info, const EncodeOptions& options);

  /// Feeds the next slices, whose samples lie where `strides` says; they are copied. Waits while enough of
  /// them are there. Throws what made the encoding fail, and UsageError for more slices than the volume has.
  void write(const std::byte* samples, std::int64_t slices, const Strides& strides);
  /// Waits for the end of the file. Throws what made the encoding fail, and UsageError where slices are
  /// missing.
  void finish();

  /// REQUIRES: finish().
  const TagHeader& header() const { return header_; }
  const TagIndex& index() const { return writer_->index(); }
  TagSizes sizes() const { return writer_->sizes(); }

 private:
  static constexpr std::size_t most_waiting = 2;  // slices

  void run();
  SliceSamples take();
  void wait_for_room();
  void end_work() noexcept;

  TagHeader header_;
  EncodePlan plan_;
  Progress progress_;
  std::optional<TagWriter> writer_;
  std::int64_t fed_ = 0;  ///< slices

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SliceSamples> waiting_;
  std::atomic<bool> given_up_ = false;  ///< by the caller
  bool ended_ = false;                  ///< the work
  std::exception_ptr failure_;
  std::thread worker_;
};

}  // namespace tagrid
