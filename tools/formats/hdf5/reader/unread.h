// Descriptions of where samples lie that nothing reads.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

namespace tagrid {

/// The names of attributes of the data set at the absolute path `name`, and of the groups around it, and of short data sets
/// beside it, that may say where samples lie, but for those in `known`.
std::vector<std::string> unread_geometry(hid_t file, const std::string& name,
                                         const std::vector<std::string>& known);

}  // namespace tagrid
