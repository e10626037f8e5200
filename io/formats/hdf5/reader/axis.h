// Data sets of one axis that say where samples lie.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <string>

#include "io/formats/axes/axes.h"

namespace tagrid {

/// The axis of `samples` samples that the data set is; the borders of samples become their centers. With
/// `may_be_first_two`, two numbers go on at equal distances. No axis if the data set is not a list of as many
/// finite numbers, or if it is in another directory than the file at `path`.
AxisReading axis_of(hid_t dataset, std::uint64_t samples, const std::string& path,
                    bool may_be_first_two = false);

}  // namespace tagrid
