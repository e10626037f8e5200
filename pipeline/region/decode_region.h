// Decodes a region of a .tag file as a volume.
#pragma once

#include "pipeline/decode/decode_run.h"
#include "pipeline/memory/resources.h"
#include "pipeline/region/read_region.h"

namespace tagrid {

/// The region of a volume. Throws UsageError where it is not within the volume or has no sample, and for a step that is not a
/// power of two up to the edge of a root cube.
Region region_of(const WantedRegion& wanted, const CodingParameters& parameters);

/// Decodes the region that `run` asks for; else as decode_volume(). From a file the header, the index and the
/// bricks that the region meets are read, and nothing else. Memory follows the region's layers of bricks.
FinishedDecode decode_region(const DecodeRun& run, const Resources& resources);

}  // namespace tagrid
