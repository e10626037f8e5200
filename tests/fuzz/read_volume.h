// Reading of files by the fuzzers of volumes.
#pragma once

#include <string>

namespace tagrid::fuzz {

/// Reads all samples of a small volume, twice if possible, and claims that they are the same. It is no fault
/// if the reader refuses the volume.
void read_volume(const std::string& path);

}  // namespace tagrid::fuzz
