// What HDF5 calls the types of samples.
#pragma once

#include <hdf5.h>

#include <optional>
#include <string>

#include "stages/sample/sample_type.h"

namespace tagrid {

/// Little endian, whatever the machine is.
hid_t hdf5_type_of(SampleType type);

/// The type of samples, and whether their most significant byte comes first.
struct StoredSamples {
  SampleType type;
  bool big_endian;
};

/// Nothing if samples of this HDF5 type are not supported.
std::optional<StoredSamples> stored_samples_of(hid_t type);
/// What a data set of this type has: "integers of 64 bits".
std::string samples_in_words(hid_t type);

}  // namespace tagrid
