// Volumes that are written as TIFF files of many pages. The format: TIFF 6.0,
// https://www.itu.int/itudoc/itu-t/com16/tiff-fx/docs/tiff6.pdf
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

/// All headers, which come before all samples: an uncompressed page for each slice; BigTIFF if the file is
/// larger than 4 GB. Spacing, unit, and the calibration of values are those of ImageJ.
std::string tiff_headers(const VolumeInfo& info);

/// True if the file says what samples mean: ImageJ has a calibration of some types.
bool keeps_values_in_tiff(const VolumeInfo& info);

/// A sentence if TIFF loses the slope and the intercept of this volume; otherwise "".
std::string lost_rescale_in_tiff(const VolumeInfo& info);

/// What else TIFF loses of this volume, one sentence for each loss.
std::vector<std::string> lost_in_tiff(const VolumeInfo& info);

/// The bytes of memory that the headers of all pages take.
std::uint64_t memory_of_tiff(const VolumeInfo& info);

}  // namespace tagrid
