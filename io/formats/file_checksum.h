// Checksums of whole files and volumes; see io/bytes/checksum.h.
#pragma once

#include <cstdint>
#include <string>

#include "io/volume/volume_source.h"

namespace tagrid {

/// `xxhsum -H3` prints the same. Throws WorldError.
std::uint64_t checksum_of_file(const std::string& path);

/// Of all samples of a volume, in their order and the byte order of memory, whatever the volume is in. Throws
/// BrokenInput, WorldError. REQUIRES: nothing was read yet.
std::uint64_t checksum_of_samples(VolumeSource& source);

}  // namespace tagrid
