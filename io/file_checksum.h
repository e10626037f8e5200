// The checksum of a whole file.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// See io/checksum.h; `xxhsum -H3` prints the same. Throws WorldError.
std::uint64_t checksum_of_file(const std::string& path);

}  // namespace tagrid
