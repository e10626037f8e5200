// Where VTKHDF says that samples lie: https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

/// The type of data that a VTKHDF file holds: "ImageData"; "" if it is not one of VTKHDF.
std::string vtkhdf_type(hid_t file);

/// True if the path is that of an array of VTKHDF.
bool is_vtkhdf_array(const std::string& name);

/// The geometry of the array at this path, if it is a volume of these dimensions in image data. Attributes
/// that cannot be read give none, and warnings. `path` is that of the file.
std::optional<Geometry> geometry_of_image_data(hid_t file, const std::string& path, const std::string& name,
                                               const Index3& dims, std::vector<std::string>& warnings);

}  // namespace tagrid
