// NRRD headers, and volumes that have them. The format: https://teem.sourceforge.net/nrrd/format.html
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"

namespace tagrid {

struct NrrdHeader {
  enum class Encoding { raw, gzip, bzip2 };

  VolumeInfo info;
  Encoding encoding = Encoding::raw;
  bool big_endian = false;
  /// As the header names them; none if the samples follow the header. All have equally many slices.
  std::vector<std::string> data_files;
  /// Number of lines to skip in each file, before anything is decompressed.
  std::int64_t line_skip = 0;
  /// Number of decompressed bytes to skip after that; -1: the samples are the last bytes of the file.
  std::int64_t byte_skip = 0;
};

/// Headers longer than this are refused.
inline constexpr std::size_t max_nrrd_header_bytes = std::size_t{1} << 20;
/// A volume of more files is refused.
inline constexpr std::int64_t max_nrrd_data_files = 65536;
/// As in the standard.
inline constexpr std::int64_t max_nrrd_axes = 16;

/// True if `bytes`, the first 9 or more of a file, begin an NRRD header of any version.
bool begins_nrrd(std::string_view bytes);

/// Reads a header: the lines from "NRRD000n" up to the blank line or the end of the file. Throws BrokenInput
/// if it is broken or describes something other than a scalar volume (see axes.h), raw, in gzip or in bzip2.
/// Safe for any bytes.
NrrdHeader parse_nrrd_header(std::string_view text);

/// A header of another program, in which some numbers may be unreadable, and what users should know of it:
/// see SourceFacts.
struct ForeignNrrdHeader {
  std::string text;
  std::vector<std::string> warnings, not_understood;
};

/// The same header, with numbers that parse_nrrd_header() reads: a decimal comma becomes a point, an
/// unreadable number of an axis "nan", which means unknown, and lines that cannot be read, comments. Places
/// and values of samples are then unknown where the header does not say them; all else stays, byte for byte.
/// Throws BrokenInput if a line is not one of an NRRD header. Safe for any bytes.
ForeignNrrdHeader foreign_nrrd_header(std::string_view text);

/// The same header for the plain form of its volume: with encoding raw, and the names of its files as
/// plain_name() says. All else stays, byte for byte. REQUIRES: parse_nrrd_header() has read it.
std::string plain_nrrd_header(std::string_view text);

/// The header of little-endian raw samples of `info`. If they follow the header (`data_file` is empty), it
/// ends with the blank line; otherwise it names their file.
std::string nrrd_header_text(const VolumeInfo& info, std::string_view data_file = "");

/// The same header in a file of its own. Throws UsageError if a header cannot name the file of the samples.
std::string detached_nrrd_header(const VolumeInfo& info, const std::string& data_file);

/// Reads a volume, attached or detached, raw, in gzip or in bzip2. `file` was opened at `path`, and is at the
/// beginning of its NRRD header. If `source.raw` is given, it must agree with the header: a different size is
/// BrokenInput; a different type, spacing or byte order is UsageError.
std::unique_ptr<VolumeSource> open_nrrd(std::unique_ptr<FileBytes> file, const std::string& path,
                                        const SourceDescription& source);

/// A file without a header. REQUIRES: source.raw.
std::unique_ptr<VolumeSource> open_raw(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

}  // namespace tagrid
