// A data set in the deflated transfer syntax (DICOM PS3.5, A.5), without its samples.
#pragma once

#include <cstdint>
#include <string>

#include "io/files/byte_source.h"

namespace tagrid {

/// What lies around the samples of an inflated data set.
struct InflatedDataset {
  std::string before, behind;
  std::string why_not;  ///< a sentence if the bytes are not those; "" if they are
};

/// Inflates the bytes of a file from `begin` to its end, and leaves out `samples` bytes from byte `at` of the result on. Takes
/// little memory: what is kept is at most 4 MiB. Throws WorldError.
InflatedDataset inflated_dataset(const ByteSource& file, std::uint64_t begin, std::uint64_t at,
                                 std::uint64_t samples);

}  // namespace tagrid
