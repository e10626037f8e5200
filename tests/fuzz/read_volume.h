// What the fuzzers of volumes do with a file.
#pragma once

#include <string>

namespace tagrid::fuzz {

/// Reads all samples of a small volume, twice where that is possible, and claims that they are the same. What
/// the reader refuses is no fault.
void read_volume(const std::string& path);

}  // namespace tagrid::fuzz
