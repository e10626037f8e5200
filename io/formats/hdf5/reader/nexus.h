// What NeXus says about data sets: https://manual.nexusformat.org/datarules.html
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>
#include <vector>

#include "io/formats/axes/axes.h"

namespace tagrid {

/// The path of the data set that the file names as its default one; "" if it names none. Throws BrokenInput
/// if the file names something that does not exist. `path` is that of the file.
std::string nexus_default(hid_t file, const std::string& path);

/// The path of the data set that a group of NeXus names as its signal, whether it exists or not; "" if it
/// names none.
std::string nexus_signal_of(hid_t group, const std::string& group_path);

/// True if the data set at this path is the signal of its group.
bool is_nexus_signal(hid_t file, const std::string& name);

/// Those of EMD, too. Nothing if the data set at the path `name` has no axes; warnings alone if the attribute
/// that names them cannot be read. `sizes`: of the data set, the slowest axis first. `path` is that of the
/// file.
std::optional<PlacesOfAxes> nexus_places(hid_t file, const std::string& path, const std::string& name,
                                         const std::vector<hsize_t>& sizes);

/// What a group stores about its signal and tagrid does not read: errors, a mask. One sentence for each.
std::vector<std::string> nexus_companions(hid_t file, const std::string& path, const std::string& name);

/// The names of the axes of a data set, the slowest one first, which the group or the data set gives.
std::vector<std::string> names_of_nexus_axes(hid_t group, hid_t dataset);

/// The names of the dimension scales of a data set, for the slowest axis first; "" for an axis
/// without a scale. Empty if no axis has one.
std::vector<std::string> names_of_scales(hid_t dataset);

}  // namespace tagrid
