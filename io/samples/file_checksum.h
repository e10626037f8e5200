// Checksums of complete files and volumes; see io/bytes/checksum.h.
#pragma once

#include <cstdint>
#include <string>

#include "io/volume/volume_source.h"

namespace tagrid {

/// The checksum of a file, as `xxhsum -H3` prints it. Throws WorldError.
std::uint64_t checksum_of_file(const std::string& path);

/// The checksum of all samples of a volume, in raster order and the byte order of memory. It does not depend
/// on the format of the volume. Throws BrokenInput, WorldError. REQUIRES: nothing was read yet.
std::uint64_t checksum_of_samples(VolumeSource& source);

}  // namespace tagrid
