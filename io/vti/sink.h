// Writes volumes as image data of VTK, for ParaView: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
#pragma once

#include <memory>
#include <string>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// Writes a .vti file, or to the standard output for "-": point data "value", appended raw.
std::unique_ptr<VolumeSink> create_vti(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options);

/// What VTK's image data cannot say of this volume; "" if nothing is lost.
std::string lost_in_vti(const VolumeInfo& info);

}  // namespace tagrid
