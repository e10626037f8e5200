// The request for the encoding of a volume, the store of its bricks, and its result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/envelope/envelope.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/volume/volume_source.h"
#include "pipeline/job/options.h"
#include "pipeline/job/settle.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct EncodeRun {
  std::string input;  ///< "-": the standard input
  SourceDescription source = {};
  std::string output;  ///< "-": the standard output
  bool overwrite = false;
  EncodeOptions options = {};
  Resources resources{0};  ///< per rank; 0 threads: all that the rank may use
  Progress progress = {};
  /// While the largest error is searched for: the progress of each try.
  Progress searching = {};

  /// Also keeps what the source files have besides samples, unless options.strip; see io/envelope.
  bool keep_files = false;
  /// Continues or begins a run that is recorded in `.NAME.parts/`. If false, a run that fails leaves nothing.
  bool resume = false;
  /// The file will be compared with the input, with the same limit on memory: see plan_encoding().
  bool verified = false;
  /// The name and version of the encoding program, for the record: another program may produce other bytes.
  std::string program = {};
  /// Called once if an earlier run is continued, with the number of its complete parts.
  std::function<void(std::int64_t there, std::int64_t parts)> goes_on = {};
  TellOfCopy before_copy =
      {};  ///< called before the samples are copied, because they are read more than once
  /// Called right before the output gets its name, while no other process can name or remove it. May throw.
  std::function<void()> before_name = {};
};

struct EncodeResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;         ///< read, headers included
  std::uint64_t file_bytes = 0;       ///< written
  std::string temporary;              ///< the file's path before it gets its name; "" for pipes and devices
  std::uint64_t memory = 0;           ///< the plan's upper limit
  std::vector<std::string> warnings;  ///< of the source
  std::string missing_of_voxel_size;  ///< see SourceFacts
  std::string reason_of_bound;        ///< how the largest error follows from the samples; see EncodeJob
  std::string lossy_source;  ///< how samples were compressed with a loss before; "" if nothing says that
  std::string why_not_restorable;  ///< why the source files cannot be restored; "" if they can
  double times_read = 0;           ///< how often a sample was read for encoding, on average
  bool was_complete = false;  ///< the output existed: it was compared with the input, and not written anew
};

using FinishedEncode = Finished<EncodeResult>;

/// Whether an earlier run has made the file of a job.
enum class Made : std::uint8_t {
  no,
  yes,       ///< as its record says
  in_doubt,  ///< a file has the name of the output, and no record says what it is
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

  /// How the store reads the source.
  virtual Reading reading(const VolumeSource& source) const = 0;
  /// Before a sample is read. Returns earlier findings. Throws UsageError if the output must not be written.
  virtual EarlierFindings begin(const ResolvedOptions& options, const VolumeSource& source) = 0;
  /// Takes the job, unless an earlier run may have made the file. Throws UsageError if that run had another
  /// job.
  virtual Made take(const EncodeJob& job, const VolumeSource& source) = 0;
  /// Encodes all bricks of the volume, or of the first one of several. Adds what that took to `result`: memory, bytes_in, times_read.
  virtual void encode(const EncodeJob& job, std::unique_ptr<VolumeSource>& source, EncodeResult& result) = 0;
  /// Encodes the other volumes of a source of several, each as a member of the file, after the envelope.
  virtual void encode_others(const EncodeJob& job, VolumeSource& source, EncodeResult& result) = 0;
  /// As look_at_contents() in pipeline/restore.
  virtual void look_at(SourceFiles& files, bool exact) = 0;
  virtual void write_envelope(std::span<const std::byte> bytes) = 0;
  /// Writes the end of the file. Sets index, file_bytes and temporary of `result`.
  virtual void finish(EncodeResult& result) = 0;
  /// Gives the file its name.
  virtual void commit() = 0;
};

}  // namespace tagrid
