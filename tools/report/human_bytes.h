// Sizes for people.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// "1.2 MB" and the like: powers of 1000, as file managers count.
std::string human_bytes(std::uint64_t bytes);

}  // namespace tagrid
