// Samples that lie uncompressed in files, slice by slice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "io/samples/stored_bits.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Slices that follow each other in a volume, and lie at equal distances in a file. Samples have the size of the type of
/// the volume, x fastest.
struct SliceRun {
  std::size_t file = 0;      ///< its number among the files of the volume
  std::uint64_t offset = 0;  ///< byte of the file at which the first slice begins
  std::int64_t slices = 1;
  std::uint64_t step = 0;  ///< bytes from the beginning of a slice to that of the next one
  bool big_endian = false;
  StoredBits stored = {};

  bool operator==(const SliceRun&) const = default;
};

/// The volume of `facts`, whose slices lie in its files as the runs say, from front to back. The traits follow from
/// that: any rows can be read. Throws WorldError if a file cannot be opened, or is not a regular one; BrokenInput if it
/// ends before its slices do. REQUIRES: only integers have stored bits; the runs have info.dims.z slices, and the numbers of their files exist.
std::unique_ptr<VolumeSource> placed_samples(SourceFacts facts, std::vector<SliceRun> runs);

}  // namespace tagrid
