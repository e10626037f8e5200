// Decodes a region of a .tag file as a volume.
#pragma once

#include "pipeline/decode/decode_run.h"
#include "pipeline/memory/resources.h"
#include "pipeline/reading/read_region.h"

namespace tagrid {

/// The region of a volume. Throws UsageError if it is not within the volume or has no sample, or if the step
/// is not a power of two up to the edge of a root cube.
Region region_of(const WantedRegion& wanted, const CodingParameters& parameters);

/// Decodes the region that `run` requests; otherwise like decode_volume(). From a file, it reads only the
/// header, the index, and the bricks that the region meets. Memory grows with the layers of bricks of the
/// region.
FinishedDecode decode_region(const DecodeRun& run, const Resources& resources);

}  // namespace tagrid
