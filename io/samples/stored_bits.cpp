#include "io/samples/stored_bits.h"

namespace tagrid {

void apply(const StoredBits& stored, SampleType type, std::byte* samples, std::size_t count) {
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
