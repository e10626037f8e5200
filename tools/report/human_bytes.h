// Sizes of files, for people.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// "1.2 MB" and the like, in powers of 1000, as in file managers.
std::string human_bytes(std::uint64_t bytes);

}  // namespace tagrid
