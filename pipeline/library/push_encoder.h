// An encoder that is fed slices, for callers that compute samples instead of reading them from a file.
#pragma once

#include <atomic>
#include <exception>
#include <optional>
#include <thread>

#include "io/files/output_file.h"
#include "io/tag/file.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"
#include "pipeline/encode/overviews.h"
#include "pipeline/job/job.h"
#include "pipeline/job/options.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "pipeline/slices/slice_source.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Encodes, on its own threads, the slices that one thread feeds. One thread at a time calls the sink.
class PushEncoder {
 public:
  /// Begins the file. `out` and the objects that `progress` uses must outlive the encoder. `samples`: the
  /// volume, where some options follow from its samples; it is read only here. Overviews need temporary files
  /// in `resources.spool`, which must be given. Throws UsageError if the volume does not allow the options,
  /// or if the limit on memory cannot be kept; WorldError if the temporary file cannot be created.
  PushEncoder(const VolumeInfo& info, const EncodeOptions& options, const Resources& resources, ByteSink& out,
              Progress progress, VolumeSource* samples = nullptr);
  /// Ends the work, whether it is complete or not.
  ~PushEncoder();
  PushEncoder(const PushEncoder&) = delete;
  PushEncoder& operator=(const PushEncoder&) = delete;

  /// The smallest limit on memory that can be kept.
  static std::uint64_t smallest_memory(const VolumeInfo& info, const EncodeOptions& options);

  /// Copies the next slices, which are laid out by `strides`. Waits while enough slices are queued. Throws
  /// the failure of the encoding, and UsageError for too many slices.
  void write(const std::byte* samples, std::int64_t slices, const Strides& strides);
  /// Waits for the end of the file. Throws the failure of the encoding, and UsageError if slices are missing.
  void finish();

  /// REQUIRES: finish().
  const TagHeader& header() const { return job_.header; }
  const TagIndex& index() const { return writer_->index(); }
  TagSizes sizes() const { return writer_->sizes(); }

 private:
  static constexpr std::size_t most_waiting = 2;  // slices

  class Slices;
  class CallersWatch;

  void run();
  /// Waits for the end of the work, and throws its failure.
  void wait_for_end();

  EncodeJob job_;
  Progress progress_;
  OverviewsOfStream overviews_;
  std::optional<TagWriter> writer_;
  std::int64_t fed_ = 0;  ///< slices

  SliceQueue queue_{most_waiting};
  std::atomic<bool> given_up_ = false;  ///< the caller has given up
  std::exception_ptr failure_;          ///< of the work; set when it has ended
  std::thread worker_;
};

}  // namespace tagrid
