// The request for the decoding of a .tag file, and its result.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/table/formats.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "pipeline/decode/values.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "stages/grid/brick_run.h"

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
  WantedRegion region = {};
  Numbers numbers = Numbers::automatic;
  /// If set, a damaged file is not an error. Samples of damaged bricks become this value, which must fit the
  /// output type, and the result lists them. REQUIRES: the input is a regular file.
  std::optional<double> fill = {};
  std::map<std::string, std::string> wishes = {};  ///< WriteOptions::wishes; those about errors are added
  Resources resources{0};                          ///< per rank; 0 threads: all that the rank may use
  Progress progress = {};
};

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
  Index3 dims = header.parameters.dims;  ///< of the volume that was written
  std::string nrrd_fields =
      numbers.fields(header.nrrd_fields);  ///< VolumeInfo::nrrd_fields of the volume that was written
  std::optional<Salvage> salvage = {};     ///< if DecodeRun::fill is set
};

using FinishedDecode = Finished<DecodeResult>;

}  // namespace tagrid
