// NIfTI headers, versions 1 and 2. The format: https://nifti.nimh.nih.gov/nifti-1,
// https://nifti.nimh.nih.gov/nifti-2
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"

namespace tagrid {

struct NiftiHeader {
  /// One volume of the file. Its geometry is that of the sform, otherwise that of the qform, otherwise the
  /// spacing alone. Key-value pairs that begin with "nifti_" have the fields of the header that say more,
  /// with their numbers unchanged.
  VolumeInfo info;
  bool big_endian = false;
  bool is_pair = false;      ///< The samples are in another file: .img beside .hdr.
  std::uint64_t offset = 0;  ///< The byte at which the samples of the first volume begin.
  std::int64_t volumes = 1;  ///< Moments, components and so on, one after the other.
  Rescale rescale;
  /// As in SourceFacts.
  std::vector<std::string> warnings, not_understood;
  std::string scale_doubt;
};

/// No header is longer.
inline constexpr std::size_t max_nifti_header_bytes = 540;

/// True if `bytes`, the first 348 or more of a file, begin a NIfTI header of either version, in either byte
/// order.
bool begins_nifti(std::string_view bytes);

/// Reads a header from the beginning of a file. Throws BrokenInput if it is broken or describes something
/// other than volumes of real numbers of up to 64 bits. Safe for any bytes.
NiftiHeader parse_nifti_header(std::string_view bytes);

}  // namespace tagrid
