// How much memory there is for this process.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// Bytes of memory of the machine, or of the control group (version 2 or 1, or one that it is in) where that
/// allows less. `root` is where /proc and /sys are found, for tests.
std::uint64_t available_memory(const std::string& root = "");

}  // namespace tagrid
