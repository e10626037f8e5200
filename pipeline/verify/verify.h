// Verifies a file: every checksum, every brick by decoding it, the grid, the statistics, and the original.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "io/tag/file.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

struct VerifyResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;  ///< of the .tag file
  std::int64_t bricks = 0;
  std::uint64_t active_points = 0;
  /// With an original: errors measured against it.
  std::optional<double> max_error;
  std::optional<double> mesh_error;  ///< only if the mesh of the file has a bound
};

/// Decodes all of `input` and throws BrokenInput at the first thing that is wrong: a checksum, a brick that
/// cannot be decoded, an activity that is not conforming, a face on which two bricks disagree, or wrong
/// statistics. With `original` ("" for none), it also throws at a voxel whose error is above the file's
/// bound, with its coordinates and both values, and if the error of the mesh is above its bound.
VerifyResult verify_file(const std::string& input, const std::string& original,
                         const SourceDescription& source, const Resources& resources,
                         const Progress& progress = {});

/// The same for any bytes, without an original.
VerifyResult verify_bytes(std::unique_ptr<ByteStream> input, const Resources& resources,
                          const Progress& progress = {});

class Verifier;
/// The same for a file that has been opened but not read.
VerifyResult verify_all(Verifier& verifier, const Progress& progress = {});

}  // namespace tagrid
