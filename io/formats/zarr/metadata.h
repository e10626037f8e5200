// The metadata of OME-Zarr 0.5, in Zarr 3: files called zarr.json.
#pragma once

#include <optional>
#include <string>

#include "io/volume/volume_info.h"
#include "io/volume/volume_sink.h"
#include "stages/grid/box.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// How the samples of an array are divided into files.
struct ZarrChunks {
  Index3 chunk;  ///< samples along each axis
  /// A file (a shard) has so many samples, in chunks that are compressed with zstd, and an index of them.
  /// Nothing: a file is a chunk of plain samples, little endian, x fastest.
  std::optional<Index3> shard = std::nullopt;
};
inline constexpr int zarr_zstd_level = 3;

/// That of an image: its axes, and the places of the arrays "0", the volume, and "1", "2" ..., facts.levels.
std::string zarr_group(const VolumeInfo& info, const KnownFacts& facts, const std::string& name);
/// That of an array.
std::string zarr_array(const Index3& dims, SampleType type, const ZarrChunks& chunks);

}  // namespace tagrid
