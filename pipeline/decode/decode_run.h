// The request for the decoding of a .tag file, its output, and its result.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/files/spool_file.h"
#include "io/formats/table/formats.h"
#include "io/tag/bricks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/volume/volume_sink.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/decode/values.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The requested region of a volume whose size is not known yet.
struct WantedRegion {
  /// Samples from `low` up to, but not including, `high` on each axis; the ends of the volume if not given.
  std::array<std::optional<std::int64_t>, 3> low, high;
  /// Only samples whose coordinates in the entire volume are multiples of `step` on all axes.
  std::int64_t step = 1;

  /// True if it is the entire volume.
  bool is_all() const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (low[axis] || high[axis]) return false;
    return step == 1;
  }
};

struct DecodeRun {
  std::string input;   ///< "-": the standard input
  std::string output;  ///< "-": the standard output
  const Format& format = format_named("nrrd");
  bool overwrite = false;
  WantedRegion region = {};  ///< in samples of the volume, even of an overview
  /// The number of the volume that is decoded, from 0 on. Without it, all volumes of the file are decoded to
  /// formats that have several. REQUIRES: a regular file as input, if it is given.
  std::optional<std::int64_t> volume = {};
  /// The factor of the overview that is decoded; 0: the volume itself. REQUIRES: 0, or a regular file as input
  /// and region.step = 1.
  std::int64_t overview = 0;
  Numbers numbers = Numbers::automatic;
  /// If set, a damaged file is not an error. Samples of damaged bricks become this value, which must fit the
  /// output type, and the result lists them. REQUIRES: the input is a regular file.
  std::optional<double> fill = {};
  std::map<std::string, std::string> wishes = {};  ///< WriteOptions::wishes; those about errors are added
  Resources resources{0};                          ///< per rank; 0 threads: all that the rank may use
  Progress progress = {};
};

/// The bytes of the file that is decoded: the input, or the volume or overview in it. REQUIRES: the input is a
/// regular file. Throws as volume_in() and overview_in() do.
std::shared_ptr<const ByteSource> source_of(const DecodeRun& run);

/// The description of samples that were decoded, with the loss of these parameters.
VolumeInfo with_loss_of(VolumeInfo samples, const CodingParameters& parameters);

/// What a file says of its volume, decoded as a whole.
KnownFacts known_facts(const TagBricks& file, const WrittenNumbers& numbers);

/// What is damaged in a file that was salvaged.
struct Salvage {
  std::vector<BrickRun> lost;         ///< in increasing order
  bool has_index = true;              ///< DecodeResult::index is that of the file
  bool is_damaged_elsewhere = false;  ///< something besides bricks is damaged

  bool is_damaged() const { return !lost.empty() || is_damaged_elsewhere; }
};

struct DecodeResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;              ///< of the .tag file
  std::uint64_t bytes_out = 0;             ///< written, headers included
  std::uint64_t memory = 0;                ///< the plan's upper limit
  std::string facts = {};                  ///< VolumeSink::facts()
  std::vector<std::string> warnings = {};  ///< VolumeSink::warnings()
  WrittenNumbers numbers = {};
  Index3 dims = header.parameters.dims;                   ///< of the volume that was written
  Metadata metadata = numbers.metadata(header.metadata);  ///< of the volume that was written
  std::optional<Salvage> salvage = {};                    ///< if DecodeRun::fill is set
  bool is_one_of_several = false;                         ///< the file has other volumes, too
};

using FinishedDecode = Finished<DecodeResult>;

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
      return make(run_.format.writes.memory(info_) + memory_of_program());
    } catch (const MemoryLimit& limit) {
      const std::uint64_t bytes = memory_of_program();
      if (bytes == 0) throw;
      throw_for_writer(limit, program(), bytes);
    }
  }
  /// Samples can be written in any order.
  bool any_order() const;
  /// The levels that are written after the volume.
  const std::vector<MeansLevel>& levels() const { return options_.known.levels; }
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

/// Passes samples to a sink: at their positions, or in raster order through a file for a layer of bricks.
class RowOutput : public RowSink {
 public:
  /// `spool_folder`: the directory of the temporary file; none if rows come in the order of the sink.
  /// `first`: the number of the sink's sample that is the first one of the rows.
  RowOutput(VolumeSink& sink, const std::optional<std::string>& spool_folder, const std::string& name,
            std::int64_t first = 0);

  /// REQUIRES: rows come in the order of their bricks.
  void write(const DecodedRows& rows) override;

 private:
  void through_spool(const DecodedRows& rows, SpoolFile& spool);

  VolumeSink& sink_;
  std::int64_t first_;
  std::optional<SpoolFile> spool_;
};

}  // namespace tagrid
