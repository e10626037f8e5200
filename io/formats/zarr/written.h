// OME-Zarr 0.5 that tagrid writes: arrays of Zarr 3, one for the volume and one for each overview.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// Begins a volume: a zip file if `path` ends in .ozx, otherwise a directory. Chunks of 64 x 64 x 64 samples
/// are compressed with zstd; a file (a shard) has 16 x 16 x 1 of them. A layer of chunks waits in a temporary
/// file. Throws UsageError and WorldError.
std::unique_ptr<VolumeSink> create_zarr(const std::string& path, const VolumeInfo& info,
                                        const KnownFacts& facts, const SinkOptions& options);

/// Bytes of memory that it takes.
std::uint64_t memory_of_zarr(const VolumeInfo& info);

/// See Format::lost_rescale and Format::lost.
std::string lost_rescale_in_zarr(const VolumeInfo& info);
std::vector<std::string> lost_in_zarr(const VolumeInfo& info);

}  // namespace tagrid
