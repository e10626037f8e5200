// The output of a decoding: first its memory, which the plan needs, then its samples.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "io/files/spool_file.h"
#include "io/volume/volume_sink.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/memory/resources.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// An output that is opened as late as possible: if a plan is refused, nothing was written to a pipe. If a
/// program writes the format, it is opened to learn how much memory that program needs.
class DecodeOutput {
 public:
  /// `of_samples` describes the samples. `others_write`: see SinkOptions. All arguments must outlive this.
  DecodeOutput(const DecodeRun& run, const VolumeInfo& of_samples, const WrittenNumbers& numbers,
               const CodingParameters& parameters, bool others_write = false);

  /// The result of make(bytes of memory that writing takes, in this process and in the program), a plan.
  /// Throws a limit that it cannot keep as a UsageError that says how much of it is for the program.
  template <class Make>
  auto plan(Make make) {
    try {
      return make(run_.format.memory(info_) + memory_of_program());
    } catch (const MemoryLimit& limit) {
      const std::uint64_t bytes = memory_of_program();
      if (bytes == 0) throw;
      throw_for_writer(limit, program(), bytes);
    }
  }
  /// Samples can be written in any order.
  bool any_order() const;
  /// Opens the output. Throws UsageError if the machine lacks the memory for the program and no limit is set.
  std::shared_ptr<VolumeSink> begin();

 private:
  WriterProgram program() const;
  std::uint64_t memory_of_program();
  void open();

  const DecodeRun& run_;
  VolumeInfo info_;
  WriteOptions options_;
  std::shared_ptr<VolumeSink> sink_;
};

/// Passes samples to a sink at their positions; in raster order through a temporary file for a layer of
/// bricks.
class RowOutput {
 public:
  /// `spool_folder`: the directory of the temporary file; "" if rows come in the order of the sink.
  RowOutput(VolumeSink& sink, const std::string& spool_folder, const std::string& name);

  /// REQUIRES: rows come in the order of their bricks.
  void write(const DecodedRows& rows);

 private:
  void through_spool(const DecodedRows& rows, SpoolFile& spool);

  VolumeSink& sink_;
  std::optional<SpoolFile> spool_;
};

}  // namespace tagrid
