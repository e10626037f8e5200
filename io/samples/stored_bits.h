// Samples of which only some bits count, as scanners store them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "stages/volume/sample_type.h"

namespace tagrid {

/// How integers become samples: sample = (the low bits of the integer) + add.
struct StoredBits {
  int bits = 0;            ///< how many low bits count; 0: all
  bool is_signed = false;  ///< The highest of these bits is a sign. Without effect if all count.
  std::int32_t add = 0;

  bool changes_nothing() const { return bits == 0 && add == 0; }
  bool operator==(const StoredBits&) const = default;
};

/// Turns `count` integers of the size of `type` into samples of that type, where they are. What is beyond the type wraps
/// around. REQUIRES: an integer type of at most 32 bits.
void apply(const StoredBits& stored, SampleType type, std::byte* samples, std::size_t count);

}  // namespace tagrid
