// Writes volumes as image data of VTK, for ParaView:
// https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// Writes a .vti file, or to the standard output for "-": point data "value", appended raw.
std::unique_ptr<VolumeSink> create_vti(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options);

/// What VTK's image data loses in every file, one sentence for each loss.
std::vector<std::string> lost_in_image_data(const VolumeInfo& info);

/// What VTK's image data loses of this volume, one sentence for each loss.
std::vector<std::string> lost_in_vti(const VolumeInfo& info);

}  // namespace tagrid
