// Where the samples of a data set lie, and what describes that and is not read.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

#include "io/programs/serve_reader.h"

namespace tagrid {

/// Describes the data set at the path `name` of the file at `path`: sets metadata, rescale and scale_doubt of the
/// volume, whose dimensions are set, and adds warnings and what is not understood. The header lines that
/// tagrid-write-hdf5 wrote count, if the attributes still say the same; otherwise attributes, VTKHDF's image
/// data, or the axes of NeXus say where samples lie.
void describe_dataset(hid_t file, const std::string& path, const std::string& name, ServedVolume& volume);

/// The type of data that a VTKHDF file holds: "ImageData"; "" if it is not one of VTKHDF.
std::string vtkhdf_type(hid_t file);

/// True if the path is that of an array of VTKHDF.
bool is_vtkhdf_array(const std::string& name);

/// The names of attributes and short data sets that may describe the geometry of the data set at
/// the absolute path `name`, except those in `known`: attributes of the data set and of the groups
/// around it, and data sets next to it.
std::vector<std::string> unread_geometry(hid_t file, const std::string& name,
                                         const std::vector<std::string>& known);

}  // namespace tagrid
