#include "stages/values/wavefront/coder.h"

#include <hwy/highway.h>

#include <bit>

#include "stages/sample/instruction_sets.h"

namespace tagrid {

// What target.h defines for each instruction set.
#define TAGRID_DECLARE_VERSIONS(target)                                                   \
  namespace target {                                                                      \
  void encode(const WaveBrick&, RowReader, RowWriter, WaveSymbols&);                      \
  WaveCode push(WaveSymbols&, std::span<const std::uint8_t>);                             \
  bool decode(const WaveBrick&, const WaveBytes&, RowWriter, std::vector<std::uint8_t>&); \
  }
TAGRID_DECLARE_VERSIONS(N_AVX3)
TAGRID_DECLARE_VERSIONS(N_AVX2)
TAGRID_DECLARE_VERSIONS(N_SSE4)
TAGRID_DECLARE_VERSIONS(HWY_NAMESPACE)
#undef TAGRID_DECLARE_VERSIONS

// Words, counts and intervals are read as halves of larger numbers.
static_assert(std::endian::native == std::endian::little);

WaveSymbols::WaveSymbols(const WaveBrick& brick)
    : buffers(brick.size, true, brick.activity != nullptr,
              static_cast<std::int16_t>(brick.parameters.reference)) {}

WaveSymbols encode_wave(const WaveBrick& brick, RowReader samples, RowWriter reconstruction) {
  WaveSymbols symbols(brick);
  TAGRID_BEST_VERSION(encode)(brick, samples, reconstruction, symbols);
  return symbols;
}

WaveCode push_symbols(WaveSymbols& symbols, std::span<const std::uint8_t> to_carry) {
  return TAGRID_BEST_VERSION(push)(symbols, to_carry);
}

bool decode_wave(const WaveBrick& brick, const WaveBytes& code, RowWriter samples,
                 std::vector<std::uint8_t>& carried) {
  return TAGRID_BEST_VERSION(decode)(brick, code, samples, carried);
}

}  // namespace tagrid
