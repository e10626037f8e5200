// Where the samples of a data set lie.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

#include "io/formats/nrrd/geometry.h"

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

}  // namespace tagrid
