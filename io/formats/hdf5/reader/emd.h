// EMD, files of electron microscopes: https://emdatasets.com/format
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

namespace tagrid {

/// The data sets beside a data set of this name that say where samples along its axes lie, the slowest axis
/// first: "dim1". None if the group is no EMD array.
std::vector<std::string> emd_axes(hid_t group, const std::string& name, std::size_t axes);

/// What an EMD file calls the axes; "" for one without a name.
std::vector<std::string> names_of_emd_axes(hid_t group, const std::string& name, std::size_t axes);

}  // namespace tagrid
