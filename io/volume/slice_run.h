// Where the samples of a volume lie in its files, if they lie there plainly.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tagrid {

/// How integers become samples: sample = (the low bits of the integer) + add. Scanners store some volumes so.
struct StoredBits {
  int bits = 0;            ///< how many low bits count; 0: all
  bool is_signed = false;  ///< The highest of these bits is a sign. Without effect if all count.
  std::int32_t add = 0;

  bool changes_nothing() const { return bits == 0 && add == 0; }
  bool operator==(const StoredBits&) const = default;
};

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

}  // namespace tagrid
