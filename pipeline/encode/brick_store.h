// Where the bricks of an encoding go until they are a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "io/envelope/envelope.h"
#include "io/volume/volume_source.h"
#include "pipeline/encode/encode_run.h"
#include "pipeline/job/settle.h"

namespace tagrid {

/// How a store reads the source.
struct Reading {
  bool any_rows = true;      ///< rows of slices in any order
  std::uint64_t memory = 0;  ///< that reading takes, besides the samples of the plan
};

/// Encodes the bricks of a job and makes a file of them: one stream by this process, or parts by many. The
/// functions are called in this order; see encode_into(). Without commit(), the destructor leaves nothing,
/// unless the run can be continued. All functions throw WorldError and BrokenInput.
class BrickStore {
 public:
  BrickStore() = default;
  virtual ~BrickStore() = default;
  BrickStore(const BrickStore&) = delete;
  BrickStore& operator=(const BrickStore&) = delete;

  virtual Reading reading(const VolumeSource& source) const = 0;
  /// Before a sample is read. Returns what an earlier run has found. Throws UsageError if the output may not be
  /// written.
  virtual EarlierFindings begin(const ResolvedOptions& options, const VolumeSource& source) = 0;
  /// Takes the job. Returns false if an earlier run has already made its file. Throws UsageError if an earlier
  /// run had another job.
  virtual bool take(const EncodeJob& job, const VolumeSource& source) = 0;
  /// Encodes all bricks. Adds what that took to `result`: memory, bytes_in, times_read.
  virtual void encode(const EncodeJob& job, std::unique_ptr<VolumeSource>& source, EncodeResult& result) = 0;
  /// As look_at_contents() in pipeline/restore.
  virtual void look_at(SourceFiles& files, bool exact) = 0;
  virtual void write_envelope(std::span<const std::byte> bytes) = 0;
  /// Writes the end of the file. Sets index, file_bytes and temporary of `result`.
  virtual void finish(EncodeResult& result) = 0;
  /// Gives the file its name.
  virtual void commit() = 0;
};

}  // namespace tagrid
