// Reads samples of a part of a volume from the bricks that hold them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "io/tag/bricks.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "pipeline/reading/region.h"
#include "stages/brick/codec.h"
#include "stages/grid/box.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// The most threads that fit into the limit on memory, if there is one. Throws MemoryLimit if none does.
int threads_for_reading(const CodingParameters& parameters, const Resources& resources);

/// Gives the bricks of regions, however their file is read.
class RegionBricks {
 public:
  virtual ~RegionBricks() = default;
  virtual const std::string& name() const = 0;  ///< of the file, for messages
  /// Told before which bricks are read, in this order.
  virtual void will_read(std::span<const std::int64_t> /*bricks*/) {}
  /// True if several threads may read, each any brick. Otherwise one reads at a time, in order.
  virtual bool at_once() const { return false; }
  /// Nothing: the brick is lost, and its samples stay as they are.
  virtual std::optional<BrickBytes> read(std::int64_t brick) = 0;

  /// True for a damaged file: a brick that does not decode, or is not accepted, is lost, and no error.
  virtual bool salvages() const { return false; }
  /// True if the brick, of which all samples are there, is one of this file. Several threads may call it.
  virtual bool accepts(const DecodedBrick& /*brick*/) const { return true; }
  /// Told of each brick that is lost after it was read, by one thread at a time.
  virtual void lose(std::int64_t /*brick*/) {}
};

/// Where samples go: to `out`, in the machine's byte order, according to `strides`.
struct RegionOutput {
  std::byte* out = nullptr;
  Strides strides = {};
  WrittenNumbers numbers = {};  ///< what samples become before
};

/// Reads only the bricks of the region, decodes them no further than needed, and stores its samples. At most `threads`
/// bricks are in memory. Throws BrokenInput, WorldError, and the exceptions of `progress`; some of the samples may then
/// have been written. REQUIRES: the volume contains the region's box; steps are positive.
void read_region(RegionBricks& bricks, const CodingParameters& parameters, const Region& region,
                 const RegionOutput& output, int threads, const Progress& progress = {});
/// The same from a file by its index. Other threads may read `file` at the same time.
void read_region(const TagBricks& file, const Region& region, const RegionOutput& output, int threads,
                 const Progress& progress = {});

/// Throws UsageError: a region of low:high along an axis is not in a volume with so many samples along it.
[[noreturn]] void refuse_region(std::int64_t low, std::int64_t high, int axis, std::int64_t samples);

/// Throws UsageError if the region is empty or not in the volume, or if a root cube does not allow the step.
Region region_of(const WantedRegion& wanted, const CodingParameters& parameters);

/// Decodes the region that `run` requests; otherwise like decode_volume(). From a file, it reads only the
/// bricks that the region meets. Memory grows with the layers of bricks of the region.
FinishedDecode decode_region(const DecodeRun& run, const Resources& resources);

}  // namespace tagrid
