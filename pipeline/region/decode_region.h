// Decodes a region of a .tag file as a volume.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "io/formats/formats.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"
#include "pipeline/region/read_region.h"
#include "pipeline/run/run.h"

namespace tagrid {

/// A requested region of a volume whose size is not known yet.
struct WantedRegion {
  /// Samples from `low` up to, but not including, `high` on each axis; the ends of the volume if not given.
  std::array<std::optional<std::int64_t>, 3> low, high;
  /// Of these, only the samples whose coordinates in the whole volume are multiples of `step` on all axes.
  std::int64_t step = 1;

  /// True if it is the whole volume.
  bool is_all() const;
};

/// The region of a volume. Throws UsageError if it is not within the volume or has no sample, and if `step`
/// is not a power of two up to the edge of a root cube.
Region region_of(const WantedRegion& wanted, const CodingParameters& parameters);

/// Decodes a region of the .tag file `input` into the volume `output`; otherwise like decode_volume(). From a
/// file, only the header, the index and the bricks that meet the region are read. Memory depends on the
/// region's layers of bricks.
DecodeResult decode_region(const std::string& input, const std::string& output, const Format& format,
                           bool overwrite, const WantedRegion& wanted, const Resources& resources,
                           const Progress& progress = {},
                           const BeforeNaming<DecodeResult>& before_naming = {}, const VdbOptions& vdb = {});

}  // namespace tagrid
