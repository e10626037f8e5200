// NIfTI headers, versions 1 and 2, and volumes that have them. The format:
// https://nifti.nimh.nih.gov/nifti-1, https://nifti.nimh.nih.gov/nifti-2
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

struct NiftiHeader {
  /// One volume of the file. Its geometry is that of the sform, otherwise that of the qform, otherwise the
  /// spacing alone. Key-value pairs that begin with "nifti_" have the fields of the header that say more,
  /// with their numbers unchanged.
  VolumeInfo info;
  bool big_endian = false;
  bool is_pair = false;      ///< The samples are in another file: .img beside .hdr.
  std::uint64_t offset = 0;  ///< The byte at which the samples of the first volume begin.
  std::int64_t volumes = 1;  ///< Moments, components and so on, one after the other.
  /// Of several volumes: lines of key-value pairs that all of them together have, and SourceFacts::volume_names.
  KeyValues pairs_of_volumes;
  std::vector<std::string> volume_names;
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

/// Reads .nii, and .hdr with .img beside it, each also in gzip. `file` was opened at `path` and is at its
/// beginning. Of several volumes, `source.series` chooses one by its number, from 1 on. Throws BrokenInput,
/// UsageError and WorldError.
std::unique_ptr<VolumeSource> open_nifti(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription& source);

/// The header before the samples of a volume: NIfTI-1, or NIfTI-2 if a size is above 32767. Positions become
/// those of right-anterior-superior. Fields that a NIfTI source had come back.
std::string nifti_header_bytes(const VolumeInfo& info);

/// What NIfTI cannot keep of this volume, one sentence for each loss.
std::vector<std::string> lost_in_nifti(const VolumeInfo& info);

}  // namespace tagrid
