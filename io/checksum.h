// XXH3, 64 bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

namespace tagrid {

/// Checksum of the concatenation of `parts`. `bound_to` makes equal bytes in another place differ.
std::uint64_t checksum_of(std::initializer_list<std::span<const std::byte>> parts,
                          std::uint64_t bound_to = 0);

/// Whether a checksum that a file has is the one that it should have. With TAGRID_NO_CHECKSUMS always: for
/// fuzzing, which could not guess one. Only test programs are compiled so; see tests/CMakeLists.txt.
bool checksums_agree(std::uint64_t in_file, std::uint64_t computed);

}  // namespace tagrid
