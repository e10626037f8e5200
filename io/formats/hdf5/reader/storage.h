// How the samples of a data set are stored, which of them are missing, and the file as it would be if they
// lay plainly in it.
#pragma once

#include <hdf5.h>

#include <cstdint>
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

/// What lies around the samples, and where they begin.
struct PlainHdf5 {
  std::string before, behind;
  std::string why_not;  ///< a sentence if there is no such copy; "" if there is one
};

/// The limit on the bytes, other than samples, that are copied.
inline constexpr std::uint64_t most_around_samples = std::uint64_t{2} << 20;

/// Copies all objects, links and attributes of the file at `path` to a file in memory, with the library, and
/// makes `dataset`, which is one of its data sets, contiguous there. Its samples, of `sample_bytes` bytes,
/// take no memory. The copy is the same every time. References to objects in attributes lead to their copies.
/// Throws WorldError.
PlainHdf5 plain_copy(const std::string& path, hid_t dataset, std::uint64_t sample_bytes);

}  // namespace tagrid
