// Finds descriptions of a geometry that are not read.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

namespace tagrid {

/// The names of attributes and short data sets that may describe the geometry of the data set at
/// the absolute path `name`, except those in `known`: attributes of the data set and of the groups
/// around it, and data sets next to it.
std::vector<std::string> unread_geometry(hid_t file, const std::string& name,
                                         const std::vector<std::string>& known);

}  // namespace tagrid
