// Data sets of one axis that say where samples lie.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <string>
#include <vector>

#include "io/formats/axes/axes.h"

namespace tagrid {

/// The axis of `samples` samples that the data set is; the borders of samples become their centers. With
/// `may_be_first_two`, two numbers go on at equal distances. No axis if the data set is not a list of as many
/// finite numbers, or if it is in another directory than the file at `path`.
AxisReading axis_of(hid_t dataset, std::uint64_t samples, const std::string& path,
                    bool may_be_first_two = false);

// EMD, files of electron microscopes: https://emdatasets.com/format

/// The data sets beside a data set of this name that say where samples along its axes lie, the slowest axis
/// first: "dim1". None if the group is no EMD array.
std::vector<std::string> emd_axes(hid_t group, const std::string& name, std::size_t axes);

/// What an EMD file calls the axes; "" for one without a name.
std::vector<std::string> names_of_emd_axes(hid_t group, const std::string& name, std::size_t axes);

}  // namespace tagrid
