// How the samples of a data set are stored, and which of them are missing.
#pragma once

#include <hdf5.h>

#include <string>

namespace tagrid {

/// For users: "shuffle, deflate". `properties` are those of the data set, here and below.
std::string name_of_storage(hid_t properties);

/// Throws BrokenInput if a filter is missing, with its number and the package that provides it; `path` is
/// that of the file.
void require_filters(hid_t properties, const std::string& path);

/// Throws BrokenInput if samples lie in other files.
void require_own_samples(hid_t properties, const std::string& path, const std::string& name);

/// How samples lost precision when they were stored, according to filters and the attributes of
/// netCDF: "HDF5, scaleoffset"; "" if nothing indicates a loss. For filters that can also be
/// lossless, the samples are not examined.
std::string loss_of(hid_t dataset, hid_t properties);

/// Samples that were never written.
struct Unwritten {
  std::string what;        ///< "3 of 8 chunks were"; "" if all samples were written
  bool has_values = true;  ///< false if the file does not say which values they have
};
Unwritten unwritten_samples(hid_t dataset, hid_t properties);

}  // namespace tagrid
