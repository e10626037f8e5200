// The request for the encoding of a volume, and its result.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/volume/volume_source.h"
#include "pipeline/job/job.h"
#include "pipeline/job/options.h"
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

}  // namespace tagrid
