// Samples of which only some bits count, as scanners store them.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "io/volume/sample_places.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// What the bits of an integer of the type Bits (unsigned, as wide as a sample) mean.
template <class Bits>
struct BitsThatCount {
  explicit BitsThatCount(const StoredBits& stored)
      : used(static_cast<Bits>(static_cast<Bits>(~Bits{0}) >>
                               (stored.bits == 0 ? 0 : static_cast<int>(8 * sizeof(Bits)) - stored.bits))),
        sign(static_cast<Bits>(used == static_cast<Bits>(~Bits{0}) ? 0 : (used >> 1) + 1)) {}

  Bits low(Bits integer) const { return static_cast<Bits>(integer & used); }
  /// The low bits, and copies of the highest of them above.
  Bits with_sign(Bits integer) const { return static_cast<Bits>((low(integer) ^ sign) - sign); }

  Bits used;  ///< ones where bits count
  Bits sign;  ///< the highest of them; 0 if all bits count, as nothing is above
};

/// Calls `use` with a Bits, as wide as a sample of an integer type of at most 32 bits.
template <class Use>
void with_bits_of(std::size_t sample_size, Use use) {
  assert(sample_size <= 4);
  if (sample_size == 1) return use(std::uint8_t{});
  if (sample_size == 2) return use(std::uint16_t{});
  use(std::uint32_t{});
}

/// Replaces each integer in `bytes` by what `change` makes of it.
template <class Bits, class Change>
void change_each(std::span<std::byte> bytes, Change change) {
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(Bits)) {
    Bits integer;
    std::memcpy(&integer, bytes.data() + i, sizeof(Bits));
    integer = change(integer);
    std::memcpy(bytes.data() + i, &integer, sizeof(Bits));
  }
}

/// Which of both forms all integers have.
struct SpareBitsSeen {
  bool zero = true, sign = true;
};

/// Notes in `seen` what bits of integers hold that do not count. REQUIRES: integers of at most 32 bits.
inline void look_at_spare(const StoredBits& stored, std::size_t size, std::span<std::byte> samples,
                          SpareBitsSeen& seen) {
  with_bits_of(size, [&]<class Bits>(Bits) {
    const BitsThatCount<Bits> bits(stored);
    change_each<Bits>(samples, [&](Bits integer) {
      seen.zero = seen.zero && integer == bits.low(integer);
      seen.sign = seen.sign && integer == bits.with_sign(integer);
      return integer;
    });
  });
}

/// What users should know of a file if other bits than the lowest `bits` are set in its samples.
inline std::string about_spare_bits(const std::string& file, int bits) {
  return file + ": only the lowest " + std::to_string(bits) +
         " bits of its samples count, but higher ones are set, too; they are no part of the numbers, "
         "although some programs read them as such";
}

/// Turns `count` integers of the size of `type` into samples of that type, where they are. What is beyond the
/// type wraps around. REQUIRES: an integer type of at most 32 bits.
inline void apply(const StoredBits& stored, SampleType type, std::byte* samples, std::size_t count) {
  if (stored.changes_nothing()) return;
  with_bits_of(size_of(type), [&]<class Bits>(Bits) {
    const BitsThatCount<Bits> bits(stored);
    const auto add = static_cast<Bits>(stored.add);
    change_each<Bits>({samples, count * sizeof(Bits)}, [&](Bits integer) {
      return static_cast<Bits>((stored.is_signed ? bits.with_sign(integer) : bits.low(integer)) + add);
    });
  });
}

}  // namespace tagrid
