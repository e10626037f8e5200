#include "io/formats/tiff/reader/float_order.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "io/bytes/little_endian.h"

namespace tagrid {
namespace {

/// Few volumes have numbers of other magnitudes, but every second float has one once its bytes are
/// swapped.
bool is_unusual(double value) {
  const double size = std::abs(value);
  return std::isfinite(value) && size != 0 && (size < 1e-20 || size > 1e20);
}

template <class Float, class Bits>
FloatOrder float_order_of(std::span<const std::byte> samples) {
  std::uint64_t here = 0, swapped = 0;
  for (std::size_t at = 0; at + sizeof(Float) <= samples.size(); at += sizeof(Float)) {
    const auto bits = load_little_endian<Bits>(samples.data() + at);
    here += is_unusual(std::bit_cast<Float>(bits));
    swapped += is_unusual(std::bit_cast<Float>(byte_swapped(bits)));
  }
  // In the right order, some numbers may be unusual; in both orders, all may be.
  constexpr std::uint64_t clearly = 4;
  if (here == 0 || swapped > clearly * here) return FloatOrder::usual;
  return here > clearly * swapped ? FloatOrder::swapped : FloatOrder::unclear;
}

}  // namespace

FloatOrder float_order_of(std::span<const std::byte> samples, SampleType type) {
  return type == SampleType::float32 ? float_order_of<float, std::uint32_t>(samples)
                                     : float_order_of<double, std::uint64_t>(samples);
}

}  // namespace tagrid
