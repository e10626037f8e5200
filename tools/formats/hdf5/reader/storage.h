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

/// Samples that were never written.
struct Unwritten {
  std::string what;        ///< "3 of 8 chunks were"; "" if all samples were written
  bool has_values = true;  ///< false if the file does not say which values they have
};
Unwritten unwritten_samples(hid_t dataset, hid_t properties);

}  // namespace tagrid
