// Where the samples of a data set lie, and what they mean.
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>
#include <vector>

#include "io/formats/nrrd/geometry.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// What a file says of a data set.
struct DatasetDescription {
  std::string nrrd;  ///< lines of an NRRD header
  Rescale rescale;
  std::string scale_doubt;
  std::vector<std::string> warnings, not_understood;
};

/// The data set at the path `name` of the file at `path`, which is a volume of these dimensions. The header
/// lines that tagrid-write-hdf5 wrote count, if the attributes still say the same; otherwise attributes,
/// VTKHDF's image data, or the axes of NeXus say where samples lie.
DatasetDescription description_of_dataset(hid_t file, const std::string& path, const std::string& name,
                                          const Index3& dims);

/// The type of data that a VTKHDF file holds: "ImageData"; "" if it is not one of VTKHDF.
std::string vtkhdf_type(hid_t file);

/// True if the path is that of an array of VTKHDF.
bool is_vtkhdf_array(const std::string& name);

/// The geometry of the array at this path, if it is a volume of these dimensions in image data. Attributes
/// that cannot be read give none, and warnings. `path` is that of the file.
std::optional<Geometry> geometry_of_image_data(hid_t file, const std::string& path, const std::string& name,
                                               const Index3& dims, std::vector<std::string>& warnings);

/// What a file says about values.
struct ScaleOfDataset {
  Rescale rescale;
  std::string doubt;  ///< a sentence, if it is not known how values follow from samples
  std::vector<std::string> warnings, not_understood;
  std::vector<std::string> attributes;  ///< those that `rescale` says now
};

/// The scale is that of the attributes rescale_slope and rescale_intercept, otherwise of scale_factor and
/// add_offset (https://cfconventions.org), otherwise of the fields scaling_factor and offset of the signal's
/// NeXus group. `path` is that of the file.
ScaleOfDataset scale_of_dataset(hid_t file, const std::string& path, const std::string& name);

}  // namespace tagrid
