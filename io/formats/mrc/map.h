// MRC files, also called CCP4 maps: a header of 1024 bytes, an extended header, and the samples.
// The layout is that of MRC2014, with the flags of IMOD.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

struct MrcHeader {
  VolumeInfo info;           ///< of one volume
  std::int64_t volumes = 1;  ///< a file can be a stack of them
  bool big_endian = false;
  std::uint64_t start = 0;  ///< the byte at which samples begin
  std::vector<std::string> warnings,
      not_understood = {};  ///< as in SourceFacts, without the name of the file
};

inline constexpr std::size_t mrc_header_bytes = 1024;

/// Reads the first mrc_header_bytes of a file. Throws BrokenInput if they are fewer, or if samples have another
/// type than int8, uint8, int16, uint16 and float32. Safe for any bytes.
MrcHeader parse_mrc_header(std::string_view bytes);

/// True if the word MAP is in its place.
bool begins_mrc(std::string_view bytes);

/// Reads a map that was opened at `path` and is at its beginning. Throws BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_mrc(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

}  // namespace tagrid
