// The meaning of samples in a data set: a scale, and samples that mark missing data.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

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
