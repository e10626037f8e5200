// Where the samples of a data set lie.
#pragma once

#include <hdf5.h>

#include "io/volume/volume_info.h"

namespace tagrid {

/// What the attributes of a data set say.
Geometry geometry_of_dataset(hid_t dataset);

}  // namespace tagrid
