// The amount of memory that this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// Bytes of memory of the machine, or of the control group (version 2 or 1, or a group that contains it) if
/// that allows less. `root` is where /proc and /sys are, for tests.
std::uint64_t available_memory(const std::string& root = "");

}  // namespace tagrid
