// Messages about a broken .tag file, the same for all ways of reading it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "io/errors/errors.h"
#include "io/tag/header.h"

namespace tagrid {

/// For the place at which the footer should be. A reader that begins at the end cannot tell a damaged file
/// from a complete one that is followed by other bytes.
inline constexpr const char* no_footer =
    "the file does not end with a footer: it is truncated or damaged, was never finished, or has extra bytes "
    "after its end";
/// For a reader that has read the complete file before.
inline constexpr const char* bytes_follow = "there are extra bytes after the end of the file";

/// The error of a part of the file, which was found before a byte.
BrokenInput broken_part(const std::string& file, const std::string& part, std::uint64_t before,
                        const std::string& what);

/// The size of the header of a file that begins with these bytes. Throws BrokenInput.
std::size_t header_size_of(const std::string& file, std::span<const std::byte> preamble);

/// The header in these bytes, with a description of a volume that can be used, and its checksum. Throws BrokenInput.
TagHeader header_of(const std::string& file, std::span<const std::byte> bytes, std::uint64_t& checksum);

}  // namespace tagrid
