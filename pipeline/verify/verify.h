// A file put to the test: every checksum, every brick decoded, the grid, the statistics, and the original.
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
  /// With an original: what was measured against it.
  std::optional<double> max_error;
  std::optional<double> mesh_error;  ///< only of a file whose mesh has a bound
};

/// Decodes all of `input` and throws BrokenInput at the first thing that is wrong: a checksum, a brick that
/// does not decode, an activity that is not conforming, a face on which two bricks disagree, statistics that
/// do not fit. With `original` ("" for none) also a voxel that is further from it than the file's bound, with
/// its coordinates and both values, and a mesh that is further from it than its bound.
VerifyResult verify_file(const std::string& input, const std::string& original,
                         const SourceDescription& source, const Resources& resources,
                         const Progress& progress = {});

/// The same of any bytes, without an original.
VerifyResult verify_bytes(std::unique_ptr<ByteStream> input, const Resources& resources,
                          const Progress& progress = {});

class Verifier;
/// The same, of a file that was opened and not looked at yet.
VerifyResult verify_all(Verifier& verifier, const Progress& progress = {});

}  // namespace tagrid
