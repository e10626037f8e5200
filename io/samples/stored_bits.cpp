#include "io/samples/stored_bits.h"

#include <cassert>
#include <cstring>

namespace tagrid {
namespace {

template <class Bits>
void apply_to(const StoredBits& stored, std::byte* samples, std::size_t count) {
  const int unused = stored.bits == 0 ? 0 : static_cast<int>(8 * sizeof(Bits)) - stored.bits;
  const auto mask = static_cast<Bits>(static_cast<Bits>(~Bits{0}) >> unused);
  const auto sign = static_cast<Bits>(stored.is_signed && unused > 0 ? Bits{1} << (stored.bits - 1) : 0);
  const auto add = static_cast<Bits>(stored.add);
  for (std::size_t i = 0; i < count; ++i) {
    Bits bits;
    std::memcpy(&bits, samples + i * sizeof(Bits), sizeof(Bits));
    bits = static_cast<Bits>((static_cast<Bits>(bits & mask) ^ sign) - sign + add);
    std::memcpy(samples + i * sizeof(Bits), &bits, sizeof(Bits));
  }
}

}  // namespace

void apply(const StoredBits& stored, SampleType type, std::byte* samples, std::size_t count) {
  if (stored.changes_nothing()) return;
  switch (size_of(type)) {
    case 1:
      return apply_to<std::uint8_t>(stored, samples, count);
    case 2:
      return apply_to<std::uint16_t>(stored, samples, count);
    case 4:
      return apply_to<std::uint32_t>(stored, samples, count);
    default:
      assert(false);
  }
}

}  // namespace tagrid
