// Attributes of groups and data sets of HDF5 files.
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>
#include <vector>

#include "io/nrrd/geometry.h"

namespace tagrid {

/// A text; nothing if there is no such attribute, or if it is not one text.
std::optional<std::string> text_attribute(hid_t object, const std::string& name);
/// One text or several, at most 100; none if there is no such attribute, or if it is not of texts.
std::vector<std::string> text_list_attribute(hid_t object, const std::string& name);
/// Numbers, at most 1000; none if there is no such attribute, or if it is not of numbers.
std::vector<double> number_attribute(hid_t object, const std::string& name);
/// Names and values of all attributes that are one text or a few numbers.
KeyValues all_attributes(hid_t object);

}  // namespace tagrid
