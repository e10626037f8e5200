// The header of a .tag file. docs/format.md specifies every byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"
#include "stages/volume/coding_parameters.h"
#include "stages/volume/status.h"

namespace tagrid {

struct TagHeader {
  CodingParameters parameters;
  std::string nrrd_fields;  ///< what the source said besides its samples; see VolumeInfo
};

inline constexpr std::size_t tag_preamble_size = 16;
/// Largest header that is read, whatever it says of itself.
inline constexpr std::uint32_t max_header_size = 1 << 24;

/// The whole header: preamble, fields, checksum. REQUIRES: check_fields(header.nrrd_fields).ok(), for a header that can
/// be read again.
std::vector<std::byte> serialize_header(const TagHeader& header);

/// The size of the whole header, from the first tag_preamble_size bytes of a file, or all that it has. Broken where they
/// are not those of a .tag file.
Status parse_preamble(std::span<const std::byte> preamble, std::size_t& header_size);

/// Reads a whole header; every field is checked. `checksum` is that of the header, to which bricks are bound.
Status parse_header(std::span<const std::byte> bytes, TagHeader& header, std::uint64_t& checksum);

/// Whether the parameters are such as a header may have; says what is wrong.
Status check_parameters(const CodingParameters& parameters);

/// Whether the lines fit into a header that parse_header() reads; says what is wrong.
Status check_fields(const std::string& nrrd_fields);

/// The volume that a file is of. Throws BrokenInput where the source's fields are none.
VolumeInfo volume_info_of(const TagHeader& header);

}  // namespace tagrid
