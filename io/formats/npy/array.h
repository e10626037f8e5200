// NumPy's .npy files: a header in the syntax of Python, and the samples of an array.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// What a header says of its array, whose fastest axis is x.
struct NpyHeader {
  Index3 dims;  ///< of one volume
  SampleType type = SampleType::uint8;
  bool big_endian = false;
  std::int64_t volumes = 1;  ///< the slowest of four axes
};

/// Reads the dictionary of a header. The last axis is x, or the first one if `fortran_order` is True. Throws
/// BrokenInput for arrays that are not volumes of a known type. Safe for any bytes.
NpyHeader parse_npy_header(std::string_view dictionary);

/// Longer headers are refused. NumPy itself reads 10,000 bytes of one, unless it is told otherwise.
inline constexpr std::size_t max_npy_header_bytes = std::size_t{1} << 16;

inline constexpr std::string_view npy_magic = "\x93NUMPY";

/// Reads an array that was opened at `path` and is at its beginning; of four axes, the slowest one counts
/// volumes. Throws BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_npy(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

/// The bytes before the samples of an array [z, y, x], little endian; several volumes have four axes.
std::string npy_header_bytes(const VolumeInfo& info);

/// See Keeps::lost_rescale and Keeps::lost.
std::string lost_rescale_in_npy(const VolumeInfo& info);
std::vector<std::string> lost_in_npy(const VolumeInfo& info);

}  // namespace tagrid
