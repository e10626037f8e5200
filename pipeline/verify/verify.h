// Verifies a file: every checksum, every brick by decoding it, the grid, the statistics, and the original.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "io/tag/file.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "pipeline/verify/geometry.h"

namespace tagrid {

struct VerifyRun {
  std::string input;              ///< the .tag file; "-": the standard input
  std::string original = {};      ///< "": no original
  SourceDescription source = {};  ///< of the original
  Resources resources{0};         ///< per rank; 0 threads: all that the rank may use
  Progress progress = {};
};

struct VerifyResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;  ///< of the .tag file
  std::int64_t bricks = 0;
  std::uint64_t active_points = 0;
  /// With an original: errors measured against it.
  std::optional<double> max_error;
  std::optional<double> mesh_error;  ///< only if the mesh of the file has a bound
  GeometryComparison geometry;       ///< with an original, of verify_file() alone
};

/// Verifies any bytes, without an original; otherwise like verify_file() in pipeline/run/run.h.
VerifyResult verify_bytes(std::unique_ptr<ByteStream> input, const Resources& resources,
                          const Progress& progress = {});

struct VerifySetup;
/// The same for a file that has been opened but not read.
VerifyResult verify_all(TagReader& reader, VerifySetup setup, const Progress& progress = {});

}  // namespace tagrid
