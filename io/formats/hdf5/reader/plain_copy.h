// The file of a data set as it would be if its samples lay plainly in it.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <optional>
#include <string>

namespace tagrid {

/// What lies around the samples, and where they begin.
struct PlainHdf5 {
  std::string before, behind;
  std::optional<std::string> why_not = {};  ///< a sentence if there is no such copy
};

/// The limit on the bytes, other than samples, that are copied.
inline constexpr std::uint64_t most_around_samples = std::uint64_t{2} << 20;

/// Copies all objects, links and attributes of the file at `path` to a file in memory, with the library, and
/// makes `dataset`, which is one of its data sets, contiguous there. Its samples, of `sample_bytes` bytes,
/// take no memory. The copy is the same every time. References to objects in attributes lead to their copies.
/// Throws WorldError.
PlainHdf5 plain_copy(const std::string& path, hid_t dataset, std::uint64_t sample_bytes);

}  // namespace tagrid
