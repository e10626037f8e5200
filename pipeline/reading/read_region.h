// Reads samples of a part of a volume from the bricks that hold them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

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

/// Reads only the bricks of the region, decodes them no further than needed, and stores its samples, in the
/// machine's byte order, according to `out` and `strides`. Other threads may read `file` at the same time.
/// Throws BrokenInput, WorldError, and the exceptions of `progress`; some of the samples may then have been
/// written. REQUIRES: the volume contains the region's box; steps are positive.
void read_region(const TagBricks& file, const Region& region, std::byte* out, const Strides& strides,
                 int threads, const Progress& progress = {});

/// Blocks that come in order.
struct BlocksInOrder {
  std::string name;  ///< of the file, for messages
  /// Called by one thread at a time, in the order of bricks_of(). Nothing: samples of the brick stay as is.
  std::function<std::optional<BrickBytes>(std::int64_t brick)> next;
  /// If given, a brick that cannot be decoded, or that it does not accept, is passed to `broken` instead of
  /// ending with an error, and its samples stay as they are.
  std::function<bool(const DecodedBrick& brick)> accepts = {};
  std::function<void(std::int64_t brick)> broken = {};  ///< called by one thread at a time
  /// Converts the samples of a brick to `type`. Called by several threads at once. May be empty.
  std::function<void(DecodedBrick& brick)> change_samples = {};
  SampleType type = SampleType::uint8;  ///< without an effect if change_samples is empty
};

/// The same for such blocks. At most `threads` of them are in memory.
void decode_bricks(const BlocksInOrder& blocks, const CodingParameters& parameters, const Region& region,
                   std::byte* out, const Strides& strides, int threads);

/// Throws UsageError: a region of low:high along an axis is not in a volume with so many samples along it.
[[noreturn]] void refuse_region(std::int64_t low, std::int64_t high, int axis, std::int64_t samples);

/// Throws UsageError if the region is empty or not in the volume, or if a root cube does not allow the step.
Region region_of(const WantedRegion& wanted, const CodingParameters& parameters);

/// Decodes the region that `run` requests; otherwise like decode_volume(). From a file, it reads only the
/// bricks that the region meets. Memory grows with the layers of bricks of the region.
FinishedDecode decode_region(const DecodeRun& run, const Resources& resources);

}  // namespace tagrid
