// Where the samples of a NIfTI file lie.
#pragma once

#include <string>
#include <vector>

#include "io/formats/nifti/fields.h"
#include "io/volume/volume_info.h"

namespace tagrid::nifti {

/// The geometry of the sform, otherwise that of the qform, otherwise the spacing alone. Adds a warning for
/// what is unusable.
Geometry geometry_of_fields(const Fields& fields, const Index3& dims, std::vector<std::string>& warnings);

}  // namespace tagrid::nifti
