// Samples of one byte as runs, as Amira stores labels (HxByteRLE): a byte above 127 says how many bytes follow as
// they are, another one how often the byte after it is repeated.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Where runs are in a file.
struct PlaceOfRuns {
  std::uint64_t start = 0, bytes = 0;
};

/// The samples of `facts`, which are runs in its only file. `plain_header` is what would stand before them if they
/// were stored plainly. Throws BrokenInput if the runs are too few for the samples. REQUIRES: samples of one byte.
std::unique_ptr<VolumeSource> byte_runs(SourceFacts facts, std::unique_ptr<FileBytes> file,
                                        const PlaceOfRuns& place, const std::string& plain_header);

}  // namespace tagrid
