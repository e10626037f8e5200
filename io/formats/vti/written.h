// Volumes that are written as image data of VTK, for ParaView:
// https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

/// What comes before the samples: point data "value", appended raw.
std::string vti_header(const VolumeInfo& info);
/// What comes after them.
inline constexpr std::string_view vti_trailer = "\n</AppendedData>\n</VTKFile>\n";

/// A sentence if this volume has a slope and an intercept, which VTK's image data loses; otherwise "".
std::string lost_rescale_in_image_data(const VolumeInfo& info);

/// What else VTK's image data loses in every file, one sentence for each loss.
std::vector<std::string> lost_in_image_data(const VolumeInfo& info);

/// What else VTK's image data loses of this volume, one sentence for each loss.
std::vector<std::string> lost_in_vti(const VolumeInfo& info);

}  // namespace tagrid
